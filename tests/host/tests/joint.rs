//! A joint on its plant: its step response, the disturbances that it bears, and the faults that stop it.

use plants::joint::{Joint as Plant, PotentiometerFault, Surroundings, counts};
use proptest::prelude::*;
use simulation::Noise;
use tasks::motor::joint::{Joint, Reading, State};
use tasks::motor::{FULL_DRIVE, to_angle};
use tasks::superbot::{JOINT, ROLL};

/// Steps of the plant in a millisecond.
const STEPS: u32 = 20;

/// A joint and the plant that it drives.
struct Rig {
    joint: Joint,
    plant: Plant,
    /// The drive that the joint last asked for.
    drive: i16,
    /// That of the converter.
    noise: Noise,
}

impl Rig {
    fn new(plant: Plant) -> Self {
        Rig { joint: Joint::new(JOINT), plant, drive: 0, noise: Noise::default() }
    }

    /// Makes a millisecond pass. The drive follows from the readings at its beginning, as on the board.
    fn step(&mut self) {
        let reading = Reading {
            potentiometer: self.noise.read(self.plant.potentiometer_volts()),
            current: self.noise.read(self.plant.current_volts()),
        };
        for _ in 0..STEPS {
            self.plant.step(f64::from(self.drive) / f64::from(FULL_DRIVE), 0.001 / f64::from(STEPS));
        }
        self.drive = self.joint.step(reading);
    }

    /// The angle in each of so many milliseconds.
    fn trace(&mut self, milliseconds: usize) -> Vec<f64> {
        let angle = |_| {
            self.step();
            self.plant.degrees()
        };
        (0..milliseconds).map(angle).collect()
    }
}

/// Overshoot in percent of the step, and the largest error over the last half second, in degrees.
fn step_response(plant: Plant, from: f64, to: f64, speed: u8) -> (f64, f64) {
    let mut rig = Rig::new(plant);
    rig.joint.turn_to((from * 10.0).round() as i16, 255);
    rig.trace(1_500);
    rig.joint.turn_to((to * 10.0).round() as i16, speed);
    let trace = rig.trace(2_500);
    let direction = (to - from).signum();
    let beyond = trace.iter().map(|angle| (angle - to) * direction).fold(0.0, f64::max);
    let error = trace[2_000..].iter().map(|angle| (angle - to).abs()).fold(0.0, f64::max);
    (beyond / (to - from).abs() * 100.0, error)
}

/// A load may turn the joint faster than it was to turn, and hold it.
#[test]
fn a_joint_that_is_turned_ahead_to_its_target_has_arrived() {
    for to in [60.0, -60.0] {
        let mut rig = Rig::new(Plant::at(0.0));
        rig.joint.turn_to(to as i16 * 10, 20);
        for percent in 0..=100 {
            rig.plant = Plant::at(to * f64::from(percent) / 100.0);
            rig.plant.surroundings.is_blocked = true;
            rig.trace(2);
        }
        rig.trace(4_000);
        assert_eq!(rig.joint.state(), State::Arrived);
    }
}

#[test]
fn a_step_of_30_degrees() {
    for (from, to) in [(0.0, 30.0), (30.0, 0.0), (-15.0, 15.0), (80.0, 50.0)] {
        for speed in [20, 60, 255] {
            let (overshoot, error) = step_response(Plant::at(from), from, to, speed);
            assert!(overshoot <= 5.0 && error <= 0.3, "{from} to {to} at {speed}: {overshoot} %, {error}");
        }
    }
}

/// A drive that follows the noise of the converter shakes the joint, and with it the robot's feet.
#[test]
fn a_joint_follows_its_converters_noise_little() {
    for (counts, seed) in (1..=4_u8).zip(1..) {
        let counts = f64::from(counts);
        let mut rig = Rig { noise: Noise::new(counts / 1024.0, seed), ..Rig::new(Plant::at(0.0)) };
        rig.joint.turn_to(300, 60);
        let overshoot = rig.trace(2_000).into_iter().fold(0.0, f64::max) - 30.0;
        let (mut squares, mut error) = (0.0, 0.0_f64);
        for _ in 0..10_000 {
            rig.step();
            squares += f64::from(rig.drive).powi(2) / 10_000.0;
            error = error.max((rig.plant.degrees() - 30.0).abs());
        }
        let drive = squares.sqrt() / f64::from(FULL_DRIVE);
        let is_calm = drive <= 0.03 + 0.06 * counts;
        assert!(is_calm && overshoot <= 0.6 && error <= 0.3, "{counts}: {drive}, {overshoot}, {error}");
    }
}

