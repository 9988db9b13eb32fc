//! Docking: latches on their plant, and the search for a neighbour's dock.

use glam::{DAffine3, DQuat, DVec3};
use plants::dock::{Latch, catches, reflected};
use plants::geometry::{Dock, attached, before};
use proptest::prelude::*;
use simulation::Random;
use tasks::docking::guidance::{Guidance, Line, Next};
use tasks::docking::latch::{DockingMotor, End, EndSwitches, Failure, PERIOD_MS, State};

/// The limit with which the board compares the motor's current, in A.
const LIMIT: f64 = 0.5;

/// Steps a motor on its latch until it is off. Returns for how long it was on, in ms.
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

/// A client that repeats its order burns no motor.
#[test]
fn an_order_that_is_repeated_does_not_put_off_the_end_of_a_jam() {
    let (mut motor, mut latch) = (DockingMotor::new(), Latch::at(0.0));
    latch.blocked_at = Some(0.5);
    let mut periods = 0;
    loop {
        motor.move_to(End::Latched);
        let switches = EndSwitches { is_released: latch.is_released(), is_latched: latch.is_latched() };
        if motor.step(switches, latch.amperes() > LIMIT).is_none() {
            break;
        }
        latch.step(1, f64::from(PERIOD_MS) / 1000.0);
        periods += 1;
        assert!(periods < 500 / PERIOD_MS, "the motor is still on");
    }
    assert_eq!(motor.state(), State::Failed(Failure::Jammed));
}

/// At the end of its travel the latch stands still, and the current shows it.
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

/// How fast joints turn in a search, in 0.1 degree a period.
const TURN: f64 = 30.0 * 10.0 * PERIOD_MS as f64 / 1000.0;

/// The most periods of a search, which make 4 s.
const MOST_PERIODS: u32 = 4_000 / PERIOD_MS as u32;

/// A module at an end of a chain: the angles of the joint behind its dock and of the other joint that bends
/// it, in 0.1 degree.
#[derive(Clone, Copy)]
struct Bend {
    behind: f64,
    opposite: f64,
}

/// Both ends of a chain that has curled to a ring. Everything but their joints is fixed.
struct Gap {
    tail: Bend,
    head: Bend,
    /// Where the head's Back lies, seen from the tail's Front.
    head_lies: DAffine3,
}

impl Gap {
    /// Ends that miss each other by `miss`.
    fn new(miss: DAffine3) -> Self {
        let end = Bend { behind: 300.0, opposite: 300.0 };
        let mut gap = Gap { tail: end, head: end, head_lies: DAffine3::IDENTITY };
        let fits = gap.tail_dock() * attached(Dock::Back, Dock::Front) * miss;
        gap.head_lies = fits * gap.head_dock().inverse();
        gap
    }

    fn tail_dock(&self) -> DAffine3 {
        let angles = [self.tail.opposite / 10.0, 0.0, self.tail.behind / 10.0];
        Dock::Front.in_module(angles).inverse() * Dock::Back.in_module(angles)
    }

    fn head_dock(&self) -> DAffine3 {
        let angles = [self.head.behind / 10.0, 0.0, self.head.opposite / 10.0];
        self.head_lies * Dock::Back.in_module(angles).inverse() * Dock::Front.in_module(angles)
    }

    /// The distance of the docks in mm, and their angle in degrees.
    fn lies(&self) -> Option<(f64, f64)> {
        before((Dock::Back, self.tail_dock()), (Dock::Front, self.head_dock()))
    }

    fn end(&mut self, is_tail: bool) -> &mut Bend {
        if is_tail { &mut self.tail } else { &mut self.head }
    }

    /// One of the ends searches. Returns whether it latches.
    fn search(&mut self, is_tail: bool, random: &mut Random) -> bool {
        let mut guidance = Guidance::new();
        let Bend { behind, opposite } = *self.end(is_tail);
        let mut targets = [behind, opposite];
        for _ in 0..MOST_PERIODS {
            let Bend { behind, opposite } = self.end(is_tail);
            let is_there = (*behind - targets[0]).abs() < 3.0;
            *behind += (targets[0] - *behind).clamp(-TURN, TURN);
            *opposite += (targets[1] - *opposite).clamp(-TURN, TURN);
            // Both angles as the converter reads them.
            let [angle, beyond] = [*behind, *opposite].map(|angle| (angle / 2.94).round() * 2.94);
            let noise = random.between(-2.5, 2.5) as i16;
            let seen = self.lies().map_or(0, |(millimetres, degrees)| reflected(millimetres, degrees));
            match guidance.step(angle as i16, seen.saturating_add_signed(noise), is_there) {
                Next::GoOn => {}
                Next::Move(line, to) => {
                    targets[0] = f64::from(to);
                    if line == Line::Shift {
                        targets[1] = beyond + angle - f64::from(to);
                    }
                }
                Next::Latch => return true,
                Next::Lost => return false,
            }
        }
        panic!("a search that does not end");
    }
}

/// A miss of so many millimetres along the tail's Back, across it and upwards, and bent, tilted and twisted
/// by so many degrees.
fn missed(millimetres: [f64; 3], [bent, tilted, twisted]: [f64; 3]) -> DAffine3 {
    let [along, across, up] = millimetres;
    let turn = DQuat::from_rotation_y(bent.to_radians())
        * DQuat::from_rotation_z(tilted.to_radians())
        * DQuat::from_rotation_x(twisted.to_radians());
    // Both modules bend about y, and z lies across.
    DAffine3::from_rotation_translation(turn, DVec3::new(along, up, across))
}

