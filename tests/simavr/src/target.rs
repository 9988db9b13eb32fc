//! The MCUs on which the kernel is tested.

use std::path::PathBuf;
use std::sync::Arc;

use simavr_harness::{Image, Mcu, Part, Pin};

use crate::{load_test_image, test_images};

/// An MCU with the devices that the test images use: see the module `mcu` of the crate `board`.
#[derive(Debug)]
pub struct Target {
    pub part: &'static Part,
    pub tick: Interrupt,
    pub external: Interrupt,
    /// The pin of the external interrupt.
    pub button: Pin,
}

/// An interrupt, and the bit that enables it (datasheets, "Interrupt Vectors" and "Register Summary").
#[derive(Debug)]
pub struct Interrupt {
    pub vector: u8,
    /// Data address.
    pub register: u16,
    pub mask: u8,
}

/// The MCU of the robot.
pub const ATMEGA128: &Target = &Target {
    part: Part::ATMEGA128,
    tick: Interrupt { vector: 15, register: 0x57, mask: 1 << 1 }, // TIMSK: OCIE0
    external: Interrupt { vector: 5, register: 0x59, mask: 1 << 4 }, // EIMSK: INT4
    button: Pin { port: 'E', bit: 4 },
};

const ATMEGA328P: &Target = &Target::later(Part::ATMEGA328P, 14, 2);
const ATMEGA1284P: &Target = &Target::later(Part::ATMEGA1284P, 16, 2);
const ATMEGA2560: &Target = &Target::later(Part::ATMEGA2560, 21, 0);

/// All of them, the robot's first.
pub const TARGETS: [&Target; 4] = [ATMEGA128, ATMEGA328P, ATMEGA1284P, ATMEGA2560];

impl Target {
    /// An MCU later than the ATmega128. `compare` is the vector of TIMER0_COMPA, `bit` the bit of port D that
    /// is INT0.
    const fn later(part: &'static Part, compare: u8, bit: u8) -> Self {
        Target {
            part,
            tick: Interrupt { vector: compare, register: 0x6e, mask: 1 << 1 }, // TIMSK0: OCIE0A
            external: Interrupt { vector: 1, register: 0x3d, mask: 1 << 0 },   // EIMSK: INT0
            button: Pin { port: 'D', bit },
        }
    }

    /// The MCU of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        TARGETS.into_iter().find(|target| target.part.name == name)
    }

    /// The directory of its test images.
    pub fn images(&self) -> PathBuf {
        test_images().join(self.folder())
    }

    /// The folder of its images among the test images, and of its expectations. The robot's MCU has no folder
    /// of its own.
    pub fn folder(&self) -> &'static str {
        if self.part.name == ATMEGA128.part.name { "" } else { self.part.name }
    }

    /// The test image of this name.
    ///
    /// # Panics
    /// When it is not there.
    pub fn image(&self, name: &str) -> Arc<Image> {
        load_test_image(&self.images().join(name))
    }

    /// Enables both interrupts. Their devices stay off: the harness raises them.
    pub fn enable_interrupts(&self, mcu: &mut Mcu) {
        for interrupt in [&self.tick, &self.external] {
            mcu.write(interrupt.register, interrupt.mask);
        }
    }

    /// An MCU that runs `image`.
    ///
    /// # Panics
    /// When the image does not fit it.
    pub fn mcu(&self, image: Arc<Image>) -> Mcu {
        Mcu::new(self.part, image, 1).unwrap_or_else(|error| panic!("{error}"))
    }
}
