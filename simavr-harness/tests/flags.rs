//! Tests that a program clears a timer's flag by a one written to it, and no other flag.

use std::sync::Arc;

use crate::common::{build_for, marked};
use simavr_harness::{Mcu, Part, State};

/// Runs the program in both interpreters. Returns what it finds in each register of flags: before it clears
/// any, and after each.
fn found(part: &'static Part, defines: &[&str]) -> Vec<Vec<u8>> {
    const END: u8 = 0xaa;
    let image = build_for(part, "flags.c", defines);
    let undecoded = Arc::new(Arc::unwrap_or_clone(image.clone()).undecoded());
    let [decoded, undecoded] = [image, undecoded].map(|image| {
        let mut mcu = Mcu::new(part, image, 1).expect("the image fits the part");
        assert_eq!(mcu.run_to_end(200_000), State::Done);
        marked(&mcu)
    });
    assert_eq!(decoded, undecoded, "{}", part.name);
    let registers = decoded.split(|&mark| mark == END).filter(|register| !register.is_empty());
    registers.map(<[u8]>::to_vec).collect()
}

/// What is left of `flags` each time that the lowest one is cleared.
fn one_by_one(flags: u8) -> Vec<u8> {
    std::iter::successors(Some(flags), |&left| (left != 0).then(|| left & (left - 1))).collect()
}

#[test]
fn a_one_written_to_a_timers_flag_clears_that_flag_alone() {
    let all = |flags: &[u8]| flags.iter().copied().map(one_by_one).collect::<Vec<_>>();
    // All but those of the capture units.
    assert_eq!(found(Part::ATMEGA128, &[]), all(&[0xdf, 0x1f]));
    for defines in [&[][..], &["SBI"]] {
        assert_eq!(found(Part::ATMEGA328P, defines), all(&[0x07; 3]), "{defines:?}");
        assert_eq!(found(Part::ATMEGA1284P, defines), all(&[0x07; 4]), "{defines:?}");
        assert_eq!(found(Part::ATMEGA2560, defines), all(&[7, 0xf, 7, 0xf, 0xf, 0xf]), "{defines:?}");
    }
}
