//! Tests of the ATmega128's timers (datasheet, "8-bit Timer/Counter" and "16-bit Timer/Counter"): when they
//! interrupt, and what their compare units do to the pins, in each mode.

use crate::common::{build_with, mcu};
use simavr_harness::{Mcu, Pin};

const MATCH: u8 = 2;
const OVERFLOW: u8 = 3;
const CAPTURE: u8 = 4;
const MATCH_B: u8 = 5;

fn run(setup: &str, more: &[&str], cycles: u64) -> Mcu {
    let setup = format!("SETUP={setup}");
    let defines: Vec<_> = [setup.as_str()].into_iter().chain(more.iter().copied()).collect();
    let mut mcu = mcu(&build_with("timers.c", &defines));
    mcu.run_until(cycles);
    mcu
}

/// The cycles of the marks of this value.
fn marks(mcu: &Mcu, value: u8) -> Vec<u64> {
    mcu.markers().iter().filter(|marker| marker.value == value).map(|marker| marker.cycle).collect()
}

/// Whether the marks come at these distances, over and over. An interrupt waits for the end of another's
/// handler.
fn come_every(marks: &[u64], distances: &[u64]) -> bool {
    let found: Vec<_> = marks.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let fits = |shift: usize| {
        let expected = distances.iter().cycle().skip(shift);
        found.iter().zip(expected).all(|(found, expected)| found.abs_diff(*expected) <= 30)
    };
    found.len() >= 4 && (0..distances.len()).any(fits)
}

struct Case {
    setup: &'static str,
    /// The marks that come, and the cycles between two of them. Others do not come.
    marks: &'static [(u8, &'static [u64])],
}

const EACH_MODE: &[Case] = &[
    // Timer0: OCR0 is 99, the clock is divided by 8.
    Case { setup: "OCR0=99;TIMSK=3;TCCR0=2", marks: &[(MATCH, &[2048]), (OVERFLOW, &[2048])] },
    Case { setup: "OCR0=99;TIMSK=3;TCCR0=0x08|2", marks: &[(MATCH, &[800])] },
    Case { setup: "OCR0=99;TIMSK=3;TCCR0=0x48|2", marks: &[(MATCH, &[2048]), (OVERFLOW, &[2048])] },
    Case {
        setup: "OCR0=99;TIMSK=3;TCCR0=0x40|2",
        marks: &[(MATCH, &[312 * 8, 198 * 8]), (OVERFLOW, &[4080])],
    },
    // With a top of 255 it overflows in CTC, too.
    Case { setup: "OCR0=255;TIMSK=3;TCCR0=0x08|2", marks: &[(MATCH, &[2048]), (OVERFLOW, &[2048])] },
    Case { setup: "OCR2=99;TIMSK=0xc0;TCCR2=0x08|2", marks: &[(MATCH, &[800])] },
    Case { setup: "OCR2=99;TIMSK=0xc0;TCCR2=0x48|2", marks: &[(MATCH, &[2048]), (OVERFLOW, &[2048])] },
    // Timer1: OCR1A is 1999, OCR1B 499, ICR1 999.
    Case { setup: "WIDE;TCCR1B=1", marks: &[(MATCH, &[65536]), (MATCH_B, &[65536]), (OVERFLOW, &[65536])] },
    Case { setup: "WIDE;TCCR1B=0x08|1", marks: &[(MATCH, &[2000]), (MATCH_B, &[2000])] },
    Case { setup: "WIDE;TCCR1B=0x18|1;ICR1=999", marks: &[(MATCH_B, &[1000]), (CAPTURE, &[1000])] },
    Case {
        setup: "TCCR1A=2;TCCR1B=0x18;ICR1=999;WIDE;TCCR1B=0x18|1",
        marks: &[(MATCH_B, &[1000]), (CAPTURE, &[1000]), (OVERFLOW, &[1000])],
    },
    Case {
        setup: "TCCR1A=3;TCCR1B=0x18;WIDE;TCCR1B=0x18|1",
        marks: &[(MATCH, &[2000]), (MATCH_B, &[2000]), (OVERFLOW, &[2000])],
    },
    Case { setup: "WIDE;TCCR1A=1;TCCR1B=0x08|2", marks: &[(OVERFLOW, &[2048])] },
    // Up and down, to ICR1 and to OCR1A.
    Case {
        setup: "TCCR1A=2;TCCR1B=0x10;ICR1=999;WIDE;TCCR1B=0x10|1",
        marks: &[(MATCH_B, &[998, 1000]), (CAPTURE, &[1998]), (OVERFLOW, &[1998])],
    },
    Case {
        setup: "TCCR1A=3;TCCR1B=0x10;WIDE;TCCR1B=0x10|1",
        marks: &[(MATCH, &[3998]), (MATCH_B, &[998, 3000]), (OVERFLOW, &[3998])],
    },
    Case {
        setup: "TCCR1A=0;TCCR1B=0x10;ICR1=999;WIDE;TCCR1B=0x10|1",
        marks: &[(MATCH_B, &[998, 1000]), (CAPTURE, &[1998]), (OVERFLOW, &[1998])],
    },
    Case {
        setup: "TCCR1A=1;TCCR1B=0x10;WIDE;TCCR1B=0x10|1",
        marks: &[(MATCH, &[3998]), (MATCH_B, &[998, 3000]), (OVERFLOW, &[3998])],
    },
    Case { setup: "WIDE;TCCR1A=1;TCCR1B=2", marks: &[(OVERFLOW, &[4080])] },
    // Timer3 as Timer1.
    Case {
        setup: "TCCR3A=2;TCCR3B=0x10;ICR3=999;OCR3A=1999;OCR3B=499;ETIMSK=0x3c;TCCR3B=0x10|1",
        marks: &[(MATCH_B, &[998, 1000]), (CAPTURE, &[1998]), (OVERFLOW, &[1998])],
    },
];

