//! The mailboxes in which the harness puts commands and finds replies.

use core::cell::UnsafeCell;
use core::ptr;

use board::debug::mark;
use model::call::{Call, Outcome};
use model::wire::{ARRANGEMENT_BYTES, COMMAND_BYTES, Command, REPLY_BYTES, Reply};
use model::world::{Arrangement, Belongings};
use tests_images::finish;

use crate::objects::TASKS;

/// Bytes that the harness reads and writes while the program stands at a mark.
#[repr(transparent)]
struct Shared<const LENGTH: usize>(UnsafeCell<[u8; LENGTH]>);

// SAFETY: `read` and `write` are the only accesses, and each mailbox has one user.
unsafe impl<const LENGTH: usize> Sync for Shared<LENGTH> {}

impl<const LENGTH: usize> Shared<LENGTH> {
    const fn new() -> Self {
        Shared(UnsafeCell::new([0; LENGTH]))
    }

    fn read(&self) -> [u8; LENGTH] {
        // SAFETY: the bytes are always valid; volatile, for the harness writes them too.
        unsafe { ptr::read_volatile(self.0.get()) }
    }

    fn write(&self, bytes: [u8; LENGTH]) {
        // SAFETY: the one user of the mailbox writes; volatile, for the harness reads them.
        unsafe { ptr::write_volatile(self.0.get(), bytes) }
    }
}

/// The mailbox of a task, of the handler or of the code that starts the tasks.
#[repr(C)]
pub struct Mailbox {
    command: Shared<COMMAND_BYTES>,
    reply: Shared<REPLY_BYTES>,
}

/// The handler's mailbox, after those of the tasks. The code that starts the tasks uses it first.
pub const HANDLER: usize = TASKS;

/// The mark by which a handler asks the harness for a command. A task's mark is its number.
const HANDLER_ASKS: u8 = 0x3f;
/// Asks the harness for the arrangement.
const ARRANGE: u8 = 0x40;

/// A call begins.
const CALLS: u8 = 0x41;

#[unsafe(no_mangle)]
static MODEL_MAILBOXES: [Mailbox; TASKS + 1] =
    [const { Mailbox { command: Shared::new(), reply: Shared::new() } }; TASKS + 1];
#[unsafe(no_mangle)]
static MODEL_ARRANGEMENT: Shared<ARRANGEMENT_BYTES> = Shared::new();

/// The objects of this run.
pub fn arrangement() -> Arrangement {
    mark(ARRANGE);
    understood(Arrangement::of_bytes(&MODEL_ARRANGEMENT.read()))
}

impl Mailbox {
    /// The mailbox of this task, or the [`HANDLER`]'s.
    pub fn of(number: usize) -> &'static Mailbox {
        &MODEL_MAILBOXES[number]
    }

    /// Reports the last call's outcome to the harness.
    pub fn reply(&self, outcome: Outcome) {
        self.reply.write(Reply::Returned(outcome).to_bytes());
    }

    /// Begins with an empty reply, since no call has returned yet.
    pub fn begin(&self) {
        self.reply.write(Reply::Nothing.to_bytes());
    }

    /// The next call; `None` at the end. A mark asks the harness for it. The messages of a job are dropped
    /// before a call that ends it, or that begins jobs.
    #[inline(never)]
    pub fn next(&self, number: usize, own: &mut Belongings) -> Option<Call> {
        loop {
            mark(if number == HANDLER { HANDLER_ASKS } else { number as u8 });
            match understood(Command::of_bytes(&self.command.read())) {
                Command::Call(call) => {
                    if matches!(call, Call::RunJobs { .. } | Call::EndJob) {
                        own.drop_messages();
                    }
                    mark(CALLS);
                    return Some(call);
                }
                Command::Ask => {}
                Command::Leave => return None,
            }
        }
    }
}

fn understood<T>(value: Option<T>) -> T {
    value.unwrap_or_else(|| finish())
}
