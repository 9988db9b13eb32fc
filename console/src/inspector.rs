//! The inspector, one on each MCU: the lowest of its tasks, which answers what the console asks.
//!
//! Whenever it runs all others wait, and none of them is kept from its work.

use kernel::{Never, Task, TaskHandle, Ticks, now};
use tasks::counter::Counter;
use tasks::link::port::Port;
use tasks::mailbox::Mailbox;
use tasks::message::Letter;

use super::question::{BRIDGE, COUNTING, COUNTS, DEVICES, MCU, MOTORS, TASK};

/// How long the inspector looks at how much of the CPU is left to it, in ticks of 1 ms.
pub const LOOK: Ticks = 50;

/// How often it can work in this time, where it has the CPU for itself: each time for 0.1 ms.
pub const WORKS: u16 = LOOK * 10;

/// The cycles of that, of 1,600, that the look takes besides the work.
pub const ROUND: u16 = 32;

/// An MCU as its inspector sees it.
pub struct Inspected {
    /// All tasks, in the order of their [names](super::report).
    pub tasks: &'static [TaskHandle],
    /// All counts.
    pub counts: &'static Counts,
}

/// By [`Who`](super::question::Who) has them, what is counted on an MCU.
pub type Counts = [&'static [Counter]; COUNTING];

/// What an MCU with these links counts.
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

/// Runs the inspector on `mailbox`. Answers go to `console`. `reset_cause` gives the flags of MCUCSR at the
/// start. `work` keeps the CPU busy for 0.1 ms less [`ROUND`] cycles, not counting what interrupts it.
#[inline(always)] // what is known of the MCU is known to the compiler then
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
            // One that finds no room is asked for again.
            let _ = console.put(task, letter);
        }
    }
}

impl Inspected {
    /// Writes what there is to say of a task, or of counts.
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

/// How often it works while it looks: as much of the time as all others and interrupts leave it.
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