#[test]
fn in_each_mode_interrupts_come_when_the_datasheet_says() {
    for Case { setup, marks: expected } in EACH_MODE {
        let wide = "WIDE=OCR1A=1999;OCR1B=499;TIMSK=0x3c";
        let mcu = run(setup, &[wide], 400_000);
        for mark in [MATCH, OVERFLOW, CAPTURE, MATCH_B] {
            // In its first round a PWM mode still compares with what the registers held before.
            let found: Vec<_> = marks(&mcu, mark).into_iter().filter(|&at| at > 10_000).collect();
            match expected.iter().find(|(value, _)| *value == mark) {
                Some((_, distances)) => {
                    assert!(
                        come_every(&found, distances),
                        "{setup}, {mark}: {:?}",
                        &found[..found.len().min(9)]
                    )
                }
                None => assert!(found.is_empty(), "{setup}, {mark}: {:?}", &found[..found.len().min(9)]),
            }
        }
    }
}

/// For how many cycles a pin is high, and then low, once it has settled.
fn pulses(setup: &str, pin: Pin) -> (u64, u64) {
    let setup = format!("SETUP={setup}");
    let mut mcu = mcu(&build_with("timers.c", &[&setup]));
    mcu.add_probe(pin);
    mcu.run_until(60_000);
    let mut edges = mcu.take_edges(0);
    edges.dedup_by_key(|edge| edge.level);
    let rise = edges.iter().rposition(|edge| edge.level).expect("the pin rises") - 4;
    let rise = rise + edges[rise..].iter().position(|edge| edge.level).expect("it rises");
    let [up, down, next] = [edges[rise], edges[rise + 1], edges[rise + 2]];
    (down.cycle - up.cycle, next.cycle - down.cycle)
}

#[test]
fn compare_units_drive_their_pins() {
    let oc0 = Pin { port: 'B', bit: 4 };
    let oc1a = Pin { port: 'B', bit: 5 };
    let oc1b = Pin { port: 'B', bit: 6 };
    for (setup, pin, high, low) in [
        ("OCR0=99;TCCR0=0x48|0x20|2", oc0, 800, 1248),
        ("OCR0=99;TCCR0=0x48|0x30|2", oc0, 1248, 800),
        ("OCR0=99;TCCR0=0x40|0x20|2", oc0, 198 * 8, 312 * 8),
        ("OCR0=99;TCCR0=0x40|0x30|2", oc0, 312 * 8, 198 * 8),
        ("OCR0=99;TCCR0=0x08|0x10|2", oc0, 800, 800),
        ("OCR1A=249;TCCR1A=0x82;TCCR1B=0x18;ICR1=999;TCCR1B=0x19", oc1a, 250, 750),
        ("TCCR1A=0x82;TCCR1B=0x18;ICR1=999;OCR1A=249;TCCR1B=0x19", oc1a, 250, 750),
        ("TCCR1A=0x82;TCCR1B=0x10;ICR1=999;OCR1A=249;TCCR1B=0x11", oc1a, 498, 1500),
        ("TCCR1A=0x21;TCCR1B=0x10;OCR1A=999;OCR1B=249;TCCR1B=0x11", oc1b, 498, 1500),
        ("TCCR1A=0x43;TCCR1B=0x18;OCR1A=999;TCCR1B=0x19", oc1a, 1000, 1000),
    ] {
        assert_eq!(pulses(setup, pin), (high, low), "{setup}");
    }
}

