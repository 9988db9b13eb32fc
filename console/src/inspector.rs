//! The inspector, one on each MCU: the task of lowest priority, which answers the console's questions.
//!
//! It runs only while all other tasks wait, so it keeps none of them from its work.

use kernel::{Never, Task, TaskHandle, Ticks, now};
use tasks::counter::Counter;
use tasks::link::port::Port;
use tasks::mailbox::Mailbox;
use tasks::message::Letter;

use super::question::{BRIDGE, COUNTING, COUNTS, DEVICES, MCU, MOTORS, TASK};

/// For how long the inspector measures the share of the CPU that is left to it, in ticks of 1 ms.
pub const LOOK: Ticks = 50;

/// How often it can work in this time if it has the CPU for itself: each time for 0.1 ms.
pub const WORKS: u16 = LOOK * 10;

/// The cycles of these 0.1 ms, 1,600, that the loop takes besides the work.
pub const ROUND: u16 = 32;

/// An MCU as its inspector sees it.
pub struct Inspected {
    /// All tasks, in the order of their [names](super::report).
    pub tasks: &'static [TaskHandle],
    /// All counts.
    pub counts: &'static Counts,
}

/// The counters of an MCU, by [`Who`](super::question::Who) has them.
pub type Counts = [&'static [Counter]; COUNTING];

/// The counts of an MCU with these links.
pub const fn counts(
    [first, second, third]: [&'static Port; 3],
    bridge: &'static [Counter],
    motors: &'static [Counter],
    devices: &'static [Counter],
) -> Counts {
    let mut counts: Counts = [&[]; COUNTING];
    counts[first.dock() as usize] = first.counts();
    counts[second.dock() as usize] = second.counts();
    counts[third.dock() as usize] = third.counts();
    counts[BRIDGE as usize] = bridge;
    counts[MOTORS as usize] = motors;
    counts[DEVICES as usize] = devices;
    counts
}

/// Runs the inspector on `mailbox`. Answers go to `console`. `reset_cause` returns the flags of MCUCSR at the
/// start. `work` keeps the CPU busy for 0.1 ms less [`ROUND`] cycles, not counting what interrupts it.
#[inline(always)] // so the compiler knows all that is constant about the MCU
pub fn run(
    task: &mut Task,
    mailbox: &'static Mailbox,
    console: &'static Mailbox,
    mcu: Inspected,
    reset_cause: impl Fn(&mut Task) -> u8,
    work: impl Fn(),
) -> Never {
    loop {
        mailbox.wait(task);
        let Some(mut letter) = mailbox.take(task) else { continue };
        if let &[kind, index] = letter.payload() {
            letter.turn();
            if kind == MCU {
                letter.push(worked(task, &work));
                letter.push(reset_cause(task).into());
            } else {
                mcu.tell(task, kind, index, &mut letter);
            }
            // If the answer finds no room, the console asks again.
            let _ = console.put(task, letter);
        }
    }
}

impl Inspected {
    /// Writes the answer about a task, or about counts.
    #[inline(always)]
    fn tell(&self, task: &mut Task, kind: u8, index: u8, answer: &mut Letter) {
        let index = usize::from(index);
        if kind == TASK {
            let Some(told) = self.tasks.get(index) else { return };
            answer.push(told.priority(task) as u16);
            answer.push(told.stack_size() as u16);
            answer.push(told.unused_stack(task).unwrap_or(0) as u16);
        } else if let Some(counts) = self.counts.get(usize::from(kind.wrapping_sub(COUNTS)))
            && let Some(counts) = counts.get(index..)
        {
            // As many as there is room for.
            for count in counts {
                answer.push(count.get(task));
            }
        }
    }
}

/// How often it works during the measurement: in the time that other tasks and interrupts leave to it.
#[inline(always)]
fn worked(task: &mut Task, work: &impl Fn()) -> u16 {
    let before = now(task);
    while now(task) == before {}
    let mut worked = 0;
    // It begins with the next tick.
    while now(task).wrapping_sub(before) <= LOOK {
        work();
        worked += 1;
    }
    worked
}