fn surroundings() -> impl Strategy<Value = Surroundings> {
    (6.0..8.4_f64, 0.001..0.06_f64, -2.0..2.0_f64, 0.5..1.5_f64).prop_map(
        |(supply_volts, load_inertia, load_torque, friction)| Surroundings {
            supply_volts,
            load_inertia,
            load_torque,
            friction,
            is_blocked: false,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The load has up to twelve times the inertia, a third of the stall torque either way, and half to one
    /// and a half times the friction; the battery is full or nearly empty.
    #[test]
    fn a_step_in_other_surroundings(surroundings in surroundings(), speed in 20..=255_u8, is_up: bool) {
        let (from, to) = if is_up { (-10.0, 20.0) } else { (20.0, -10.0) };
        let mut plant = Plant::at(from);
        plant.surroundings = surroundings;
        let (overshoot, error) = step_response(plant, from, to, speed);
        prop_assert!(overshoot <= 5.0 && error <= 0.3, "{} %, {}", overshoot, error);
    }

    /// With any orders and any readings of the converter there is no overflow, no drive outside of its range
    /// or beyond an end stop, and no drive in a joint that is off.
    #[test]
    fn any_reading_is_borne(
        orders in prop::collection::vec((any::<i16>(), any::<u8>(), 0..=1023_u16, 0..=1023_u16, 1..300_usize), 1..20),
    ) {
        let mut joint = Joint::new(JOINT);
        for (angle, speed, potentiometer, current, periods) in orders {
            joint.turn_to(angle, speed);
            for _ in 0..periods {
                let drive = joint.step(Reading { potentiometer, current });
                prop_assert!((-FULL_DRIVE..=FULL_DRIVE).contains(&drive));
                let is_on = matches!(joint.state(), State::Moving | State::Arrived);
                prop_assert!(is_on || drive == 0);
                if let Some(angle) = joint.position().map(to_angle) {
                    prop_assert!(angle < 901 || drive <= 0);
                    prop_assert!(angle > -901 || drive >= 0);
                }
            }
        }
    }
}

#[test]
fn a_joint_is_off_until_it_is_told() {
    let mut rig = Rig::new(Plant::at(12.0));
    rig.trace(100);
    assert_eq!(
        (rig.joint.state(), rig.drive, rig.joint.position().map(to_angle)),
        (State::Off, 0, Some(119))
    );
}

#[test]
fn arrived_is_said_when_it_is_so() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.joint.turn_to(300, 60);
    while rig.joint.state() == State::Moving {
        rig.step();
    }
    assert_eq!(rig.joint.state(), State::Arrived);
    assert!((rig.plant.degrees() - 30.0).abs() < 0.6, "{}", rig.plant.degrees());
    rig.joint.turn_to(-300, 60);
    assert_eq!(rig.joint.state(), State::Moving);
    rig.joint.release();
    rig.step();
    assert_eq!((rig.joint.state(), rig.drive), (State::Off, 0));
}

#[test]
fn the_speed_limit_holds() {
    for speed in [10, 30, 60] {
        let mut rig = Rig::new(Plant::at(-60.0));
        rig.joint.turn_to(600, speed);
        let trace = rig.trace(1_500);
        // After the start, over a fifth of a second.
        for pair in trace[200..].windows(200).filter(|pair| pair[199] < 59.0) {
            let seen = (pair[199] - pair[0]) / 0.199;
            assert!((seen - f64::from(speed)).abs() <= 0.1 * f64::from(speed) + 1.0, "{speed}: {seen}");
        }
    }
}

#[test]
fn the_end_stops_hold() {
    let mut rig = Rig::new(Plant::at(70.0));
    rig.joint.turn_to(i16::MAX, 255);
    let farthest = rig.trace(3_000).into_iter().fold(0.0, f64::max);
    assert!((89.7..91.5).contains(&farthest), "{farthest}");
    // A joint that was left outside comes in.
    let mut rig = Rig::new(Plant::at(-110.0));
    rig.joint.turn_to(i16::MIN, 255);
    rig.trace(3_000);
    assert!((rig.plant.degrees() + 90.0).abs() <= 0.3, "{}", rig.plant.degrees());
}

#[test]
fn the_roll_joint_turns_135_degrees_to_either_side() {
    for (order, end) in [(1_800, 135.0), (-1_800, -135.0)] {
        let mut rig = Rig { joint: Joint::new(ROLL), ..Rig::new(Plant::at(0.0)) };
        rig.joint.turn_to(order, 255);
        rig.trace(4_000);
        assert!((rig.plant.degrees() - end).abs() <= 0.5, "{}", rig.plant.degrees());
    }
}

#[test]
fn a_blocked_joint_draws_no_more_than_its_limit_and_stalls() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.plant.surroundings.is_blocked = true;
    rig.joint.turn_to(600, 255);
    let mut periods = 0;
    while rig.joint.state() == State::Moving {
        rig.step();
        periods += 1;
        assert!(periods < 20 || rig.plant.amperes() < 0.85, "{} A after {periods} ms", rig.plant.amperes());
    }
    assert_eq!((rig.joint.state(), rig.drive), (State::Stalled, 0));
    assert!((240..300).contains(&periods), "{periods} ms");
    // Once it is free and gets an order again, it moves.
    rig.plant.surroundings.is_blocked = false;
    rig.joint.turn_to(200, 255);
    rig.trace(2_000);
    assert_eq!(rig.joint.state(), State::Arrived);
    assert!((rig.plant.degrees() - 20.0).abs() <= 0.3, "{}", rig.plant.degrees());
}

