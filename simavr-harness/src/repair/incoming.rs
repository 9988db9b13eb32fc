//! The line at the receiver of a USART: the characters on their way there. Where some overlap, as the light
//! of two docks may, the line is low while any of them is.

use std::collections::VecDeque;

use crate::character::{BITS, Character};

#[derive(Default)]
pub(super) struct Incoming {
    /// In the order of their starts.
    characters: VecDeque<Character>,
    /// The receiver has read the line up to this cycle, and looks for the next edge from there on.
    read_until: u64,
    next: Option<Frame>,
}

/// A frame, as a receiver takes it: from a falling edge, for the time of the character that falls there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    pub start: u64,
    pub end: u64,
}

impl Incoming {
    /// A character comes. It has to be known before the frame ends with which it overlaps.
    pub fn push(&mut self, character: Character) {
        let place = self.characters.partition_point(|other| other.start <= character.start);
        self.characters.insert(place, character);
        self.next = self.find();
    }

    /// The next frame, which the receiver has at its end.
    pub fn next(&self) -> Option<Frame> {
        self.next
    }

    /// The characters that [overlap](Self::next) with a frame, in the order of their starts.
    pub fn of(&self, frame: Frame) -> impl Iterator<Item = &Character> + Clone {
        self.characters.iter().take_while(move |character| character.start < frame.end)
    }

    /// The receiver has read a frame, up to the middle of its stop bit.
    pub fn read(&mut self, frame: Frame) {
        self.read_until = frame.end - (frame.end - frame.start) / (2 * BITS);
        self.characters.retain(|character| character.end > frame.end);
        self.next = self.find();
    }

    fn find(&self) -> Option<Frame> {
        let frame =
            |character: &Character, start: u64| Frame { start, end: start + character.end - character.start };
        let first = self.characters.front()?;
        if first.start >= self.read_until {
            return Some(frame(first, first.start));
        }
        let falls = |character| {
            let edges = Character::edges(character).filter(|&(at, level)| !level && at >= self.read_until);
            edges.map(move |(at, _)| frame(character, at))
        };
        let was_high = |frame: &Frame| is_high(self.characters.iter(), frame.start - 1);
        self.characters.iter().flat_map(falls).filter(was_high).min_by_key(|frame| frame.start)
    }
}

/// The level at a cycle of a line that carries these characters.
pub(super) fn is_high<'a>(mut characters: impl Iterator<Item = &'a Character>, at: u64) -> bool {
    characters.all(|character| character.level(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: u64 = 416;
    const LENGTH: u64 = BITS * BIT;

    fn character(value: u8, start: u64) -> Character {
        Character { value, start, end: start + LENGTH }
    }

    /// The frames that a receiver reads of these characters: start, value and level of the stop bit.
    fn frames(characters: &[Character]) -> Vec<(u64, u8, bool)> {
        let mut incoming = Incoming::default();
        characters.iter().for_each(|&character| incoming.push(character));
        let mut frames = Vec::new();
        while let Some(frame) = incoming.next() {
            let level = |bit: u64| is_high(incoming.of(frame), frame.start + bit * BIT + BIT / 2);
            let value = (0..8).fold(0, |value, bit| value | u8::from(level(bit + 1)) << bit);
            assert!(!level(0), "a frame begins with a start bit");
            frames.push((frame.start, value, level(BITS - 1)));
            incoming.read(frame);
        }
        frames
    }

    #[test]
    fn characters_that_follow_each_other_are_read_each_by_itself_in_whatever_order_they_are_told() {
        let close = 2 * LENGTH + 1_000 - 6;
        let told = [character(0x55, 1_000 + LENGTH), character(0, 1_000), character(0xff, close)];
        assert_eq!(
            frames(&told),
            [(1_000, 0, true), (1_000 + LENGTH, 0x55, true), (close, 0xff, true)],
            "a sender on pins may begin a few cycles early"
        );
    }

    #[test]
    fn of_characters_that_begin_at_once_the_zeros_are_heard() {
        assert_eq!(frames(&[character(0b1100, 500), character(0b1010, 500)]), [(500, 0b1000, true)]);
    }

    #[test]
    fn a_character_that_is_low_where_another_one_stops_breaks_that_and_goes_on_at_its_next_edge() {
        // Its third bit of data falls on the first one's stop bit, its fifth is the next that falls.
        let late = character(0b1110_1011, 6 * BIT);
        assert_eq!(
            frames(&[character(0xff, 0), late]),
            [(0, 0b1101_1111, false), (11 * BIT, 0b1111_1111, true)]
        );
    }

    #[test]
    fn an_edge_under_a_character_that_is_low_is_none() {
        let characters = [character(0xff, 0), character(0, 5 * BIT), character(0xff, 12 * BIT)];
        assert_eq!(frames(&characters).len(), 1, "the last start bit begins while the zero is low");
    }
}
