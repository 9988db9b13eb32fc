//! The motion of a robot.

/// How a robot has moved since the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// How far its middle has moved ahead, in m: in the direction in which module 0 faced at the beginning.
    pub distance: f64,
    /// How far it has moved to the left, in m.
    pub sideways: f64,
    /// How far it has turned to the left, in degrees: see [`turned`].
    pub heading: f64,
    /// The length of the robot at the beginning, in the direction in which module 0 faced, in m.
    pub length: f64,
    /// The mean speed at which the parts that bear the robot slide on the ground, weighted by the load that
    /// each bears, over the robot's mean speed. Infinite for a robot that has not moved.
    pub slip: f64,
}

/// How far the axes of a robot's parts have turned to the left since they were `start`, in degrees. Each pair
/// is an axis as seen from above. `last` is the result of a short while ago.
///
/// It is the mean of axes without a sign, weighted by their lengths as seen from above (Mardia and Jupp,
/// 2000, section 1.1: angles are doubled). So neither a robot on its back nor a ring that rolls has turned.
/// `last` decides which of the two directions of the mean is meant: the angle continues past 180 degrees.
pub fn turned(start: &[[f64; 2]], now: &[[f64; 2]], last: f64) -> f64 {
    let doubled = start.iter().zip(now).map(|([x, y], [to_x, to_y])| {
        let [along, across] = [x * to_x + y * to_y, x * to_y - y * to_x];
        let length = along.hypot(across).max(f64::MIN_POSITIVE);
        [(along * along - across * across) / length, 2.0 * along * across / length]
    });
    let [along, across] = doubled.fold([0.0; 2], |[a, b], [along, across]| [a + along, b + across]);
    let direction = across.atan2(along).to_degrees() / 2.0;
    last + (direction - last + 90.0).rem_euclid(180.0) - 90.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// The axes of `parts`, turned by `turn`, as seen from above.
    fn axes(parts: &[DMat3], turn: DMat3) -> Vec<[f64; 2]> {
        let axes =
            parts.iter().flat_map(|part| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * *part * axis));
        axes.map(|axis| [axis.x, axis.y]).collect()
    }

    #[test]
    fn a_body_turns_on_past_a_whole_turn_on_its_feet_and_on_its_back() {
        let parts = [0.0, 20.0, -20.0].map(|degrees: f64| DMat3::from_rotation_z(degrees.to_radians()));
        let start = axes(&parts, DMat3::IDENTITY);
        for over in [0.0, 180.0_f64] {
            let over = DMat3::from_rotation_x(over.to_radians());
            let mut heading = 0.0;
            for degrees in 0..=500 {
                let turn = DMat3::from_rotation_z(f64::from(degrees).to_radians());
                heading = turned(&start, &axes(&parts, turn * over), heading);
                assert!((heading - f64::from(degrees)).abs() < 1e-9, "{heading} at {degrees}");
            }
        }
    }

    /// Twice the heading is the direction of a sum of vectors, one for each axis: as long as the axis was,
    /// times as long as it is.
    #[test]
    fn a_longer_axis_counts_for_more() {
        let turn = DMat3::from_rotation_z(40.0_f64.to_radians());
        let long = turn * DVec3::X * 3.0;
        let heading = turned(&[[1.0, 0.0], [3.0, 0.0]], &[[1.0, 0.0], [long.x, long.y]], 0.0);
        let (sin, cos) = 80.0_f64.to_radians().sin_cos();
        let expected = (9.0 * sin).atan2(1.0 + 9.0 * cos).to_degrees() / 2.0;
        assert!((heading - expected).abs() < 1e-9, "{heading}, not {expected}");
    }

    #[test]
    fn a_ring_that_rolls_does_not_turn() {
        let parts = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0]
            .map(|degrees: f64| DMat3::from_rotation_y(degrees.to_radians()));
        let start = axes(&parts, DMat3::IDENTITY);
        for degrees in 0..720 {
            let rolled = axes(&parts, DMat3::from_rotation_y(f64::from(degrees).to_radians()));
            assert!(turned(&start, &rolled, 0.0).abs() < 1e-9, "{degrees}");
        }
    }
}
