//! Makes a documentation test of each page in docs/examples: code that must not compile according to the page
//! must not.

use std::path::Path;
use std::{env, fs};

fn main() {
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples");
    let mut paths: Vec<_> = fs::read_dir(&pages)
        .expect("the pages are there")
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    paths.sort();
    let items = paths.iter().map(|path| format!("#[doc = include_str!({path:?})]\nconst _: () = ();\n"));
    let out = Path::new(&env::var("OUT_DIR").expect("Cargo sets it")).join("pages.rs");
    fs::write(out, items.collect::<String>()).expect("the list can be written");
    println!("cargo::rerun-if-changed={}", pages.display());
}
