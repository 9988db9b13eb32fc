//! The wave of the laboratory's caterpillar: in step s of 20 Motor0 is at 20 cos(s pi / 10) degrees and
//! Motor2, half a module behind it, at 20 cos((s + 2) pi / 10).

use super::posture;

motion![
    posture(20, 0, 16),
    posture(19, 0, 12),
    posture(16, 0, 6),
    posture(12, 0, 0),
    posture(6, 0, -6),
    posture(0, 0, -12),
    posture(-6, 0, -16),
    posture(-12, 0, -19),
    posture(-16, 0, -20),
    posture(-19, 0, -19),
    posture(-20, 0, -16),
    posture(-19, 0, -12),
    posture(-16, 0, -6),
    posture(-12, 0, 0),
    posture(-6, 0, 6),
    posture(0, 0, 12),
    posture(6, 0, 16),
    posture(12, 0, 19),
    posture(16, 0, 20),
    posture(19, 0, 19)
];
