//! An MCU that runs the image `model`: its mailboxes, its marks, its interrupts.

use std::ops::Range;
use std::sync::Arc;

use model::call::{Group, Outcome};
use model::referee::Complaint;
use model::reference::TaskId;
use model::wire::{COMMAND_BYTES, Command, REPLY_BYTES, Reply};
use model::world::Arrangement;
use simavr_harness::{Image, Mcu, Place, State};

use crate::target::Target;

/// A handler, or the code that starts the tasks, asks for a command. The marks of the tasks are lower.
const HANDLER: u8 = 0x3f;
/// The program asks for the arrangement.
const ARRANGE: u8 = 0x40;
/// The commanded call begins.
const CALLS: u8 = 0x41;

/// More cycles than ever pass between two stops.
const PATIENCE: u64 = 1_000_000;

/// A place between two instructions.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// Cycles after the first boundary.
    pub after: usize,
    /// The task whose stack is in use; `None`: the kernel's stack.
    pub task: Option<TaskId>,
}

/// The image `model`, and the places of the data that the harness needs.
pub struct Subject {
    target: &'static Target,
    /// Calls that the image does not make.
    without: Option<Group>,
    image: Arc<Image>,
    mailboxes: u16,
    arrangement: u16,
    stacks: Range<u16>,
    tasks: usize,
}

/// The size of a mailbox, in bytes.
const MAILBOX: u16 = (COMMAND_BYTES + REPLY_BYTES) as u16;

/// The reason why the program has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// A task asks for a command.
    Task(TaskId),
    /// A handler, or the code that starts the tasks, asks for a command.
    Handler,
    /// The commanded call begins.
    Begins,
    /// No task runs.
    Asleep,
    /// The time is up.
    Late,
}

impl Subject {
    /// # Panics
    /// When the image is not `model`.
    pub fn new(target: &'static Target, image: Arc<Image>) -> Self {
        Subject::of(target, image, None)
    }

    /// The images for `target`: one that makes all calls, or several if the flash is small.
    ///
    /// # Panics
    /// When one is not there.
    pub fn all(target: &'static Target) -> Vec<Self> {
        if target.part.name != "atmega328p" {
            return vec![Subject::new(target, target.image("model"))];
        }
        let parts = [("without-bytes/model", Group::Bytes), ("without-several/model", Group::Several)];
        parts.map(|(name, group)| Subject::of(target, target.image(name), Some(group))).into()
    }

    fn of(target: &'static Target, image: Arc<Image>, without: Option<Group>) -> Self {
        let find = |name: &str| match image.symbol(name).map(|symbol| (symbol.place, symbol.size)) {
            Some((Place::Data(start), size)) => start..start + size,
            _ => panic!("the image has no {name}: build it again"),
        };
        let mailboxes = find("MODEL_MAILBOXES");
        Subject {
            target,
            without,
            arrangement: find("MODEL_ARRANGEMENT").start,
            stacks: find("MODEL_STACKS"),
            // The last one is the handler's.
            tasks: mailboxes.len() / usize::from(MAILBOX) - 1,
            mailboxes: mailboxes.start,
            image,
        }
    }

    /// How many tasks a setup has at most.
    pub fn tasks(&self) -> usize {
        self.tasks
    }

    /// Calls that the image does not make.
    pub fn without(&self) -> Option<Group> {
        self.without
    }

    /// The MCU on which the image runs.
    pub fn target(&self) -> &'static Target {
        self.target
    }

    /// The task whose stack is in use.
    fn task_of_stack(&self, mcu: &Mcu) -> Option<TaskId> {
        let Range { start, end } = self.stacks;
        let offset = mcu.stack_pointer().checked_sub(start)?;
        let size = (end - start) / self.tasks as u16;
        (offset < end - start).then(|| usize::from(offset / size))
    }

    /// An MCU that asks for its arrangement.
    ///
    /// # Panics
    /// When the image does not get that far.
    pub fn mcu(&self) -> Mcu {
        let mut mcu = self.target.mcu(self.image.clone());
        self.target.enable_interrupts(&mut mcu);
        mcu.run_to_marker(ARRANGE, PATIENCE).expect("the image asks for its arrangement");
        mcu
    }
}

/// A run of the program.
pub struct Chip<'a> {
    subject: &'a Subject,
    mcu: &'a mut Mcu,
}

impl<'a> Chip<'a> {
    /// Continues from where `mcu` asks for its arrangement.
    pub fn new(subject: &'a Subject, mcu: &'a mut Mcu, arrangement: &Arrangement) -> Self {
        let mut chip = Chip { subject, mcu };
        chip.write(subject.arrangement, &arrangement.to_bytes());
        chip
    }

