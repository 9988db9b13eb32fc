//! Computes the levels of wires from what was sent over them.

use crate::character::{Character, levels};
use crate::probe::Edge;
use crate::trace::Slice;

/// A wire.
#[derive(Clone, Debug)]
pub struct Line {
    pub name: String,
    /// Its level before the first edge.
    pub is_high: bool,
    /// In the order of time, with alternating levels.
    pub edges: Vec<Edge>,
}

impl Line {
    /// A wire at level `is_high`, except in the spans `otherwise`, which may overlap.
    pub(super) fn of(name: String, is_high: bool, mut otherwise: Vec<(u64, u64)>) -> Self {
        otherwise.retain(|(begin, end)| begin < end);
        otherwise.sort_unstable();
        let mut edges: Vec<Edge> = Vec::new();
        let mut until = None;
        for (begin, end) in otherwise {
            if until.is_none_or(|until| until < begin) {
                edges.extend(until.map(|cycle| Edge { cycle, level: is_high }));
                edges.push(Edge { cycle: begin, level: !is_high });
            }
            until = until.max(Some(end));
        }
        edges.extend(until.map(|cycle| Edge { cycle, level: is_high }));
        Line { name, is_high, edges }
    }

    /// A wire that takes each of these levels at its cycle.
    pub(super) fn of_levels(
        name: String,
        is_high: bool,
        levels: impl IntoIterator<Item = (u64, bool)>,
    ) -> Self {
        let mut before = is_high;
        let levels = levels.into_iter();
        let edges = levels.filter(|&(_, level)| std::mem::replace(&mut before, level) != level);
        let edges = edges.map(|(cycle, level)| Edge { cycle, level }).collect();
        Line { name, is_high, edges }
    }
}

/// The line at a serial port that carries these characters. An idle line is high. While two senders overlap,
/// the line is low when either of them drives it low.
pub fn serial_line(name: String, characters: &[Character]) -> Line {
    let lows = characters.iter().flat_map(|character| {
        let lows = (0..).zip(levels(character.value)).filter(|&(_, level)| !level);
        lows.map(|(number, _)| (character.bit(number), character.bit(number + 1)))
    });
    Line::of(name, true, lows.collect())
}

/// A signal on the wires of a bus. A START and a STOP take a bit, a byte nine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusSignal {
    /// A START or a repeated START.
    Start,
    Byte {
        value: u8,
        acknowledged: bool,
    },
    Stop,
}

/// SCL and SDA of a two-wire bus that carries these signals.
pub fn bus_lines(signals: &[Slice<BusSignal>]) -> [Line; 2] {
    let (mut clock, mut data) = (Vec::new(), Vec::new());
    for Slice { begin, end, what } in signals {
        let at = |part: u64, parts: u64| begin + part * (end - begin) / parts;
        match *what {
            BusSignal::Start => {
                data.extend([(at(0, 4), true), (at(2, 4), false)]);
                clock.extend([(at(1, 4), true), (at(4, 4), false)]);
            }
            BusSignal::Stop => {
                data.extend([(at(0, 4), false), (at(2, 4), true)]);
                clock.push((at(1, 4), true));
            }
            BusSignal::Byte { value, acknowledged } => {
                let bits = (0..8).rev().map(|bit| value & 1 << bit != 0).chain([!acknowledged]);
                for (number, level) in (0..).zip(bits) {
                    // SDA changes while SCL is low.
                    data.push((at(4 * number + 1, 36), level));
                    clock.extend([(at(4 * number + 2, 36), true), (at(4 * number + 4, 36), false)]);
                }
            }
        }
    }
    [Line::of_levels("SCL".into(), true, clock), Line::of_levels("SDA".into(), true, data)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges(line: &Line) -> Vec<(u64, bool)> {
        line.edges.iter().map(|edge| (edge.cycle, edge.level)).collect()
    }

    #[test]
    fn a_character_is_low_where_its_bits_are() {
        let character = Character { value: 0b1111_0001, start: 1000, end: 2000 };
        let line = serial_line("line".into(), &[character]);
        assert_eq!(edges(&line), [(1000, false), (1100, true), (1200, false), (1500, true)]);
    }

    #[test]
    fn two_senders_at_once_are_low_where_either_is() {
        let character = |start| Character { value: 0xff, start, end: start + 1000 };
        let line = serial_line("line".into(), &[character(1050), character(1000), character(1150)]);
        assert_eq!(edges(&line), [(1000, false), (1250, true)]);
    }

    #[test]
    fn a_bus_is_idle_but_between_start_and_stop() {
        let slice = |begin, end, what| Slice { begin, end, what };
        let byte = BusSignal::Byte { value: 0xa5, acknowledged: true };
        let signals =
            [slice(0, 40, BusSignal::Start), slice(40, 400, byte), slice(500, 540, BusSignal::Stop)];
        let [clock, data] = bus_lines(&signals);
        assert_eq!(edges(&clock)[..3], [(40, false), (60, true), (80, false)]);
        assert_eq!(clock.edges.len(), 2 * 10);
        assert_eq!((edges(&clock).last(), edges(&data).last()), (Some(&(510, true)), Some(&(520, true))));
        assert_eq!(edges(&data)[..3], [(20, false), (50, true), (90, false)]);
    }
}
