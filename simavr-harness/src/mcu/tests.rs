use super::*;

/// LDI r16, 0x80; STS SPMCSR, r16; EOR r1, r1; OUT SPH, r1; OUT SPL, r1; SEI; NOP; RJMP to itself.
const PROGRAM: [u16; 9] = [0xe800, 0x9300, 0x0068, 0x2411, 0xbe1e, 0xbe1d, 0x9478, 0x0000, 0xcfff];

/// LDI r16, 0x80; STS SPMCSR, r16; LDI r17, 0x10; OUT SPH, r17; RJMP to itself.
const WAITING: [u16; 6] = [0xe800, 0x9300, 0x0068, 0xe110, 0xbf1e, 0xcfff];

#[test]
fn who_writes_sreg_from_outside_lets_in_the_interrupt_that_waits() {
    for decoded in [true, false] {
        let mut flash: Vec<u8> = WAITING.into_iter().flat_map(u16::to_le_bytes).collect();
        flash.resize(0x2000, 0);
        let image = Arc::new(Image::of_flash(flash, decoded));
        let mut mcu = Mcu::new(Part::ATMEGA128, image, 1).expect("the image fits");
        mcu.run_until(1_000);
        assert!(mcu.pc() == 10 && !mcu.interrupts_enabled());
        mcu.write(SREG, 0x81);
        assert_eq!((mcu.read(SREG), mcu.registers().status), (Some(0x81), 0x81));
        // It jumps once more to itself.
        mcu.step();
        assert_eq!(mcu.pc(), 10);
        mcu.step();
        assert!((4 * 34..).contains(&mcu.pc()), "{:#x}", mcu.pc());
    }
}

#[test]
fn an_interrupt_without_a_stack_ends_the_run_at_once_whoever_watches() {
    let record = std::env::temp_dir().join(format!("superbot-no-stack-{}", std::process::id()));
    let ends = [(true, false), (true, true), (false, false)].map(|(decoded, is_watched)| {
        let mut flash: Vec<u8> = PROGRAM.into_iter().flat_map(u16::to_le_bytes).collect();
        flash.resize(0x2000, 0);
        let mut image = Image::of_flash(flash, decoded);
        if is_watched {
            image.record_coverage(&record).expect("it can be written");
        }
        let mut mcu = Mcu::new(Part::ATMEGA128, Arc::new(image), 1).expect("the image fits");
        mcu.run_until(1_000);
        assert!(matches!(mcu.state(), State::Crashed(_)), "{:?}", mcu.state());
        (mcu.state(), mcu.cycle(), mcu.pc())
    });
    std::fs::remove_file(record).expect("it was written");
    assert_eq!(ends[1..], [ends[0].clone(), ends[0].clone()]);
    assert_eq!(ends[0].2, 4 * 34, "at the vector SPM READY");
}

#[test]
fn mcus_of_an_image_share_its_flash_unless_they_may_write_it() {
    let new = |image: &Arc<Image>| Mcu::new(Part::ATMEGA128, Arc::clone(image), 1).expect("the image fits");
    let place = |mcu: &Mcu| mcu.cpu.with_flash(<[u8]>::as_ptr);
    let spm: [u16; 2] = [0x95e8, 0xcfff];
    for (program, decoded, is_shared) in
        [(&WAITING[..], true, true), (&spm[..], true, false), (&WAITING[..], false, false)]
    {
        let flash = program.iter().flat_map(|opcode| opcode.to_le_bytes()).collect();
        let image = Arc::new(Image::of_flash(flash, decoded));
        let (one, mut other) = (new(&image), new(&image));
        assert_eq!(place(&one) == place(&other), is_shared);
        let contents = one.cpu.with_flash(<[u8]>::to_vec);
        assert_eq!(contents, other.cpu.with_flash(<[u8]>::to_vec));
        assert!(contents.starts_with(image.flash()) && contents[image.flash().len()..][..8] == [0xff; 8]);
        // Dropping one MCU leaves the others' flash as it is.
        drop(one);
        other.run_until(1_000);
        assert_eq!(other.cpu.with_flash(<[u8]>::to_vec), contents);
    }
}