    /// Runs to the next stop, or to the first instruction boundary at or after `cycle`.
    ///
    /// # Errors
    /// The program does not reach a stop.
    pub fn run(&mut self, cycle: Option<u64>) -> Result<Stop, Complaint> {
        let marked = self.mcu.run_to_stop(cycle.unwrap_or(self.mcu.cycle() + PATIENCE));
        match (marked, self.mcu.state()) {
            (Some(CALLS), State::Running) => Ok(Stop::Begins),
            (Some(HANDLER), State::Running) => Ok(Stop::Handler),
            (Some(task @ ..HANDLER), State::Running) => Ok(Stop::Task(task.into())),
            (None, State::Sleeping) => Ok(Stop::Asleep),
            (None, State::Running) if cycle.is_some() => Ok(Stop::Late),
            (marked, state) => Err(format!("the program is lost, at mark {marked:x?}: {state:?}")),
        }
    }

    pub fn cycle(&self) -> u64 {
        self.mcu.cycle()
    }

    /// The outcome of the last call of task `id`, unless the task has begun anew since.
    pub fn reply_of_task(&mut self, id: TaskId) -> Option<Outcome> {
        self.reply(id)
    }

    pub fn command_task(&mut self, id: TaskId, command: Command) {
        self.command(id, command);
    }

    /// The outcome of a handler's last call.
    pub fn reply_of_handler(&mut self) -> Option<Outcome> {
        self.reply(self.subject.tasks)
    }

    pub fn command_handler(&mut self, command: Command) {
        self.command(self.subject.tasks, command);
    }

    fn command(&mut self, number: usize, command: Command) {
        let mailbox = self.mailbox(number);
        self.write(mailbox, &command.to_bytes());
    }

    /// Takes the reply out of a mailbox.
    fn reply(&mut self, number: usize) -> Option<Outcome> {
        let at = self.mailbox(number) + COMMAND_BYTES as u16;
        let bytes: [u8; REPLY_BYTES] =
            std::array::from_fn(|index| self.mcu.read(at + index as u16).unwrap_or(0));
        self.write(at, &Reply::Nothing.to_bytes());
        match Reply::of_bytes(&bytes) {
            Some(Reply::Returned(outcome)) => Some(outcome),
            _ => None,
        }
    }

    fn mailbox(&self, number: usize) -> u16 {
        self.subject.mailboxes + number as u16 * MAILBOX
    }

    fn write(&mut self, start: u16, bytes: &[u8]) {
        for (address, &byte) in (start..).zip(bytes) {
            self.mcu.write(address, byte);
        }
    }

    /// Explores the run until a task asks for a command, or no task runs. Returns the boundaries between its
    /// instructions at which an interrupt is accepted at once, counted from here.
    pub fn boundaries(&mut self) -> Vec<Boundary> {
        let start = self.cycle();
        let marks = self.mcu.markers().len();
        let subject = self.subject;
        self.mcu.explore(|mcu| {
            let mut boundaries = Vec::new();
            let mut was_enabled = true;
            while mcu.markers().len() == marks
                && mcu.state() == State::Running
                && mcu.cycle() < start + PATIENCE
            {
                let is_enabled = mcu.interrupts_enabled();
                if is_enabled && was_enabled {
                    let after = (mcu.cycle() - start) as usize;
                    boundaries.push(Boundary { after, task: subject.task_of_stack(mcu) });
                }
                was_enabled = is_enabled;
                mcu.step();
            }
            boundaries
        })
    }

    /// Raises the tick's interrupt and runs until it is accepted. Returns the task on whose stack that
    /// happens; `None` for the kernel's stack.
    ///
    /// # Errors
    /// It is not accepted.
    pub fn tick(&mut self) -> Result<Option<TaskId>, Complaint> {
        self.interrupt(self.subject.target.tick.vector)
    }

    /// The same for the external interrupt.
    ///
    /// # Errors
    /// It is not accepted.
    pub fn press(&mut self) -> Result<Option<TaskId>, Complaint> {
        self.interrupt(self.subject.target.external.vector)
    }

    fn interrupt(&mut self, vector: u8) -> Result<Option<TaskId>, Complaint> {
        let before = self.mcu.interrupts_enabled();
        self.mcu.raise_interrupt(vector);
        let mut is_accepted = before && !self.mcu.interrupts_enabled();
        let end = self.mcu.cycle() + PATIENCE;
        let marks = self.mcu.markers().len();
        while !is_accepted {
            if self.mcu.cycle() > end || !self.mcu.is_alive() {
                return Err(format!("interrupt {vector} is not accepted"));
            }
            is_accepted = self.mcu.step().is_some_and(|accepted| accepted.vector == vector);
        }
        // After RETI an instruction runs before the next interrupt. A task may ask for a command in it, and
        // then has to ask again.
        let asks: Vec<_> = self.mcu.markers()[marks..].iter().map(|marker| marker.value).collect();
        asks.into_iter()
            .filter(|&mark| mark < HANDLER)
            .for_each(|task| self.command(task.into(), Command::Ask));
        Ok(self.subject.task_of_stack(self.mcu))
    }
}
