//! Tests that two MCUs on a bus see the status codes of the datasheet.

use std::sync::Arc;

use crate::common::{build, build_with, marked, mcu, mcu_with_seed};
use simavr_harness::{Bus, BusCounts, Image, Mcu, Reset, State, lockstep};
use simulation::Random;

/// TWBR for 100 kHz at 16 MHz: 160 cycles a bit.
const BIT_RATE: &str = "BIT_RATE=72";
const BIT: u64 = 160;

/// The program of a master that plays `script`.
fn master(script: char) -> Arc<Image> {
    build_with("twi_master.c", &[BIT_RATE, &format!("SCRIPT='{script}'")])
}

/// Runs a master that plays `script`, and a slave, to the master's end.
fn play(script: char, slave_defines: &[&str]) -> ([Mcu; 2], Bus) {
    let slave = build_with("twi_slave.c", &[&[BIT_RATE], slave_defines].concat());
    let mut mcus = [mcu(&master(script)), mcu(&slave)];
    let mut bus = Bus::new(2);
    lockstep::run_until(&mut mcus, &mut bus, 200_000, u64::MAX);
    assert_eq!(mcus[0].state(), State::Done, "{:x?}", marked(&mcus[0]));
    assert_eq!(mcus[1].state(), State::Sleeping);
    (mcus, bus)
}

/// Runs two masters that play these scripts at the same time, and a slave. Calls `check` with the outcome,
/// which is the same in turns of any length.
fn play_both(scripts: [char; 2], check: impl Fn([Mcu; 3], Bus)) {
    let masters = scripts.map(master);
    let slave = build_with("twi_slave.c", &[BIT_RATE]);
    for quantum in [u64::MAX, 1] {
        let mut mcus = [mcu(&masters[0]), mcu(&masters[1]), mcu(&slave)];
        let mut bus = Bus::new(3);
        lockstep::run_until(&mut mcus, &mut bus, 200_000, quantum);
        check(mcus, bus);
    }
}

#[track_caller]
fn assert_markers(mcu: &Mcu, expected: &[u8]) {
    let found = marked(mcu);
    assert!(found == expected, "found {found:x?}, expected {expected:x?}");
}

#[test]
fn write_three() {
    let (mcus, bus) = play('W', &[]);
    assert_markers(&mcus[0], &[0x08, 0x18, 0x28, 0x28, 0x28, 0xff]);
    assert_markers(&mcus[1], &[0x60, 0x80, 0xd0, 0x80, 0xd1, 0x80, 0xd2, 0xa0]);
    assert_eq!(bus.counts(), BusCounts { bytes: 4, ..BusCounts::default() });
}

#[test]
fn read_four() {
    let (mcus, _) = play('R', &[]);
    let bytes = [0x08, 0x40, 0x50, 0xe0, 0x50, 0xe1, 0x50, 0xe2, 0x58, 0xe3, 0xff];
    assert_markers(&mcus[0], &bytes);
    assert_markers(&mcus[1], &[0xa8, 0xb8, 0xb8, 0xb8, 0xc0]);
}

#[test]
fn repeated_start() {
    let (mcus, _) = play('T', &[]);
    assert_markers(&mcus[0], &[0x08, 0x18, 0x28, 0x10, 0x40, 0x50, 0xe0, 0x58, 0xe1, 0xff]);
    assert_markers(&mcus[1], &[0x60, 0x80, 0xd0, 0xa0, 0xa8, 0xb8, 0xc0]);
}

#[test]
fn nobody_there() {
    let mut mcus = [mcu(&master('W'))];
    lockstep::run_until(&mut mcus, &mut Bus::new(1), 200_000, u64::MAX);
    assert_markers(&mcus[0], &[0x08, 0x20, 0xff]);
}