#[test]
fn a_joint_that_holds_a_load_has_not_stalled() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.plant.surroundings.load_torque = -3.0;
    rig.joint.turn_to(300, 60);
    rig.trace(60_000);
    assert_eq!(rig.joint.state(), State::Arrived);
    assert!((rig.plant.degrees() - 30.0).abs() <= 0.3, "{}", rig.plant.degrees());
}

/// In a quarter of a second it makes less way than a degree.
#[test]
fn a_joint_that_lifts_a_load_slowly_has_not_stalled() {
    for speed in 1..=8 {
        let mut rig = Rig::new(Plant::at(0.0));
        rig.plant.surroundings.load_torque = -2.0;
        rig.joint.turn_to(100, speed);
        rig.trace(11_000 / usize::from(speed) + 1_000);
        assert_eq!(rig.joint.state(), State::Arrived, "at {speed} degrees a second");
        assert!((rig.plant.degrees() - 10.0).abs() <= 0.3, "{}", rig.plant.degrees());
    }
}

#[test]
fn a_slow_joint_that_is_blocked_stalls() {
    for speed in [1, 2, 4, 8] {
        let mut rig = Rig::new(Plant::at(0.0));
        rig.plant.surroundings.is_blocked = true;
        rig.joint.turn_to(100, speed);
        rig.trace(3_000 / usize::from(speed) + 1_000);
        assert_eq!((rig.joint.state(), rig.drive), (State::Stalled, 0), "at {speed} degrees a second");
    }
}

/// Its motor would get hot, and empty the battery.
#[test]
fn a_joint_that_is_held_near_its_target_gives_way() {
    // The first is a count of the converter off.
    let held = [(3, State::Arrived), (5, State::Moving), (10, State::Moving), (19, State::Moving)];
    for (off, state) in held {
        let mut rig = Rig::new(Plant::at(0.0));
        rig.plant.surroundings.is_blocked = true;
        rig.joint.turn_to(off, 60);
        rig.trace(5_000);
        assert!(rig.plant.amperes() > 0.6, "it tries for a while: {} A", rig.plant.amperes());
        rig.trace(7_000);
        for _ in 0..600 {
            rig.joint.turn_to(off, 60); // a repeated order does not put it off
            rig.trace(100);
            assert!(rig.plant.amperes() <= 0.33, "{} A", rig.plant.amperes());
        }
        assert_eq!(rig.joint.state(), state);
        rig.plant.surroundings.is_blocked = false;
        rig.trace(1_000);
        assert_eq!(rig.joint.state(), State::Arrived);
    }
}

