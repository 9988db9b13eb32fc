//! A robot that was ordered to stop, with the images that it is flashed with: it loses no neighbour while the
//! behaviours' clock wraps after 65.5 s, and walks when it is ordered to.

use simavr_harness::{Engine, RobotBuilder};
use simulation::{Robot, Run, Scenario, faults};
use superbot_tests_simavr::{MILLISECOND, firmware};

const SECOND: u64 = 1000 * MILLISECOND;

#[test]
fn a_robot_that_stands_for_a_minute_loses_nobody_and_walks_on() {
    let robot = "shape = 'chain'\nmodules = 2\n\
        [[event]]\nat = 2\ncommand = [0xd0, 1, 255]\nto = '0.Up'\n\
        [[event]]\nat = 72\ncommand = [0xd2, 2, 255]\nto = '0.Up'\n";
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(robot).expect("it is right");
    let engine = Engine::new(RobotBuilder::wired(firmware(), &wiring).build().expect("it can be built"), 2);
    let mut run = Run::new(engine, timeline, SECOND);
    while run.step(80 * SECOND).expect("the events can happen") {}
    assert_eq!(run.observer.discovery.lapses, 0);
    let actions = [0, 1].map(|module| run.robot.status(module).map(|status| status.action));
    assert_eq!(actions, [Some(hormone::action::Action::Wave); 2]);
    assert_eq!(faults(&run, false), [""; 0]);
}
