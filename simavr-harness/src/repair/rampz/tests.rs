use std::sync::Arc;

use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::Part;

/// LDI r16, 0xff; OUT RAMPZ, r16; LDI r30, 0xff; LDI r31, 0xff; IN r17, RAMPZ; ELPM r2, Z+; ELPM r3, Z;
/// IN r18, RAMPZ; RJMP to itself.
const PROGRAM: [u16; 9] = [0xef0f, 0xbf0b, 0xefef, 0xefff, 0xb71b, 0x9027, 0x9036, 0xb72b, 0xcfff];

#[test]
fn elpm_reads_round_the_end_of_the_flash_and_not_beyond() {
    for decoded in [true, false] {
        let mut flash: Vec<u8> = PROGRAM.into_iter().flat_map(u16::to_le_bytes).collect();
        flash.resize(0x2_0000, 0x5a);
        let image = Arc::new(Image::of_flash(flash, decoded));
        let mut mcu = Mcu::new(Part::ATMEGA128, image, 1).expect("the image fits");
        mcu.run_until(100);
        let [r2, r3, r17, r18] = [2, 3, 17, 18].map(|register| mcu.read(register).expect("it is there"));
        assert_eq!([r2, r3], [0x5a, PROGRAM[0].to_le_bytes()[0]], "the last byte, and the first");
        assert_eq!([r17, r18], [1, 0], "RAMPZ0 alone, which Z+ turns to 0");
    }
}

/// LDI r30, 0xff; LDI r31, 0xff; LPM r2, Z+; MOVW r24, r30; LDI r31, 0x81; LPM r3, Z; LPM r31, Z; RJMP to
/// itself.
const LPM: [u16; 8] = [0xefef, 0xefff, 0x9025, 0x01cf, 0xe8f1, 0x9034, 0x91f4, 0xcfff];

/// LDI r16, PGERS | SPMEN; LDI r30, 0; LDI r31, 0x81; OUT SPMCSR, r16; SPM; RJMP to itself.
const SPM: [u16; 6] = [0xe003, 0xe0e0, 0xe8f1, 0xbf07, 0x95e8, 0xcfff];

/// An ATmega328P, whose 32 KB of flash are fewer than Z reaches, after a program in a flash full of 0x5a.
fn run_small(program: &[u16], decoded: bool) -> Mcu {
    let mut flash: Vec<u8> = program.iter().copied().flat_map(u16::to_le_bytes).collect();
    flash.resize(0x8000, 0x5a);
    let mut mcu = Mcu::new(Part::ATMEGA328P, Arc::new(Image::of_flash(flash, decoded)), 1).expect("it fits");
    mcu.run_until(100);
    mcu
}

#[test]
fn lpm_reads_round_the_end_of_the_flash() {
    for decoded in [true, false] {
        let mcu = run_small(&LPM, decoded);
        let registers = [2, 3, 24, 25, 30, 31].map(|register| mcu.read(register).expect("it is there"));
        assert_eq!(registers, [0x5a, 0x5a, 0, 0, 0, 0x5a]);
    }
}

#[test]
fn spm_erases_round_the_end_of_the_flash() {
    let mcu = run_small(&SPM, true);
    mcu.cpu().with_flash(|flash| {
        assert!(flash[0x100..0x180].iter().all(|byte| *byte == 0xff), "the page");
        assert!(flash[0x180..0x8000].iter().all(|byte| *byte == 0x5a), "and no other");
    });
    assert_eq!([30, 31].map(|register| mcu.read(register)), [Some(0), Some(0x81)]);
}
