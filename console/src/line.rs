//! A line of text.

use core::convert::Infallible;

use ufmt::uWrite;

/// The most characters of a line, its end included.
pub const LENGTH: usize = 80;

/// A line that is being written. What goes beyond its length is left out.
pub struct Line {
    text: [u8; LENGTH],
    length: usize,
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

impl Line {
    /// An empty line.
    pub const fn new() -> Self {
        Line { text: [0; LENGTH], length: 0 }
    }

    /// What is written.
    pub fn text(&self) -> &[u8] {
        self.text.get(..self.length).unwrap_or(&[])
    }

    /// Nothing is written any more.
    pub fn clear(&mut self) {
        self.length = 0;
    }

    pub fn push(&mut self, character: u8) {
        if let Some(slot) = self.text.get_mut(self.length) {
            *slot = character;
            self.length += 1;
        }
    }

    /// What `write` writes, and before it as many spaces as make it `width` characters.
    pub fn right(&mut self, width: usize, write: impl FnOnce(&mut Line) -> Result<(), Infallible>) {
        let start = self.length;
        let Ok(()) = write(self);
        let end = self.length;
        let spaces = width.saturating_sub(end - start);
        for _ in 0..spaces {
            self.push(b' ');
        }
        // From the last character on, each moves by as much as was pushed.
        for index in (start..self.length).rev() {
            let before = index.checked_sub(self.length - end).filter(|&before| before >= start);
            let character = before.and_then(|before| self.text.get(before)).copied().unwrap_or(b' ');
            if let Some(slot) = self.text.get_mut(index) {
                *slot = character;
            }
        }
    }
}

impl uWrite for Line {
    type Error = Infallible;

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        text.bytes().for_each(|character| self.push(character));
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
