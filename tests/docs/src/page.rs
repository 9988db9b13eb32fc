//! A page, and the commands' output that it shows.

use std::ops::Range;

use crate::figures::{Stale, figures, steady};

/// A command's output, or its picture, that a page shows.
pub struct Shown {
    pub command: String,
    /// Whether the command writes a picture that the page shows.
    pub is_picture: bool,
    /// The line of the comment that names the command.
    at: usize,
}

/// A page, by line.
pub struct Page {
    lines: Vec<String>,
}

impl Page {
    pub fn new(text: &str) -> Page {
        Page { lines: text.split('\n').map(String::from).collect() }
    }

    pub fn text(&self) -> String {
        self.lines.join("\n")
    }

    /// The outputs that it shows, the last one first, so that a replacement moves no line that is still to be
    /// replaced.
    pub fn shown(&self) -> Vec<Shown> {
        let command = |line: &str| {
            let command = line.strip_prefix("<!-- ")?.strip_suffix(" -->")?;
            command.starts_with("./x ").then(|| command.to_string())
        };
        let is_picture = |at: usize| self.next(at).is_some_and(|next| self.lines[next].starts_with("!["));
        let shown = |(at, line): (usize, &String)| {
            Some(Shown { command: command(line)?, is_picture: is_picture(at), at })
        };
        self.lines.iter().enumerate().rev().filter_map(shown).collect()
    }

    /// Replaces the shown lines with the command's output, except for times of the machine, which differ from
    /// run to run. Of a table's command only the table is taken. Returns the lines that differ, old and new.
    ///
    /// # Errors
    /// No block or table follows the comment, or the command printed none.
    pub fn replace(&mut self, shown: &Shown, printed: &str) -> Result<Vec<(String, String)>, String> {
        let Shown { command, at, .. } = shown;
        let (range, is_table) =
            self.below(*at).ok_or(format!("there is no block or table below `{command}`"))?;
        let old = self.lines[range.clone()].to_vec();
        let printed = printed.trim_end().split('\n').map(str::trim_end);
        let new: Vec<String> = printed
            .filter(|line| !is_table || line.starts_with('|'))
            .map(|line| {
                let same = |old: &&String| steady(old.trim_end()) == steady(line);
                old.iter().find(same).cloned().unwrap_or(line.into())
            })
            .collect();
        if new.iter().all(String::is_empty) {
            return Err(format!("`{command}` prints nothing to show"));
        }
        let line = |lines: &[String], number| lines.get(number).cloned().unwrap_or_default();
        let pairs = (0..old.len().max(new.len())).map(|number| (line(&old, number), line(&new, number)));
        let changed = pairs.filter(|(old, new)| old != new).collect();
        self.lines.splice(range, new);
        Ok(changed)
    }

    /// The lines of the block or the table below a line, and whether it is a table.
    fn below(&self, at: usize) -> Option<(Range<usize>, bool)> {
        let next = self.next(at)?;
        let is_table = self.lines[next].starts_with('|');
        if !is_table && !self.lines[next].starts_with("```") {
            return None;
        }
        let start = if is_table { next } else { next + 1 };
        let is_end = |line: &String| if is_table { !line.starts_with('|') } else { line == "```" };
        let end = start + self.lines[start..].iter().position(is_end)?;
        Some((start..end, is_table))
    }

    /// The next line that is not empty.
    fn next(&self, at: usize) -> Option<usize> {
        (at + 1..self.lines.len()).find(|&line| !self.lines[line].is_empty())
    }

    /// The lines outside of commands' output that still have figures that have changed.
    pub fn stale(&self, old: &[String]) -> Vec<Stale> {
        let shown: Vec<_> = self.shown().iter().filter_map(|shown| Some(self.below(shown.at)?.0)).collect();
        let lines = self.lines.iter().enumerate();
        let prose = lines.filter(|(line, _)| !shown.iter().any(|range| range.contains(line)));
        let stale = prose.flat_map(|(line, text)| {
            let figures = figures(text).into_iter().filter(|figure| old.contains(figure));
            figures.map(move |figure| Stale { line: line + 1, figure, text: text.trim().into() })
        });
        stale.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str =
        "# It\n\n<!-- ./x sim -->\n```text\n20 s simulated in 3.1 s\nhop 2974 us\n```\n\nAbout 2,974 us.\n";

    fn replaced(page: &str, printed: &str) -> (String, Vec<(String, String)>) {
        let mut page = Page::new(page);
        let [shown] = &page.shown()[..] else { panic!("one command") };
        let changed = page.replace(shown, printed).expect("there is something to replace");
        (page.text(), changed)
    }

    #[test]
    fn what_is_printed_takes_the_place_of_what_was() {
        let (text, changed) = replaced(PAGE, "20 s simulated in 4.7 s\nhop 3001 us\nmore\n");
        assert_eq!(text, PAGE.replace("hop 2974 us", "hop 3001 us\nmore"), "wall time stays as it was");
        let pair = |old: &str, new: &str| (old.to_string(), new.to_string());
        assert_eq!(changed, [pair("hop 2974 us", "hop 3001 us"), pair("", "more")]);
        assert_eq!(
            Page::new(&text).stale(&["2974".into()]).iter().map(|it| it.line).collect::<Vec<_>>(),
            [10]
        );
    }

    #[test]
    fn what_is_the_same_stays() {
        let printed = "20 s simulated in 99.9 s\nhop 2974 us\n";
        assert_eq!(replaced(PAGE, printed), (PAGE.to_string(), vec![]));
    }

    #[test]
    fn of_a_table_the_table_alone_is_shown() {
        let page = "<!-- ./x period -->\n| a | b |\n|---|---|\n| 1 | 2 |\n\nAfter it.\n";
        let (text, changed) = replaced(page, "a title\n\n| a | b |\n|---|---|\n| 1 | 3 |\n");
        assert_eq!(text, page.replace("| 2 |", "| 3 |"));
        assert_eq!(changed.len(), 1);
    }

    #[test]
    fn where_nothing_is_to_be_replaced_is_an_error() {
        for (page, printed, why) in [
            ("<!-- ./x sim -->\nText.\n", "text", "there is no block"),
            ("<!-- ./x sim -->\n```text\nno end\n", "text", "there is no block"),
            (PAGE, "\n", "prints nothing"),
            ("<!-- ./x period -->\n| a |\n", "no table", "prints nothing"),
        ] {
            let mut page = Page::new(page);
            let error = page.replace(&page.shown()[0], printed).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn other_comments_are_no_commands() {
        assert!(Page::new("<!-- patch -->\n<!-- ./x -->\n`./x sim`\n").shown().is_empty());
    }
}
