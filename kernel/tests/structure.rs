//! How the sources hang together: what only `arch` may have, and layers without a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All sources, by their paths.
fn sources() -> BTreeMap<String, String> {
    let (mut folders, mut sources) = (vec![root()], BTreeMap::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("the sources are there") {
            let path = entry.expect("the folder can be read").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(root()).expect("it lies there").to_str().expect("a plain name");
            sources.insert(name.to_owned(), fs::read_to_string(&path).expect("it is text"));
        }
    }
    assert!(sources.len() > 25, "{sources:?}");
    sources
}

/// The files outside of `folder` with a line that has `text`, and these lines.
fn outside<'s>(
    sources: &'s BTreeMap<String, String>,
    folder: &'s str,
    text: &'s str,
) -> Vec<(&'s str, &'s str)> {
    let others = sources.iter().filter(move |(name, _)| !name.starts_with(folder));
    let lines = others.flat_map(|(name, source)| source.lines().map(move |line| (name.as_str(), line)));
    lines.filter(|(_, line)| line.contains(text)).collect()
}

#[test]
fn each_algorithm_stands_once() {
    // What is said of the architecture besides lets the crate use the AVR's assembly at all.
    let attribute = "#![cfg_attr(target_arch = \"avr\", feature(asm_experimental_arch))]";
    assert_eq!(outside(&sources(), "arch/", "target_arch"), [("lib.rs", attribute)]);
}

#[test]
fn assembly_is_where_bench_counts_it() {
    let sources = sources();
    assert_eq!(outside(&sources, "arch/avr/", "asm!"), []);
    let files: BTreeSet<_> = outside(&sources, "-", "asm!").into_iter().map(|(name, _)| name).collect();
    let counted = ["flash", "interrupts", "start", "switch", "vectors"];
    assert_eq!(files, counted.map(|name| format!("arch/avr/{name}.rs")).iter().map(String::as_str).collect());
}

/// The module at the top of the tree in which a source lies.
fn module(name: &str) -> &str {
    name.split(['/', '.']).next().unwrap_or(name)
}

/// Which modules each uses. `arch` is left out: it is the contract below all, and the ports that keep it are
/// above.
fn uses(sources: &BTreeMap<String, String>) -> BTreeMap<&str, BTreeSet<&str>> {
    let mut uses: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, source) in sources.iter().filter(|(name, _)| !["arch", "lib"].contains(&module(name))) {
        let used = uses.entry(module(name)).or_default();
        for line in source.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let Some((_, path)) = line.split_once("crate::") else { continue };
            let end = path.find(|char: char| !char.is_alphanumeric() && char != '_').unwrap_or(path.len());
            used.insert(&path[..end]);
        }
        used.remove(module(name));
    }
    let modules: BTreeSet<_> = uses.keys().copied().collect();
    uses.values_mut().for_each(|used| used.retain(|name| modules.contains(name)));
    uses
}

#[test]
fn layers_have_no_circle() {
    let sources = sources();
    let mut uses = uses(&sources);
    assert!(uses["queue"].contains("semaphore"), "{uses:?}");
    // From below: what uses nothing that is above.
    while let Some(lowest) = uses.iter().find(|(_, used)| used.is_empty()).map(|(&name, _)| name) {
        uses.remove(lowest);
        for used in uses.values_mut() {
            used.remove(lowest);
        }
    }
    assert!(uses.is_empty(), "a circle is among these: {uses:?}");
}
