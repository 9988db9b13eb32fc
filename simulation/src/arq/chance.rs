//! A link on which things happen by chance.

use tasks::dock::Dock;
use tasks::link::port::RETRY_LIMIT;

use super::line::{End, Event, Link, Number, Violation};
use crate::random::Random;

/// How often each thing happens when it can: probabilities. By default nothing goes wrong.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rates {
    /// A frame is lost.
    pub lose: f64,
    /// One bit of it is wrong.
    pub corrupt: f64,
    /// It arrives twice.
    pub twice: f64,
    /// The receiver has no room for its message.
    pub no_room: f64,
    /// An end hears what it has sent.
    pub reflect: f64,
    /// A sender's time is up although something is still under way to it.
    pub early_time_out: f64,
    /// A sender takes up its next message in place of the one under way.
    pub supersede: f64,
    /// An end loses its memory.
    pub reset: f64,
}

/// The fates of the messages.
#[derive(Debug, Default)]
pub struct Counts {
    /// Messages that arrived, as their senders know.
    pub delivered: u64,
    /// Messages whose sender was told that it gave up.
    pub gave_up: u64,
    /// Messages taken by receivers.
    pub received: u64,
    /// Outcomes that must not happen.
    pub violations: Vec<Violation>,
}

/// A million messages over links that lose each frame with probability `loss`: over twenty pairs of a Back
/// and a Front, half of the messages each way.
pub fn million_at_loss(loss: f64) -> Counts {
    let rates = Rates { lose: loss, ..Rates::default() };
    let mut all = Counts::default();
    for pair in 0..20 {
        let end = |dock, seed| End::new(dock, seed, RETRY_LIMIT);
        let mut link = Link::new([end(Dock::Back, 7 + pair), end(Dock::Front, 9)], 4);
        let counts = drive(&mut link, rates, pair.into(), 25_000);
        all.delivered += counts.delivered;
        all.gave_up += counts.gave_up;
        all.received += counts.received;
        all.violations.extend(counts.violations);
    }
    all
}

/// Runs until each end has sent `messages`.
pub fn drive(link: &mut Link, rates: Rates, seed: u64, messages: Number) -> Counts {
    let mut random = Random::new(seed);
    let mut counts = Counts::default();
    while link.ends.iter().any(|end| end.next < messages || end.is_busy()) {
        match step(link, rates, &mut random, messages) {
            Ok(Event::Nothing) => {}
            Ok(Event::Received) => counts.received += 1,
            Ok(Event::Delivered) => counts.delivered += 1,
            Ok(Event::GaveUp) => counts.gave_up += 1,
            Err(violation) => counts.violations.push(violation),
        }
    }
    counts
}

/// Lets something happen at one of the ends.
fn step(link: &mut Link, rates: Rates, random: &mut Random, messages: Number) -> Result<Event, Violation> {
    let end = random.below(2);
    if random.chance(rates.reset) {
        link.reset(end);
    } else if random.chance(rates.reflect) {
        return link.reflect(end);
    } else if let Some(mut wire) = link.ends[end].line.pop_front() {
        if random.chance(rates.lose) {
            return Ok(Event::Nothing);
        }
        if random.chance(rates.twice) {
            link.ends[end].line.push_front(wire.clone());
        }
        if random.chance(rates.corrupt) {
            let place = random.below(wire.len());
            wire[place] ^= 1 << random.below(8);
        }
        let room = !random.chance(rates.no_room);
        return link.arrive(end, &wire, room);
    } else if link.ends[end].is_busy() {
        let idle = link.ends[1 - end].line.is_empty();
        if link.ends[end].next < messages && random.chance(rates.supersede) {
            link.start(end);
        } else if idle || random.chance(rates.early_time_out) {
            return Ok(link.time_out(end));
        }
    } else if link.ends[end].next < messages {
        link.start(end);
    }
    Ok(Event::Nothing)
}
