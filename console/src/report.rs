//! The console's reports: which questions to ask, and the lines that the answers make.

use kernel::flash::Flash;
use ufmt::{uWrite, uwrite};

use super::line::Line;
use super::request::Topic;
use crate::inspector::{LOOK, WORKS};
use crate::question::{self, Question, WORDS};
use tasks::bridge::protocol::BridgeCounters;
use tasks::devices::task as devices;
use tasks::dock::{Dock, DockSet};
use tasks::link::counters::LinkCounters;
use tasks::motor::task as motor;
use tasks::router::Mcu;

/// The next step of a report.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub enum Next {
    /// Ask this MCU; then hand its answer to [`take`](Report::take), or call [`miss`](Report::miss) if there
    /// is none.
    Ask(Mcu, Question),
    /// Show the line.
    Show,
    End,
}

/// A part of a report.
#[derive(Clone, Copy)]
enum Section {
    Title,
    Cpu(Mcu),
    Tasks(Mcu),
    Counts(Table),
}

/// A table of counts: a column for each dock, or for each MCU.
#[derive(Clone, Copy)]
enum Table {
    Links,
    Bridges,
    Motors,
    Devices,
}

/// A word of a table, padded with spaces.
type Word = [u8; NAME];

/// `text` as a word.
const fn word(text: &str) -> Word {
    let text = text.as_bytes();
    let mut word = [b' '; NAME];
    let mut index = 0;
    while index < text.len() {
        word[index] = text[index];
        index += 1;
    }
    word
}

/// Several texts as words.
const fn words<const N: usize>(texts: [&str; N]) -> [Word; N] {
    let mut words = [[b' '; NAME]; N];
    let mut index = 0;
    while index < N {
        words[index] = word(texts[index]);
        index += 1;
    }
    words
}

kernel::flash! {
    static ALL: [Section; 9] = [
        Section::Title,
        Section::Cpu(Mcu::Master),
        Section::Cpu(Mcu::Slave),
        Section::Tasks(Mcu::Master),
        Section::Tasks(Mcu::Slave),
        Section::Counts(Table::Links),
        Section::Counts(Table::Bridges),
        Section::Counts(Table::Motors),
        Section::Counts(Table::Devices),
    ];
    static TASKS: [Section; 3] = [Section::Title, Section::Tasks(Mcu::Master), Section::Tasks(Mcu::Slave)];
    static CPU: [Section; 3] = [Section::Title, Section::Cpu(Mcu::Master), Section::Cpu(Mcu::Slave)];
    static COUNTS: [Section; 5] = [
        Section::Title,
        Section::Counts(Table::Links),
        Section::Counts(Table::Bridges),
        Section::Counts(Table::Motors),
        Section::Counts(Table::Devices),
    ];

    /// The master's tasks, in the order of its inspector's list.
    static MASTER_TASKS: [Word; 11] = [
        word("joints"),
        word("receive"),
        word("bridge"),
        word("send USART0"),
        word("send USART1"),
        word("send soft UART"),
        word("devices"),
        word("AC_RECV"),
        word("AC_SEND"),
        word("HORMONE"),
        word("inspector"),
    ];

    /// The slave's tasks, in the order of its inspector's list.
    static SLAVE_TASKS: [Word; 9] = [
        word("joints"),
        word("receive"),
        word("bridge"),
        word("send USART0"),
        word("send USART1"),
        word("send soft UART"),
        word("devices"),
        word("console"),
        word("inspector"),
    ];

    static LINK_COUNTS: [Word; <LinkCounters>::NAMES.len()] = words(<LinkCounters>::NAMES);
    static BRIDGE_COUNTS: [Word; <BridgeCounters>::NAMES.len()] = words(<BridgeCounters>::NAMES);
    static MOTOR_COUNTS: [Word; <motor::Counters>::NAMES.len()] = words(<motor::Counters>::NAMES);
    static DEVICE_COUNTS: [Word; <devices::Counters>::NAMES.len()] = words(<devices::Counters>::NAMES);

    static RESET_CAUSES: [Word; 5] =
        [word("power-on"), word("RESET pin"), word("brown-out"), word("watchdog"), word("JTAG")];
}

/// The columns of a table of counts, at most.
const COLUMNS: usize = 6;

/// The rows of a table of counts, at most: those of a table of links.
const ROWS: usize = <LinkCounters>::NAMES.len();

/// The width of the names before the columns, and of each column.
const NAME: usize = 17;
const WIDTH: usize = 7;