#[test]
fn general_call() {
    let (mcus, _) = play('G', &[]);
    assert_markers(&mcus[0], &[0x08, 0x18, 0x28, 0x28, 0xff]);
    assert_markers(&mcus[1], &[0x70, 0x90, 0xd0, 0x90, 0xd1, 0xa0]);
}

/// The masters send the same until one ends the transfer and the other goes on. Only one of them can.
#[test]
fn a_stop_wins_over_a_repeated_start() {
    play_both(['S', 'T'], |mcus, bus| {
        assert_markers(&mcus[0], &[0x08, 0x18, 0x28, 0xff]);
        assert_markers(&mcus[1], &[0x08, 0x18, 0x28, 0x38, 0xff]);
        assert_markers(&mcus[2], &[0x60, 0x80, 0xd0, 0xa0]);
        assert_eq!(bus.counts(), BusCounts { bytes: 2, arbitrations_lost: 1, abandoned: 0 });
    });
}

/// One of two masters wants a repeated START where the other sends a byte, and this one leaves within it.
#[test]
fn a_byte_whose_sender_leaves_reaches_nobody() {
    play_both(['L', 'P'], |mcus, bus| {
        assert_markers(&mcus[0], &[0x08, 0x18, 0xff]);
        assert_markers(&mcus[1], &[0x08, 0x18, 0x38, 0xff]);
        assert_markers(&mcus[2], &[0x60]);
        assert_eq!(bus.counts(), BusCounts { bytes: 1, abandoned: 1, ..BusCounts::default() });
    });
}

/// "TWDR always contains the last byte present on the bus" (section "TWI Data Register").
#[test]
fn an_addressed_slave_finds_the_address_in_twdr() {
    for (script, expected) in [('T', &[0x60, 0x40, 0x80, 0xd0, 0xa0, 0xa8, 0x41][..]), ('G', &[0x70, 0x00])] {
        let (mcus, _) = play(script, &["TELLS_ADDRESS"]);
        assert_eq!(marked(&mcus[1])[..expected.len()], *expected);
    }
}

#[test]
fn the_slave_refuses_the_second_byte() {
    let (mcus, _) = play('N', &["TAKES=1"]);
    assert_markers(&mcus[0], &[0x08, 0x18, 0x28, 0x30, 0xff]);
    assert_markers(&mcus[1], &[0x60, 0x80, 0xd0, 0x88]);
}

/// A slow slave stretches the clock: the events are the same, each later by the slave's wait.
#[test]
fn the_clock_waits_for_a_slow_slave() {
    let duration = |mcus: &[Mcu; 2]| {
        let markers = mcus[0].markers();
        markers.last().unwrap().cycle - markers[0].cycle
    };
    let (quick, _) = play('W', &[]);
    let (slow, _) = play('W', &["WAIT=250"]);
    assert_eq!(marked(&quick[0]), marked(&slow[0]));
    // Four bytes and a STOP, and the time in the handlers.
    let wire = (4 * 9 + 1) * BIT;
    assert!((wire..wire + 1000).contains(&duration(&quick)), "{}", duration(&quick));
    // A round of the wait takes at least five cycles. The last wait, after the STOP, does not delay the
    // master.
    assert!(duration(&slow) > duration(&quick) + 4 * 250 * 5, "{}", duration(&slow));
}

/// Programs of two nodes that send 50 messages each to the other, at `bit_rate` (TWBR).
fn peers(bit_rate: u8) -> [Arc<Image>; 2] {
    let bit_rate = format!("BIT_RATE={bit_rate}");
    [("OWN=0x10", "PEER=0x20"), ("OWN=0x20", "PEER=0x10")]
        .map(|(own, peer)| build_with("twi_peer.c", &[&bit_rate, own, peer]))
}

const MESSAGES: std::ops::RangeInclusive<u8> = 1..=50;

