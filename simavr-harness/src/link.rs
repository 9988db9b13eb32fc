//! One direction of the link between two docks: decides which of the bytes sent arrive.

use std::collections::BTreeSet;

use simulation::Random;

/// The faults of a link. By default there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability that a byte is lost.
    pub byte_loss: f64,
    /// Probability that a byte arrives with one wrong bit.
    pub byte_noise: f64,
    /// Probability that a frame is lost whole: the bytes up to a 0, and that 0.
    pub frame_loss: f64,
    /// The frames, counted from 0, that are lost in any case.
    pub lost_frames: BTreeSet<u64>,
}

/// What a direction of a link has carried since it was joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    pub bytes: u64,
    pub lost_bytes: u64,
    /// Frames begun. A 0 without bytes before it begins no frame.
    pub frames: u64,
    /// The frames lost whole.
    pub lost_frames: u64,
}

/// One direction of a link.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    pub faults: Faults,
    random: Random,
    frame: Frame,
    counts: LinkCounts,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Frame {
    Between,
    Carried,
    Lost,
}

/// The byte that ends a frame.
const DELIMITER: u8 = 0;

impl Channel {
    pub fn new(faults: Faults, random: Random) -> Self {
        Self { faults, random, frame: Frame::Between, counts: LinkCounts::default() }
    }

    pub fn counts(&self) -> LinkCounts {
        self.counts
    }

    /// The byte that arrives when `byte` is sent; `None` if it is lost.
    pub fn carry(&mut self, byte: u8) -> Option<u8> {
        if self.frame == Frame::Between && byte != DELIMITER {
            self.frame = self.begin_frame();
        }
        let arrives = self.frame != Frame::Lost && !self.random.chance(self.faults.byte_loss);
        self.counts.bytes += 1;
        self.counts.lost_bytes += u64::from(!arrives);
        if byte == DELIMITER {
            self.frame = Frame::Between;
        }
        let noise = self.random.chance(self.faults.byte_noise);
        let wrong = if noise { 1 << (self.random.next_u64() & 7) } else { 0 };
        arrives.then_some(byte ^ wrong)
    }

    fn begin_frame(&mut self) -> Frame {
        let number = self.counts.frames;
        self.counts.frames += 1;
        let chance = self.random.chance(self.faults.frame_loss);
        if chance || self.faults.lost_frames.contains(&number) {
            self.counts.lost_frames += 1;
            Frame::Lost
        } else {
            Frame::Carried
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes that arrive of frames 1 1 0, 2 2 0, 3 3 0, ...
    fn arrivals(faults: Faults, frames: u8) -> (Vec<u8>, LinkCounts) {
        let mut channel = Channel::new(faults, Random::new(5));
        let sent = (1..=frames).flat_map(|number| [number, number, 0]);
        let arrived = sent.filter_map(|byte| channel.carry(byte)).collect();
        (arrived, channel.counts())
    }

    #[test]
    fn a_good_link_carries_all() {
        let (arrived, counts) = arrivals(Faults::default(), 2);
        assert_eq!(arrived, [1, 1, 0, 2, 2, 0]);
        assert_eq!(counts, LinkCounts { bytes: 6, frames: 2, ..LinkCounts::default() });
    }

    #[test]
    fn the_frame_named_is_lost_whole() {
        let faults = Faults { lost_frames: [1].into(), ..Faults::default() };
        let (arrived, counts) = arrivals(faults, 3);
        assert_eq!(arrived, [1, 1, 0, 3, 3, 0]);
        assert_eq!(counts, LinkCounts { bytes: 9, lost_bytes: 3, frames: 3, lost_frames: 1 });
    }

    #[test]
    fn delimiters_alone_are_no_frames() {
        let faults = Faults { lost_frames: [0].into(), ..Faults::default() };
        let mut channel = Channel::new(faults, Random::new(5));
        let arrived = [0, 0, 7, 0, 8].map(|byte| channel.carry(byte));
        assert_eq!(arrived, [Some(0), Some(0), None, None, Some(8)]);
    }

    #[test]
    fn losses_follow_their_probability() {
        let (_, counts) = arrivals(Faults { frame_loss: 0.3, ..Faults::default() }, 200);
        assert!((40..80).contains(&counts.lost_frames), "{counts:?}");
        assert_eq!(counts.lost_bytes, 3 * counts.lost_frames);
        let (_, counts) = arrivals(Faults { byte_loss: 0.1, ..Faults::default() }, 200);
        assert!((40..80).contains(&counts.lost_bytes), "{counts:?}");
        let (_, counts) = arrivals(Faults { byte_loss: 1.0, ..Faults::default() }, 200);
        assert_eq!(counts.lost_bytes, 600);
    }

    #[test]
    fn noise_changes_a_bit() {
        let (arrived, counts) = arrivals(Faults { byte_noise: 0.2, ..Faults::default() }, 200);
        assert_eq!((arrived.len(), counts.lost_bytes), (600, 0));
        let sent = (1..=200_u8).flat_map(|number| [number, number, 0]);
        let wrong: Vec<u32> =
            arrived.iter().zip(sent).map(|(&arrived, sent)| (arrived ^ sent).count_ones()).collect();
        assert!(wrong.iter().all(|&bits| bits <= 1));
        assert!((80..160).contains(&wrong.iter().sum::<u32>()));
    }
}