impl Table {
    fn title(self) -> &'static str {
        match self {
            Table::Links => "links",
            Table::Bridges => "bridge",
            Table::Motors => "joints' control",
            Table::Devices => "devices",
        }
    }

    fn rows(self) -> &'static Flash<[Word]> {
        match self {
            Table::Links => &LINK_COUNTS,
            Table::Bridges => &BRIDGE_COUNTS,
            Table::Motors => &MOTOR_COUNTS,
            Table::Devices => &DEVICE_COUNTS,
        }
    }

    /// The heads of its columns.
    fn heads(self) -> &'static [&'static str] {
        match self {
            Table::Links => &["Front", "Back", "Left", "Right", "Up", "Down"],
            Table::Bridges | Table::Motors | Table::Devices => &["master", "slave"],
        }
    }

    /// How many questions fill a column.
    fn parts(self) -> u8 {
        self.rows().len().div_ceil(WORDS) as u8
    }
}

/// The answers for a column.
#[derive(Clone, Copy)]
struct Column {
    words: [u16; ROWS],
    length: u8,
}

impl Column {
    const EMPTY: Column = Column { words: [0; ROWS], length: 0 };

    fn get(&self, row: u8) -> Option<u16> {
        self.words.get(usize::from(row)).copied().filter(|_| row < self.length)
    }

    /// Puts these words into the rows from `from` on.
    fn fill(&mut self, from: u8, words: impl Iterator<Item = u16>) {
        self.length = from;
        for (slot, word) in self.words.iter_mut().skip(from.into()).zip(words) {
            *slot = word;
            self.length += 1;
        }
    }
}

/// A report in progress.
pub struct Report {
    /// The docks of the slave; the others are the master's.
    slave: DockSet,
    sections: &'static Flash<[Section]>,
    /// The current section, how many of its questions were asked, and how many of its lines were written.
    section: usize,
    asked: u8,
    row: u8,
    columns: [Column; COLUMNS],
    /// The MCUs that have missed an answer, by [`Mcu`]. They are not asked again.
    is_silent: [bool; 2],
    /// A silent MCU that the report has not named yet.
    missed: Option<Mcu>,
}

impl Report {
    /// A report on `topic`. `slave` has the docks of that MCU.
    pub fn new(topic: Topic, slave: DockSet) -> Report {
        Report {
            slave,
            sections: match topic {
                Topic::All => &ALL,
                Topic::Tasks => &TASKS,
                Topic::Cpu => &CPU,
                Topic::Counts => &COUNTS,
            },
            section: 0,
            asked: 0,
            row: 0,
            columns: [Column::EMPTY; COLUMNS],
            is_silent: [false; 2],
            missed: None,
        }
    }

    /// The next step. For [`Next::Show`], `line` has the line.
    pub fn next(&mut self, line: &mut Line) -> Next {
        line.clear();
        if let Some(mcu) = self.missed.take() {
            let Ok(()) = uwrite!(line, "no answer from the {}\n", name(mcu));
            return Next::Show;
        }
        while let Some(section) = self.sections.get(self.section) {
            match self.question(section) {
                Some((mcu, _)) if self.is_silent(mcu) => self.asked += 1,
                Some((mcu, question)) => return Next::Ask(mcu, question),
                None if self.write(section, line) => {
                    self.row += 1;
                    line.push(b'\n');
                    return Next::Show;
                }
                None => {
                    self.section += 1;
                    (self.asked, self.row) = (0, 0);
                    self.columns = [Column::EMPTY; COLUMNS];
                }
            }
        }
        Next::End
    }

    /// Takes the words of the answer to the last question.
    pub fn take(&mut self, words: impl Iterator<Item = u16>) {
        let Some(section) = self.sections.get(self.section) else { return };
        let (column, row) = self.place(section);
        if let Some(column) = self.columns.get_mut(usize::from(column)) {
            column.fill(row, words);
        }
        self.asked = self.asked.saturating_add(1);
    }

    /// Notes that the last question has no answer.
    pub fn miss(&mut self) {
        let Some(section) = self.sections.get(self.section) else { return };
        if let Some((mcu, _)) = self.question(section) {
            self.missed = Some(mcu);
            if let Some(is_silent) = self.is_silent.get_mut(mcu as usize) {
                *is_silent = true;
            }
        }
    }

    fn is_silent(&self, mcu: Mcu) -> bool {
        self.is_silent.get(mcu as usize).copied().unwrap_or(false)
    }

