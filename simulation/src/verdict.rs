//! Whether a robot that has run did as it should.

use crate::course::Course;
use crate::hardware::CLOCK_HZ;
use crate::robot::Robot;
use crate::run::Run;
use crate::walker::Violation;

/// The number of modules that are named, of those that do not know what they are.
const MISTAKEN_NAMED: usize = 5;

/// The least speed of a robot that walks, in m/s: a module's half in 5 s.
const WALKS: f64 = 0.084 / 5.0;

/// A robot so short that this is less has to come half its length in so many seconds.
const HALF_ITS_LENGTH: f64 = 20.0;

/// The time in which a robot's modules learn their types, and legs roll upright, in s.
const RISES: f64 = 3.0;

/// A robot that was told to walk for less than this, in s, is not judged by how far it has come.
const JUDGED_AFTER: f64 = 8.0;

/// The faults of a robot in a run, a line each. If the ground is not level and bare, the robot is not judged
/// by how far it has come.
pub fn faults(run: &Run<impl Robot>, is_level: bool) -> Vec<String> {
    let Run { robot, observer, .. } = run;
    let modules = robot.wiring().modules();
    let mut faults = robot.crashes();
    faults.extend(robot.trouble().map(ToString::to_string));
    faults.extend(run.impossible.iter().map(ToString::to_string));
    let unheard = observer.unheard.iter();
    faults.extend(unheard.map(|order| {
        format!(
            "nobody heard {} after {} s: no program ran there; give it later",
            order.change,
            order.seconds()
        )
    }));
    let unasked = observer.unasked().iter();
    faults.extend(unasked.map(|event| {
        format!(
            "{} after {:.2} s by the robot itself, which was not ordered to take another shape",
            event.change,
            event.seconds()
        )
    }));
    let wired = &observer.audible;
    let mistaken: Vec<usize> = (0..modules).filter(|&module| !robot.is_right_by(wired, module)).collect();
    for &module in mistaken.iter().take(MISTAKEN_NAMED) {
        let wiring = wired.neighbours(module);
        let seen = robot.status(module).map(|status| (status.module_type, status.neighbours()));
        faults.push(format!("module {module} is wired {wiring:?}, but sees {seen:?}"));
    }
    if let more @ 1.. = mistaken.len().saturating_sub(MISTAKEN_NAMED) {
        faults.push(format!("{more} more modules do not see their wiring"));
    }
    if !(0..modules).any(|module| robot.is_on(module)) {
        faults.push("no module has power".into());
    } else if !observer.gait.is_led() {
        faults.push(
            "nobody leads: most gaits need a head, some need a ring or a single module; check the types, or \
             order another gait, as the files in robots/gaits do"
                .into(),
        );
    } else if observer.hops.delivered == 0 && modules > 1 {
        faults.push("no hormone was delivered: run longer, or give the head a module to send to".into());
    }
    let seconds = |cycles: u64| cycles as f64 / f64::from(CLOCK_HZ);
    if let Some(Violation { at, module, wrong }) = observer.gait.first_violation() {
        faults.push(format!(
            "the gait was wrong {} times; first, after {:.2} s, module {module} {wrong}",
            observer.gait.violations(),
            seconds(at)
        ));
    }
    // A world that has broken is to be mended first: that run comes no further.
    if robot.trouble().is_none()
        && let Some((unjudged, until)) = observer.gait.unjudged(robot.now())
    {
        faults.push(format!(
            "{unjudged} modules were not judged, because they still had time to come right: run for more \
             than {:.1} s",
            seconds(until)
        ));
    }
    let Course { ordered_at, is_undisturbed } = observer.course;
    // Legs walk from power-up on, whatever is ordered.
    let told_at = if observer.gait.has_pairs_of_legs() { Some(0) } else { ordered_at };
    if let Some(motion) = robot.motion()
        && is_level
        && is_undisturbed
        && let Some(told_at) = told_at
        && let Some(least) = least_way(motion.length, seconds(robot.now() - told_at))
        && motion.distance < least
    {
        faults.push(format!(
            "the robot does not walk: it moved {:.3} m ahead, but must move at least {least:.3} m",
            motion.distance
        ));
    }
    // Where frames are lost or modules come and go hormones may be given up; what the modules made of it is
    // counted above.
    if let lost @ 1.. = observer.hops.lost_without_cause() {
        faults.push(format!("{lost} hormones were lost"));
    }
    faults
}

/// How far a robot of this length, in m, has to come at least in so many seconds of walking; `None` where
/// that is not asked.
fn least_way(length: f64, walked: f64) -> Option<f64> {
    (walked >= JUDGED_AFTER).then(|| WALKS.min(length / 2.0 / HALF_ITS_LENGTH) * (walked - RISES))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_robot_has_to_come_17_mm_a_second_and_a_short_one_half_its_length_in_20_s() {
        for (length, walked, millimetres) in [
            (2.0, 7.9, None),
            (2.0, 8.0, Some(84)),
            (2.0, 20.0, Some(286)),
            (0.672, 20.0, Some(286)),
            (0.4, 20.0, Some(170)),
        ] {
            let least = least_way(length, walked).map(|least| (least * 1000.0).round() as i32);
            assert_eq!(least, millimetres, "{length} m, {walked} s");
        }
    }
}