/// The ends miss each other by up to 20 mm along and across, and by 10 degrees. In the directions in which no
/// joint can turn them they miss by as much as the ground allows. Tail and head in turn bring them together.
#[test]
fn ends_that_miss_each_other_come_together() {
    let mut random = Random::new(1);
    let mut searches = [0; 8];
    for _ in 0..2_000 {
        let mut drawn = |most: f64| random.between(-most, most);
        let miss = missed([drawn(20.0), drawn(20.0), drawn(4.0)], [drawn(10.0), drawn(2.0), drawn(2.0)]);
        let mut gap = Gap::new(miss);
        let latches = (0..8).position(|number| gap.search(number % 2 == 0, &mut random));
        let searched = latches.unwrap_or_else(|| panic!("{miss:?} becomes {:?}", gap.lies()));
        let (millimetres, degrees) = gap.lies().expect("they face each other");
        assert!(catches(millimetres, degrees), "{millimetres} mm, {degrees} degrees");
        searches[searched] += 1;
    }
    println!("searches that it took, 1 to 8: {searches:?}");
    assert!(searches[0] + searches[1] > 1_600, "{searches:?}");
}

/// One end alone leaves a gap that it can't close.
#[test]
fn one_end_alone_is_not_enough() {
    let mut gap = Gap::new(missed([-20.0, 0.0, 0.0], [0.0; 3]));
    let mut random = Random::new(1);
    assert!((0..8).all(|_| !gap.search(true, &mut random)));
    assert!((0..4).any(|number| gap.search(number % 2 != 0, &mut random)));
}

/// Without a reflection no joint is moved.
#[test]
fn a_dock_out_of_reach_is_lost_at_once() {
    let far = Gap::new(missed([-60.0, 40.0, 0.0], [30.0, 0.0, 0.0]));
    let (millimetres, degrees) = far.lies().expect("they face each other");
    let seen = reflected(millimetres, degrees);
    assert_eq!(Guidance::new().step(300, seen, true), Next::Lost);
    assert_eq!(Guidance::new().step(300, 7, true), Next::Lost);
    assert_eq!(Guidance::new().step(300, 8, true), Next::Move(Line::Turn, 420));
}

/// If something is dragged along, the best angle on the way back differs from that on the way there; the
/// search still finds it. Here the dock before a joint at 0 lags behind its turns by 3 degrees.
#[test]
fn what_is_dragged_along_does_not_mislead_the_search() {
    for facing in (-90..=90_i16).step_by(5) {
        let mut dragged = 0_i16;
        let mut seen = 0;
        turned(|angle| {
            dragged = dragged.clamp(angle - 15, angle + 15);
            seen = 480_u16.saturating_sub(4 * dragged.abs_diff(facing)).max(8);
            seen
        });
        assert!(seen >= 480 - 4 * 5, "{facing}: {seen}");
    }
}

/// A dock that is near enough as the joint passes by is latched at once: on the way back it may not be near
/// enough.
#[test]
fn a_search_stops_where_it_is_near_enough() {
    let mut guidance = Guidance::new();
    assert_eq!(guidance.step(0, 400, true), Next::Move(Line::Turn, 120));
    assert_eq!(guidance.step(30, 600, false), Next::GoOn);
    assert_eq!(guidance.step(40, 590, false), Next::Move(Line::Turn, 40));
    assert_eq!(guidance.step(40, 590, false), Next::GoOn);
    assert_eq!(guidance.step(40, 590, true), Next::Latch);
}

/// The angles at which a search from 0 looked, with the readings of `seen`, until it shifts.
fn turned(mut seen: impl FnMut(i16) -> u16) -> Vec<i16> {
    let (mut angle, mut target, mut looked) = (0_i16, 0_i16, Vec::new());
    let mut guidance = Guidance::new();
    loop {
        looked.push(angle);
        match guidance.step(angle, seen(angle), angle == target) {
            Next::Move(Line::Turn, to) => target = to,
            Next::GoOn => {}
            _ => return looked,
        }
        angle += (target - angle).signum();
        assert!(looked.len() < 1_000, "a search that does not end");
    }
}

/// The reflection falls off evenly to both sides, so that each angle differs from the next.
#[test]
fn a_turn_ends_close_to_where_most_was_seen() {
    for facing in -110..=110_i16 {
        let looked = turned(|angle| 480_u16.saturating_sub(4 * angle.abs_diff(facing)).max(8));
        let last = looked.last().expect("it begins somewhere");
        assert!(last.abs_diff(facing) <= 2, "{last} for {facing}");
    }
}

#[test]
fn a_turn_that_finds_no_more_goes_no_further_than_its_reach() {
    for seen in [|angle: i16| (300 + angle) as u16, |angle: i16| (300 - angle) as u16, |_| 300] {
        let looked = turned(seen);
        assert!(looked.iter().all(|angle| angle.abs() <= 120));
    }
    let last = |seen: fn(i16) -> u16| turned(seen).last().copied().expect("it begins somewhere");
    assert!(last(|angle| (300 + angle) as u16) >= 90);
    assert!(last(|angle| (300 - angle) as u16) <= -90);
    assert!(last(|_| 300).abs() <= 30);
}

proptest! {
    /// With any readings, a search whose joint comes to its targets ends, and not far from where it began.
    #[test]
    fn a_search_ends(start in -900..=900_i16, readings in prop::collection::vec(0..=1023_u16, 50)) {
        let mut guidance = Guidance::new();
        let mut angle = start;
        let mut ended = false;
        for reading in readings {
            match guidance.step(angle, reading, true) {
                Next::GoOn => {}
                Next::Move(_, to) => {
                    prop_assert!((to - start).abs() <= 2 * (120 + 30));
                    angle = to;
                }
                Next::Latch | Next::Lost => { ended = true; break }
            }
        }
        prop_assert!(ended);
    }
}
