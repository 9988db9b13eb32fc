//! Builds the programs in `fixtures` with avr-gcc, and makes MCUs that run them.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use simavr_harness::{Image, Mcu, Part};

/// Builds `fixtures/<source>` for the ATmega128, with each of `defines` ("NAME=VALUE") defined.
pub fn build_with(source: &str, defines: &[&str]) -> Arc<Image> {
    build_for(Part::ATMEGA128, source, defines)
}

/// The same for any part.
pub fn build_for(part: &Part, source: &str, defines: &[&str]) -> Arc<Image> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(source);
    let elf =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{source}-{}-{number}.elf", std::process::id()));
    let status = Command::new("avr-gcc")
        .args([&format!("-mmcu={}", part.name), "-Os", "-std=gnu99", "-Wall", "-Werror", "-o"])
        .arg(&elf)
        .args(defines.iter().map(|define| format!("-D{define}")))
        .arg(&fixture)
        .status()
        .expect("avr-gcc runs (Debian: gcc-avr and avr-libc; ./x test installs them)");
    assert!(status.success(), "avr-gcc builds {}", fixture.display());
    let image = Image::load(&elf).expect("avr-gcc makes an AVR image");
    std::fs::remove_file(&elf).expect("the image can be removed");
    Arc::new(image)
}

/// Builds `fixtures/<source>` for the ATmega128.
pub fn build(source: &str) -> Arc<Image> {
    build_with(source, &[])
}

/// An ATmega128 that runs `image`.
pub fn mcu(image: &Arc<Image>) -> Mcu {
    mcu_with_seed(image, 1)
}

/// The same, with memory at power-up by `seed`.
pub fn mcu_with_seed(image: &Arc<Image>, seed: u64) -> Mcu {
    Mcu::new(Part::ATMEGA128, image.clone(), seed).expect("the image fits the ATmega128")
}

/// A part that runs `fixtures/<source>`.
pub fn mcu_of(part: &'static Part, source: &str, defines: &[&str]) -> Mcu {
    Mcu::new(part, build_for(part, source, defines), 1).expect("the image fits the part")
}

/// The values of all markers so far.
pub fn marked(mcu: &Mcu) -> Vec<u8> {
    mcu.markers().iter().map(|marker| marker.value).collect()
}
