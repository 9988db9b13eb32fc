//! Reads the states of tasks from the kernel's data in SRAM.
//!
//! The offsets of the fields follow from `repr(C)` in [`ready.rs`](../../../kernel/src/ready.rs),
//! [`control_block.rs`](../../../kernel/src/control_block.rs), [`proxy.rs`](../../../kernel/src/proxy.rs) and
//! [`timer.rs`](../../../kernel/src/timer.rs), with addresses of two bytes. The meanings of links are in
//! [`link.rs`](../../../kernel/src/link.rs). A faulty program may have overwritten the data with anything, so
//! nothing here relies on their being valid.

use crate::cpu::{Cpu, Registers};
use crate::trace::names::Names;
use crate::trace::{NotTraceable, TaskState, Wait};

/// In `Kernel`: the task that should run, the running task, and the last task of each queue of ready tasks.
const HEAD: u16 = 0;
const RUNNING: u16 = 2;
const QUEUES: u16 = 5;
const LEVELS: u16 = 8;
/// In `Kernel`: the first timer.
const TIMERS: u16 = QUEUES + 2 * LEVELS;

/// In `ControlBlock`.
const LEVEL: u16 = 0;
const STACK_POINTER: u16 = 1;
pub(super) const LINK: u16 = 3;
const PRIORITY: u16 = 5;

/// In `ControlBlock::stack_pointer`: the context is a preempted one.
const PREEMPTED: u16 = 0x8000;

/// In `ControlBlock::level`.
const HALTED: u8 = 0x80;

/// In `ControlBlock::priority`.
const PROXY: u8 = 0x20;
const KILLED: u8 = 0x10;
const PROXIED: u8 = 0x08;

/// In `Timer`, after the link to the next one.
const DEADLINE: u16 = 2;
const TARGET: u16 = 4;

/// Links that lead to no task: `END` marks the end of a list; the two others have meanings of their own.
const END: u16 = 0x8000;
const DELAYED: u16 = 0xff00;
const PARKED: u16 = 0xfe00;

/// No list is longer, unless the program has corrupted the kernel's data.
const LONGEST_LIST: usize = 256;

/// The addresses of the kernel's data.
pub(crate) struct Kernel {
    start: u16,
    idle: u16,
    /// Bytes of a control block.
    control_block: u16,
    ticks: Option<u16>,
}

/// Why a task is not ready.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// There is no task on the stack.
    Absent,
    /// The addresses of the semaphores, and the ticks until the wait ends by itself.
    Waiting {
        on: Vec<u16>,
        ticks: Option<u16>,
    },
    Suspended,
    Killed,
}

impl Kept {
    /// The task's state, with the program's names; `None` if there is no task.
    pub fn state(self, names: &mut Names) -> Option<TaskState> {
        match self {
            Kept::Absent => None,
            Kept::Suspended => Some(TaskState::Suspended),
            Kept::Killed => Some(TaskState::Killed),
            Kept::Waiting { on, ticks } => {
                let on = on.into_iter().map(|semaphore| names.name(semaphore)).collect();
                Some(TaskState::Waiting(Wait { on, ticks }))
            }
        }
    }
}

