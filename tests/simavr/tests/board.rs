//! The board's drivers on the MCU: the marks of test images, compared with their pins and wires.

use std::collections::BTreeMap;
use std::ops::Range;

use plants::joint::volts;
use simavr_harness::{
    Bus, Character, Controller, Engine, Images, Mcu, Multiplexer, Pin, Place, Reset, RobotBuilder, State,
    WhileWriting, lockstep,
};
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::{MILLISECOND, image, mcu, mcu_with_seed};

/// Cycles of a frame of ten bits at 38400 baud, with the USART's divisor.
const FRAME: u64 = 4160;

#[test]
fn usarts_carry_frames_and_streams() {
    let mut mcu = mcu("board_usart");
    // Loops each transmitter back to its own receiver, well within a frame.
    while mcu.is_alive() && mcu.cycle() < 2_000 * FRAME {
        mcu.run_until(mcu.cycle() + FRAME / 10);
        for usart in 0..2 {
            for character in mcu.take_sent(usart) {
                assert_eq!(character.end - character.start, FRAME);
                mcu.receive(usart, character);
            }
        }
    }
    assert_eq!(mcu.state(), State::Done);
    let one = [20, 1, 40, 3, 0x40, 0x41];
    assert_eq!(values(mcu.markers()), [one, one.map(|mark| mark | 0x80)].concat());
    assert!(
        mcu.pin(Pin { port: 'E', bit: 0 }) && mcu.pin(Pin { port: 'D', bit: 2 }),
        "RXD0 and RXD1 are pulled up"
    );
    // Frames of 20, 1, 40, 60 and 3 bytes and a stream of 3.
    for usart in 0..2 {
        let counts = mcu.usart_counts(usart).expect("the part has two");
        assert_eq!((counts.sent, counts.received, counts.overrun), (127, 127, 0));
    }
}

#[test]
fn a_slice_is_done_with_when_it_is_sent_and_not_when_a_signal_says_so() {
    let mut mcu = mcu("board_sent");
    assert_eq!(mcu.run_to_end(300 * MILLISECOND), State::Done);
    assert_eq!(values(mcu.markers()), [40, 0x80].repeat(3));
    let sent = mcu.take_sent(0);
    assert!(sent.iter().all(|character| character.value == 0x55), "sent when it was gone: {sent:02x?}");
    assert_eq!(sent.len(), 3 * 40);
    for (marks, sent) in mcu.markers().chunks(2).zip(sent.chunks(40)) {
        let (begin, end) = (marks[0].cycle, marks[1].cycle);
        assert!(sent.iter().all(|character| begin <= character.start && character.end <= end));
    }
}

/// Runs programs whose MCUs share a bus. Returns their marks.
fn on_one_bus(names: &[&str], milliseconds: u64) -> Vec<Vec<u8>> {
    let mut mcus: Vec<Mcu> = names.iter().map(|name| mcu(name)).collect();
    let mut bus = Bus::new(mcus.len());
    lockstep::run_until(&mut mcus, &mut bus, milliseconds * MILLISECOND, u64::MAX);
    mcus.iter().map(|mcu| values(mcu.markers())).collect()
}

/// The steps, and the statuses at the device, stand in `board_i2c`.
#[test]
fn a_device_on_the_bus_is_written_to_and_read_from() {
    let marks = on_one_bus(&["board_i2c", "board_i2c_device"], 100);
    assert_eq!(marks[0], (1..=11).collect::<Vec<_>>());
    #[rustfmt::skip]
    let statuses = [
        0x60, 0x80, 0x80, 0x80, 0x80, 0xa0,
        0x60, 0x80, 0xa0, 0xa8, 0xb8, 0xb8, 0xc0,
        0xa8, 0xc0,
        0x60, 0x80, 0x80, 0x80, 0xa0, 0xa8, 0xb8, 0xb8, 0xc0,
        0xa8, 0xc0, 0x60, 0x80, 0xa0, 0xa8, 0xb8, 0xc0,
        0x60, 0x80, 0x88,
        0x60, 0xa0,
        0x60, 0x80, 0xa0, 0xa8, 0xc0, 0xa8, 0xc0,
    ];
    assert_eq!(marks[1], statuses);
}

/// Both MCUs exchange 50 packets, and each of them writes and reads 50 times.
#[test]
fn packets_and_a_device_share_the_bus() {
    let marks = on_one_bus(&["board_i2c_crowd_a", "board_i2c_crowd_b", "board_i2c_device"], 1_000);
    for marks in &marks[..2] {
        let count = |value| marks.iter().filter(|mark| **mark == value).count();
        assert_eq!([1, 2, 3, 4, 5].map(count), [50, 50, 1, 50, 1], "{marks:x?}");
        assert_eq!(marks.len(), 152, "{marks:x?}");
    }
}

