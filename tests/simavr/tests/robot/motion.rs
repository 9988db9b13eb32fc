//! Joints of whole modules on their plants: how the images carry out an action.

use plants::joint::Joint;
use simavr_harness::bench::module::{Weight, under_weight};
use simavr_harness::{Controller, Engine, Reset, RobotBuilder};
use simulation::{Change, JointFault, JointOf, Robot};
use superbot_tests_simavr::{MILLISECOND, firmware, images};
use tasks::motor::Axis;

/// The module in the middle of a chain, a spine, which goes straight.
const SPINE: usize = 1;

/// A chain of three whose spine is bent by 30 degrees at all joints.
fn bent_chain() -> Engine {
    let mut robot = RobotBuilder::chain(firmware(), 3).seed(1).build().expect("three modules can be built");
    let spine = robot.module_mut(SPINE).expect("there is one");
    for axis in Axis::ALL {
        *spine.body_mut().joint_mut(axis) = Joint::at(30.0);
    }
    Engine::new(robot, 1)
}

/// The angles of the spine's joints, in degrees.
fn angles(engine: &Engine) -> [f64; 3] {
    let spine = engine.robot().module(SPINE).expect("there is one");
    Axis::ALL.map(|axis| spine.body().joint(axis).degrees())
}

/// Periods of the joints' control, and those missed, of one MCU of the spine.
fn periods(engine: &Engine, mcu: Controller) -> [u16; 2] {
    let spine = engine.robot().module(SPINE).expect("there is one");
    let counters = spine.mcu(mcu).read_symbol("MOTORS").expect("both images have it");
    [[counters[0], counters[1]], [counters[2], counters[3]]].map(u16::from_le_bytes)
}

#[test]
fn joints_go_straight_and_rest_there() {
    let mut engine = bent_chain();
    let mut lowest = [f64::MAX; 3];
    for millisecond in (0..3_000).step_by(5) {
        engine.run_until(millisecond * MILLISECOND);
        lowest = [0, 1, 2].map(|axis| lowest[axis].min(angles(&engine)[axis]));
    }
    for (lowest, angle) in lowest.into_iter().zip(angles(&engine)) {
        let overshoot = -lowest / 30.0;
        assert!(overshoot <= 0.05, "{overshoot}");
        assert!(angle.abs() <= 0.3, "{angle}");
    }
    for mcu in Controller::ALL {
        let [before, missed] = periods(&engine, mcu);
        assert!((500..2_000).contains(&before), "{before} periods");
        assert_eq!(missed, 0);
        engine.run_until(engine.cycle() + 100 * MILLISECOND);
        assert_eq!(periods(&engine, mcu), [before, 0], "at rest there is nothing to compute");
    }
    // Moved by force, a joint comes back.
    let spine = engine.robot_mut().module_mut(SPINE).expect("there is one");
    *spine.body_mut().joint_mut(Axis::Back) = Joint::at(-8.0);
    engine.run_until(engine.cycle() + 2_000 * MILLISECOND);
    assert!(angles(&engine)[2].abs() <= 0.3, "{:?}", angles(&engine));
}

/// HORMONE on the master has sent the target of the slave's joint long before.
#[test]
fn a_joint_whose_mcu_was_reset_is_told_again() {
    let mut engine = bent_chain();
    engine.run_until(3_000 * MILLISECOND);
    for mcu in Controller::ALL {
        let spine = engine.robot_mut().module_mut(SPINE).expect("there is one");
        spine.mcu_mut(mcu).reset(Reset::External);
        Axis::ALL.into_iter().for_each(|axis| *spine.body_mut().joint_mut(axis) = Joint::at(-8.0));
        engine.run_until(engine.cycle() + 2_000 * MILLISECOND);
        assert!(
            angles(&engine).into_iter().all(|angle| angle.abs() <= 0.3),
            "{mcu:?}: {:?}",
            angles(&engine)
        );
    }
}

#[test]
fn a_joint_with_a_broken_potentiometer_stays_where_it_is() {
    let mut engine = bent_chain();
    engine.run_until(800 * MILLISECOND);
    let joint = JointOf { module: SPINE, axis: Axis::Roll };
    engine.change(&Change::Fault { joint, fault: JointFault::Open }).expect("there is one");
    engine.run_until(850 * MILLISECOND);
    let [_, roll, _] = angles(&engine);
    assert!((5.0..25.0).contains(&roll), "{roll}");
    engine.run_until(3_000 * MILLISECOND);
    let now = angles(&engine);
    assert!(now[0].abs() <= 0.3 && now[1] == roll && now[2].abs() <= 0.3, "{now:?}");
}

#[test]
fn joints_that_bear_the_body_keep_time_and_place() {
    let Weight { jitter, missed, error } = under_weight(&images()).unwrap_or_else(|error| panic!("{error}"));
    // In cycles of 1/16 us, and degrees: the aims of a module at the bench.
    assert!(jitter > 0 && jitter <= 20 * 16 && missed == 0, "{jitter} cycles, {missed} missed");
    assert!(error > 0.0 && error <= 0.3, "{error} degrees");
}
