use std::sync::Arc;

use simulation::Body;

use super::*;
use crate::image::Image;
use crate::part::Part;

/// Two MCUs that run `program`, wired to a body.
fn wired(program: &[u16]) -> [Mcu; 2] {
    let mut flash: Vec<u8> = program.iter().flat_map(|word| word.to_le_bytes()).collect();
    flash.resize(0x2_0000, 0xff);
    let image = Arc::new(Image::of_flash(flash, true));
    let mut mcus = [1, 2].map(|seed| Mcu::new(Part::ATMEGA128, image.clone(), seed).expect("the image fits"));
    BodyPins::default().attach(&Body::default(), &mut mcus);
    mcus
}

/// OUT to an I/O address, from register 16 to 31.
const fn out(address: u16, register: u16) -> u16 {
    0xb800 | (address & 0x30) << 5 | register << 4 | address & 0x0f
}

/// LDI of register 16 to 31.
const fn ldi(register: u16, value: u16) -> u16 {
    0xe000 | (value & 0xf0) << 4 | (register & 0x0f) << 4 | value & 0x0f
}

/// RJMP to itself.
const STAY: u16 = 0xcfff;

/// STS of register 16, and a data address.
const STS_R16: u16 = 0x9300;
const ETIMSK: u16 = 0x7d;

// I/O addresses.
const OUT_TIMSK: u16 = 0x37;
const OUT_TCCR1A: u16 = 0x2f;
const OUT_TCCR1B: u16 = 0x2e;
const OUT_OCR1AH: u16 = 0x2b;
const OUT_OCR1AL: u16 = 0x2a;
const OUT_ICR1H: u16 = 0x27;
const OUT_ICR1L: u16 = 0x26;
const OUT_DDRB: u16 = 0x17;
const OUT_DDRD: u16 = 0x11;
const OUT_PORTD: u16 = 0x12;

/// The high byte of a compare register waits in the timer for the low byte (section "Accessing 16-bit
/// Registers").
#[test]
fn a_duty_that_is_half_written_drives_no_motor() {
    let program = [
        ldi(16, 0x20),
        out(OUT_DDRB, 16), // OC1A = PB5
        ldi(16, 0x10),     // WGM13
        out(OUT_TCCR1B, 16),
        ldi(16, 0x80), // COM1A1
        out(OUT_TCCR1A, 16),
        ldi(16, 1),
        ldi(17, 0x90),
        out(OUT_ICR1H, 16),
        out(OUT_ICR1L, 17), // 400
        ldi(16, 0),
        ldi(17, 0xff),
        out(OUT_OCR1AH, 16),
        out(OUT_OCR1AL, 17), // 255
        ldi(18, 1),
        out(OUT_OCR1AH, 18),
        out(OUT_OCR1AL, 16), // 256
        STAY,
    ];
    let mut mcus = wired(&program);
    let mut seen = Vec::new();
    for cycle in 1..=20 {
        mcus[0].run_until(cycle);
        seen.push((duty(&mcus[0], &JOINTS[0]).abs() * 400.0).round() as u16);
    }
    seen.dedup();
    assert_eq!(seen, [0, 255, 256]);
}

/// Nothing counts Timer1 on a module, so a program that waits for its interrupts would wait forever.
#[test]
fn interrupts_of_timer1_crash_a_module_s_program() {
    for program in [&[ldi(16, 0x10), out(OUT_TIMSK, 16), STAY][..], &[ldi(16, 1), STS_R16, ETIMSK, STAY]] {
        let mut mcus = wired(program);
        mcus[0].run_until(100);
        BodyPins::default().step(&mut Body::default(), &mut mcus);
        mcus[0].run_until(200);
        assert!(mcus[0].crash_reason().is_some_and(|reason| reason.contains("Timer1")));
    }
}

/// The body takes the duty from OCR1x and ICR1, so in other modes motors would turn as no motor does.
#[test]
fn a_program_that_drives_a_joint_by_timer1_in_another_mode_crashes() {
    /// Which of the MCUs crash that have these in TCCR1A, TCCR1B and DDRB.
    fn refused(a: u8, b: u8, outputs: u8) -> [bool; 2] {
        let set = [(outputs, OUT_DDRB), (b, OUT_TCCR1B), (a, OUT_TCCR1A)];
        let mut program: Vec<u16> =
            set.into_iter().flat_map(|(value, address)| [ldi(16, value.into()), out(address, 16)]).collect();
        program.push(STAY);
        let mut mcus = wired(&program);
        mcus.iter_mut().for_each(|mcu| mcu.run_until(100));
        BodyPins::default().step(&mut Body::default(), &mut mcus);
        mcus.iter_mut().for_each(|mcu| mcu.run_until(200));
        mcus.each_ref().map(|mcu| mcu.crash_reason().is_some_and(|reason| reason.contains("Timer1")))
    }
    let both = 0x60; // OC1A, and OC1B, which drives a joint on the master only
    for (a, b) in [(0x80, 0x11), (0x82, 0x11), (0x82, 0x19)] {
        assert_eq!(refused(a, b, both), [false; 2], "phase and frequency correct, phase correct, fast");
    }
    for (a, b) in [(0x80, 0x01), (0x81, 0x09), (0x80, 0x09), (0x82, 0x09), (0xc0, 0x11), (0x40, 0x19)] {
        assert_eq!(refused(a, b, both), [true; 2], "{a:#x}, {b:#x}");
        assert_eq!(refused(a, b & !CLOCK, both), [false; 2], "it does not run");
        assert_eq!(refused(a, b, 0x40), [false; 2], "the pin is an input");
    }
    assert_eq!(refused(0x20, 0x05, both), [true, false]);
    assert_eq!(refused(0x0c, 0x09, 0xff), [false; 2], "OC1C drives no joint");
}

/// A bit of PORTx without that of DDRx is a pull-up (section "Configuring the Pin").
#[test]
fn a_pull_up_closes_no_power_switch() {
    let mut mcus = wired(&[ldi(16, 0x10), out(OUT_PORTD, 16), 0x0000, out(OUT_DDRD, 16), STAY]);
    let mut is_closed_after = |cycles| {
        mcus[0].run_until(cycles);
        !drives(&mcus).closed.is_empty()
    };
    assert!(!is_closed_after(3), "the pin is an input");
    assert!(is_closed_after(10), "the pin is an output");
}

/// A program that reads the counter of Timer1 would wait for ever.
#[test]
fn a_program_that_reads_the_counter_of_timer1_crashes() {
    const IN_R16_TCNT1L: u16 = 0xb50c;
    let [mut master, _] = wired(&[IN_R16_TCNT1L, STAY]);
    master.run_until(100);
    assert!(master.crash_reason().is_some_and(|reason| reason.contains("TCNT1")), "{:?}", master.state());
}
