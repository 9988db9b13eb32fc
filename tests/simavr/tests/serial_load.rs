//! Every serial line and the bus as busy as they can be, on two modules joined at all docks: nothing is lost.

use simavr_harness::bench::module::serial_load;
use simavr_harness::{Character, OpenedBy, Pin, SerialPins};
use superbot_tests_simavr::{MILLISECOND, mcu, test_images};

/// Cycles of a byte at 38400 baud, with the USART's divisor.
const FRAME: u64 = 4160;

/// The longest that an interrupt of the UART in software may have to wait, in cycles, without its own time;
/// see `board/README.md`.
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
    let bytes = 100_000; // `./x bench module` tries a million
    let load = serial_load(&test_images(), bytes).unwrap_or_else(|error| panic!("{error}"));
    assert!(load.soft_uart_bytes >= bytes, "{load:?}");
    assert_eq!((load.soft_uart_errors, load.other_errors), (0, 0), "{load:?}");
}
