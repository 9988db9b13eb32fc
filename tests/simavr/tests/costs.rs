//! The documented cycles of calls that have no figure in `./x bench`.

use superbot_tests_simavr::{MILLISECOND, mcu};

/// The bit that the mark at the end of a stretch has set besides the stretch's number.
const END: u8 = 0x80;

/// The later mark's own cycles.
const MARK: u64 = 2;

/// The least and the most that each stretch of `board_costs` has taken, from 1 on.
fn measured() -> Vec<(u64, u64)> {
    let mut mcu = mcu("board_costs");
    mcu.run_until(20 * MILLISECOND);
    let mut stretches = vec![(u64::MAX, 0); 11];
    for pair in mcu.markers().windows(2) {
        if pair[1].value == pair[0].value | END && pair[0].value & END == 0 {
            let cycles = pair[1].cycle - pair[0].cycle - MARK;
            let (least, most) = &mut stretches[usize::from(pair[0].value) - 1];
            (*least, *most) = (cycles.min(*least), cycles.max(*most));
        }
    }
    stretches
}

#[test]
fn calls_take_what_the_documentation_says() {
    let measured = measured();
    let [lock, unlock, lock_below, unlock_below, one, two, four, eight, nobody, waiting, timeouts] =
        measured[..]
    else {
        panic!("{measured:?}")
    };
    // `Mutex::lock`, and docs/examples/mutexes.md. A program that also calls `try_lock` takes one call more.
    for (name, (least, most), said) in [
        ("to lock at the ceiling", lock, 55..=70),
        ("to unlock at the ceiling", unlock, 65..=75),
        ("to lock below it", lock_below, 100..=120),
        ("to unlock below it", unlock_below, 160..=200),
    ] {
        assert!(said.contains(&least) && said.contains(&most), "{name}: {least} to {most}, not {said:?}");
    }
    // `Flash::get`, and docs/examples/flash_tables.md.
    for (bytes, (_, most), said) in [(1, one, 10), (2, two, 50), (4, four, 70), (8, eight, 110)] {
        assert!(is_about(most, said), "{bytes} bytes: {most}, not {said}");
    }
    // `EventFlags::set`, and docs/examples/event_flags.md: for each waiting task.
    for (name, (_, most), said) in [("a wait", waiting, 120), ("a wait with a timeout", timeouts, 200)] {
        let cycles = (most - nobody.1) / 4;
        assert!(is_about(cycles, said), "{name}: {cycles}, not {said}");
    }
}

/// Whether `cycles` is less than an eighth away from `said`.
fn is_about(cycles: u64, said: u64) -> bool {
    cycles.abs_diff(said) * 8 < said
}