/// Else its task would wait for ever.
#[test]
fn a_transaction_ends_when_the_bus_is_freed_for_packets() {
    let marks = on_one_bus(&["board_i2c_freed", "board_i2c_device"], 100);
    assert_eq!(marks[0], [1, 2]);
}

/// Both MCUs send 50 packets to the other; from the 25th on they begin at the same tick.
#[test]
fn the_bus_carries_packets_both_ways() {
    let images = Images { master: image("board_twi_a"), slave: image("board_twi_b") };
    let robot = RobotBuilder::new(images, 1).seed(7).build().expect("one module can be built");
    let mut engine = Engine::new(robot, 1);
    engine.run_until(250 * MILLISECOND);
    let mut marks = BTreeMap::new();
    for event in engine.take_events() {
        *marks.entry((event.controller, event.value)).or_insert(0) += 1;
    }
    let both = Controller::ALL;
    let expected = both.into_iter().flat_map(|mcu| [((mcu, 1), 50), ((mcu, 2), 50), ((mcu, 3), 1)]);
    assert_eq!(marks, expected.collect());
    let counts = engine.robot().module(0).expect("there is one").bus_counts();
    assert!(counts.arbitrations_lost > 0, "{counts:?}");
}

#[test]
fn tasks_share_the_eeprom_and_sleep_while_it_writes() {
    const WRITE: u64 = 135_168;
    let mut mcu = mcu("board_eeprom");
    assert_eq!(mcu.run_to_end(10 * WRITE), State::Done);
    let marks = [&[1, 3, 2][..], b"spine", &[4, 5, 6, 7, 8, 12]].concat();
    assert_eq!(values(mcu.markers()), marks);
    let cycle = |index: usize| mcu.markers()[index].cycle;
    // Writes of 3 and 5 bytes; writing the same bytes again writes none.
    for (begin, end, bytes) in [(0, 2, 3), (2, 8, 5), (8, 9, 0)] {
        let cycles = cycle(end) - cycle(begin);
        assert!((bytes * WRITE..bytes * WRITE + 3_000).contains(&cycles), "{bytes} bytes in {cycles} cycles");
    }
    let since_start = mcu.cycle() - cycle(0);
    assert!(since_start - (mcu.cycle() - mcu.awake_cycles()) < 10_000, "it did not sleep");
    assert_eq!(mcu.eeprom()[0xff..0x104], *b"spine");
    assert_eq!(mcu.eeprom()[0xffd..], [10, 11, 12]);
    assert_eq!(mcu.eeprom().iter().filter(|byte| **byte != 0xff).count(), 8);
}

/// The chip may not allow writes to SPMCSR while the EEPROM is written. A frame that comes as a write begins,
/// or during it, still wakes its task, and the software interrupt for that comes once.
#[test]
fn a_frame_that_comes_while_the_eeprom_is_written_is_not_forgotten() {
    const WRITE: u64 = 135_168;
    for begin in [0, WRITE - 300, WRITE + 50_000] {
        for offset in 0..600 {
            let mut mcu = mcu("board_spm");
            mcu.disturb_spm(WhileWriting::KeepsRegister);
            let writes = mcu.run_to_marker(1, 20 * MILLISECOND).expect("it writes").cycle;
            let ends = writes + begin + offset;
            for (value, end) in [(0x55, ends - FRAME), (0, ends)] {
                let start = end - FRAME;
                mcu.run_until(start);
                mcu.receive(0, Character { value, start, end });
            }
            let place = format!("{begin} + {offset}");
            assert_eq!(mcu.run_to_end(4 * WRITE), State::Done, "{place}");
            let mut marks = values(mcu.markers());
            marks.sort_unstable();
            assert_eq!((marks, mcu.resets()), (vec![1, 2, 3], 0), "{place}");
            assert_eq!(mcu.eeprom()[..2], [1, 2], "{place}");
        }
    }
}

/// A write is under way when the MCU is reset: the next write waits for it.
#[test]
fn the_eeprom_is_awaited_after_a_reset() {
    let mut mcu = mcu("board_eeprom");
    mcu.run_to_marker(3, 20 * MILLISECOND).expect("it writes");
    mcu.reset(Reset::External);
    mcu.program_eeprom(0xffd, &[0xff; 3]);
    assert_eq!(mcu.run_to_end(100 * MILLISECOND), State::Done);
    assert_eq!(mcu.eeprom()[0xffd..], [10, 11, 12]);
}

