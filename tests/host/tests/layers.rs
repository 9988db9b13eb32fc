//! The modules of a crate use each other without a cycle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The top-level modules of a crate that each one uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

#[test]
fn no_crate_has_a_circle() {
    // The kernel's `arch` is left out: it is the contract below all, while its ports are above.
    for (name, left_out) in [
        ("kernel", "arch"),
        ("plants", ""),
        ("hormone", ""),
        ("simulation", ""),
        ("simavr-harness", ""),
        ("simavr-harness/program", ""),
        ("stack-bound", ""),
        ("time-bound", ""),
        ("world", ""),
    ] {
        let mut uses = uses(name, left_out);
        assert!(uses.values().any(|used| !used.is_empty()), "{name}: no module uses another");
        // Removes modules from the bottom up: each time one that uses no other that is left.
        while let Some(lowest) = uses.iter().find(|(_, used)| used.is_empty()).map(|(name, _)| name.clone()) {
            uses.remove(&lowest);
            uses.values_mut().for_each(|used| _ = used.remove(&lowest));
        }
        assert!(uses.is_empty(), "{name}: a circle is among these: {uses:#?}");
    }
}

fn uses(name: &str, left_out: &str) -> Uses {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name).join("src");
    let mut uses = Uses::new();
    for path in sources(&root) {
        let place = path.strip_prefix(&root).expect("it lies there").with_extension("");
        let parts: Vec<&str> = place.iter().map(|part| part.to_str().expect("a plain name")).collect();
        if [left_out, "lib", "main"].contains(&parts[0]) || parts.contains(&"tests") {
            continue;
        }
        let source = fs::read_to_string(&path).expect("it is text");
        // So many modules up lies the crate.
        let depth = parts.iter().filter(|part| **part != "mod").count();
        let source = source.replace(&"super::".repeat(depth), "crate::");
        uses.entry(parts[0].to_owned()).or_default().extend(named(&source));
    }
    let modules: BTreeSet<String> = uses.keys().cloned().collect();
    for (module, used) in &mut uses {
        used.retain(|name| name != module && modules.contains(name));
    }
    uses
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let within = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    paths.flat_map(within).collect()
}

/// The names that follow `crate::` in a source: one name, or those in braces.
fn named(source: &str) -> Vec<String> {
    let code: String = source.lines().map(|line| line.split("//").next().unwrap_or(line)).collect();
    let names = |path: &str| {
        let is_name = |char: char| char.is_alphanumeric() || char == '_';
        let (list, count) = match path.strip_prefix('{') {
            Some(list) => (list.split('}').next().unwrap_or(list), usize::MAX),
            None => (path, 1),
        };
        let words = list.split(move |char| !is_name(char)).take(count);
        words.map(str::to_owned).collect::<Vec<_>>()
    };
    code.split("crate::").skip(1).flat_map(names).collect()
}
