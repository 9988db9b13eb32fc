//! The kernel's feature `stack-check`: an overflow of one byte is found, a stack that is used to its last
//! byte is no overflow, and the check costs a switch what is documented.

use fastrand::Rng;
use simavr_harness::{Marker, Place, State};
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::mcu;
use superbot_tests_simavr::stacks::stacks;
use superbot_tests_simavr::storm::{BOOTED, rage};
use superbot_tests_simavr::target::TARGETS;

/// The mark of an overflow that the kernel found.
const STACK_OVERFLOW: u8 = 0xec;

/// More cycles than the images need.
const LIMIT: u64 = 1_000_000;

#[test]
fn an_overflow_of_one_byte_is_found_at_the_switch() {
    for target in TARGETS {
        let path = target.images().join("stack-overflow/storm.elf");
        let stacks = stacks(target.part, &path, None);
        let busy = stacks.iter().find(|stack| stack.name == "BUSY").expect("the image has that stack");
        assert_eq!(busy.bound.needs() - u32::from(busy.bound.size), 1, "it is a byte too small");

        let mut mcu = target.mcu(target.image("stack-overflow/storm"));
        target.enable_interrupts(&mut mcu);
        mcu.run_to_marker(BOOTED, LIMIT).expect("it starts");
        mcu.take_markers();
        let mut random = Rng::with_seed(1);
        while mcu.is_alive() && mcu.cycle() < LIMIT {
            mcu.raise_interrupt(target.tick.vector);
            mcu.run_until(mcu.cycle() + random.u64(1..=2000));
        }
        let marks = values(mcu.markers());
        let [.., STACK_OVERFLOW, low, high] = marks[..] else { panic!("none was found: {marks:02x?}") };
        let is_busy = |(name, _): &(&str, _)| name.ends_with("4BUSY");
        let place = mcu.image().symbols().find(is_busy).map(|(_, symbol)| symbol.place);
        assert_eq!(place, Some(Place::Data(u16::from_le_bytes([low, high]))));
    }
}

#[test]
fn a_stack_that_is_used_to_its_last_byte_is_none() {
    for target in TARGETS {
        let stacks = stacks(target.part, &target.images().join("stack-check/storm.elf"), None);
        let mut mcu = target.mcu(target.image("stack-check/storm"));
        target.enable_interrupts(&mut mcu);
        rage(target, &mut mcu, 2_000_000, &mut Rng::with_seed(1));
        // After the storm the lowest task runs, and is preempted anywhere.
        let mut random = Rng::with_seed(1);
        while mcu.cycle() < 4_000_000 {
            mcu.raise_interrupt(target.tick.vector);
            mcu.run_until(mcu.cycle() + random.u64(1..=20_000));
        }
        assert!(mcu.is_alive(), "{}", target.part.name);
        let busy = stacks.iter().find(|stack| stack.name == "BUSY").expect("the image has that stack");
        assert_eq!(
            busy.used(&mcu),
            busy.bound.size.into(),
            "{}: it is used to its last byte",
            target.part.name
        );
    }
}

/// The cycles of the check in a switch: see `docs/kernel.md`, "Stack sizes".
const COST: u64 = 36;

#[test]
fn a_switch_takes_as_much_longer_as_is_said() {
    let marks = |name| {
        let mut mcu = mcu(name);
        assert_eq!(mcu.run_to_end(LIMIT), State::Done);
        mcu.take_markers()
    };
    let (without, with) = (marks("preemption"), marks("stack-check/preemption"));
    assert_eq!(values(&without), values(&with));
    // A yield lies between these two marks.
    let yield_cycles = |marks: &[Marker]| {
        let [before, after] = [5, 6].map(|value| marks.iter().find(|mark| mark.value == value));
        after.expect("it marks").cycle - before.expect("it marks").cycle
    };
    assert_eq!(yield_cycles(&with) - yield_cycles(&without), COST);
}