#[test]
fn a_panic_leaves_its_place_to_the_next_start() {
    const BUTTON: Pin = Pin { port: 'E', bit: 4 };
    const SOURCE: &str = include_str!("../../images/src/bin/board_panic.rs");
    let (line, text) =
        SOURCE.lines().enumerate().find(|(_, line)| line.contains("// panics")).expect("one does");
    let column = text.find("values").expect("it is the expression");
    let task = match image("board_panic").symbol("PANICKER").expect("there is the task").place {
        Place::Data(address) => address,
        place => panic!("a stack in {place:?}"),
    };
    let place = [line as u16 + 1, column as u16 + 1, task];

    for seed in 0..4 {
        let mut mcu = mcu_with_seed("board_panic", seed);
        mcu.drive_pin(BUTTON, false);
        mcu.run_until(10 * MILLISECOND);
        assert_eq!(values(&mcu.take_markers()), [1], "chance values are no record");
        mcu.drive_pin(BUTTON, true);
        mcu.run_until(mcu.cycle() + 40 * MILLISECOND);
        let marks = values(&mcu.take_markers());
        assert_eq!(marks, [vec![2], place.map(u16::to_le_bytes).concat()].concat());
        mcu.reset(Reset::External);
        mcu.run_until(mcu.cycle() + 40 * MILLISECOND);
        assert_eq!(values(&mcu.take_markers()), [4], "it is told once");
        assert_eq!(mcu.state(), State::Sleeping);
    }
}

#[test]
fn the_next_start_tells_which_stack_was_overflowed() {
    const NAME: &str = "stack-check/board_overflow";
    let Place::Data(task) = image(NAME).symbol("SMALL").expect("there is the task").place else {
        panic!("a stack lies in RAM")
    };
    let mut mcu = mcu(NAME);
    mcu.run_until(50 * MILLISECOND);
    let record = [0, 0, task].map(u16::to_le_bytes).concat();
    assert_eq!(values(&mcu.take_markers()), [vec![1, 2], record].concat());
    assert_eq!(mcu.state(), State::Sleeping);
}

/// The direction of the joint.
const JOINT_DIRECTION: Pin = Pin { port: 'C', bit: 0 };

/// The set-up of Timer1 and of the pin of its output A, and the duty: that output is the speed of the joint.
/// The pin itself would show little, because simavr only counts up where this mode counts up and down.
fn joint_speed(mcu: &Mcu) -> [u16; 5] {
    const TCCR1A: u16 = 0x4f;
    const TCCR1B: u16 = 0x4e;
    const ICR1: u16 = 0x46;
    const OCR1A: u16 = 0x4a;
    const DDRB: u16 = 0x37;
    let byte = |address| u16::from(mcu.read(address).expect("it is a register"));
    let word = |address| byte(address) | byte(address + 1) << 8;
    [byte(TCCR1A), byte(TCCR1B), byte(DDRB), word(ICR1), word(OCR1A)]
}

#[test]
fn a_long_delay_does_not_drift() {
    let mut mcu = mcu("board_delay");
    let begin = mcu.run_to_marker(1, 10 * MILLISECOND).expect("the task runs").cycle;
    let end = mcu.run_to_marker(2, 70_000 * MILLISECOND).expect("the delay ends").cycle;
    let milliseconds = (end - begin) as f64 / MILLISECOND as f64;
    assert!((66_000.0..66_001.0).contains(&milliseconds), "{milliseconds} ms");
}

#[test]
fn delays_last_and_outputs_switch() {
    let mut mcu = mcu("board_timer");
    let mut before = mcu.run_to_marker(1, 10 * MILLISECOND).expect("the task runs").cycle;
    // Cycles that each delay may take: never less than requested; 5 ms end on a tick, the others after a
    // loop.
    let delays: [(u8, Range<u64>); 3] = [(2, 80_000..96_500), (3, 4_800..4_900), (4, 32..100)];
    for (mark, cycles) in delays {
        let now = mcu.run_to_marker(mark, 10 * MILLISECOND).expect("the delay ends").cycle;
        assert!(cycles.contains(&(now - before)), "mark {mark} after {} cycles", now - before);
        before = now;
    }
    mcu.run_to_marker(5, MILLISECOND).expect("the outputs are on");
    assert!(mcu.pin(JOINT_DIRECTION));
    // Cleared on a match while counting up, set while counting down; up to ICR1 and down again, which makes
    // 20 kHz.
    assert_eq!(joint_speed(&mcu), [0x80, 0x11, 1 << 5, 400, 100]);
    mcu.run_to_marker(6, 4 * MILLISECOND).expect("the outputs are off");
    assert!(!mcu.pin(JOINT_DIRECTION));
    assert_eq!(joint_speed(&mcu), [0x80, 0x11, 1 << 5, 400, 0]);
    // The CPU kept busy for 0, 3, 4 and 400 cycles, and perhaps for a tick.
    let mut before = mcu.run_to_marker(7, MILLISECOND).expect("the task goes on").cycle;
    for (mark, cycles) in [(8, 0..60), (9, 0..60), (10, 4..64), (11, 400..460)] {
        let now = mcu.run_to_marker(mark, 20 * MILLISECOND).expect("the loop ends").cycle;
        assert!(cycles.contains(&(now - before)), "mark {mark} after {} cycles", now - before);
        before = now;
    }
    assert_eq!(mcu.run_to_end(MILLISECOND), State::Done);
    assert_eq!(values(mcu.markers()), (1..=11).collect::<Vec<_>>());
}

