//! The modules of a crate use each other without a cycle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The modules of a crate that each one uses, by their paths.
type Uses = BTreeMap<String, BTreeSet<String>>;

/// The crates, and the module of each that is left out. The kernel's `arch` is the contract below all, while
/// its ports are above.
const CRATES: [(&str, &str); 14] = [
    ("kernel", "arch"),
    ("instruction-set", ""),
    ("board", ""),
    ("tasks", ""),
    ("hormone", ""),
    ("console", ""),
    ("plants", ""),
    ("world", ""),
    ("simulation", ""),
    ("simavr-harness", ""),
    ("simavr-harness/program", ""),
    ("stack-bound", ""),
    ("time-bound", ""),
    ("viewer", ""),
];

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    for (name, left_out) in CRATES {
        expect_no_circle(name, &file_uses(name, left_out));
    }
}

#[test]
fn no_folders_of_a_crate_use_each_other_in_a_circle() {
    for (name, left_out) in CRATES {
        // Their `superbot` describes all other modules, and some of these read it.
        if ["board", "tasks"].contains(&name) {
            continue;
        }
        let mut uses = Uses::new();
        let folder = |path: &str| path.split("::").next().unwrap_or(path).to_owned();
        for (file, used) in file_uses(name, left_out) {
            uses.entry(folder(&file)).or_default().extend(used.iter().map(|path| folder(path)));
        }
        uses.iter_mut().for_each(|(module, used)| _ = used.remove(module));
        expect_no_circle(name, &uses);
    }
}

fn expect_no_circle(name: &str, uses: &Uses) {
    let mut uses = uses.clone();
    assert!(uses.len() == 1 || uses.values().any(|used| !used.is_empty()), "{name}: no module uses another");
    // Removes modules from the bottom up: each time one that uses no other that is left.
    while let Some(lowest) = uses.iter().find(|(_, used)| used.is_empty()).map(|(name, _)| name.clone()) {
        uses.remove(&lowest);
        uses.values_mut().for_each(|used| _ = used.remove(&lowest));
    }
    assert!(uses.is_empty(), "{name}: a circle is among these: {uses:#?}");
}

/// By file, as a module's path.
fn file_uses(name: &str, left_out: &str) -> Uses {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name).join("src");
    let mut uses = Uses::new();
    for path in sources(&root) {
        let place = path.strip_prefix(&root).expect("it lies there").with_extension("");
        let mut parts: Vec<&str> = place.iter().map(|part| part.to_str().expect("a plain name")).collect();
        if [left_out, "lib", "main", "bin"].contains(&parts[0]) || parts.contains(&"tests") {
            continue;
        }
        parts.retain(|part| *part != "mod");
        let source = fs::read_to_string(&path).expect("it is text");
        let code = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or(&source);
        uses.entry(parts.join("::")).or_default().extend(named(code, &parts));
    }
    let modules: BTreeSet<String> = uses.keys().cloned().collect();
    for (module, used) in &mut uses {
        let files = used.iter().filter_map(|path| file_of(path, &modules)).filter(|file| file != module);
        *used = files.collect();
    }
    uses
}

/// The file of the module with this path, or of the one that has an item with this path.
fn file_of(path: &str, modules: &BTreeSet<String>) -> Option<String> {
    let mut path = path;
    while !modules.contains(path) {
        path = path.rsplit_once("::")?.0;
    }
    Some(path.to_owned())
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let within = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    let is_source = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "rs");
    paths.flat_map(within).filter(is_source).collect()
}

/// The paths from the crate in the source of the module with the path `parts`: behind `crate::`, or behind
/// `super::`, of which a path may have several.
fn named(source: &str, parts: &[&str]) -> Vec<String> {
    let code: String = source.lines().map(|line| line.split("//").next().unwrap_or(line)).collect();
    // What a macro names is used by the program that it is expanded in.
    let mut code = code.replace("$crate::", "");
    for up in (1..=parts.len()).rev() {
        let parents: String = parts[..parts.len() - up].iter().map(|part| format!("{part}::")).collect();
        code = code.replace(&"super::".repeat(up), &format!("crate::{parents}"));
    }
    code.split("crate::").skip(1).flat_map(paths).collect()
}

/// The path that a text begins with, or those in the braces at its end.
fn paths(text: &str) -> Vec<String> {
    let is_path = |char: char| char.is_alphanumeric() || char == '_' || char == ':';
    let end = text.find(|char| !is_path(char)).unwrap_or(text.len());
    let (path, rest) = text.split_at(end);
    match rest.strip_prefix('{').and_then(|rest| rest.split('}').next()) {
        Some(list) => list.split(',').map(|item| format!("{path}{}", item.trim())).collect(),
        None => vec![path.to_owned()],
    }
}
