//! Files of notes, as `stacks.txt` and `loops.txt` are.

/// The notes of a file, each with the number of its line, from 1 on. An empty line is none, nor one that
/// begins with `#`. Some editors begin a file with a byte order mark.
pub fn notes(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    (1..).zip(lines).filter(|(_, note)| !note.is_empty() && !note.starts_with('#'))
}
