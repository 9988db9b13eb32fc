//! Tests a single program: its image, its memory, its end and its resets.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use crate::common::{build, build_with, marked, mcu};
use simavr_harness::{Image, Mcu, Part, Pin, Place, Reset, State};

const PORF: u8 = 0x01;
const EXTRF: u8 = 0x02;
const BORF: u8 = 0x04;
const WDRF: u8 = 0x08;

#[test]
fn sleep_with_interrupts_off_ends_the_run() {
    let mut mcu = mcu(&build("program.c"));
    assert_eq!(mcu.run_to_end(10_000), State::Done);
    assert_eq!(marked(&mcu), [PORF, 0x55]);
    let end = mcu.cycle();
    mcu.run_until(end + 1000);
    assert_eq!(mcu.cycle(), end, "a program that is done does not go on");
}

#[test]
fn an_endless_loop_is_stopped_at_the_cycle_asked_for() {
    let mut mcu = mcu(&build_with("program.c", &["FOREVER"]));
    assert_eq!(mcu.run_to_end(10_001), State::Running);
    assert!((10_001..10_003).contains(&mcu.cycle()), "{}", mcu.cycle());
    assert_eq!(mcu.awake_cycles(), mcu.cycle());
}

#[test]
fn what_no_program_should_do_crashes_it() {
    for (variant, reason) in [
        ("CRASH", "Invalid Opcode"),
        ("STRAY", "write address"),
        ("SELF_PROGRAMMING", "self-programming is not simulated"),
        ("REGISTER=MCUCR=_BV(SRE)", "external memory"),
        ("REGISTER=MCUCR=_BV(IVCE);MCUCR=_BV(IVSEL)", "boot section"),
        ("REGISTER=XDIV=_BV(XDIVEN)|3", "divided clock"),
        ("REGISTER=ASSR=_BV(AS0)", "crystal"),
        ("REGISTER=SFIOR=_BV(TSM)", "timers that are held"),
        ("REGISTER=SFIOR=_BV(PUD)", "pull-ups"),
        ("REGISTER=SFIOR=_BV(ACME)", "comparator"),
        ("REGISTER=ACSR|=_BV(ACIE)", "comparator"),
        ("REGISTER=ACSR=_BV(ACBG)", "comparator"),
        ("REGISTER=UCSR1C=_BV(UMSEL1)|_BV(UCSZ11)", "synchronous"),
        ("REGISTER=UCSR0B=_BV(RXEN0)|_BV(UCSZ02)", "ninth data bit"),
        ("REGISTER=UCSR0A=_BV(MPCM0)", "addresses"),
        ("POWER_DOWN", "another mode than idle"),
    ] {
        let image = build_with("program.c", &[variant]);
        let mut mcus = [mcu(&image), mcu(&image)];
        let state = mcus[0].run_to_end(10_000);
        let State::Crashed(message) = &state else { panic!("{variant}: {state:?}") };
        assert!(message.contains(reason), "{variant}: {message}");
        assert_eq!(marked(&mcus[0]), [PORF]);
        for until in 1..=mcus[0].cycle() {
            mcus[1].run_until(until);
        }
        assert_eq!((mcus[1].state(), mcus[1].cycle()), (state, mcus[0].cycle()), "{variant}, cycle by cycle");
    }
}

#[test]
fn symbols_lead_to_memory() {
    let image = build("program.c");
    let mut mcu = mcu(&image);
    mcu.run_to_end(10_000);
    assert_eq!(mcu.read_symbol("initialised").unwrap(), 0x1235_u16.to_le_bytes());
    assert_eq!(mcu.read_symbol("cleared").unwrap(), [0, 0, 0]);
    assert!(mcu.read_symbol("main").is_err(), "main is in flash");
    let Some(Place::Flash(main)) = image.symbol("main").map(|symbol| symbol.place) else {
        panic!("main is in flash")
    };
    assert_eq!(image.function_at(main + 2), Some(("main", 2)));
    let is_label = |name| image.symbol(name).map(|symbol| symbol.is_label);
    // `__stop_program` is the loop at the end of the start-up code.
    assert_eq!(["main", "exit", "__stop_program"].map(is_label), [Some(false), Some(false), Some(true)]);
}

#[test]
fn an_image_that_is_none_says_what_to_do() {
    for error in [
        Image::load("no/such/image.elf").unwrap_err(),
        Image::parse(b"not an image").unwrap_err(),
        Image::parse(&std::fs::read(std::env::current_exe().unwrap()).unwrap()).unwrap_err(),
    ] {
        assert!(error.to_string().contains("./x build"), "{error}");
    }
}

#[test]
fn an_image_that_is_a_pipe_is_refused_at_once() {
    let pipe = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("pipe-{}", std::process::id()));
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("there is mkfifo").success());
    let refused = Image::load(&pipe);
    std::fs::remove_file(&pipe).expect("the pipe is there");
    assert!(refused.unwrap_err().to_string().contains("not a regular file"));
}

#[test]
fn memory_at_power_up_follows_the_seed() {
    let image = build("program.c");
    let chance = |seed| {
        let mut mcu = Mcu::new(Part::ATMEGA128, Arc::clone(&image), seed).unwrap();
        mcu.run_to_end(10_000);
        mcu.read_symbol("chance").unwrap()
    };
    assert_eq!(chance(7), chance(7));
    assert_ne!(chance(7), chance(8));
    let distinct: std::collections::BTreeSet<_> = chance(7).into_iter().collect();
    assert!(distinct.len() > 32, "64 random bytes, not {distinct:?}");
}

