//! Single steps: a suspended task executes exactly one instruction, even if interrupts occur meanwhile.

use simavr_harness::{Mcu, Place, State};
use superbot_tests_simavr::MILLISECOND;
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::target::{TARGETS, Target};

// The marks of the image.
const ROUND: u8 = 0x01;
const STEPPED: u8 = 0x02;
const RESUMED: u8 = 0x03;
const TICK: u8 = 0x04;
const PRESSED: u8 = 0x05;
const WRONG: u8 = 0xff;

/// The marks of a task that steps through calls of the kernel: it yields, and then waits; passes its
/// semaphore, its mutex and the post, which wakes a higher task at once; and has ended.
const WALK: [u8; 7] = [0x10, 0x15, 0x11, 0x12, 0x16, 0x13, 0x14];

/// Steps that the image makes.
const STEPS: usize = 300;

/// The most cycles of a step, and of anything that has to wait for it.
const STEP: u64 = 6_000;

/// The least cycles from one step to the next.
const SHORTER: u64 = 1_500;

/// The program counter, as a byte address, of a task that an interrupt preempted.
fn saved_pc(mcu: &Mcu, target: &Target, control: u16) -> u32 {
    let byte = |address: u16| mcu.read(address).expect("it is in SRAM");
    let stack_pointer = u16::from_le_bytes([byte(control + 1), byte(control + 2)]);
    assert!(stack_pointer & 0x8000 != 0, "an interrupt saved it");
    let context = stack_pointer & 0x7fff;
    // Above 16 registers lie the other 16 and SREG, which an interrupt pushes first, and then the program
    // counter.
    let place = context + 16 + 17;
    let bytes = (0..target.part.return_address).map(|index| u32::from(byte(place + index)));
    2 * bytes.fold(0, |pc, byte| pc << 8 | byte)
}

/// The places of the worker's round where an interrupt could occur, in the order of execution.
fn round(mcu: &mut Mcu) -> Vec<u32> {
    loop {
        mcu.run_to_marker(ROUND, 100 * MILLISECOND).expect("the worker runs");
        let mut places = vec![mcu.pc()];
        loop {
            // The instruction after `sei` still runs before any interrupt.
            let was_enabled = mcu.interrupts_enabled();
            if mcu.step().is_some() {
                break; // once more, without a tick
            }
            if mcu.pc() == places[0] {
                return places;
            }
            if was_enabled && mcu.interrupts_enabled() {
                places.push(mcu.pc());
            }
        }
    }
}

#[test]
fn an_external_interrupt_that_a_step_enables_stays_enabled() {
    for target in TARGETS {
        let mut mcu = target.mcu(target.image("step_external"));
        mcu.drive_pin(target.button, false);
        mcu.run_to_marker(1, 100 * MILLISECOND).expect("the task makes its steps, and waits");
        mcu.drive_pin(target.button, true);
        assert_eq!(mcu.run_to_end(MILLISECOND), State::Done, "{}", target.part.name);
        assert_eq!(values(mcu.markers()), [1, 2], "{}", target.part.name);
    }
}

#[test]
fn a_suspended_task_steps_by_one_instruction() {
    for (target, seed) in TARGETS.into_iter().flat_map(|target| (0..3).map(move |seed| (target, seed))) {
        let name = target.part.name;
        let image = target.image("step");
        let Place::Data(worker) = image.symbol("WORKER").expect("there is one").place else {
            panic!("a stack in flash")
        };
        let mut mcu = target.mcu(image);
        mcu.drive_pin(target.button, false);
        let round = round(&mut mcu);
        assert!(round.len() > 60, "{name}: {} places", round.len());

        let mut before = mcu.run_to_marker(STEPPED, 10 * MILLISECOND).expect("it makes a step").cycle;
        let first = saved_pc(&mcu, target, worker);
        let mut place = round.iter().position(|pc| *pc == first).expect("it is in the round");
        mcu.take_markers();

        let (mut steps, mut ticks, mut presses, mut pressed_at) = (1, 0, 0, None);
        let begin = before;
        let (mut level, mut random) = (false, 7919 * seed);
        let mut is_over = false;
        while !is_over {
            // The button is pressed at all distances from the steps.
            random = (random * 4_005 + 1) % (1 << 16);
            mcu.run_until(mcu.cycle() + random % SHORTER);
            let markers = mcu.take_markers();
            // After the last step the task soon continues by itself.
            let is_suspended = markers.iter().all(|marker| marker.value != RESUMED);
            for marker in markers {
                match marker.value {
                    STEPPED => {
                        place = (place + 1) % round.len();
                        steps += 1;
                        let cycles = marker.cycle - before;
                        assert!((SHORTER..STEP).contains(&cycles), "{name}: a step of {cycles} cycles");
                        before = marker.cycle;
                        if is_suspended {
                            let pc = saved_pc(&mcu, target, worker);
                            assert_eq!(
                                pc,
                                round[place],
                                "{name}: step {steps}, from {:#x}",
                                round[place - 1]
                            );
                        }
                    }
                    PRESSED => {
                        let pressed: u64 = pressed_at.take().expect("it was pressed");
                        let latency = marker.cycle - pressed;
                        assert!(latency < STEP, "{name}: {latency} cycles to the task of the button");
                        presses += 1;
                    }
                    ROUND => {}
                    TICK => ticks += 1,
                    RESUMED => is_over = true,
                    _ => panic!("{name}: {marker:x?}"),
                }
            }
            level = !level && pressed_at.is_none();
            if level {
                pressed_at = Some(mcu.cycle());
            }
            mcu.drive_pin(target.button, level);
        }
        assert_eq!(steps, STEPS, "{name}");
        let elapsed = (before - begin) / MILLISECOND;
        assert!((elapsed - 1..=elapsed + 1).contains(&ticks), "{name}: {ticks} ticks in {elapsed} ms");
        assert!(presses > 100, "{name}: {presses} presses");

        // The worker has all its registers, and the rest works.
        assert_eq!(mcu.run_to_end(100 * MILLISECOND), State::Done);
        let marks = values(mcu.markers());
        assert!(marks.iter().filter(|mark| **mark == ROUND).count() > 50, "{name}: the worker works");
        assert!(!marks.contains(&WRONG), "{name}: {marks:x?}");
        let walk: Vec<u8> = marks.into_iter().filter(|mark| *mark > PRESSED).collect();
        assert_eq!(walk, WALK, "{name}");
    }
}
