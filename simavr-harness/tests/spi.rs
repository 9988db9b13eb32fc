//! Tests of the ATmega128's SPI as a master (datasheet, "Serial Peripheral Interface").

use crate::common::{build_with, marked, mcu};
use simavr_harness::{Pin, State};

const MISO: Pin = Pin { port: 'B', bit: 3 };
const SS: Pin = Pin { port: 'B', bit: 0 };

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

/// "If SS is configured as an input, it must be held high to ensure Master SPI operation" (section "SS Pin
/// Functionality").
#[test]
fn a_master_whose_ss_is_driven_low_becomes_a_slave() {
    let (master, slave, spif) = (0x50, 0x40, 0x80);
    let run = |level: Option<bool>, falls_at: Option<u64>| {
        let mut mcu = mcu(&build_with("spi.c", &["SELECTED", "RATE=0", "DOUBLE=0"]));
        if let Some(level) = level {
            mcu.drive_pin(SS, level);
        }
        if let Some(cycle) = falls_at {
            mcu.run_to_marker(master, 10_000).expect("it is a master");
            mcu.run_until(mcu.cycle() + cycle);
            mcu.drive_pin(SS, false);
        }
        assert_eq!(mcu.run_to_end(10_000), State::Done);
        marked(&mcu)
    };
    assert_eq!(run(None, None), [master, master, spif]);
    assert_eq!(run(Some(true), None), [master, master, spif]);
    assert_eq!(run(Some(false), None), [slave, slave, spif]);
    assert_eq!(run(Some(true), Some(10)), [master, slave, spif]);
}
