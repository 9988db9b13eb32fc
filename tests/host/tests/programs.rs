//! Where the tests of a package are one program, each of their files is part of it.

use std::fs;
use std::path::{Path, PathBuf};

/// The folders of the workspace whose files are compiled as one program of tests.
fn programs() -> Vec<PathBuf> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let read = |path: &Path| fs::read_to_string(path).unwrap();
    let workspace = read(&root.join("Cargo.toml"));
    let (_, members) = workspace.split_once("\nmembers = [").unwrap();
    let (members, _) = members.split_once(']').unwrap();
    let packages = members.split('"').skip(1).step_by(2).map(|package| root.join(package));
    let folders = packages.flat_map(|package| {
        let manifest = read(&package.join("Cargo.toml"));
        let paths =
            manifest.lines().filter_map(|line| line.strip_prefix("path = \"")?.strip_suffix("/main.rs\""));
        paths
            .filter(|folder| folder.starts_with("tests"))
            .map(|folder| package.join(folder))
            .collect::<Vec<_>>()
    });
    folders.collect()
}

#[test]
fn every_file_of_tests_is_compiled() {
    let programs = programs();
    for folder in &programs {
        let main = fs::read_to_string(folder.join("main.rs")).unwrap();
        for file in fs::read_dir(folder).unwrap() {
            let name = file.unwrap().file_name().into_string().unwrap();
            let Some(module) = name.strip_suffix(".rs").filter(|&module| module != "main") else { continue };
            assert!(main.contains(&format!("mod {module};")), "{name} is not part of {folder:?}");
        }
    }
    assert!(programs.len() > 3, "{programs:?}");
}
