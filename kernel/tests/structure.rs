//! How the sources hang together: what only `arch` may have.

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

/// What a macro defines is a part of the program, whose safe code could call it.
#[test]
fn functions_that_only_the_kernel_may_call_are_unsafe() {
    let sources = sources();
    let mut functions = outside(&sources, "-", "extern \"C\" fn kernel_");
    // The program's handler of an overflow: whoever calls it does not come back.
    functions.retain(|(_, line)| !line.contains("kernel_stack_overflow"));
    assert!(functions.len() >= 4, "{functions:?}");
    assert!(functions.iter().all(|(_, line)| line.trim().starts_with("unsafe ")), "{functions:?}");
}
