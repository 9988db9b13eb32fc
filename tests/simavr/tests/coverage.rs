//! The gaps that the coverage report finds, and code that it must not take for a gap.

use std::path::Path;
use std::sync::Arc;

use simavr_harness::{Image, State};
use superbot_tests_simavr::coverage::{Found, Functions, What};
use superbot_tests_simavr::target::{ATMEGA128, Target};

/// A function of the kernel that every image with a semaphore has.
const FUNCTION: &str = "kernel::ready::append";
/// The end of its mangled name.
const MANGLED: &str = "6kernel5ready6append";

/// A test image with an empty record of its own.
fn image(target: &Target, name: &str, record: &str) -> Image {
    let mut image =
        Image::load(target.images().join(name).with_extension("elf")).expect("./x test builds it");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{record}-{}", std::process::id()));
    std::fs::write(&file, []).expect("the file can be written");
    image.record_coverage(&file).expect("the file can be mapped");
    // The mapping stays.
    std::fs::remove_file(file).expect("it can be removed");
    image
}

/// A test image with a record of its own, run to its end.
fn run(target: &Target, name: &str, record: &str) -> Image {
    let image = Arc::new(image(target, name, record));
    let mut mcu = target.mcu(image.clone());
    assert_eq!(mcu.run_to_end(4_000_000), State::Done);
    drop(mcu);
    Arc::unwrap_or_clone(image)
}

/// The gaps in that function.
fn gaps(images: &[&Image]) -> Vec<Found> {
    let mut functions = Functions::default();
    images.iter().for_each(|image| functions.add("one", image));
    let all = functions.gaps().into_iter();
    all.filter(|found| found.gap.function == FUNCTION).collect()
}

#[test]
fn what_does_not_run_is_a_gap_and_what_does_is_none() {
    let never = image(ATMEGA128, "semaphore", "never");
    let [whole] = &gaps(&[&never])[..] else { panic!("one gap from begin to end") };
    let is_it = |(name, _): &(&str, _)| name.ends_with(MANGLED);
    let size = never.symbols().find(is_it).expect("it is there").1.size;
    assert_eq!((whole.gap.from, whole.gap.to, whole.gap.what), (0, size.into(), What::NeverExecuted));

    let runs = run(ATMEGA128, "semaphore", "runs");
    let left = gaps(&[&runs]);
    assert!(left.iter().all(|found| found.gap != whole.gap), "{left:?}");
    let bytes = |found: &Found| found.gap.to - found.gap.from;
    assert!(left.iter().map(bytes).sum::<u32>() < u32::from(size) / 2, "most of it runs: {left:?}");
    // This image counts and wakes in one order only; interrupts would take other paths.
    assert!(left.iter().any(|found| found.gap.what != What::NeverExecuted), "{left:?}");
}

#[test]
fn images_add_up_where_the_code_is_the_same() {
    let other = Target::named("atmega1284p").expect("it is one of them");
    let one = run(ATMEGA128, "semaphore", "one");
    let never = image(other, "semaphore", "other-never");
    // The linker has put the function elsewhere, and it refers to other addresses.
    assert_eq!(gaps(&[&one, &never]), gaps(&[&one]));
    let two = run(ATMEGA128, "preemption", "two");
    let (of_one, of_both) = (gaps(&[&one]), gaps(&[&one, &two]));
    assert!(of_both.iter().all(|found| of_one.contains(found)), "{of_both:?} of {of_one:?}");
}

#[test]
fn an_image_that_records_nothing_covers_nothing() {
    let image = Image::load(ATMEGA128.images().join("semaphore.elf")).expect("./x test builds it");
    assert_eq!(gaps(&[&image]).len(), 1);
}
