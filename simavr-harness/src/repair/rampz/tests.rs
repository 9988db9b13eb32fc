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