#[test]
fn memory_is_copied_and_filled() {
    let mut mcu = mcu("board_memory");
    assert_eq!(mcu.run_to_end(2_000 * MILLISECOND), State::Done);
    assert_eq!(values(mcu.markers()), [0x55]);
}

/// The power switch of the first dock.
const POWER_SWITCH: Pin = Pin { port: 'D', bit: 4 };

/// The multiplexer at ADC7, and its address.
const MULTIPLEXER: Multiplexer = Multiplexer {
    pin: 7,
    address: [Pin { port: 'G', bit: 0 }, Pin { port: 'G', bit: 1 }, Pin { port: 'G', bit: 2 }],
};

#[test]
fn rounds_measure_what_is_asked_for() {
    let mut mcu = mcu("board_adc");
    // Readings of the joints, and of the docks at rest.
    let pins = [700, 7, 1023, 513, 512, 512, 512].map(volts);
    let multiplexed = [1, 2, 300, 400, 500, 600, 700, 1000].map(volts);
    mcu.set_analog(|analog| {
        analog.pins[..7].copy_from_slice(&pins);
        analog.multiplexed = multiplexed;
        analog.multiplexer = Some(MULTIPLEXER);
    });
    let end = mcu.run_to_marker(0x71, 40 * MILLISECOND).expect("all is measured").cycle;
    // Three rounds, and for each input one that begins after the request and one that ends with the reading.
    assert!((11 * MILLISECOND..21 * MILLISECOND).contains(&end), "{end} cycles");
    let expected =
        [1023, 7, 700, 513, 1023, 1, 2, 300, 400, 500, 600, 700, 1000].into_iter().flat_map(u16::to_le_bytes);
    assert_eq!(values(mcu.markers()), expected.chain([0x71]).collect::<Vec<_>>());
    mcu.run_to_marker(0x74, 10 * MILLISECOND).expect("no reading is older than the request for it");
    mcu.run_to_marker(0x73, 400 * MILLISECOND).expect("no reading is taken for another's");
    assert!(mcu.pin(POWER_SWITCH));
    // Currents at the limit of what a dock may carry, in either direction.
    for reading in [512 - 255, 512 + 255] {
        mcu.set_analog(|analog| analog.pins[4] = volts(reading));
        mcu.run_until(mcu.cycle() + 5 * MILLISECOND);
        assert!(mcu.pin(POWER_SWITCH), "{reading}");
    }
    mcu.set_analog(|analog| analog.pins[4] = volts(512 + 257));
    let start = mcu.cycle();
    while mcu.pin(POWER_SWITCH) && mcu.cycle() < start + 10 * MILLISECOND {
        mcu.run_until(mcu.cycle() + 100);
    }
    assert!(mcu.cycle() - start <= 4 * MILLISECOND, "it took {} cycles", mcu.cycle() - start);
    mcu.run_to_end(MILLISECOND);
    assert_eq!(mcu.markers().last().map(|mark| mark.value), Some(0x72));
}

const AFTER_POWER_UP: [u8; 2] = [1, 3];
const AFTER_ANOTHER_RESET: [u8; 2] = [4, 3];

/// Boots, and returns the nonce. The image's other marks must be `marks`.
fn nonce(mcu: &mut Mcu, marks: [u8; 2]) -> u16 {
    assert_eq!(mcu.run_to_end(20 * MILLISECOND), State::Done);
    let marked = values(&mcu.take_markers());
    let [low, high, rest @ ..] = &marked[..] else { panic!("{marked:?}") };
    assert_eq!(rest, marks);
    u16::from_le_bytes([*low, *high])
}

#[test]
fn no_two_boots_have_the_same_nonce() {
    let mut nonces = Vec::new();
    for seed in 0..8 {
        let mut mcu = mcu_with_seed("board_boot", seed);
        nonces.push(nonce(&mut mcu, AFTER_POWER_UP));
        for cause in [Reset::External, Reset::BrownOut, Reset::External] {
            mcu.reset(cause);
            nonces.push(nonce(&mut mcu, AFTER_ANOTHER_RESET));
        }
        mcu.reset(Reset::PowerOn);
        nonces.push(nonce(&mut mcu, AFTER_POWER_UP));
    }
    let number = nonces.len();
    nonces.sort();
    nonces.dedup();
    assert_eq!(nonces.len(), number);
}
