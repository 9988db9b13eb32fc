//! Docking: latches on their plant, and the search for a neighbour's dock.

use plants::dock::{Latch, reflected};
use proptest::prelude::*;
use tasks::docking::guidance::{Guidance, Next};
use tasks::docking::latch::{DockingMotor, End, EndSwitches, Failure, PERIOD_MS, State};

/// What the board compares the motor's current with, in A.
const LIMIT: f64 = 0.5;

/// Steps a motor on its latch until it is off; returns for how long it was on, in ms.
fn run(motor: &mut DockingMotor, latch: &mut Latch) -> u32 {
    let mut milliseconds = 0;
    loop {
        let switches = EndSwitches { is_released: latch.is_released(), is_latched: latch.is_latched() };
        let Some(end) = motor.step(switches, latch.amperes() > LIMIT) else { return milliseconds };
        let direction = if end == End::Latched { 1 } else { -1 };
        latch.step(direction, f64::from(PERIOD_MS) / 1000.0);
        milliseconds += u32::from(PERIOD_MS);
    }
}

#[test]
fn a_latch_goes_from_end_to_end() {
    let (mut motor, mut latch) = (DockingMotor::new(), Latch::at(0.4));
    run(&mut motor, &mut latch);
    assert_eq!(motor.state(), State::Between);
    for end in [End::Latched, End::Released, End::Latched] {
        motor.move_to(end);
        run(&mut motor, &mut latch);
        assert_eq!(motor.state(), State::At(end));
    }
    motor.move_to(End::Latched);
    assert_eq!(run(&mut motor, &mut latch), 0, "it is there");
}

#[test]
fn what_is_in_the_way_stops_the_motor() {
    let (mut motor, mut latch) = (DockingMotor::new(), Latch::at(0.0));
    latch.blocked_at = Some(0.5);
    motor.move_to(End::Latched);
    assert!(run(&mut motor, &mut latch) < 500);
    assert_eq!(motor.state(), State::Failed(Failure::Jammed));
    motor.move_to(End::Released);
    run(&mut motor, &mut latch);
    assert_eq!(motor.state(), State::At(End::Released));
}

/// At the end of its way the latch stands still, and the current tells.
#[test]
fn a_broken_switch_does_not_burn_the_motor() {
    let (mut motor, mut latch) = (DockingMotor::new(), Latch::at(0.0));
    latch.switch_is_broken = true;
    motor.move_to(End::Latched);
    assert!(run(&mut motor, &mut latch) < 1_000);
    assert_eq!(motor.state(), State::Failed(Failure::Jammed));
}

#[test]
fn a_motor_without_a_latch_is_given_up() {
    let mut motor = DockingMotor::new();
    motor.move_to(End::Latched);
    let nothing = EndSwitches { is_released: false, is_latched: false };
    let periods = (0..).take_while(|_| motor.step(nothing, false).is_some()).count();
    assert_eq!(periods, usize::from(2_000 / PERIOD_MS));
    assert_eq!(motor.state(), State::Failed(Failure::TimedOut));
}

/// What a dock must reflect to be near enough to latch.
const NEAR: u16 = 500;

/// Searches for a dock `millimetres` away that the joint faces at `facing`. Returns how it ended, and the
/// angle then.
fn search(start: i16, facing: i16, millimetres: f64, mut noise: impl FnMut() -> i16) -> (Next, i16) {
    let mut angle = start;
    let mut guidance = Guidance::new(start, NEAR);
    for _ in 0..50 {
        let seen = reflected(millimetres, f64::from(angle - facing) / 10.0);
        match guidance.step(seen.saturating_add_signed(noise())) {
            Next::Turn(to) => angle = to,
            end => return (end, angle),
        }
    }
    panic!("a search that does not end");
}

#[test]
fn a_dock_within_reach_is_found() {
    for askew in -150..=150 {
        for millimetres in [0.0, 3.0, 8.0] {
            let (end, angle) = search(200, 200 + askew, millimetres, || 0);
            assert_eq!(end, Next::Latch, "{askew} {millimetres}");
            assert!((angle - 200 - askew).abs() <= 20, "{askew} {millimetres}: {angle}");
        }
    }
}

/// What is reflected falls off evenly to both sides, so that each turn is told from the next.
#[test]
fn a_search_ends_where_most_was_seen() {
    for facing in -100..=100_i16 {
        let seen = |angle: i16| 900_u16.saturating_sub(4 * angle.abs_diff(facing));
        let (mut angle, mut looked) = (0, vec![0]);
        let mut guidance = Guidance::new(0, NEAR);
        while let Next::Turn(to) = guidance.step(seen(angle)) {
            angle = to;
            looked.push(to);
            assert!(looked.len() < 50, "a search that does not end");
        }
        let best = looked.iter().map(|angle| seen(*angle)).max();
        assert_eq!(Some(seen(angle)), best, "{facing}");
    }
}

#[test]
fn a_search_that_does_better_with_each_turn_ends() {
    let mut guidance = Guidance::new(0, u16::MAX);
    let turns = (1..100).take_while(|turn| matches!(guidance.step(9 * turn), Next::Turn(_))).count();
    assert_eq!(turns, 39);
}

#[test]
fn a_dock_out_of_reach_is_not() {
    for askew in [-900, -300, 0, 100, 900] {
        assert_eq!(search(0, askew, 40.0, || 0).0, Next::Lost);
    }
    assert_eq!(search(0, 450, 0.0, || 0).0, Next::Lost);
}

proptest! {
    #[test]
    fn noise_does_not_mislead_the_search(askew in -120..=120_i16, noise in prop::collection::vec(-2..=2_i16, 50)) {
        let mut noise = noise.into_iter().cycle();
        let (end, angle) = search(0, askew, 3.0, || noise.next().unwrap_or(0));
        prop_assert_eq!(end, Next::Latch);
        prop_assert!((angle - askew).abs() <= 30, "{}", angle);
    }

    /// Whatever is read, a search ends, and not far from where it began.
    #[test]
    fn a_search_ends(start in -900..=900_i16, readings in prop::collection::vec(0..=1023_u16, 50)) {
        let mut guidance = Guidance::new(start, NEAR);
        let mut ended = false;
        for reading in readings {
            match guidance.step(reading) {
                Next::Turn(angle) => prop_assert!((angle - start).abs() <= 41 * 32),
                Next::Latch | Next::Lost => { ended = true; break }
            }
        }
        prop_assert!(ended);
    }
}
