//! The common parts of the tests in simavr: the places of the images, and comparisons of their output with
//! expectations.

pub mod bounds;
pub mod chain;
pub mod coverage;
pub mod examples;
pub mod hormones;
pub mod marks;
pub mod model;
pub mod qemu;
pub mod rules;
pub mod soft_uart;
pub mod stacks;
pub mod storm;
pub mod sweep;
pub mod target;
pub mod times;

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use simavr_harness::{Image, Images, Mcu, Part};

/// One simulated millisecond, in cycles.
pub const MILLISECOND: u64 = simavr_harness::CLOCK_HZ as u64 / 1000;

/// The arguments of this program. An argument that is not UTF-8 becomes a name that does not exist.
pub fn arguments() -> impl Iterator<Item = String> {
    std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned())
}

/// The arguments of this program, and whether it only has to tell if it takes them: then `--check` comes
/// first.
pub fn checked_arguments() -> (bool, Vec<String>) {
    let mut arguments = arguments().peekable();
    let only_checks = arguments.next_if(|first| first == "--check").is_some();
    (only_checks, arguments.collect())
}

/// The number that the environment has by this name, if it has one.
///
/// # Panics
/// When it is no such number.
pub fn setting<T: FromStr>(name: &str) -> Option<T> {
    let value = std::env::var(name).ok()?;
    Some(value.parse().unwrap_or_else(|_| panic!("{name} is a number, not {value}")))
}

/// The test image of this name, where `./x test` puts it.
///
/// # Panics
/// When it is not there.
pub fn image(name: &str) -> Arc<Image> {
    load_test_image(&test_images().join(name))
}

/// An ATmega128 that runs the test image of this name.
pub fn mcu(name: &str) -> Mcu {
    mcu_with_seed(name, 1)
}

/// An ATmega128 that runs the test image of this name, with SRAM at power-up drawn from `seed`.
pub fn mcu_with_seed(name: &str, seed: u64) -> Mcu {
    Mcu::new(Part::ATMEGA128, image(name), seed).expect("the image fits the ATmega128")
}

/// The images that a module of the robot is flashed with.
///
/// # Panics
/// When they are not there.
pub fn firmware() -> Images {
    Images { master: load(&images().join("firmware-master")), slave: load(&images().join("firmware-slave")) }
}

/// The directory of the test images.
pub fn test_images() -> PathBuf {
    images().join("tests")
}

/// The directory of the robot's images.
pub fn images() -> PathBuf {
    std::env::var_os("SUPERBOT_IMAGES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/images"), PathBuf::from)
}

/// A test image. It records its coverage if that is enabled.
fn load_test_image(path: &Path) -> Arc<Image> {
    let mut image = Arc::unwrap_or_clone(load(path));
    coverage::record(&mut image);
    Arc::new(image)
}

fn load(path: &Path) -> Arc<Image> {
    match Image::load(path.with_extension("elf")) {
        Ok(image) => Arc::new(image),
        Err(error) => panic!("{error}\n`./x test` builds all images and runs these tests"),
    }
}