    /// The question that has to be asked before the next line, if there is one, and the MCU to ask.
    fn question(&self, section: Section) -> Option<(Mcu, Question)> {
        let asked = self.asked;
        match section {
            Section::Title => None,
            Section::Cpu(mcu) => (asked == 0).then_some((mcu, Question::Mcu)),
            // The first line is the heads of the columns.
            Section::Tasks(mcu) => {
                let is_due = asked < self.row && usize::from(asked) < tasks(mcu).len();
                is_due.then_some((mcu, Question::Task(asked)))
            }
            Section::Counts(table) => {
                let (column, from) = self.place(section);
                let side = if column == 0 { Mcu::Master } else { Mcu::Slave };
                let (mcu, of) = match table {
                    Table::Motors => (side, question::MOTORS),
                    Table::Devices => (side, question::DEVICES),
                    Table::Bridges => (side, question::BRIDGE),
                    Table::Links => {
                        let dock = Dock::from_index(column)?;
                        (if self.slave.contains(dock) { Mcu::Slave } else { Mcu::Master }, column)
                    }
                };
                (usize::from(column) < table.heads().len()).then_some((mcu, Question::Counts { of, from }))
            }
        }
    }

    /// The column and the first row for the answer to the next question.
    fn place(&self, section: Section) -> (u8, u8) {
        match section {
            Section::Counts(table) if table.parts() == 2 => (self.asked / 2, self.asked % 2 * WORDS as u8),
            Section::Counts(_) => (self.asked, 0),
            _ => (0, 0),
        }
    }

    /// Writes the next line of a section. Returns whether there is one.
    fn write(&self, section: Section, line: &mut Line) -> bool {
        match (section, self.row) {
            (Section::Title, 0) => {
                line.append(concat!("SuperBot ", env!("CARGO_PKG_VERSION")).as_bytes());
                Some(())
            }
            (Section::Cpu(mcu), 0) => self.write_cpu(mcu, line),
            (Section::Title | Section::Cpu(_), _) => None,
            (Section::Tasks(mcu), _) if self.is_silent(mcu) => None,
            (Section::Tasks(mcu), 0) => write_heads(name(mcu), &["priority", "stack", "unused"], line),
            (Section::Tasks(mcu), row) => self.write_task(mcu, row - 1, line),
            (Section::Counts(table), 0) => write_heads(table.title(), table.heads(), line),
            (Section::Counts(table), row) => self.write_counts(table, row - 1, line),
        }
        .is_some()
    }

    fn write_cpu(&self, mcu: Mcu, line: &mut Line) -> Option<()> {
        let [column, ..] = &self.columns;
        let (worked, causes) = (column.get(0)?, column.get(1)?);
        let awake = WORKS.saturating_sub(worked) * (1000 / WORKS);
        let Ok(()) = uwrite!(line, "{}: awake for {}.{} % of {} ms", name(mcu), awake / 10, awake % 10, LOOK);
        let mut before = ", reset by ";
        for (bit, cause) in RESET_CAUSES.iter().enumerate() {
            if causes >> bit & 1 != 0 {
                let Ok(()) = line.write_str(before);
                before = ", ";
                line.append(cause.trim_ascii_end());
            }
        }
        Some(())
    }

    fn write_task(&self, mcu: Mcu, index: u8, line: &mut Line) -> Option<()> {
        line.append(&tasks(mcu).get(index.into())?);
        let [column, ..] = &self.columns;
        for row in 0..3 {
            let word = column.get(row)?;
            line.right(WIDTH, |line| uwrite!(line, "{}", word));
        }
        Some(())
    }

    fn write_counts(&self, table: Table, row: u8, line: &mut Line) -> Option<()> {
        line.append(&table.rows().get(row.into())?);
        for (column, _) in self.columns.iter().zip(table.heads()) {
            match column.get(row) {
                Some(count) => line.right(WIDTH, |line| uwrite!(line, "{}", count)),
                None => line.right(WIDTH, |line| line.write_str("-")),
            }
        }
        Some(())
    }
}

/// The line above a table.
fn write_heads(title: &str, heads: &[&str], line: &mut Line) -> Option<()> {
    let Ok(()) = uwrite!(line, "\n{}", title);
    for _ in title.len()..NAME {
        line.push(b' ');
    }
    for head in heads {
        line.right(WIDTH, |line| line.write_str(head));
    }
    Some(())
}

/// The names of an MCU's tasks.
fn tasks(mcu: Mcu) -> &'static Flash<[Word]> {
    match mcu {
        Mcu::Master => &MASTER_TASKS,
        Mcu::Slave => &SLAVE_TASKS,
    }
}

const fn name(mcu: Mcu) -> &'static str {
    match mcu {
        Mcu::Master => "master",
        Mcu::Slave => "slave",
    }
}
