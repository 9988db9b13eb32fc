//! The kernel's own data in RAM, and the conditions that must hold for it.
//!
//! It is read by the layout of the kernel's `Kernel`, `ControlBlock` and `Timer`, which have no padding on
//! the AVR.

use simavr_harness::{Image, Mcu, Place};

use crate::target::Target;

/// The ends of the mangled names of statics.
const KERNEL: &str = "6kernel6KERNEL";
const IDLE: &str = "6kernel4IDLE";
const TICKS: &str = "6kernel5timer5TICKS";
const NEXT_DEADLINE: &str = "6kernel5timer13NEXT_DEADLINE";
/// The prefix of the names of the stacks.
const STACKS: &str = "5sweep5stack";

/// Offsets in `Kernel`.
const RUNNING: u16 = 2;
const HEAD_LEVEL: u16 = 4;
const LAST: u16 = 5;
const FIRST_TIMER: u16 = 21;

/// The level of the idle task, and the number of queues of ready tasks.
const LEVELS: u8 = 8;

/// Offsets in `ControlBlock`, and its size.
const LEVEL: u16 = 0;
const STACK_POINTER: u16 = 1;
const LINK: u16 = 3;
const PRIORITY: u16 = 5;
const CONTROL_BLOCK: u16 = 6;

/// Flags in the byte of the priority, whose low bits are the priority: a task that waits by proxy waiters has
/// the first. A proxy waiter, whose stack pointer is the address of its wait set, has the second.
const PROXIED: u8 = 0x08;
const PROXY: u8 = 0x20;

/// A flag in the level of a task that is suspended or was killed, and of a proxy waiter.
const HALTED: u8 = 0x80;

/// The link of a task that has not started or has ended, and the bit that the ends of all lists have set.
const NONE: u16 = 0;
const END: u16 = 0x8000;

/// Offset in `WaitSet`.
const SET_TASK: u16 = 2;

/// More tasks than wait for anything in any image.
const MOST_WAITING: usize = 20;

/// Offset in `Timer`.
const DEADLINE: u16 = 2;

/// The sizes of a task's contexts on its stack besides the program counter, in bytes.
const VOLUNTARY: u16 = 2;
const PREEMPTED: u16 = 33;

/// The stack pointer of a task that is being started.
const STARTS: u16 = 1;

/// The bit that the saved stack pointer of a preempted task has set.
const PREEMPTED_MARK: u16 = 0x8000;

/// More timers than any image has.
const MOST_TIMERS: usize = 100;

/// A stack. SP points into it, or at the byte below when it is full.
#[derive(Clone, Debug)]
pub struct Stack {
    pub name: String,
    /// The task's control block; for the kernel's stack, that of the idle task.
    pub control: u16,
    /// The lowest byte, and the highest.
    pub lowest: u16,
    pub highest: u16,
}

impl Stack {
    pub fn holds(&self, stack_pointer: u16) -> bool {
        (self.lowest - 1..=self.highest).contains(&stack_pointer)
    }

    pub fn size(&self) -> u16 {
        self.highest - self.lowest + 1
    }
}

/// The places of the kernel's data and the stacks in an image.
pub struct Kernel {
    pub target: &'static Target,
    kernel: u16,
    pub idle: u16,
    ticks: u16,
    next_deadline: u16,
    /// The kernel's stack, and then each task's.
    pub stacks: Vec<Stack>,
}

impl Kernel {
    /// # Panics
    /// When the image is not one of the sweep's.
    pub fn of(target: &'static Target, image: &Image) -> Self {
        let data: Vec<_> = image
            .symbols()
            .filter_map(|(name, symbol)| match symbol.place {
                Place::Data(start) => Some((name, start, symbol.size)),
                _ => None,
            })
            .collect();
        let find = |name: &str| {
            let symbol = data.iter().find(|(mangled, ..)| mangled.ends_with(name));
            symbol.unwrap_or_else(|| panic!("the image has no {name}")).1
        };
        let idle = find(IDLE);
        let kernel_stack = Stack {
            name: "(kernel)".to_owned(),
            control: idle,
            lowest: find("__bss_end"),
            highest: target.part.ram_end,
        };
        let mut tasks: Vec<_> = data
            .iter()
            .filter_map(|&(mangled, control, size)| {
                let (_, name) = mangled.split_once(STACKS)?;
                let name = name.trim_start_matches(|digit: char| digit.is_ascii_digit()).to_owned();
                Some(Stack { name, control, lowest: control + CONTROL_BLOCK, highest: control + size - 1 })
            })
            .collect();
        assert!(!tasks.is_empty(), "the image has no stacks");
        tasks.sort_by(|one, other| one.name.cmp(&other.name));
        let stacks = std::iter::once(kernel_stack).chain(tasks).collect();
        Kernel {
            target,
            kernel: find(KERNEL),
            idle,
            ticks: find(TICKS),
            next_deadline: find(NEXT_DEADLINE),
            stacks,
        }
    }

