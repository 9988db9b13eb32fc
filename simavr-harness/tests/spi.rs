//! Tests of the ATmega128's SPI as a master (datasheet, "Serial Peripheral Interface").

use crate::common::{build_with, marked, mcu};
use simavr_harness::{Pin, State};

const MISO: Pin = Pin { port: 'B', bit: 3 };

#[test]
fn a_master_reads_miso_and_each_byte_takes_eight_clocks() {
    for (rate, double, clock) in [(0, 0, 4), (1, 0, 16), (2, 0, 64), (3, 0, 128), (0, 1, 2), (3, 1, 64)] {
        for (level, byte) in [(false, 0), (true, 0xff)] {
            let mut mcu = mcu(&build_with("spi.c", &[&format!("RATE={rate}"), &format!("DOUBLE={double}")]));
            mcu.drive_pin(MISO, level);
            assert_eq!(mcu.run_to_end(200_000), State::Done);
            let (spif, wcol) = (0x80, 0x40);
            assert_eq!(
                marked(&mcu),
                [1, 2, byte, double, 1, 2, byte, spif | wcol, byte, 0],
                "{rate}, {double}"
            );
            let cycles: Vec<_> = mcu.markers().iter().map(|marker| marker.cycle).collect();
            for begin in [0, 4] {
                let took = cycles[begin + 1] - cycles[begin];
                assert!((8 * clock..8 * clock + 30).contains(&took), "{rate}, {double}: {took}");
            }
        }
    }
}
