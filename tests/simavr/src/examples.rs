//! The examples: their names, and the output of each.

use std::path::{Path, PathBuf};

use simavr_harness::{Mcu, Part, State};

use crate::{MILLISECOND, images, load, marks};

/// The most cycles that an example may take.
const LIMIT: u64 = 1000 * MILLISECOND;

/// The names of all examples, sorted.
///
/// # Panics
/// When their folder can't be read.
pub fn names() -> Vec<String> {
    stems(&root().join("examples/src/bin"))
}

/// The file with an example's program.
pub fn source(name: &str) -> PathBuf {
    root().join("examples/src/bin").join(name).with_extension("rs")
}

/// The file of notes for `stack-bound` about an example, if it needs one.
pub fn stack_notes(name: &str) -> Option<PathBuf> {
    Some(root().join("examples/stacks").join(name).with_extension("txt")).filter(|notes| notes.exists())
}

/// The folder of the pages about the examples.
pub fn pages() -> PathBuf {
    root().join("docs/examples")
}

/// The image of an example, where `./x test` puts it.
pub fn image(name: &str) -> PathBuf {
    images().join("examples").join(name).with_extension("elf")
}

/// Runs an example to its end, and returns what it printed.
///
/// # Panics
/// When it is not built, or does not end by itself.
pub fn run(name: &str) -> String {
    let image = load(&image(name));
    let mut mcu = Mcu::new(Part::ATMEGA128, image, 1).expect("the image fits the ATmega128");
    let end = mcu.run_to_end(LIMIT);
    let output = String::from_utf8(marks::values(mcu.markers())).expect("it prints text");
    assert_eq!(end, State::Done, "{name} printed:\n{output}");
    output
}

/// The names of the files in a folder, without extensions, sorted.
///
/// # Panics
/// When it can't be read.
pub fn stems(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let stem = |path: PathBuf| Some(path.file_stem()?.to_str()?.to_owned());
    let mut stems: Vec<_> =
        entries.filter_map(|entry| stem(entry.expect("the folder can be read").path())).collect();
    stems.sort();
    stems
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
