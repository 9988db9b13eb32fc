//! Coverage: which instructions of the kernel no test in simavr executes, and which of its branches go one
//! way only.
//!
//! While [`FOLDER`] is set, every test image records there what its MCUs execute. [`functions()`] reads the
//! records and merges them, because each image is linked on its own and has its own copy of the kernel. A
//! function in several images is the same *variant* if its instructions are the same except for values and
//! addresses that the linker may have put there (see [`simavr_harness::Form`]). An instruction counts as
//! executed if any image executes it in the same variant; a branch goes both ways if it does so in all images
//! together. The compiler may have made other branches from the same source, so each variant must be covered
//! by itself: for a function that the image `model` has, which makes all calls in random order, the variants
//! in `model`; for other functions, and for assembly, the variants in every image.
//!
//! The kernel's functions are those of the crate `kernel` and the assembly `kernel_*`, by the symbols of the
//! image. These do not count:
//! - code that the compiler inlined into a test's own functions, because images have no debugging information
//!   that would tell it apart;
//! - functions of the kernel that are generic over a test's function, such as a task's entry function: that
//!   function is inlined into them;
//! - interrupt vectors, which the macros of `kernel` and of `board` declare by the same names.

use std::path::{Path, PathBuf};

use simavr_harness::Image;
use simulation::fnv_1a;

use crate::target::TARGETS;
use crate::test_images;

mod functions;
mod gap;
mod list;
mod variants;

pub use gap::{Gap, What};
pub use list::{Complaint, List};
pub use variants::{Found, Functions};

/// The environment variable with the folder of the records.
pub const FOLDER: &str = "SUPERBOT_COVERAGE";

/// Images that test the robot's devices or measure figures: they have the same kernel, but do not test it.
/// And the image with random interrupts: the instructions that it executes depend on chance.
const OTHERS: [&str; 5] = ["board_", "bench_", "flood_", "devices", "storm"];

/// The exception, which counts.
const MONITOR: &str = "board_monitor";

/// Records what the image executes, if coverage is recorded.
///
/// # Panics
/// When the record cannot be written.
pub fn record(image: &mut Image) {
    if let Some(folder) = folder() {
        let recorded =
            std::fs::create_dir_all(&folder).and_then(|()| image.record_coverage(&file(&folder, image)));
        recorded.unwrap_or_else(|error| panic!("{FOLDER}={}: {error}", folder.display()));
    }
}

/// The kernel's functions, with the records in the folder.
///
/// # Errors
/// There is no folder or no record, or an image cannot be read.
pub fn functions() -> Result<Functions, String> {
    let folder = folder().ok_or_else(|| format!("{FOLDER} is not set: run ./x coverage"))?;
    let mut functions = Functions::default();
    for path in images()? {
        let mut image = Image::load(&path).map_err(|error| error.to_string())?;
        let file = file(&folder, &image);
        if !file.exists() {
            return Err(format!("no test has run {}: run ./x coverage", path.display()));
        }
        image.record_coverage(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let name = path.strip_prefix(test_images()).unwrap_or(&path).display().to_string();
        functions.add(&name, &image);
    }
    Ok(functions)
}

fn folder() -> Option<PathBuf> {
    std::env::var_os(FOLDER).map(PathBuf::from)
}

/// The file in which an image records. The image's contents give its name, so that no record of another build
/// is taken for its own.
fn file(folder: &Path, image: &Image) -> PathBuf {
    folder.join(format!("{:016x}", fnv_1a(image.flash().iter().copied())))
}

/// The images that test the kernel, sorted.
fn images() -> Result<Vec<PathBuf>, String> {
    let others = ["cpu-time", "tickless"].map(|folder| test_images().join(folder));
    let mut images = Vec::new();
    for folder in TARGETS.map(|target| target.images()).iter().chain(&others) {
        let entries = std::fs::read_dir(folder)
            .map_err(|error| format!("{}: {error}; ./x coverage builds the images", folder.display()))?;
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let mut paths: Vec<_> = paths.filter(|path| tests_the_kernel(path)).collect();
        paths.sort();
        images.append(&mut paths);
    }
    Ok(images)
}

fn tests_the_kernel(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    path.extension().is_some_and(|extension| extension == "elf")
        && (stem == MONITOR || !OTHERS.iter().any(|other| stem.starts_with(other)))
}
