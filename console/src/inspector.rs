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

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::posting::put;
    use crate::question::{Question, words};
    use kernel::{Interrupt, LONGEST, Priority, Stack, host};
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicU16, Ordering::Relaxed};
    use std::vec::Vec;
    use tasks::dock::Dock;
    use tasks::message::{Address, TaskCode};

    const CONSOLE: Address = Address::here(TaskCode::CONSOLE);
    const INSPECTOR: Address = Address::here(TaskCode::SLAVE_INSPECTOR);

    /// How often the inspector looks at the clock in a tick, if it has the CPU for itself.
    const LOOKS: u16 = WORKS / LOOK;

    static QUESTIONS: Mailbox = Mailbox::new(3);
    static ANSWERS: Mailbox = Mailbox::new(1);
    static CLIENT: Stack<100> = Stack::new();
    static INSPECTS: Stack<200> = Stack::new();
    static TASKS: [TaskHandle; 2] = [CLIENT.task(), INSPECTS.task()];
    static LINKS: [Port; 3] = [Port::new(Dock::Down), Port::new(Dock::Back), Port::new(Dock::Up)];
    static OF_BRIDGE: [Counter; 8] = [const { Counter::new() }; 8];
    static OF_MOTORS: [Counter; 2] = [const { Counter::new() }; 2];
    static OF_DEVICES: [Counter; 3] = [const { Counter::new() }; 3];
    static COUNTED: Counts =
        super::counts([&LINKS[0], &LINKS[1], &LINKS[2]], &OF_BRIDGE, &OF_MOTORS, &OF_DEVICES);

    fn ask(task: &mut Task, payload: &[u8]) {
        put(task, &QUESTIONS, INSPECTOR, CONSOLE, payload);
    }

    fn answer(task: &mut Task, question: Question) -> Vec<u16> {
        ask(task, &question.to_payload());
        ANSWERS.wait(task);
        let answer = ANSWERS.take(task).expect("it was woken by that");
        assert_eq!((answer.to(), answer.from()), (CONSOLE, INSPECTOR));
        words(question, answer.payload()).expect("to this question").collect()
    }

    /// So often, time passes as the inspector looks at the clock.
    fn tick(interrupt: &mut Interrupt) {
        host::tick(interrupt);
        host::arrive_later(LOOKS.into(), tick);
    }

    #[test]
    fn each_question_has_its_answer() {
        static ANSWERED: Mutex<Vec<Vec<u16>>> = Mutex::new(Vec::new());
        static WORKED: AtomicU16 = AtomicU16::new(0);
        let counts = |of, from| Question::Counts { of, from };
        let rows: [(Question, &[u16]); 15] = [
            // It has worked at each look but the first, which saw that a tick had passed.
            (Question::Mcu, &[WORKS - 1, 0x1B]),
            (Question::Task(0), &[6, 100, 0]),
            (Question::Task(1), &[7, 200, 0]),
            (Question::Task(2), &[]),
            // As many as there is room for, and no more than there are.
            (counts(Dock::Down.index(), 0), &[100, 101, 102, 103, 104, 105, 106]),
            (counts(Dock::Down.index(), 7), &[107, 108, 109, 110, 111]),
            (counts(Dock::Back.index(), 11), &[211]),
            (counts(Dock::Up.index(), 11), &[311]),
            (counts(Dock::Up.index(), 12), &[]),
            (counts(Dock::Up.index(), 13), &[]),
            (counts(Dock::Front.index(), 0), &[]),
            (counts(BRIDGE, 6), &[406, 407]),
            (counts(MOTORS, 0), &[500, 501]),
            (counts(DEVICES, 0), &[600, 601, 602]),
            (counts(DEVICES + 1, 0), &[]),
        ];
        let ask_all = move |task: &mut Task| {
            let [down, back, up] = [&LINKS[0], &LINKS[1], &LINKS[2]].map(Port::counts);
            for (first, counters) in
                (100..).step_by(100).zip([down, back, up, &OF_BRIDGE, &OF_MOTORS, &OF_DEVICES])
            {
                (first..).zip(counters).for_each(|(count, counter)| counter.set(task, count));
            }
            for other in [&[][..], &[TASK], &[TASK, 0, 0]] {
                ask(task, other); // no question: it has no answer
            }
            // The clock will begin anew within the first measurement.
            task.delay(LONGEST);
            task.delay(LONGEST);
            for (question, _) in rows {
                let answer = answer(task, question);
                ANSWERED.lock().expect("no test panicked with it").push(answer);
            }
            loop {
                task.delay(LONGEST);
            }
        };
        host::run_for(
            u32::from(u16::MAX),
            |boot| {
                let inspect = |task: &mut Task| {
                    host::arrive_later(LOOKS.into(), tick);
                    let mcu = Inspected { tasks: &TASKS, counts: &COUNTED };
                    let work = || _ = WORKED.fetch_add(1, Relaxed);
                    run(task, &QUESTIONS, &ANSWERS, mcu, |_| 0x1B, work)
                };
                CLIENT.start(boot, Priority::P6, ask_all).expect("the stack is free");
                INSPECTS.start(boot, Priority::P7, inspect).expect("the stack is free");
            },
            |_, _| {},
        );
        host::cancel_arrival();
        assert_eq!(*ANSWERED.lock().expect("no test panicked with it"), rows.map(|(_, answer)| answer));
        assert_eq!(WORKED.load(Relaxed), WORKS - 1);
    }
}
