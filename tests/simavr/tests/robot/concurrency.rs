//! Tasks against one loop: checks the statements of docs/concurrency.md in short runs.

use std::sync::Arc;

use hormone::gait::GaitName;
use hormone::hormone::Hormone;
use hormone::order::{Order, What};
use hormone::period::Period;
use simavr_harness::bench::concurrency::{Case, Row, Size, Style, run};
use simavr_harness::{Engine, Image, Images, RobotBuilder};
use simulation::{Change, Face};
use superbot_tests_simavr::{MILLISECOND, firmware, images};
use tasks::dock::Dock;
use tasks::motor::Axis;

const SECONDS: u64 = 2;

fn row(case: Case, style: Style) -> Row {
    run(&images(), case, style, SECONDS).unwrap_or_else(|error| panic!("{error}"))
}

/// The rows of both programs for this case.
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

/// The robot's master as one loop.
fn sequential_master() -> Image {
    let path = images().join("sequential/sequential-master.elf");
    Image::load(path).unwrap_or_else(|error| panic!("{error}; ./x bench concurrency builds it"))
}

/// The angles of the front joints of a chain's modules, in degrees, every 20 ms from 3 to 9 s. The chain
/// walks slowly, by a gait that turns no other joint of the master, so that the joint comes to rest between
/// two orders.
fn waves(images: Images) -> Vec<f64> {
    let robot = RobotBuilder::chain(images, 3).seed(1).build().expect("the robot can be built");
    let mut engine = Engine::new(robot, 1);
    engine.run_until(1_000 * MILLISECOND);
    let period = Period::of_milliseconds(4_000).expect("there is such a Period");
    let order = Order { what: What::Walk(GaitName::Caterpillar as u8, period), serial: 1 };
    let payload = Hormone::Order(order).to_payload().to_vec();
    let at = Face { module: 0, dock: Dock::Front };
    engine.robot_mut().change(&Change::Command { at, payload }).expect("the dock is free");
    engine.run_until(3_000 * MILLISECOND);
    let mut degrees = Vec::new();
    while engine.cycle() < 9_000 * MILLISECOND {
        engine.run_until(engine.cycle() + 20 * MILLISECOND);
        let modules = (0..3).filter_map(|module| engine.robot().module(module));
        degrees.extend(modules.map(|module| module.body().joint(Axis::Front).degrees()));
    }
    degrees
}

#[test]
fn a_joint_follows_a_single_order_by_the_loop_as_it_does_by_tasks() {
    let tasks = waves(firmware());
    let sequential = waves(Images { master: Arc::new(sequential_master()), ..firmware() });
    let most =
        tasks.iter().copied().fold(f64::MIN, f64::max) - tasks.iter().copied().fold(f64::MAX, f64::min);
    assert!(most > 20.0, "the chain does not undulate: {most}");
    let apart = tasks.iter().zip(&sequential).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    assert!(apart < 2.0, "{apart} degrees apart");
}

#[test]
fn the_loop_takes_less_ram_and_a_hundredth_less_flash() {
    let tasks = Size::of(&firmware().master, Style::Tasks);
    let sequential = Size::of(&sequential_master(), Style::Loop);
    assert!(sequential.ram_bytes + 1_000 < tasks.ram_bytes, "{sequential:?} {tasks:?}");
    let less = tasks.flash_bytes.checked_sub(sequential.flash_bytes);
    assert!(less.is_some_and(|bytes| (400..700).contains(&bytes)), "{sequential:?} {tasks:?}");
    assert!(sequential.flash_of_kernel_bytes < tasks.flash_of_kernel_bytes, "{sequential:?} {tasks:?}");
}
