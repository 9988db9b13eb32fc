//! Which of several orders a body follows, by what its modules do.

use hormone::gait::Gait;

use super::{Order, beat};

/// What the modules of a body do.
pub struct Shown {
    /// The name of the gait by which one of them says that it walks.
    pub says: Option<u8>,
    /// Whether any of them acts.
    pub acts: bool,
    /// How long the last beat took, in cycles.
    pub beat: Option<u64>,
}

impl Shown {
    /// Which of these orders the body follows; the first one where nothing shows another. By a gait that is
    /// led its modules act. A body that already has the shape that a gait makes of it may walk by the gait
    /// that follows, as `then` says.
    pub fn tells(
        &self,
        orders: &[Order],
        is_led: impl Fn(&Gait) -> bool,
        then: impl Fn(&Gait) -> Option<Gait>,
    ) -> usize {
        let gaits: Vec<Option<Gait>> = orders.iter().map(|order| order.gait()).collect();
        let stop = gaits.iter().position(Option::is_none);
        let rests = !self.acts && stop.is_some();
        if rests && stop == Some(0) {
            return 0;
        }
        let may_walk = |gait: &Gait| !rests || !is_led(gait);
        let walks = || (0..gaits.len()).filter_map(|it| Some((it, gaits[it].filter(may_walk)?)));
        let may_be = |(it, gait): (usize, Gait)| [Some(gait), then(&gait)].map(|gait| Some((it, gait?)));
        let said = walks().flat_map(may_be).flatten().filter(|(_, gait)| Some(gait.name) == self.says);
        let apart = |gait: &Gait| self.beat.map(|it| it.abs_diff(beat(gait)));
        let nearest = said.min_by_key(|(_, gait)| apart(gait)).map(|(order, _)| order);
        let else_it = if rests { stop } else { walks().next().map(|(order, _)| order) };
        nearest.or(else_it).unwrap_or(0)
    }
}
