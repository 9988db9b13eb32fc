//! Tests the record of which instructions ran, and which way they went.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::common::{build_with, mcu};
use simavr_harness::{Image, Kind, Place, State, Ways};

const NEVER: Ways = Ways { on: false, away: false };
const ON: Ways = Ways { on: true, away: false };
const AWAY: Ways = Ways { on: false, away: true };
const BOTH: Ways = Ways { on: true, away: true };

/// An empty file for a record.
fn record(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    std::fs::write(&path, []).expect("the file can be written");
    path
}

/// The fixture, which records in `file`.
fn image(defines: &[&str], record: &Path) -> Arc<Image> {
    let mut image = Arc::unwrap_or_clone(build_with("coverage.S", defines));
    image.record_coverage(record).expect("the file can be mapped");
    Arc::new(image)
}

fn address(image: &Image, label: &str) -> u32 {
    match image.symbol(label).map(|symbol| symbol.place) {
        Some(Place::Flash(address)) => address,
        place => panic!("{label}: {place:?}"),
    }
}

fn ways(image: &Image, label: &str) -> Ways {
    image.coverage().expect("it records").ways(address(image, label))
}

#[test]
fn each_instruction_tells_where_it_went() {
    let ways_to_run = [("decoded", &[][..]), ("left-to-simavr", &["SPM_INSIDE"]), ("fed", &["WATCHDOG"])];
    for (name, defines) in ways_to_run {
        let record = record(name);
        let image = image(defines, &record);
        assert_eq!(mcu(&image).run_to_end(100_000), State::Done);
        for (label, expected) in [
            ("main", ON),
            ("both_ways", BOTH),
            ("always_skips", AWAY),
            ("skipped", NEVER),
            ("never_branches", ON),
            ("never_skips", ON),
            ("ends", ON),
            ("never", NEVER),
        ] {
            assert_eq!(ways(&image, label), expected, "{name}: {label}");
        }
        std::fs::remove_file(record).expect("it can be removed");
    }
}

#[test]
fn runs_add_up_in_one_file() {
    let record = record("two-runs");
    let first = image(&[], &record);
    mcu(&first).run_until(1); // no further than the first instruction
    let second = image(&[], &record);
    assert_eq!(ways(&second, "both_ways"), NEVER);
    mcu(&second).run_to_end(100_000);
    assert_eq!(ways(&first, "both_ways"), BOTH);
    std::fs::remove_file(record).expect("it can be removed");
}

#[test]
fn nothing_is_recorded_unless_asked_for() {
    assert!(build_with("coverage.S", &[]).coverage().is_none());
}

#[test]
fn code_tells_what_forks_and_what_returns() {
    let image = build_with("coverage.S", &[]);
    let code = image.code(address(&image, "main")..address(&image, "never") + 2);
    let kinds: Vec<_> = code.iter().map(|code| code.kind).collect();
    use Kind::{Branch, Indirect, Other, Skip};
    assert_eq!(kinds, [Other, Other, Branch, Skip, Other, Branch, Skip, Other, Other, Indirect]);
    let skipped = address(&image, "skipped");
    let after = code.iter().find(|code| code.address > skipped).expect("it is not the last");
    assert_eq!(after.address, skipped + 4, "a call has two words");
}

/// Compares the same code at another address, with its callees elsewhere.
#[test]
fn code_has_one_form_wherever_it_lies() {
    let forms = |defines: &[&str], from: &str, to: &str| {
        let image = build_with("forms.S", defines);
        let code = image.code(address(&image, from)..address(&image, to));
        code.into_iter().map(|code| code.form).collect::<Vec<_>>()
    };
    let here = forms(&[], "one", "one_end");
    assert_eq!(here.len(), 9);
    assert_eq!(here, forms(&["AWAY"], "one", "one_end"));
    assert_eq!(here, forms(&["FAR"], "one", "one_end"));
    assert_ne!(here, forms(&[], "other", "other_end"), "a branch leads elsewhere");
}
