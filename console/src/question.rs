//! The console's questions to an inspector, and the answers.
//!
//! ```text
//!   question   +------+-------+
//!              | kind | index |
//!              +------+-------+-----------------------------------+
//!   answer     | kind | index | 0..=7 words, low byte first       |
//!              +------+-------+-----------------------------------+
//! ```
//!
//! The answer follows the question in the same buffer, so that a late answer is not taken for the answer to
//! another question. It has no words if there is no such task or count.

use tasks::message::MAX_PAYLOAD;

/// The most words of an answer.
pub const WORDS: usize = (MAX_PAYLOAD - HEADER) / 2;

const HEADER: usize = 2;

/// A question to an MCU.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Question {
    /// How often the inspector has worked, [`WORKS`](super::inspector::WORKS) times at most, in
    /// [`LOOK`](super::inspector::LOOK) ticks; the flags of MCUCSR at the MCU's start.
    Mcu,
    /// The task at this place in the MCU's list: priority, bytes of stack, and how many of them it has never
    /// used.
    Task(u8),
    /// The counts of a link, the bridge, the joints' control or the devices' task: [`WORDS`] counts from the
    /// one with the index `from` on.
    Counts { of: Who, from: u8 },
}

/// The owner of counts: the link at a dock by the dock's index, then these.
pub type Who = u8;
pub const BRIDGE: Who = 6;
pub const MOTORS: Who = 7;
pub const DEVICES: Who = 8;

/// How many owners of counts there can be on an MCU.
pub const COUNTING: usize = 9;

/// The kinds of questions. The kind for counts is `COUNTS` plus their owner.
pub(crate) const MCU: u8 = 0;
pub(crate) const TASK: u8 = 1;
pub(crate) const COUNTS: u8 = 2;

impl Question {
    /// As a message's payload.
    pub const fn to_payload(self) -> [u8; HEADER] {
        match self {
            Question::Mcu => [MCU, 0],
            Question::Task(index) => [TASK, index],
            Question::Counts { of, from } => [COUNTS + of, from],
        }
    }
}

/// The words of an answer to `question`; `None` if the payload answers another, or is no answer.
pub fn words(question: Question, payload: &[u8]) -> Option<impl Iterator<Item = u16>> {
    let words = payload.strip_prefix(&question.to_payload())?;
    words.len().is_multiple_of(2).then(|| {
        words.chunks_exact(2).map(|word| match *word {
            [low, high] => u16::from_le_bytes([low, high]),
            _ => 0, // never: chunks of two
        })
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;
    use tasks::message::{Address, Letter, Message, TaskCode};

    #[test]
    fn an_answer_is_read_as_it_was_written_and_by_its_own_question_alone() {
        let question = Question::Counts { of: BRIDGE, from: 7 };
        let (to, from) = (Address::here(TaskCode::MASTER_INSPECTOR), Address::here(TaskCode::CONSOLE));
        let mut answer = Letter::of(Message::new(to, from, &question.to_payload()).expect("it fits"));
        let mut expected = Vec::new();
        for word in (0x0102..).take(WORDS + 1) {
            assert_eq!(
                words(question, answer.payload()).expect("it answers that").collect::<Vec<_>>(),
                expected
            );
            for other in [Question::Mcu, Question::Task(7), Question::Counts { of: BRIDGE, from: 0 }] {
                assert!(words(other, answer.payload()).is_none());
            }
            answer.push(word);
            expected.push(word);
        }
        assert_eq!(answer.payload().len(), MAX_PAYLOAD);
        assert!(words(question, &answer.payload()[..MAX_PAYLOAD - 1]).is_none(), "half a word");
    }
}
