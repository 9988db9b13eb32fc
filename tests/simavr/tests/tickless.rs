//! Tickless idle: the same times with fewer interrupts.

use simavr_harness::{Character, Mcu, Pin, SerialPins, State};
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::soft_uart::{FRAME, LINE};
use superbot_tests_simavr::{MILLISECOND, mcu};

/// The most cycles by which a mark may come later or earlier than with a tick each time: a twentieth of a
/// tick, because a tick itself takes longer.
const APART: u64 = MILLISECOND / 20;

const SECOND: u64 = 1000 * MILLISECOND;

/// INT4 of the ATmega128.
const BUTTON: Pin = Pin { port: 'E', bit: 4 };

#[test]
fn timers_end_on_the_same_ticks() {
    let [plain, tickless] = ["timer", "tickless/timer"].map(|name| {
        let mut mcu = mcu(name);
        assert_eq!(mcu.run_to_end(SECOND), State::Done, "{name}");
        mcu
    });
    assert_eq!(values(tickless.markers()), values(plain.markers()));
    for (one, other) in tickless.markers().iter().zip(plain.markers()) {
        let apart = one.cycle.abs_diff(other.cycle);
        assert!(apart < APART, "mark {:02x}: {apart} cycles apart", one.value);
    }
}

#[test]
fn a_minute_without_work() {
    let [plain, tickless] = ["idle", "tickless/idle"].map(|name| {
        let mut mcu = mcu(name);
        let interrupts = interrupts_in_a_minute(&mut mcu);
        println!("{name}: {interrupts} interrupts, {} cycles awake", mcu.awake_cycles());
        interrupts
    });
    assert_eq!(plain, 60_000);
    assert_eq!(tickless, 60 * 4, "each second 250 ticks at a time");
}

#[test]
fn whoever_ends_a_sleep_finds_the_time_as_it_is() {
    for name in ["idle", "tickless/idle"] {
        let mut mcu = mcu(name);
        mcu.drive_pin(BUTTON, false);
        // The task that marks the seconds runs soon after a tick.
        let begun = mcu.run_to_marker(1, 2 * SECOND).expect("the first second").cycle;
        for press in 1..=1000 {
            mcu.run_until(begun + press * (8 * MILLISECOND + 1009));
            let pressed = mcu.cycle();
            let within = (pressed - begun) % MILLISECOND;
            mcu.take_markers();
            mcu.drive_pin(BUTTON, true);
            mcu.run_until(pressed + 1000);
            let told =
                mcu.markers().iter().map(|mark| mark.value).find(|&value| value >= 0x80).expect("a mark");
            mcu.drive_pin(BUTTON, false);
            // The first mark came some time after its tick, and some time passes from the press until the
            // task reads the time.
            let tick = 1000 + (pressed - begun) / MILLISECOND;
            let is_near = within > MILLISECOND - 2 * APART;
            let expected = [tick, tick + u64::from(is_near)].map(|tick| 0x80 | (tick & 0x7f) as u8);
            assert!(expected.contains(&told), "{name}, {within} cycles behind a tick: {told:02x}");
            let due = mcu.run_to_marker(0x7f, 4 * MILLISECOND).expect("the end of the delay").cycle;
            let behind = (due - begun) % MILLISECOND;
            assert!(!(APART..MILLISECOND - APART).contains(&behind), "{name}: {behind} cycles behind a tick");
        }
    }
}

/// The vector that stores a byte does not enter the kernel, but it stores the time as well.
#[test]
fn frames_that_come_to_a_cpu_that_sleeps_stay_whole() {
    for name in ["board_frames", "tickless/board_frames"] {
        let mut mcu = mcu(name);
        mcu.add_serial_pins(SerialPins {
            receive: Pin { port: 'E', bit: 7 },
            transmit: Pin { port: 'E', bit: 5 },
        });
        for pause in 1..=40 {
            for (line, base) in [(0, 0), (LINE, 0x80)] {
                // At a different place in a tick each time, and after longer and longer sleeps.
                mcu.run_until(mcu.cycle() + pause * (7 * MILLISECOND + 1009));
                mcu.take_markers();
                let begun = mcu.cycle();
                for number in 0..20 {
                    let start = begun + number * FRAME;
                    let value = if number < 19 { 0x55 ^ number as u8 } else { 0 };
                    mcu.receive(line, Character { value, start, end: start + FRAME });
                }
                mcu.run_until(begun + 24 * FRAME);
                assert_eq!(values(mcu.markers()), [base | 20], "{name}, line {line}, pause {pause}");
            }
        }
    }
}

/// Runs the image `idle`, which marks each second, and checks that each mark comes at its tick. Returns the
/// number of interrupts.
fn interrupts_in_a_minute(mcu: &mut Mcu) -> u32 {
    mcu.drive_pin(BUTTON, false);
    let begun = mcu.run_to_marker(0, SECOND).expect("the first mark").cycle;
    let mut interrupts = 0;
    while mcu.markers().last().is_some_and(|mark| mark.value < 60) {
        interrupts += u32::from(mcu.step().is_some());
        assert!(mcu.is_alive());
    }
    let first = mcu.markers()[1].cycle;
    assert!(first.abs_diff(begun + SECOND) < MILLISECOND);
    for (second, mark) in (0..).zip(&mcu.markers()[1..]) {
        let apart = mark.cycle.abs_diff(first + second * SECOND);
        assert!(apart < 100, "after {second} s {apart} cycles off");
    }
    interrupts
}
