//! When the periods of the joints' control begin, with other events at the same moment.

use simavr_harness::{CONTROL_PROBE, Character, Controller, Engine, Mcu, RobotBuilder};
use simulation::Shape;
use superbot_tests_simavr::bounds::{load, pull};
use superbot_tests_simavr::soft_uart::{FRAME, LINE};
use superbot_tests_simavr::{MILLISECOND, firmware};

/// The module in the middle of three: its joints are controlled.
const MIDDLE: usize = 1;

/// A period's begin is held up by no more than the rest of one short vector, in cycles: that vector restores
/// its registers, and Timer2's saves its own.
const HELD_UP: u64 = 60;

/// With the module's other events it is held up by no more than this, in cycles, in at least one robot of
/// [`ROBOTS`].
const IN_TIME: u64 = 110;

/// In no robot is it held up by more than 20 us, in cycles.
const AT_MOST: u64 = 320;

/// The pull at the joints changes its direction after so many periods, so that they are never at rest.
const TURN: u64 = 40;

fn mcu(engine: &mut Engine, controller: Controller) -> &mut Mcu {
    engine.robot_mut().module_mut(MIDDLE).expect("it is there").mcu_mut(controller)
}

/// How often each moment is tried: another event may come at the same moment in one of the tries.
const TRIES: usize = 3;

/// How many robots are tried, each with its own seed: the other events as the control ends depend on chance.
const ROBOTS: u64 = 5;

/// How much later than usual a period begins if a received bit ends so many cycles after the usual begin: the
/// most over all `moments` of the least over a moment's tries. `usual` is the begin of one period; the next
/// ones follow by a millisecond each.
fn held_up(
    engine: &mut Engine,
    controller: Controller,
    usual: u64,
    moments: impl Iterator<Item = i64>,
) -> u64 {
    let late = moments.flat_map(|behind| [behind; TRIES]).zip(1..).map(|(behind, period)| {
        if period % TURN == 0 {
            pull(engine, MIDDLE, (period / TURN).is_multiple_of(2));
        }
        let usual = usual + period * MILLISECOND;
        let start = (usual - FRAME / 10).saturating_add_signed(behind);
        mcu(engine, controller).receive(LINE, Character { value: 0xff, start, end: start + FRAME });
        engine.run_until(usual + MILLISECOND / 2);
        let begin = begins(engine, controller).next().expect("the joints are controlled");
        begin.saturating_sub(usual)
    });
    let late: Vec<u64> = late.collect();
    late.chunks(TRIES).filter_map(|tries| tries.iter().min()).copied().max().unwrap_or(0)
}

/// A robot of this seed whose middle module's joints are controlled, and the offset within each millisecond
/// at which this MCU's periods begin.
fn controlled(controller: Controller, seed: u64) -> (Engine, u64) {
    let wiring = Shape::Chain.wiring(3).expect("a chain may be so long");
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(seed).build().expect("the robot can be built");
    let mut engine = Engine::new(robot, 1);
    pull(&mut engine, MIDDLE, false);
    engine.run_until(500 * MILLISECOND);
    mcu(&mut engine, controller).add_probe(CONTROL_PROBE);
    engine.run_until(520 * MILLISECOND + MILLISECOND / 2);
    let phases = begins(&mut engine, controller).map(|begin| begin % MILLISECOND);
    let phase = phases.min().expect("the joints are controlled");
    (engine, phase)
}

/// The begins of periods since the last call.
fn begins(engine: &mut Engine, controller: Controller) -> impl Iterator<Item = u64> {
    let edges = mcu(engine, controller).take_edges(0);
    edges.into_iter().filter(|edge| edge.level).map(|edge| edge.cycle)
}

#[test]
fn a_bit_that_ends_just_then_holds_up_no_period_for_long() {
    for controller in Controller::ALL {
        let (mut engine, phase) = controlled(controller, 1);
        let usual = engine.cycle() / MILLISECOND * MILLISECOND + phase;
        let most = held_up(&mut engine, controller, usual, -300..100);
        println!("{controller:?}: {most} cycles");
        assert!(most <= HELD_UP, "{controller:?}: a period began {most} cycles late");
    }
}

#[test]
fn no_period_begins_where_the_control_ends() {
    for controller in Controller::ALL {
        let tries = (1..=ROBOTS).map(|seed| {
            let (mut engine, phase) = controlled(controller, seed);
            load(&mut engine, MIDDLE, 0.0);
            engine.run_until(3_000 * MILLISECOND);
            let begins: Vec<u64> = begins(&mut engine, controller).collect();
            let last = begins.last().expect("the joints were controlled");
            assert!(*last < 2_500 * MILLISECOND, "{controller:?}: the joints are not at rest");
            begins.iter().map(|begin| (begin % MILLISECOND).abs_diff(phase)).max().unwrap_or(0)
        });
        let late: Vec<u64> = tries.collect();
        println!("{controller:?}: {late:?} cycles");
        let [least, most] =
            [late.iter().min(), late.iter().max()].map(|late| *late.expect("robots were tried"));
        assert!(most <= AT_MOST && least <= IN_TIME, "{controller:?}: periods began {late:?} cycles late");
    }
}
