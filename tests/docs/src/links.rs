//! Links of all pages: each relative one leads to a file or a folder, and its anchor to a heading.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders whose pages are not ours.
const FOREIGN: [&str; 2] = ["target", "node_modules"];

/// All pages below a folder.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let shown = entries.filter(|path| {
        let name = path.file_name().unwrap().to_string_lossy();
        !name.starts_with('.') && !FOREIGN.contains(&&*name)
    });
    let pages = shown.flat_map(|path| match path.is_dir() {
        true => pages(&path),
        false => vec![path],
    });
    pages.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// The lines of a page without its blocks of code.
fn prose(text: &str) -> Vec<&str> {
    let mut is_code = false;
    let is_prose = |line: &&str| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    };
    text.lines().filter(is_prose).collect()
}

/// The targets of a page's links and pictures. A span of code has none; it ends with its paragraph.
fn targets(text: &str) -> Vec<String> {
    let text = prose(text).join("\n");
    let text: String = text.split("\n\n").flat_map(|paragraph| paragraph.split('`').step_by(2)).collect();
    let after = |opening, closing| {
        let parts = text.split(opening).skip(1);
        parts.filter_map(move |part: &str| Some(part.split_once(closing)?.0.to_string()))
    };
    after("](", ')').chain(after("src=\"", '"')).chain(after("href=\"", '"')).collect()
}

/// The anchors of a page, by GitHub's rule.
fn anchors(text: &str) -> Vec<String> {
    let mut seen = HashMap::new();
    let heading = |line: &str| Some(line.trim_start_matches('#').strip_prefix(' ')?.trim().to_string());
    let headings = prose(text).into_iter().filter(|line| line.starts_with('#')).filter_map(heading);
    let anchor = |heading: String| {
        let is_kept = |it: &char| it.is_alphanumeric() || matches!(it, ' ' | '-' | '_');
        let anchor = heading.to_lowercase().chars().filter(is_kept).collect::<String>().replace(' ', "-");
        let repeats = seen.entry(anchor.clone()).and_modify(|repeats| *repeats += 1).or_insert(0);
        if *repeats == 0 { anchor } else { format!("{anchor}-{repeats}") }
    };
    headings.map(anchor).collect()
}

/// The fault of a target, as seen from a page.
fn fault(page: &Path, target: &str) -> Option<&'static str> {
    if target.contains(':') {
        return None; // of another site
    }
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor)));
    let path = if path.is_empty() { page.into() } else { page.parent()?.join(path) };
    if !path.exists() {
        return Some("no such file");
    }
    let anchor = anchor?;
    let headings = anchors(&fs::read_to_string(path).unwrap_or_default());
    (!headings.iter().any(|it| it == anchor)).then_some("no such heading")
}

#[test]
fn each_link_leads_to_a_file_and_each_anchor_to_a_heading() {
    let root = Path::new(crate::ROOT).canonicalize().unwrap();
    let pages = pages(&root);
    assert!(pages.contains(&root.join("README.md")) && pages.contains(&root.join("kernel/README.md")));
    let mut faults = Vec::new();
    for page in pages {
        for target in targets(&fs::read_to_string(&page).unwrap()) {
            if let Some(fault) = fault(&page, &target) {
                faults.push(format!("{}: {target}: {fault}", page.strip_prefix(&root).unwrap().display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn anchors_are_those_of_github() {
    let page = "# The `x_y` of A, and B\n\n```sh\n# a comment\n```\n## More\n#hash\n## More\n### More!\n";
    assert_eq!(anchors(page), ["the-x_y-of-a-and-b", "more", "more-1", "more-2"]);
}

#[test]
fn links_are_found_in_text_alone() {
    let page = "A [`link`](a.md), `[no](b.md)`, a `stray\n\n![one](c.svg) <img src=\"d.png\">\n\
        ```\n[no](e.md)\n```\n";
    assert_eq!(targets(page), ["a.md", "c.svg", "d.png"]);
}

#[test]
fn a_broken_link_is_a_fault() {
    let page = Path::new(crate::ROOT).join("docs/decisions.md");
    for (target, expected) in [
        ("robot.md", None),
        ("robot.md#links", None),
        ("#the-kernel", None),
        ("../kernel", None),
        ("https://example.org/nothing", None),
        ("robots.md", Some("no such file")),
        ("robot.md#link", Some("no such heading")),
        ("#kernel", Some("no such heading")),
    ] {
        assert_eq!(fault(&page, target), expected, "{target}");
    }
}
