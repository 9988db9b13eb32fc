//! A line of text.

use core::convert::Infallible;
use core::mem;

use ufmt::uWrite;

/// The most characters of a line, including its end.
pub const LENGTH: usize = 96;

/// A line that is being written. Characters beyond its length are dropped.
#[derive(Default)]
pub struct Line(heapless::Vec<u8, LENGTH>);

impl Line {
    /// An empty line.
    pub const fn new() -> Self {
        Line(heapless::Vec::new())
    }

    /// The characters written so far.
    pub fn text(&self) -> &[u8] {
        &self.0
    }

    /// Empties the line.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    pub fn push(&mut self, character: u8) {
        let _ = self.0.push(character);
    }

    /// Writes several characters.
    pub fn append(&mut self, characters: &[u8]) {
        characters.iter().for_each(|&character| self.push(character));
    }

    /// Writes the output of `write`, right-aligned with spaces to `width` characters.
    pub fn right(&mut self, width: usize, write: impl FnOnce(&mut Line) -> Result<(), Infallible>) {
        let start = self.0.len();
        let Ok(()) = write(self);
        self.align_right(start, width);
    }

    /// Puts spaces before what stands from `start` on, so that it takes `width` characters.
    fn align_right(&mut self, start: usize, width: usize) {
        for _ in self.0.len() - start..width {
            if self.0.push(b' ').is_err() {
                return;
            }
            // Each character takes the place of the next one.
            let mut before = b' ';
            self.0.iter_mut().skip(start).for_each(|place| mem::swap(place, &mut before));
        }
    }
}

impl uWrite for Line {
    type Error = Infallible;

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        self.append(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ufmt::uwrite;

    #[test]
    fn columns_end_where_they_shall() {
        let mut line = Line::new();
        line.right(6, |line| uwrite!(line, "{}", 12_u16));
        line.right(6, |line| uwrite!(line, "{}", 65_535_u16));
        line.right(2, |line| line.write_str("wide"));
        assert_eq!(line.text(), b"    12 65535wide");
        line.clear();
        assert_eq!(line.text(), b"");
    }

    #[test]
    fn a_full_line_takes_no_more() {
        let mut line = Line::new();
        for _ in 0..LENGTH - 1 {
            line.push(b'x');
        }
        line.right(5, |line| line.write_str("y"));
        line.push(b'z');
        assert_eq!(line.text(), [&[b'x'; LENGTH - 1][..], b"y"].concat());
    }
}
