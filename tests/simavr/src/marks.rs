//! Marks: the reports that a test image makes by writes to a register.
//!
//! The expectation of an image is a file: one line a mark, the mark in hexadecimal and the cycles since the
//! mark before. Marks must be equal; cycles must not be more, because simavr's cycles repeat exactly.

use std::path::Path;

use simavr_harness::Marker;

/// The values of `markers`.
pub fn values(markers: &[Marker]) -> Vec<u8> {
    markers.iter().map(|marker| marker.value).collect()
}

/// Compares `markers` with the file `expected/NAME.txt`. A name may begin with a folder.
///
/// # Panics
/// When a mark differs or came later than expected. With `UPDATE_EXPECTED` set, the file is written instead.
pub fn expect(name: &Path, markers: &[Marker]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/expected").join(name).with_extension("txt");
    let mut seen = String::new();
    let mut before = 0;
    for marker in markers {
        seen += &format!("{:02x} +{}\n", marker.value, marker.cycle - before);
        before = marker.cycle;
    }
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        path.parent().map(std::fs::create_dir_all).transpose().expect("its folder can be made");
        std::fs::write(&path, seen).expect("the expectation can be written");
        return;
    }
    let expected = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; UPDATE_EXPECTED=1 writes it", path.display()));
    let (expected, seen) = (lines(&expected), lines(&seen));
    let marks = |lines: &[(String, u64)]| lines.iter().map(|(mark, _)| mark.clone()).collect::<Vec<_>>();
    assert_eq!(marks(&seen), marks(&expected), "{}: marks", name.display());
    for (index, ((mark, cycles), (_, limit))) in seen.iter().zip(&expected).enumerate() {
        assert!(
            cycles <= limit,
            "{}: mark {mark} (number {index}) took {cycles} cycles, {limit} before; \
             if that is meant, UPDATE_EXPECTED=1 writes the new figure",
            name.display()
        );
    }
}

fn lines(text: &str) -> Vec<(String, u64)> {
    text.lines()
        .map(|line| {
            let (mark, cycles) = line.split_once(" +").expect("a line is a mark and cycles");
            (mark.to_owned(), cycles.parse().expect("cycles are a number"))
        })
        .collect()
}
