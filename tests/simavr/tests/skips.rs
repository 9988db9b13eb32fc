//! No image skips an instruction that jumps to an address from the stack or Z: QEMU gets that wrong, see
//! `qemu.rs`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rustc_demangle::demangle;
use simavr_harness::{Code, Image, Kind, Place};
use superbot_tests_simavr::images;

/// Functions of the present kernel that do.
const KNOWN: [&str; 0] = [];

#[test]
fn no_function_skips_an_indirect_jump() {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let all = images_in(&images());
    assert!(all.len() > 50, "{} images: ./x test builds them", all.len());
    for path in all {
        let image = Image::load(&path).unwrap_or_else(|error| panic!("{error}"));
        for address in offenders(&image) {
            let (name, offset) = image.function_at(address).expect("it lies in a function");
            let name = format!("{:#}", demangle(name));
            found.entry(name).or_default().push(format!("{} at {address:#x}, +{offset:#x}", path.display()));
        }
    }
    let names: Vec<_> = found.keys().map(String::as_str).collect();
    assert_eq!(names, KNOWN, "{found:#?}");
}

/// The addresses of such skips in an image's functions.
fn offenders(image: &Image) -> Vec<u32> {
    let functions = image.symbols().filter_map(|(_, symbol)| match symbol.place {
        Place::Flash(start) if symbol.is_function => Some(image.code(start..start + u32::from(symbol.size))),
        _ => None,
    });
    functions.flat_map(|code| code.windows(2).filter_map(offender).collect::<Vec<_>>()).collect()
}

fn offender(pair: &[Code]) -> Option<u32> {
    (pair[0].kind == Kind::Skip && pair[1].kind == Kind::Indirect).then_some(pair[0].address)
}

/// All images in a folder and those in it.
fn images_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let (folders, files): (Vec<_>, Vec<_>) = paths.partition(|path| path.is_dir());
    let files = files.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == "elf"));
    files.chain(folders.iter().flat_map(|folder| images_in(folder))).collect()
}
