//! Tasks against one loop: what docs/concurrency.md says of both, in short runs.

use simavr_harness::Image;
use simavr_harness::bench::concurrency::{Case, Row, Size, Style, run};
use superbot_tests_simavr::images;

const SECONDS: u64 = 2;

fn row(case: Case, style: Style) -> Row {
    run(&images(), case, style, SECONDS).unwrap_or_else(|error| panic!("{error}"))
}

/// Each of the two with its row of this case.
fn both(case: Case) -> [Row; 2] {
    Style::ALL.map(|style| row(case, style))
}

#[test]
fn the_loop_does_all_that_the_tasks_do_while_nothing_computes_for_long() {
    for row in both(Case::Control).into_iter().chain(both(Case::Crowded)) {
        assert_eq!((row.control_missed, row.resets, row.edges_unanswered), (0, 0, 0), "{row:?}");
        assert_eq!((row.hormones_lost, row.seven.missed, row.eleven.missed), (Some(0), 0, 0), "{row:?}");
        assert!(row.bytes_lost.is_some_and(|bytes| bytes < 5), "{row:?}");
        assert!(row.hop_us_max.is_some_and(|hop| hop < 10_000.0), "{row:?}");
        assert!(row.control_done_us_max < 1_000.0, "{row:?}");
    }
}

#[test]
fn what_computes_for_50_ms_holds_up_the_loop_and_no_task() {
    let [tasks, sequential] = both(Case::Computes);
    assert_eq!((tasks.control_missed, tasks.seven.missed, tasks.bytes_lost), (0, 0, Some(0)), "{tasks:?}");
    assert!(tasks.hop_us_max.is_some_and(|hop| hop < 10_000.0), "{tasks:?}");
    assert!(tasks.reaction_us_max.is_some_and(|reaction| reaction < 2_000.0), "{tasks:?}");
    assert!(sequential.control_missed > sequential.control_periods / 5, "{sequential:?}");
    assert!(sequential.control_done_us_max > 45_000.0, "{sequential:?}");
    assert!(sequential.hop_us_max.is_some_and(|hop| hop > 20_000.0), "{sequential:?}");
    assert!(sequential.seven.missed > 0 && sequential.seven.late_ms_max > 40.0, "{sequential:?}");
    let cut = row(Case::ComputesInPieces, Style::Loop);
    assert_eq!((cut.control_missed, cut.seven.missed), (0, 0), "cut by hand it holds up nothing: {cut:?}");
}

#[test]
fn a_behaviour_that_hangs_resets_the_loop_and_stops_no_other_task() {
    let [tasks, sequential] = both(Case::Hangs);
    assert_eq!((tasks.resets, tasks.control_missed, tasks.hormones_lost), (0, 0, Some(0)), "{tasks:?}");
    assert_eq!((tasks.edges_unanswered, tasks.seven.missed, tasks.eleven.missed), (0, 0, 0), "{tasks:?}");
    assert!(sequential.resets >= 2 && sequential.edges_unanswered > 0, "{sequential:?}");
}

#[test]
fn the_loop_takes_less_ram_and_flash() {
    let size = |style, name: &str| {
        let image = Image::load(images().join(name)).unwrap_or_else(|error| panic!("{error}"));
        Size::of(&image, style)
    };
    let tasks = size(Style::Tasks, "firmware-master.elf");
    let sequential = size(Style::Loop, "sequential/sequential-master.elf");
    assert!(sequential.ram_bytes + 1_000 < tasks.ram_bytes, "{sequential:?} {tasks:?}");
    assert!(sequential.flash_bytes < tasks.flash_bytes, "{sequential:?} {tasks:?}");
    assert!(sequential.flash_of_kernel_bytes < tasks.flash_of_kernel_bytes, "{sequential:?} {tasks:?}");
}
