//! Figures in lines of text.

/// A figure in the text of a page that its command no longer prints.
pub struct Stale {
    /// From 1.
    pub line: usize,
    pub figure: String,
    pub text: String,
}

/// Text that is followed by a time of this machine, or by its memory.
const OF_THE_MACHINE: [&str; 3] = [" simulated in ", "each module takes ", " of CPU time a second, and "];

/// The least digits of a figure that is looked for: a shorter one may stand for something else.
const TELLING: usize = 3;

/// The line without figures that differ from run to run or from machine to machine.
pub fn steady(line: &str) -> String {
    OF_THE_MACHINE.iter().fold(line.to_string(), |line, before| match line.split_once(before) {
        Some((head, tail)) => {
            let rest = tail.trim_start_matches(|it: char| it.is_ascii_digit() || it == '.');
            format!("{head}{before}{rest}")
        }
        None => line,
    })
}

/// The figures of a line with enough digits that they rarely appear by chance, without the commas between
/// thousands.
pub fn figures(line: &str) -> Vec<String> {
    let is_part = |it: char| it.is_ascii_alphanumeric() || matches!(it, '.' | ',' | '_');
    let words = line.split(|it| !is_part(it)).map(|word| word.trim_matches(['.', ',']).replace(',', ""));
    let is_figure = |word: &String| {
        let digits = word.chars().filter(char::is_ascii_digit).count();
        digits >= TELLING && word.chars().all(|it| it.is_ascii_digit() || it == '.')
    };
    words.filter(is_figure).collect()
}

/// The figures of old lines that are in no new one.
pub fn gone(changed: &[(String, String)]) -> Vec<String> {
    let new: Vec<String> = changed.iter().flat_map(|(_, new)| figures(new)).collect();
    let mut gone: Vec<String> = changed.iter().flat_map(|(old, _)| figures(old)).collect();
    gone.retain(|figure| !new.contains(figure));
    gone
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn figures_are_found_whatever_stands_around_them() {
        let line = "It takes 44,904 cycles, 2.81 ms (12.5 %), by `0x1234` and r24: 1.900. USART0 has 42.";
        assert_eq!(figures(line), ["44904", "2.81", "12.5", "1.900"]);
    }

    #[test]
    fn figures_that_only_moved_are_not_gone() {
        let pair = |old: &str, new: &str| (old.to_string(), new.to_string());
        assert_eq!(gone(&[pair("a 1234", "a 1235"), pair("b 1235", "b 1236")]), ["1234"]);
    }

    #[test]
    fn times_of_the_machine_are_told_from_other_figures() {
        let progress = "  20.00 of 20.00 s simulated in 44.6 s, 3861 hormones delivered";
        assert_eq!(steady(progress), "  20.00 of 20.00 s simulated in  s, 3861 hormones delivered");
        let cost = "simulator  each module takes 44.5 ms of CPU time a second, and 568 KB of memory";
        assert_eq!(steady(cost), "simulator  each module takes  ms of CPU time a second, and  KB of memory");
        assert_eq!(steady("hop        2974 us mean"), "hop        2974 us mean");
    }

    /// A row of a table has names in its first cell, and their figures in the second, in the same order.
    #[test]
    fn the_kernels_figures_are_those_that_the_bench_is_held_to() {
        let held: BTreeMap<&str, &str> = include_str!("../../simavr/tests/expected/bench.txt")
            .lines()
            .filter_map(|line| line.split_once(' '))
            .collect();
        let mut shown = Vec::new();
        for row in include_str!("../../../docs/figures.md").lines() {
            let [_, first, second, ..] = row.split('|').collect::<Vec<_>>()[..] else { continue };
            let names = first.split('`').skip(1).step_by(2).filter(|name| held.contains_key(name));
            let figures = second.split(|it: char| !it.is_ascii_digit()).filter(|word| !word.is_empty());
            for (name, figure) in names.zip(figures) {
                assert_eq!(held[name], figure, "{name}");
                shown.push(name);
            }
        }
        // Ticks with some timers and with many are shown in one row, by the first.
        let missing: Vec<_> = held.keys().filter(|name| !shown.contains(name)).collect();
        assert_eq!(missing, [&"tick_cycles_1", &"tick_cycles_10", &"tick_cycles_50"]);
    }
}