/// PORTB is the program's while units drive pins of it: what it writes there changes none of them, it reads
/// what it wrote, and gets the pin back as it has written it.
#[test]
fn a_compare_unit_has_its_pin_to_itself() {
    const BIT: u8 = 0x20;
    let setup = "TCCR1A=0x82;TCCR1B=0x18;ICR1=999;OCR1A=249;TCCR1B=0x19";
    let write =
        |value, pin| format!("WAIT(1400);PORTB={value};OCDR=PORTB;OCDR=PINB&0x20;WAIT(1000);OCDR={pin}");
    let later = [write("1", "PINB&0x20"), write("0x21", "PORTB"), "TCCR1A=2;OCDR=PINB&0x20;DDRB=0".into()];
    let setup = format!("SETUP={setup};{}", later.join(";"));
    let mut mcu = mcu(&build_with("timers.c", &[&setup, "WAIT(cycles)=__builtin_avr_delay_cycles(cycles)"]));
    mcu.add_probe(Pin { port: 'B', bit: 5 });
    mcu.run_until(12_000);
    let values: Vec<u8> = mcu.markers().iter().map(|marker| marker.value).collect();
    assert_eq!(values[..7], [1, 0, 0, 0x21, 0, 0x21, BIT]);
    let edges: Vec<_> = mcu.take_edges(0).iter().map(|edge| (edge.cycle, edge.level)).collect();
    let high: Vec<_> = edges.windows(2).filter(|pair| pair[0].1).map(|pair| pair[1].0 - pair[0].0).collect();
    assert_eq!(high[..4], [250; 4], "{edges:?}");
}

/// Section "Compare Match Output Unit": a compare value that the counter has passed matches in the next
/// round. With CTC the counter first goes on to its maximum (section "Clear Timer on Compare Match Mode").
#[test]
fn a_top_below_the_counter_is_reached_the_next_time_round() {
    let mcu = run("OCR0=200;TIMSK=3;TCCR0=0x08|4", &["LATER_AT=6400", "LATER=OCR0=50"], 40_000);
    let [first, second] = marks(&mcu, MATCH)[..2] else { panic!("it matches twice") };
    assert!(first.abs_diff((256 + 51) * 64) < 200, "{first}");
    assert!(second.abs_diff(first + 51 * 64) < 30, "{second}");
    let overflow = marks(&mcu, OVERFLOW)[0];
    assert!(overflow.abs_diff(256 * 64) < 200, "{overflow}");
}

/// The counter keeps its value when its mode or its clock changes.
#[test]
fn the_counter_keeps_its_value_when_its_clock_changes() {
    let mcu = run("TIMSK=1;TCCR0=2", &["LATER_AT=1600", "LATER=TCCR0=1"], 3_000);
    let [begin] = marks(&mcu, 1)[..] else { panic!("it begins once") };
    let overflow = marks(&mcu, OVERFLOW)[0] - begin;
    assert!((1600 + 56..1600 + 150).contains(&overflow), "{overflow}");
}

#[test]
fn a_timer_counts_the_edges_at_its_pin() {
    for (setup, pin) in [
        ("OCR1A=4;TIMSK=0x10;TCCR1B=0x0f", Pin { port: 'D', bit: 6 }),
        ("OCR2=4;TIMSK=0x80;TCCR2=0x0e", Pin { port: 'D', bit: 7 }),
        ("OCR3A=4;ETIMSK=0x10;TCCR3B=0x0f", Pin { port: 'E', bit: 6 }),
    ] {
        let mut mcu = run(setup, &[], 1_000);
        for edge in 0..40 {
            mcu.drive_pin(pin, edge % 2 == 0);
            mcu.run_until(mcu.cycle() + 100);
        }
        assert_eq!(marks(&mcu, MATCH).len(), 4, "{setup}");
    }
}