impl Kernel {
    pub fn of(names: &Names, cpu: Cpu) -> Result<Self, NotTraceable> {
        let place = |path: &'static str, least: u16| {
            let fits = |&(start, size): &(u16, u16)| {
                size >= least
                    && start >= cpu.ram_start()
                    && usize::from(start) + usize::from(size) <= cpu.data_size()
            };
            names.place(path).filter(fits).ok_or(NotTraceable(path))
        };
        let (start, _) = place("kernel::KERNEL", TIMERS + 2)?;
        let (idle, control_block) = place("kernel::IDLE", PRIORITY + 1)?;
        let ticks = names.place("kernel::timer::TICKS").map(|(start, _)| start);
        Ok(Self { start, idle, control_block, ticks })
    }

    /// The bytes of a control block, after which the task's stack begins.
    pub fn control_block_bytes(&self) -> u16 {
        self.control_block
    }

    /// The address of the byte that is stored last when another task becomes the running one.
    pub fn running_changes_at(&self) -> u16 {
        self.start + RUNNING + 1
    }

    /// The addresses of the bytes that change when a task becomes ready.
    pub fn queues(&self) -> std::ops::Range<u16> {
        self.start + QUEUES..self.start + TIMERS
    }

    /// The task to which the kernel gives the CPU; `None` if it idles. While the kernel loads the context of
    /// another task, the idle task is its running one.
    pub fn chosen(&self, cpu: Cpu) -> Option<u16> {
        let running = word(cpu, self.start + RUNNING);
        let task = if running == self.idle { word(cpu, self.start + HEAD) } else { running };
        (task != self.idle).then_some(task)
    }

    /// All tasks that are ready, including the running one.
    pub fn ready(&self, cpu: Cpu) -> Vec<u16> {
        let mut ready = Vec::new();
        for last in self.queues().step_by(2).map(|queue| word(cpu, queue)) {
            if !is_task(last) {
                continue;
            }
            let mut task = last;
            for _ in 0..LONGEST_LIST {
                task = word(cpu, task.wrapping_add(LINK));
                ready.push(task);
                if task == last || !is_task(task) {
                    break;
                }
            }
        }
        ready
    }

    /// Whether the kernel's data are initialised. Before that they are chance values.
    pub fn is_laid(&self, cpu: Cpu, is_task: impl Fn(u16) -> bool) -> bool {
        let tasks = [HEAD, RUNNING].map(|at| word(cpu, self.start + at));
        tasks.into_iter().all(|task| task == self.idle || is_task(task))
    }

    /// The kernel's running task; `None` if that is the idle task.
    pub fn running(&self, cpu: Cpu) -> Option<u16> {
        Some(word(cpu, self.start + RUNNING)).filter(|&task| task != self.idle)
    }

    /// The registers with which a task resumes, from its saved context. A voluntary context has Y and the
    /// return address, a preempted one all registers (kernel/src/arch/avr/mod.rs). Registers that are not
    /// saved read 0.
    pub fn saved(&self, cpu: Cpu, task: u16) -> Registers {
        let stack_pointer = word(cpu, task.wrapping_add(STACK_POINTER));
        let lowest = stack_pointer & !PREEMPTED;
        let byte = |at: u16| word(cpu, lowest.wrapping_add(at)).to_le_bytes()[0];
        let mut registers = Registers::default();
        let return_address = if stack_pointer & PREEMPTED == 0 {
            [registers.general[29], registers.general[28]] = [byte(1), byte(2)];
            3
        } else {
            // From the lowest byte up.
            let order = (2..18).rev().chain((18..30).rev()).chain([1]);
            for (at, register) in (0..).zip(order) {
                registers.general[register] = byte(at);
            }
            registers.status = byte(29) | 0x80; // I was set when the interrupt was accepted
            [registers.general[0], registers.general[30], registers.general[31]] =
                [byte(30), byte(31), byte(32)];
            33
        };
        registers.pc = 2 * u32::from(u16::from_be_bytes([byte(return_address), byte(return_address + 1)]));
        registers.stack_pointer = lowest.wrapping_add(return_address + 1);
        registers
    }

    /// The state of a task while `running` has the CPU and the tasks in `ready` are ready; `None` if there is
    /// no task.
    pub fn state(
        &self,
        cpu: Cpu,
        task: u16,
        (running, ready): (Option<u16>, &[u16]),
        names: &mut Names,
    ) -> Option<TaskState> {
        if running == Some(task) {
            Some(TaskState::Running)
        } else if ready.contains(&task) {
            Some(TaskState::Ready)
        } else {
            self.kept(cpu, task).state(names)
        }
    }

    /// Why a task is not ready.
    pub fn kept(&self, cpu: Cpu, task: u16) -> Kept {
        let [flags, _] = word(cpu, task.wrapping_add(PRIORITY)).to_le_bytes();
        match word(cpu, task.wrapping_add(LINK)) {
            _ if flags & KILLED != 0 => Kept::Killed,
            PARKED => Kept::Suspended,
            DELAYED => Kept::Waiting { on: Vec::new(), ticks: self.ticks_left(cpu, task, &[]) },
            0 => Kept::Absent,
            link if link & END != 0 && flags & PROXIED != 0 => {
                let on = self.awaited_by_proxies(cpu, link & !END);
                Kept::Waiting { ticks: self.ticks_left(cpu, task, &on), on }
            }
            _ => {
                let on = queue_of(cpu, task).into_iter().collect::<Vec<_>>();
                Kept::Waiting { ticks: self.ticks_left(cpu, task, &on), on }
            }
        }
    }

    /// The semaphores in whose queues proxy waiters of a wait set stand. Proxy waiters may lie anywhere in
    /// SRAM. They are found by their bytes, which name the wait set, and by standing in the queue of their
    /// semaphore.
    fn awaited_by_proxies(&self, cpu: Cpu, set: u16) -> Vec<u16> {
        let of_set = |control_block: &[u8]| match control_block {
            &[HALTED, low, high, _, _, flags, ..] => {
                u16::from_le_bytes([low, high]) == set && flags & PROXY != 0
            }
            _ => false,
        };
        let size = usize::from(self.control_block);
        let found: Vec<u16> = cpu.with_data(|data| {
            let ram = usize::from(cpu.ram_start())..data.len() - size;
            ram.filter(|&at| of_set(&data[at..at + size])).map(|at| at as u16).collect()
        });
        let awaited = |proxy: u16| {
            let semaphore = word(cpu, proxy.wrapping_add(self.control_block));
            queue(cpu, semaphore).contains(&proxy).then_some(semaphore)
        };
        found.into_iter().filter_map(awaited).collect()
    }

    /// The ticks until a timer wakes the task, or posts one of the semaphores that it waits for; `None`
    /// without such a timer.
    fn ticks_left(&self, cpu: Cpu, task: u16, semaphores: &[u16]) -> Option<u16> {
        let now = word(cpu, self.ticks?);
        let mut timer = word(cpu, self.start + TIMERS);
        for _ in 0..LONGEST_LIST {
            if !is_task(timer) {
                break;
            }
            let target = word(cpu, timer.wrapping_add(TARGET));
            if target == task | END || semaphores.contains(&target) {
                return Some(word(cpu, timer.wrapping_add(DEADLINE)).wrapping_sub(now));
            }
            timer = word(cpu, timer);
        }
        None
    }
}