#[test]
fn a_reset_keeps_the_clock_and_the_memory() {
    let mut mcu = mcu(&build("program.c"));
    mcu.run_to_end(10_000);
    let (clock, chance) = (mcu.cycle(), mcu.read_symbol("chance").unwrap());
    for (cause, flag) in [(Reset::External, EXTRF), (Reset::BrownOut, BORF)] {
        mcu.take_markers();
        mcu.reset(cause);
        assert_eq!(mcu.run_to_end(10_000), State::Done);
        assert_eq!(marked(&mcu), [flag, 0x55]);
        assert!(mcu.markers()[0].cycle > clock);
        assert_eq!(mcu.read_symbol("chance").unwrap(), chance);
    }
    mcu.reset(Reset::PowerOn);
    assert_ne!(mcu.read_symbol("chance").unwrap(), chance);
    assert_eq!(mcu.resets(), 3);
}

#[test]
fn a_program_clears_reset_flags_and_sets_none() {
    let mut mcu = mcu(&build_with("program.c", &["FLAGS"]));
    assert_eq!(mcu.run_to_end(10_000), State::Done);
    assert_eq!(marked(&mcu), [PORF, PORF, 0, 0x55]);
}

#[test]
fn bits_that_the_hardware_clears_or_that_are_reserved_read_0() {
    for (register, written, expected) in [
        ("ACSR", 0xb3, 0x83),
        ("SFIOR", 0x03, 0x00),
        ("WDTCR", 0xe0, 0x00),
        ("ASSR", 0x07, 0x00),
        ("MCUCR", 0x21, 0x20),
        ("DDRG", 0xff, 0x1f),
        ("PORTG", 0xff, 0x1f),
    ] {
        let variant = format!("REGISTER={register}={written};OCDR={register}");
        let mut mcu = mcu(&build_with("program.c", &[&variant]));
        assert_eq!(mcu.run_to_end(10_000), State::Done);
        assert_eq!(marked(&mcu), [PORF, expected, 0x55], "{register}");
    }
}

/// The outside drives bit 5 low and bit 1 high. Then the program switches the pull-ups of bits 7 to 4 on.
/// Then it makes bits 3 to 0 outputs, of which bits 2 and 0 are high.
#[test]
fn pins_are_driven_and_read() {
    let pin = |bit| Pin { port: 'D', bit };
    let mut mcu = mcu(&build_with("program.c", &["PINS"]));
    mcu.drive_pin(pin(5), false);
    mcu.drive_pin(pin(1), true);
    for cause in [PORF, EXTRF] {
        assert_eq!(mcu.run_to_end(10_000), State::Done);
        assert_eq!(marked(&mcu), [cause, 0x02, 0xd2, 0x55]);
        let levels = (0..8).fold(0, |all, bit| all | u8::from(mcu.pin(pin(bit))) << bit);
        assert_eq!(levels, 0xd5, "{levels:#x}");
        mcu.take_markers();
        mcu.reset(Reset::External);
    }
}

#[test]
fn the_watchdog_resets_again_and_again_on_one_clock() {
    let mut mcu = mcu(&build_with("program.c", &["WATCHDOG"]));
    mcu.run_until(16_000_000 / 10);
    // The datasheet gives 14.0 ms. The next times, 28.1 and 56.2 ms, tell that it is 14.05 ms.
    let period = 16 * 14_050;
    let starts: Vec<_> = mcu.markers().iter().map(|marker| marker.cycle).collect();
    assert_eq!(marked(&mcu)[..3], [PORF, WDRF, WDRF]);
    assert_eq!(mcu.resets(), 7);
    for pair in starts.windows(2) {
        let length = pair[1] - pair[0];
        assert!((period..period + 1000).contains(&length), "{length}");
    }
}

/// The program switches the watchdog off while WDRF is set, and WDRF stays set.
#[test]
fn the_watchdog_can_be_switched_off_after_its_reset() {
    let mut mcu = mcu(&build_with("program.c", &["WATCHDOG_OFF"]));
    assert_eq!(mcu.run_to_end(16_000_000 / 10), State::Done);
    assert_eq!(marked(&mcu), [PORF, PORF | WDRF, 0, PORF | WDRF, 0x55]);
    assert_eq!(mcu.resets(), 1);
}

/// Without the timed sequence, a write switches a watchdog on that is off, with the time in the same write,
/// and changes nothing of one that is on.
#[test]
fn the_watchdog_is_switched_on_by_a_single_write() {
    let mut mcu = mcu(&build_with("program.c", &["WATCHDOG_WRITTEN"]));
    mcu.run_until(16_000_000 / 10);
    let starts: Vec<_> = mcu.markers().iter().map(|marker| marker.cycle).collect();
    assert_eq!(marked(&mcu), [PORF, 0x0a, PORF | WDRF, 0x0a]);
    let period = 16 * 14_050 * 4;
    assert!((period..period + 1000).contains(&(starts[2] - starts[0])), "{starts:?}");
}

#[test]
fn reserved_bits_of_its_register_do_not_keep_the_watchdog_from_resetting() {
    let mut mcu = mcu(&build_with("program.c", &["REGISTER=WDTCR=_BV(WDE)|0xe0", "FOREVER"]));
    mcu.run_until(16 * 14_050 * 3);
    assert_eq!(mcu.resets(), 2);
}

#[test]
fn a_program_without_the_kernel_is_not_traced() {
    let mut mcu = mcu(&build("program.c"));
    let error = mcu.trace().expect_err("it has no kernel");
    assert!(error.to_string().contains("./x build"), "{error}");
    assert!(mcu.take_trace().is_none());
}
