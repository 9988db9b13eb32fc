//! Holding of a leg that lies on its back: the foot is pressed down to the other side than in
//! [`holding`](super::holding).

use super::posture;

motion![
    posture(20, 110, 18),
    posture(20, 110, 9),
    posture(20, 110, 0),
    posture(20, 110, -9),
    posture(20, 110, -18)
];