#[test]
fn two_masters_lose_arbitrations_but_no_message() {
    let mut mcus = peers(72).each_ref().map(mcu);
    let mut bus = Bus::new(2);
    lockstep::run_until(&mut mcus, &mut bus, 3_000_000, u64::MAX);
    for mcu in &mcus {
        let received: Vec<u8> = marked(mcu).into_iter().filter(|&value| value != 0xff).collect();
        assert_eq!(received, MESSAGES.collect::<Vec<_>>());
        assert!(marked(mcu).contains(&0xff), "all sent");
    }
    assert!(bus.counts().arbitrations_lost > 20, "{:?}", bus.counts());
}

#[test]
fn the_length_of_turns_changes_nothing() {
    // 100 kHz, and 400 kHz.
    for bit_rate in [72, 12] {
        let images = peers(bit_rate);
        let outcome = |quantum| {
            let mut mcus = images.each_ref().map(mcu);
            let mut bus = Bus::new(2);
            lockstep::run_until(&mut mcus, &mut bus, 500_000, quantum);
            (mcus.each_ref().map(Mcu::state_hash), mcus.each_ref().map(marked), bus.counts())
        };
        let whole = outcome(u64::MAX);
        assert!(whole.2.bytes > 50, "{:?}", whole.2);
        for quantum in [1, 7, 40, 160, 1000] {
            assert_eq!(outcome(quantum), whole, "quantum {quantum}, TWBR {bit_rate}");
        }
    }
}

/// The programs of three nodes write random values into their registers, and resets come at random.
#[test]
fn the_length_of_turns_changes_nothing_whatever_programs_write() {
    let image = build("twi_random.c");
    let mut counts = Vec::new();
    for seed in 0..100 {
        let outcome = |quantum| {
            let mut random = Random::new(seed);
            let mut mcus = [(); 3].map(|()| mcu_with_seed(&image, random.next_u64()));
            let mut bus = Bus::new(3);
            let mut seen = Vec::new();
            for _ in 0..20 {
                let until = mcus[0].cycle() + random.next_u64() % 5000;
                lockstep::run_until(&mut mcus, &mut bus, until, quantum);
                if random.chance(0.05) {
                    mcus[random.below(3)].reset(Reset::External);
                }
                seen.push(mcus.each_ref().map(Mcu::state_hash));
            }
            (seen, bus.counts())
        };
        let whole = outcome(u64::MAX);
        for quantum in [1, 37] {
            assert_eq!(outcome(quantum), whole, "seed {seed}, quantum {quantum}");
        }
        counts.push(whole.1);
    }
    let sum = |of: fn(&BusCounts) -> u64| counts.iter().map(of).sum::<u64>();
    assert!(sum(|counts| counts.bytes) > 500, "{counts:?}");
    assert!(sum(|counts| counts.arbitrations_lost) > 50, "{counts:?}");
    assert!(sum(|counts| counts.abandoned) > 500, "{counts:?}");
}

/// Resets one node at many points of a transfer: it releases the bus, and all later messages of both nodes
/// arrive.
#[test]
fn a_reset_in_mid_transfer_does_not_hang_the_bus() {
    let images = peers(12);
    let mut bus_errors = 0;
    for reset_node in 0..2 {
        for delay in (0..4000).step_by(97) {
            let mut mcus = images.each_ref().map(mcu);
            let mut bus = Bus::new(2);
            let at = 20_000 + delay;
            lockstep::run_until(&mut mcus, &mut bus, at, u64::MAX);
            mcus[reset_node].reset(Reset::External);
            lockstep::run_until(&mut mcus, &mut bus, 1_000_000, u64::MAX);
            for (index, mcu) in mcus.iter().enumerate() {
                let received = marked(mcu);
                assert!(received.contains(&50), "node {index} of reset {reset_node} at {at}");
            }
            let errors = |mcu: &Mcu| marked(mcu).iter().filter(|&&value| value == 0xee).count();
            bus_errors += mcus.iter().map(errors).sum::<usize>();
        }
    }
    assert!(bus_errors > 0, "some reset falls into a byte");
}
