//! The tick's vector, which is assembly, counts in the same way as the kernel's function, which the host's
//! tests run.

use simavr_harness::{Mcu, Place};
use superbot_tests_simavr::target::{TARGETS, Target};

/// Marks of the image `tick`.
const BY_VECTOR: u8 = 1;
const BY_FUNCTION: u8 = 2;
const COUNTED: u8 = 3;

/// More cycles than pass between two marks.
const PATIENCE: u64 = 10_000;

/// The present tick before, and the first deadline.
type Ticks = (u16, u16);

/// The present tick after, and whether a deadline has come.
type Counted = (u16, bool);

/// An MCU that runs the image `tick`, and the addresses that the test needs.
struct Chip {
    target: &'static Target,
    mcu: Mcu,
    now: u16,
    next: u16,
    expire: u32,
}

impl Chip {
    fn new(target: &'static Target) -> Self {
        let mut mcu = target.mcu(target.image("tick"));
        target.enable_interrupts(&mut mcu);
        let place = |end: &str| {
            let symbol = mcu.image().symbols().find(|(name, _)| name.ends_with(end));
            symbol.unwrap_or_else(|| panic!("the image has no {end}")).1.place
        };
        let data = |end: &str| match place(end) {
            Place::Data(address) => address,
            _ => panic!("{end} is no variable"),
        };
        let (now, next) = (data("6kernel5timer5TICKS"), data("6kernel5timer13NEXT_DEADLINE"));
        let Place::Flash(expire) = place("6kernel5timer6expire") else { panic!("it is a function") };
        Chip { target, mcu, now, next, expire }
    }

    fn set(&mut self, (now, next): Ticks) {
        for (address, word) in [(self.now, now), (self.next, next)] {
            let [low, high] = word.to_le_bytes();
            self.mcu.write(address, low);
            self.mcu.write(address + 1, high);
        }
    }

    fn now(&self) -> u16 {
        let byte = |address| self.mcu.read(address).expect("it is in RAM");
        u16::from_le_bytes([byte(self.now), byte(self.now + 1)])
    }

    fn by_vector(&mut self, ticks: Ticks) -> Counted {
        self.mcu.run_to_marker(BY_VECTOR, PATIENCE).expect("the task counts on");
        self.set(ticks);
        self.mcu.raise_interrupt(self.target.tick.vector);
        let mut expires = false;
        // The interrupt may have to wait for an instruction to end.
        let mut was_masked = false;
        while !was_masked || !self.mcu.interrupts_enabled() {
            was_masked |= !self.mcu.interrupts_enabled();
            expires |= self.mcu.pc() == self.expire;
            self.mcu.step();
        }
        (self.now(), expires)
    }

    fn by_function(&mut self, ticks: Ticks) -> Counted {
        self.mcu.run_to_marker(BY_FUNCTION, PATIENCE).expect("the task counts on");
        self.set(ticks);
        let counted = self.mcu.run_to_stop(self.mcu.cycle() + PATIENCE).expect("the function returns");
        (self.now(), counted == COUNTED + 1)
    }
}

#[test]
fn the_vector_counts_as_the_function_does() {
    for target in TARGETS {
        let mut chip = Chip::new(target);
        let mut due = 0;
        for now in (0..=u16::MAX).step_by(97).chain([0xfe, 0xff, 0x100, 0x7fff, 0xfffe, 0xffff]) {
            let then = now.wrapping_add(1);
            for next in [then, now, then.wrapping_add(1), then ^ 0x100, then ^ 0x8000, then ^ 1, 0xffff] {
                let by_vector = chip.by_vector((now, next));
                assert_eq!(by_vector, chip.by_function((now, next)), "{}: {now} {next}", target.part.name);
                assert_eq!(by_vector, (then, then == next));
                due += u32::from(by_vector.1);
            }
        }
        assert!(due > 600, "a deadline comes: {due}");
    }
}