    /// The size of a preempted context, in bytes.
    pub fn preempted_context(&self) -> u16 {
        PREEMPTED + self.target.part.return_address
    }

    fn voluntary_context(&self) -> u16 {
        VOLUNTARY + self.target.part.return_address
    }

    /// Whether SP lies on the kernel's stack.
    pub fn is_kernel_stack(&self, stack_pointer: u16) -> bool {
        self.stacks[0].holds(stack_pointer)
    }

    pub fn head(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.kernel)
    }

    pub fn running(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.kernel + RUNNING)
    }

    /// Ticks until the next one that does more than count; 0 stands for 65,536.
    pub fn ticks_left(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.next_deadline).wrapping_sub(word(mcu, self.ticks))
    }

    /// The stack of the task with this control block.
    pub fn stack_of(&self, control: u16) -> Option<&Stack> {
        self.stacks.iter().find(|stack| stack.control == control)
    }

    /// The stack pointer of a preempted task. The saved value is the address of the lowest byte of its
    /// context.
    pub fn preempted_at(&self, mcu: &Mcu, control: u16) -> Option<u16> {
        let saved = word(mcu, control + STACK_POINTER);
        (saved & PREEMPTED_MARK != 0).then_some((saved & !PREEMPTED_MARK).wrapping_sub(1))
    }

    /// Whether there is a task on the stack of this control block.
    pub fn is_started(&self, mcu: &Mcu, control: u16) -> bool {
        word(mcu, control + STACK_POINTER) > STARTS
    }

    pub fn name(&self, control: u16) -> &str {
        self.stack_of(control).map_or("no task", |stack| &stack.name)
    }

    /// Checks the conditions that hold wherever a task runs with interrupts enabled, outside the kernel or on
    /// its return from there.
    ///
    /// # Errors
    /// The condition that does not hold.
    pub fn check(&self, mcu: &Mcu) -> Result<(), String> {
        let (head, running) = (self.head(mcu), self.running(mcu));
        if head != running {
            return Err(format!("{} runs where {} should", self.name(running), self.name(head)));
        }
        self.check_lists(mcu)
    }

    /// Checks the conditions that hold wherever interrupts are enabled.
    ///
    /// # Errors
    /// The condition that does not hold.
    pub fn check_lists(&self, mcu: &Mcu) -> Result<(), String> {
        let mut ready = vec![self.idle];
        for level in 0..LEVELS {
            self.check_ring(mcu, level, &mut ready)?;
        }
        self.check_head(mcu)?;
        self.check_waiting(mcu, &ready)?;
        self.check_contexts(mcu)?;
        self.check_timers(mcu)
    }

    /// The head is the first task of the highest queue, or the running task, which is about to find the head.
    fn check_head(&self, mcu: &Mcu) -> Result<(), String> {
        let head = self.head(mcu);
        let level = byte(mcu, self.kernel + HEAD_LEVEL);
        let last = |level: u8| word(mcu, self.kernel + LAST + 2 * u16::from(level));
        let highest = (0..LEVELS).find(|&level| last(level) != 0).unwrap_or(LEVELS);
        let first = if highest == LEVELS { self.idle } else { word(mcu, last(highest) + LINK) };
        if highest < level {
            return Err(format!("P{highest} is ready, but the head's level is {level}"));
        }
        if head != first && head != self.running(mcu) {
            return Err(format!("{} is the head, but {} is first", self.name(head), self.name(first)));
        }
        Ok(())
    }

    /// Checks the ring of the ready tasks of a level, none of which may be in `seen`.
    fn check_ring(&self, mcu: &Mcu, level: u8, seen: &mut Vec<u16>) -> Result<(), String> {
        let last = word(mcu, self.kernel + LAST + 2 * u16::from(level));
        if last == NONE {
            return Ok(());
        }
        let mut task = last;
        loop {
            task = word(mcu, task + LINK);
            if self.stack_of(task).is_none() || task == self.idle {
                return Err(format!("{task:#x} is in the queue of P{level}"));
            }
            if seen.contains(&task) {
                return Err(format!("{} is in the queue of P{level}, and is ready", self.name(task)));
            }
            if byte(mcu, task + LEVEL) != level {
                return Err(format!("{} is in the queue of P{level}", self.name(task)));
            }
            seen.push(task);
            if task == last {
                return Ok(());
            }
        }
    }

    /// The links of all tasks that are not in `ready` lead, through other waiters, to the end of a list.
    fn check_waiting(&self, mcu: &Mcu, ready: &[u16]) -> Result<(), String> {
        for stack in self.stacks[1..].iter().filter(|stack| !ready.contains(&stack.control)) {
            let name = &stack.name;
            let mut task = stack.control;
            if !self.is_started(mcu, task) {
                match word(mcu, task + LINK) {
                    NONE => continue,
                    link => return Err(format!("{name} has not started, but is linked to {link:#x}")),
                }
            }
            for number in 0.. {
                let link = word(mcu, task + LINK);
                if link & END != 0 {
                    break;
                }
                if number == MOST_WAITING || ready.contains(&link) || !self.may_wait(mcu, link) {
                    return Err(format!("{name} waits in a list with {link:#x}"));
                }
                task = link;
            }
        }
        Ok(())
    }

    /// Whether this is the control block of a task or of a proxy waiter.
    fn may_wait(&self, mcu: &Mcu, control: u16) -> bool {
        if self.stack_of(control).is_some() {
            return control != self.idle && self.is_started(mcu, control);
        }
        let task = word(mcu, word(mcu, control + STACK_POINTER).wrapping_add(SET_TASK));
        byte(mcu, control + PRIORITY) & PROXY != 0
            && byte(mcu, control + LEVEL) & HALTED != 0
            && self.stack_of(task).is_some()
            && byte(mcu, task + PRIORITY) & PROXIED != 0
    }

    /// Each task that is not running has a whole context on its own stack.
    fn check_contexts(&self, mcu: &Mcu) -> Result<(), String> {
        let running = self.running(mcu);
        let is_saved = |stack: &&Stack| stack.control != running && self.is_started(mcu, stack.control);
        for stack in self.stacks[1..].iter().filter(is_saved) {
            let (context, stack_pointer) = match self.preempted_at(mcu, stack.control) {
                Some(stack_pointer) => (self.preempted_context(), stack_pointer),
                None => (self.voluntary_context(), word(mcu, stack.control + STACK_POINTER)),
            };
            if !stack.holds(stack_pointer) || stack_pointer + context > stack.highest {
                return Err(format!("{}'s context is said to lie at {stack_pointer:#x}", stack.name));
            }
        }
        Ok(())
    }

    /// The armed timers are all due in the future, in the order of their deadlines, and the tick compares
    /// with the first.
    fn check_timers(&self, mcu: &Mcu) -> Result<(), String> {
        let now = word(mcu, self.ticks);
        let next = word(mcu, self.next_deadline);
        if word(mcu, self.kernel + FIRST_TIMER) != NONE && self.ticks_left(mcu).wrapping_sub(1) >= 0x7fff {
            return Ok(()); // timers are expiring
        }
        let mut timer = word(mcu, self.kernel + FIRST_TIMER);
        let mut before = 1;
        for number in 0.. {
            if timer == 0 {
                break;
            }
            if number == MOST_TIMERS {
                return Err("the list of timers has no end".to_owned());
            }
            let deadline = word(mcu, timer + DEADLINE);
            let ahead = deadline.wrapping_sub(now);
            if ahead < before || ahead > 0x7fff {
                return Err(format!("timer {number} in the list is due in {} ticks", ahead as i16));
            }
            if number == 0 && deadline != next {
                return Err(format!("the first timer is due at {deadline}, the tick compares with {next}"));
            }
            before = ahead;
            timer = word(mcu, timer);
        }
        Ok(())
    }
}

fn byte(mcu: &Mcu, address: u16) -> u8 {
    mcu.read(address).unwrap_or(0)
}

fn word(mcu: &Mcu, address: u16) -> u16 {
    u16::from_le_bytes([byte(mcu, address), byte(mcu, address.wrapping_add(1))])
}
