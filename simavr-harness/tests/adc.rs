//! Tests the duration of conversions, and their results.

use crate::common::{build_with, mcu};
use simavr_harness::{Mcu, State};

const AVCC: u8 = 0x40;
const INTERNAL: u8 = 0xc0;
const LEFT: u8 = 0x20;

/// The most cycles by which a poll sees the flag late, together with those of a mark.
const POLL: u64 = 12;

fn run(millivolts: u16, reference: u8, prescaler: u8) -> Mcu {
    let defines = [format!("REFERENCE={reference}"), format!("PRESCALER={prescaler}")];
    let mut mcu = mcu(&build_with("adc.c", &defines.each_ref().map(String::as_str)));
    mcu.set_analog(|analog| analog.pins[2] = f64::from(millivolts) / 1000.0);
    assert_eq!(mcu.run_to_end(100_000), State::Done);
    mcu
}

#[test]
fn the_first_conversion_takes_25_clocks_and_the_others_13() {
    for (prescaler, clock) in [(7, 128), (6, 64), (5, 32)] {
        let mcu = run(1000, AVCC, prescaler);
        let cycles: Vec<u64> = mcu.markers().iter().map(|marker| marker.cycle).collect();
        let [first, second] = [cycles[1] - cycles[0], cycles[6] - cycles[5]];
        // A conversion begins with the next clock of the converter.
        assert!((25 * clock..26 * clock + POLL).contains(&first), "{first} cycles at {clock}");
        assert!((13 * clock..14 * clock + POLL).contains(&second), "{second} cycles at {clock}");
        // Free running, a conversion follows the one before at once.
        let [.., one, next] = cycles[..] else { panic!("{cycles:?}") };
        assert!((next - one).abs_diff(13 * clock) < POLL, "{} cycles at {clock}", next - one);
    }
}

#[test]
fn results_are_parts_of_the_reference() {
    let result = |millivolts, reference| {
        let mcu = run(millivolts, reference, 5);
        let values: Vec<u8> = mcu.markers().iter().map(|marker| marker.value).collect();
        // Writing a one has cleared the flag, and no conversion is under way.
        assert_eq!((values[2], &values[5..8]), (0, &values[..3]));
        let [first, second, moved] =
            [3, 8, 10].map(|mark| u16::from_le_bytes([values[mark], values[mark + 1]]));
        assert!(first < second || second == 0, "the first one with a reference is off: {first}, {second}");
        let is_left = reference & LEFT != 0;
        assert_eq!(moved, if is_left { second >> 6 } else { second << 6 }, "ADLAR takes effect at once");
        second
    };
    assert_eq!(result(0, AVCC), 0);
    assert_eq!(result(2500, AVCC), 512);
    assert_eq!(result(4999, AVCC), 1023);
    assert_eq!(result(6000, AVCC), 1023);
    assert_eq!(result(1280, INTERNAL), 512);
    assert_eq!(result(2500, AVCC | LEFT), 512 << 6);
}

/// Two's complement of ten bits, in 1/512 of the reference (section "ADC Conversion Result").
#[test]
fn a_differential_input_is_a_difference_times_a_gain() {
    let result = |channel: u8, millivolts: [u16; 4]| {
        let channel = format!("CHANNEL={channel}");
        let mut mcu = mcu(&build_with("adc.c", &["REFERENCE=0x40", "PRESCALER=5", &channel]));
        mcu.set_analog(|analog| {
            for (pin, millivolts) in analog.pins.iter_mut().zip(millivolts) {
                *pin = f64::from(millivolts) / 1000.0;
            }
        });
        assert_eq!(mcu.run_to_end(100_000), State::Done);
        let values: Vec<u8> = mcu.markers().iter().map(|marker| marker.value).collect();
        let bits = u16::from_le_bytes([values[8], values[9]]);
        assert!(bits < 1024);
        (bits << 6) as i16 >> 6
    };
    assert_eq!(result(0b10000, [3750, 1250, 0, 0]), 256);
    assert_eq!(result(0b10000, [1250, 3750, 0, 0]), -256);
    assert_eq!(result(0b11001, [0, 2500, 0, 0]), 256);
    assert_eq!(result(0b11001, [0, 0, 5000, 0]), -512);
    assert_eq!(result(0b01001, [1000, 1250, 0, 0]), 256);
    assert_eq!(result(0b01000, [1000, 0, 0, 0]), 0);
    assert_eq!(result(0b01111, [0, 0, 2500, 2510]), 204);
    assert_eq!(result(0b01111, [0, 0, 2500, 2600]), 511);
    assert_eq!(result(0b11111, [1000; 4]), 0);
}
