//! A robot that was ordered to stop, with the images that it is flashed with: it loses no neighbour while the
//! behaviours' clock wraps after 65.5 s, and walks when it is ordered to. Its joints stay where they are,
//! also when MCUs are reset.

use plants::joint::Joint;
use simavr_harness::{Engine, RobotBuilder};
use simulation::{Change, Mcus, Robot, Run, Scenario, faults};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::motor::Axis;

const SECOND: u64 = 1000 * MILLISECOND;

/// The run of a robot file after so many seconds.
fn after(seconds: u64, robot: &str) -> Run<Engine> {
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(robot).expect("it is right");
    let engine = Engine::new(RobotBuilder::wired(firmware(), &wiring).build().expect("it can be built"), 2);
    let mut run = Run::new(engine, timeline, SECOND);
    while run.step(seconds * SECOND).expect("the events can happen") {}
    run
}

#[test]
fn a_robot_that_stands_for_a_minute_loses_nobody_and_walks_on() {
    let robot = "shape = 'chain'\nmodules = 2\n\
        [[event]]\nat = 2\ncommand = [0xd0, 1, 255]\nto = '0.Up'\n\
        [[event]]\nat = 72\ncommand = [0xd2, 2, 255]\nto = '0.Up'\n";
    let run = after(80, robot);
    assert_eq!(run.observer.discovery.lapses, 0);
    let actions = [0, 1].map(|module| run.robot.status(module).map(|status| status.action));
    assert_eq!(actions, [Some(hormone::action::Action::Wave); 2]);
    assert_eq!(faults(&run, false), [""; 0]);
}

/// A leg of a robot that stands would give way. Nobody gives HORMONE, which starts anew, a target.
#[test]
fn joints_of_a_module_that_was_reset_while_it_stood_bear_a_load_where_they_are() {
    let robot = "shape = 'chain'\nmodules = 2\n\
        [[event]]\nat = 2\ncommand = [0xd0, 1, 255]\nto = '0.Up'\n";
    let mut engine = after(4, robot).robot;
    let angles = |engine: &Engine| engine.robot().module(1).expect("there are two").body().angles();
    for mcus in [Mcus::Master, Mcus::Slave, Mcus::Both] {
        engine.change(&Change::Reset { module: 1, mcus }).expect("there are two modules");
        engine.run_until(engine.cycle() + SECOND / 2);
        let before = angles(&engine);
        let body = engine.robot_mut().module_mut(1).expect("there are two").body_mut();
        for (axis, degrees) in Axis::ALL.into_iter().zip(before) {
            *body.joint_mut(axis) = Joint::at(degrees - 8.0);
        }
        engine.run_until(engine.cycle() + SECOND);
        for ((axis, degrees), now) in Axis::ALL.into_iter().zip(before).zip(angles(&engine)) {
            assert!((now - degrees).abs() <= 0.3, "{mcus:?}: {axis:?} was at {degrees}, and is at {now}");
        }
    }
}
