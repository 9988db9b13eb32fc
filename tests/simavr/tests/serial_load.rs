//! Every serial line and the bus as busy as they can be, on two modules joined at all docks: nothing is lost.

use simavr_harness::{Character, Controller, Engine, Face, Images, OpenedBy, Pin, RobotBuilder, SerialPins};
use superbot_tests_simavr::{MILLISECOND, image, mcu};
use tasks::dock::Dock;

/// What came on a line, as `board_serial` counts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Counts {
    right: u32,
    wrong: u16,
    lost: u16,
}

/// Cycles of a byte at 38400 baud, as the divisor makes it.
const FRAME: u64 = 4160;

const LINES: [&str; 4] = ["FOR_SOFT_UART", "FOR_USART0", "FOR_USART1", "FOR_BUS"];

/// Two modules of which each sends to the other, by all docks.
fn pair(seed: u64) -> Engine {
    let images = Images { master: image("board_serial_a"), slave: image("board_serial_b") };
    let join = |robot: RobotBuilder, dock| robot.attach(Face { module: 0, dock }, Face { module: 1, dock });
    let robot = Dock::ALL.into_iter().fold(RobotBuilder::new(images, 2).seed(seed), join);
    Engine::new(robot.build().expect("two modules can be joined"), 2)
}

/// What came on a line of each MCU.
fn counts(engine: &Engine, line: &str) -> [Counts; 4] {
    let counts = [0, 1].map(|index| {
        let module = engine.robot().module(index).expect("there are two");
        Controller::ALL.map(|controller| {
            let bytes = module.mcu(controller).read_symbol(line).expect("the image has it");
            let [a, b, c, d, e, f, g, h] = bytes[..] else { panic!("{bytes:?}") };
            Counts {
                right: u32::from_le_bytes([a, b, c, d]),
                wrong: u16::from_le_bytes([e, f]),
                lost: u16::from_le_bytes([g, h]),
            }
        })
    });
    let [[a, b], [c, d]] = counts;
    [a, b, c, d]
}

/// Runs until so many bytes have come on the lines in software, over all MCUs.
fn run(seed: u64, bytes: u32) {
    let mut engine = pair(seed);
    // Ends that send at once do not hear each other: a while until they take turns.
    engine.run_until(500 * MILLISECOND);
    let start = LINES.map(|line| counts(&engine, line));
    let mut come = 0;
    while come < bytes {
        engine.run_until(engine.cycle() + 100 * MILLISECOND);
        let now = LINES.map(|line| counts(&engine, line));
        for (now, start) in now.iter().flatten().zip(start.iter().flatten()) {
            assert_eq!((now.wrong, now.lost), (start.wrong, start.lost), "{LINES:?}: {now:?}");
        }
        let before = come;
        let [soft, soft_before] =
            [now, start].map(|[soft, ..]| soft.iter().map(|counts| counts.right).sum::<u32>());
        come = soft - soft_before;
        assert!(come > before, "nothing comes any more: {now:?}");
    }
    for (line, now) in LINES.into_iter().zip(LINES.map(|line| counts(&engine, line))) {
        println!("{line}: {:?} bytes in {} ms", now.map(|counts| counts.right), engine.cycle() / MILLISECOND);
    }
}

/// The most that an interrupt of the UART in software may have to wait, less what it takes itself; see `board/README.md`.
const MASKED_AT_MOST: u64 = 550;

#[test]
fn nothing_keeps_the_uart_in_software_waiting_for_too_long() {
    let mut mcu = mcu("board_serial_a");
    mcu.add_serial_pins(SerialPins {
        receive: Pin { port: 'E', bit: 7 },
        transmit: Pin { port: 'E', bit: 5 },
    });
    for number in 0..400_u16 {
        let start = 300_000 + u64::from(number) * FRAME;
        let value = if number % 23 == 22 { 0 } else { (number % 23) as u8 + 1 };
        for line in 0..3 {
            mcu.receive(line, Character { value, start, end: start + FRAME });
        }
    }
    let windows = mcu.masked_windows(120 * MILLISECOND);
    let longest = windows.iter().find(|window| window.opened_by != OpenedBy::Start).expect("there are some");
    assert!(longest.cycles <= MASKED_AT_MOST, "{longest:?}");
}

#[test]
fn the_uart_in_software_makes_no_error_under_load() {
    // A million takes a minute and a half.
    let bytes = std::env::var("SOFT_UART_BYTES").ok().and_then(|bytes| bytes.parse().ok());
    let bytes = bytes.unwrap_or(100_000);
    for seed in 1..=4 {
        run(seed, bytes / 4);
    }
}