#[test]
fn a_joint_that_has_given_way_lifts_its_load_to_another_target() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.plant.surroundings = Surroundings { is_blocked: true, load_torque: -2.0, ..Surroundings::default() };
    rig.joint.turn_to(10, 60);
    rig.trace(12_000);
    rig.plant.surroundings.is_blocked = false;
    rig.joint.turn_to(300, 60);
    rig.trace(2_000);
    assert_eq!(rig.joint.state(), State::Arrived);
    assert!((rig.plant.degrees() - 30.0).abs() <= 0.3, "{}", rig.plant.degrees());
}

#[test]
fn a_broken_potentiometer_stops_the_motor() {
    for fault in [PotentiometerFault::Open, PotentiometerFault::ShortToSupply] {
        let mut rig = Rig::new(Plant::at(0.0));
        rig.joint.turn_to(600, 60);
        rig.trace(200);
        rig.plant.set_fault(Some(fault));
        rig.step();
        assert_eq!(rig.drive, 0, "at the first bad reading");
        rig.trace(2);
        assert_eq!(rig.joint.state(), State::BrokenPotentiometer);
        rig.trace(50); // the rest of the swing ends
        let angle = rig.plant.degrees();
        rig.joint.turn_to(600, 60);
        rig.trace(10);
        assert_eq!(rig.joint.state(), State::BrokenPotentiometer, "a new order does not help");
        assert_eq!(rig.plant.degrees(), angle);
        rig.plant.set_fault(None);
        rig.joint.turn_to(300, 60);
        rig.trace(2_000);
        assert!((rig.plant.degrees() - 30.0).abs() <= 0.3, "{}", rig.plant.degrees());
    }
}

/// Its readings are plausible, so only the lack of progress shows the fault.
#[test]
fn a_stuck_potentiometer_is_a_stall() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.joint.turn_to(600, 60);
    rig.trace(200);
    rig.plant.set_fault(Some(PotentiometerFault::Stuck));
    rig.trace(700);
    assert_eq!((rig.joint.state(), rig.drive), (State::Stalled, 0));
}

#[test]
fn a_lone_bad_reading_is_passed_over() {
    let mut rig = Rig::new(Plant::at(0.0));
    rig.joint.turn_to(300, 60);
    for period in 0..2_500 {
        if period % 50 == 0 {
            rig.plant.set_fault(Some(PotentiometerFault::Open));
            rig.step();
            rig.step();
            rig.plant.set_fault(None);
        }
        rig.step();
    }
    assert_eq!(rig.joint.state(), State::Arrived);
    assert!((rig.plant.degrees() - 30.0).abs() <= 0.3, "{}", rig.plant.degrees());
}

#[test]
fn a_joint_at_rest_is_left_alone_until_it_is_moved() {
    let mut rig = Rig::new(Plant::at(0.0));
    assert!(rig.joint.is_at_rest(), "it is off");
    rig.joint.turn_to(300, 60);
    let periods = (0..)
        .take_while(|_| !{
            rig.step();
            rig.joint.is_at_rest()
        })
        .count();
    assert!((600..2_000).contains(&periods), "{periods} ms");
    assert!((rig.plant.degrees() - 30.0).abs() <= 0.3);
    let mut watch = |plant: Plant| {
        rig.joint.watch(Reading { potentiometer: counts(plant.potentiometer_volts()), current: 0 });
        rig.joint.is_at_rest()
    };
    assert!(watch(Plant::at(30.0)) && watch(Plant::at(30.1)));
    assert!(!watch(Plant::at(31.0)), "it was moved");
    rig.trace(200);
    assert!(rig.joint.is_at_rest(), "and has found back");
    let mut broken = Plant::at(30.0);
    broken.set_fault(Some(PotentiometerFault::Open));
    rig.joint.watch(Reading { potentiometer: counts(broken.potentiometer_volts()), current: 0 });
    assert!(!rig.joint.is_at_rest());
    rig.joint.turn_to(300, 60);
    assert!(!rig.joint.is_at_rest(), "it was told to");
}
