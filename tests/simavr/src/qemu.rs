//! A second emulator: QEMU, which shares no code with simavr and the harness.
//!
//! The images are built with the feature `qemu` of `tests-images`. They send their marks over USART0, and
//! `END` when they are done.

use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use crate::target::Target;
use crate::test_images;

/// The bytes that a program sends at its end: `END` in the module `qemu` of the crate `board`.
const END: [u8; 2] = [0xff, 0x04];

/// An MCU that QEMU has.
#[derive(Debug)]
pub struct Machine {
    /// QEMU's name of a board with it.
    name: &'static str,
    /// The name of the MCU.
    pub mcu: &'static str,
}

pub const MACHINES: [Machine; 2] =
    [Machine { name: "uno", mcu: "atmega328p" }, Machine { name: "mega2560", mcu: "atmega2560" }];

/// A program that did not end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hung {
    /// The bytes that it sent before the run was given up.
    pub sent: Vec<u8>,
}

impl Machine {
    /// The same MCU in simavr.
    ///
    /// # Panics
    /// Never: the tests in simavr have all MCUs of [`MACHINES`].
    pub fn target(&self) -> &'static Target {
        Target::named(self.mcu).expect("the kernel is tested on it")
    }

    /// The test image of this name.
    pub fn image(&self, name: &str) -> PathBuf {
        test_images().join("qemu").join(self.mcu).join(name).with_extension("elf")
    }

    /// Runs a program until it reports its end, for `limit` at most. Returns the bytes that it sent before
    /// that.
    ///
    /// # Errors
    /// The program did not end.
    ///
    /// # Panics
    /// When there is no such program, or QEMU cannot be started.
    pub fn run(&self, image: &Path, limit: Duration) -> Result<Vec<u8>, Hung> {
        assert!(image.exists(), "{}: ./x test builds it", image.display());
        let mut qemu = Qemu::start(self.name, image);
        let mut output = BufReader::new(qemu.0.stdout.take().expect("it is piped"));
        let (sender, receiver) = mpsc::channel();
        // Ends with QEMU's output, which ends when QEMU is dropped.
        thread::spawn(move || {
            let mut byte = [0];
            while output.read_exact(&mut byte).is_ok() && sender.send(byte[0]).is_ok() {}
        });
        let deadline = Instant::now() + limit;
        let mut sent = Vec::new();
        loop {
            match receiver.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(byte) => sent.push(byte),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return Err(Hung { sent }),
            }
            if let Some(marks) = sent.strip_suffix(&END) {
                return Ok(marks.to_vec());
            }
        }
    }
}

/// QEMU, as long as this lives.
struct Qemu(Child);

impl Qemu {
    fn start(machine: &str, image: &Path) -> Self {
        let qemu = Command::new("qemu-system-avr")
            .args(["-display", "none", "-monitor", "none", "-serial", "stdio", "-machine", machine, "-bios"])
            .arg(image)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        Qemu(qemu.expect("qemu-system-avr runs (Debian: qemu-system-misc; ./x test installs it)"))
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // A process that has ended by itself can't be killed, and need not be.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
