//! Each example has a page in docs/examples, which shows its program, its output, and what the kernel's part
//! costs. The tests compare the page with the source, a run in simavr and the kernel's figures;
//! `UPDATE_EXPECTED=1` rewrites it.

use std::collections::BTreeMap;
use std::path::Path;

use stack_bound::{Annotations, Image};
use superbot_tests_simavr::examples;

/// The page that lists the others.
const INDEX: &str = "README";

/// A line for each figure of the kernel: its name and its value.
const FIGURES: &str = include_str!("expected/bench.txt");

#[test]
fn each_has_a_page_that_the_index_names() {
    let mut pages = examples::stems(&examples::pages());
    pages.retain(|page| page != INDEX);
    assert_eq!(pages, examples::names());
    let index = read(&examples::pages().join(INDEX).with_extension("md"));
    for page in pages {
        assert!(index.contains(&format!("]({page}.md)")), "the index does not name {page}");
    }
}

#[test]
fn each_page_shows_the_program_what_it_prints_and_what_it_costs() {
    for name in examples::names() {
        let path = examples::pages().join(&name).with_extension("md");
        let page = read(&path);
        let renewed = renewed(&page, &read(&examples::source(&name)), &examples::run(&name));
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&path, renewed).expect("the page can be written");
            continue;
        }
        for (number, (is, shall_be)) in (1..).zip(page.lines().zip(renewed.lines())) {
            assert_eq!(is, shall_be, "{name}.md, line {number}; UPDATE_EXPECTED=1 writes it");
        }
        assert_eq!(page.len(), renewed.len(), "{name}.md; UPDATE_EXPECTED=1 writes it");
    }
}

#[test]
fn each_has_large_enough_stacks() {
    for name in examples::names() {
        let image = Image::load(examples::image(&name)).expect("the image can be read");
        let notes = examples::stack_notes(&name);
        let notes = notes.map(|notes| Annotations::load(notes, &image).expect("the notes fit the image"));
        let stacks = stack_bound::stacks(&image, &notes.unwrap_or_default())
            .unwrap_or_else(|problems| panic!("{name}: {problems:?}"));
        for stack in stacks {
            println!("{name}: {} needs {} bytes of {}", stack.name, stack.needs(), stack.size);
            assert!(!stack.is_too_small(), "{name}: {stack}");
        }
    }
}

/// The page with `program` in its block of `rs`, `output` in its block of `text`, and the kernel's figures in
/// its table.
fn renewed(page: &str, program: &str, output: &str) -> String {
    let figures = FIGURES.lines().filter_map(|line| line.split_once(' ')).collect();
    let mut renewed = String::new();
    let mut lines = page.lines();
    let mut blocks = 0;
    while let Some(line) = lines.next() {
        let block = match line {
            "```rs" => program,
            "```text" => output,
            _ => {
                renewed += &with_figure(line, &figures);
                renewed += "\n";
                continue;
            }
        };
        blocks += 1;
        renewed += &format!("{line}\n{block}```\n");
        lines.find(|&line| line == "```").expect("a block ends");
    }
    assert_eq!(blocks, 2, "a page has a block of `rs` and one of `text`");
    renewed
}

/// The row of a table, "| `figure` | value unit |", with the figure's present value; any other line
/// unchanged.
fn with_figure(line: &str, figures: &BTreeMap<&str, &str>) -> String {
    let row = line.strip_prefix("| `").and_then(|rest| {
        let (name, rest) = rest.split_once("` | ")?;
        let (_, unit) = rest.split_once(' ')?;
        Some((name, figures.get(name)?, unit))
    });
    row.map_or_else(|| line.to_owned(), |(name, value, unit)| format!("| `{name}` | {value} {unit}"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