/// The semaphore in whose queue a task stands. The link at the end of the queue leads to it.
fn queue_of(cpu: Cpu, task: u16) -> Option<u16> {
    let mut link = word(cpu, task.wrapping_add(LINK));
    for _ in 0..LONGEST_LIST {
        if !is_task(link) {
            break;
        }
        link = word(cpu, link.wrapping_add(LINK));
    }
    (link & END != 0).then_some(link & !END)
}

/// The tasks and proxy waiters in the queue of a semaphore.
fn queue(cpu: Cpu, semaphore: u16) -> Vec<u16> {
    let mut waiting = Vec::new();
    let mut link = word(cpu, semaphore);
    while is_task(link) && waiting.len() < LONGEST_LIST {
        waiting.push(link);
        link = word(cpu, link.wrapping_add(LINK));
    }
    waiting
}

/// Whether a link leads to a task, or another address in SRAM: it is neither an end nor a number of signals.
fn is_task(link: u16) -> bool {
    (0x100..END).contains(&link)
}

/// A word of SRAM; 0 beyond its end.
pub(super) fn word(cpu: Cpu, address: u16) -> u16 {
    let start = usize::from(address);
    cpu.with_data(|data| match data.get(start..start + 2) {
        Some(&[low, high]) => u16::from_le_bytes([low, high]),
        _ => 0,
    })
}

const _: () =
    assert!(LEVEL == 0 && STACK_POINTER == 1 && LINK == 3, "`of_set` matches a control block's bytes");
