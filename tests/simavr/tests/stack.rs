//! A program counts the unused bytes of its tasks' stacks, and detects that one task has used all of its
//! stack.

use simavr_harness::{Mcu, State};
use superbot_tests_simavr::stacks::{Stack, stacks};
use superbot_tests_simavr::target::TARGETS;

/// The mark of a task that has not been started, and that of a stack that is not intact.
const NOT_STARTED: u8 = 0;
const OVERRUN: u8 = 0xfe;

#[test]
fn a_task_sees_what_is_left_of_a_stack() {
    for target in TARGETS {
        let stacks = stacks(target.part, &target.images().join("stack.elf"), None);
        let [deep, watcher] = ["DEEP", "WATCHER"]
            .map(|name| stacks.iter().find(|stack| stack.name == name).expect("the image has that stack"));
        let beyond = deep.bound.needs() - u32::from(deep.bound.size);
        assert_eq!(beyond, 2, "{}: beyond its stack by as much as the image says", target.part.name);

        let mut mcu = target.mcu(target.image("stack"));
        assert_eq!(next_mark(&mut mcu), Some(NOT_STARTED));
        let mut seen = Vec::new();
        while let Some(left) = next_mark(&mut mcu).filter(|&mark| mark != OVERRUN) {
            assert_eq!(left, unused(deep, &mcu), "{}, DEEP at {}", target.part.name, mcu.cycle());
            let own = next_mark(&mut mcu);
            assert_eq!(own, Some(unused(watcher, &mcu)), "{}, WATCHER at {}", target.part.name, mcu.cycle());
            if seen.last() != Some(&left) {
                seen.push(left);
            }
        }
        assert!(seen.is_sorted_by(|before, after| before > after), "{}: {seen:?}", target.part.name);
        // One for each depth, and where the tick may occur in a call there, two.
        assert!(seen.len() >= 4 && seen.last() == Some(&0), "{}: {seen:?}", target.part.name);
        assert_eq!(mcu.markers().last().map(|mark| mark.value), Some(OVERRUN), "{}", target.part.name);
        assert_eq!(mcu.run_to_end(1_000), State::Done);
    }
}

/// How many bytes of a stack have never been used.
fn unused(stack: &Stack, mcu: &Mcu) -> u8 {
    u8::try_from(u32::from(stack.bound.size) - stack.used(mcu)).expect("the stacks are small")
}

/// Runs to the next mark; `None` where the program ends.
fn next_mark(mcu: &mut Mcu) -> Option<u8> {
    let before = mcu.markers().len();
    while mcu.is_alive() && mcu.markers().len() == before {
        mcu.step();
    }
    mcu.markers().get(before).map(|mark| mark.value)
}
