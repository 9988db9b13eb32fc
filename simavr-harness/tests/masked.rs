//! Tests that masked windows are measured to the cycle.

use crate::common::{build, mcu};
use simavr_harness::{OpenedBy, Place, State};

#[test]
fn each_window_is_found_with_its_cause_and_length() {
    let image = build("masked.S");
    let mut mcu = mcu(&image);
    let windows = mcu.masked_windows(10_000);
    assert_eq!(mcu.state(), State::Done);

    // The first masked instruction is the one after the CLI.
    let after_label = |name| match image.symbol(name).map(|symbol| symbol.place) {
        Some(Place::Flash(address)) => address + 2,
        place => panic!("{name} is in flash, not {place:?}"),
    };
    let found = |opened_by, start: Option<u32>| {
        let mut matching = windows
            .iter()
            .filter(|window| window.opened_by == opened_by)
            .filter(|window| start.is_none_or(|start| window.start == start))
            .map(|window| (window.cycles, window.times));
        (matching.next(), matching.next())
    };
    let short = Some(after_label("short_window"));
    let joined = Some(after_label("joined_window"));
    let long = Some(after_label("long_window"));
    assert_eq!(found(OpenedBy::Instruction, short), (Some((2, 1)), None));
    assert_eq!(found(OpenedBy::Instruction, joined), (Some((5, 1)), None));
    assert_eq!(found(OpenedBy::Instruction, long), (Some((21, 1)), None));
    assert_eq!(found(OpenedBy::Interrupt(5), None), (Some((12, 1)), None));
    assert!(found(OpenedBy::Start, None).0.is_some_and(|(cycles, _)| cycles > 5));
    assert!(windows.is_sorted_by_key(|window| std::cmp::Reverse(window.cycles)));
}
