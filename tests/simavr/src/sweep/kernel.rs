//! The kernel's own data in RAM, and what must hold of it.
//!
//! Read by the layout of the kernel's `Kernel`, `ControlBlock` and `Timer`, all in bytes and without padding on the AVR.

use simavr_harness::{Image, Mcu, Part, Place};

use crate::target::Target;

/// How the mangled names of statics end.
const KERNEL: &str = "6kernel6KERNEL";
const IDLE: &str = "6kernel4IDLE";
const SCHEDULER: &str = "6kernel9SCHEDULER";
const TICKS_LEFT: &str = "6kernel5timer10TICKS_LEFT";
/// What stands before the names of the stacks.
const STACKS: &str = "5sweep5stack";

/// Offsets in `Kernel`.
const RUNNING: u16 = 2;
const ARRIVED: u16 = 4;
const LAST: u16 = 5;
const NEXT_DEADLINE: u16 = 21;
const FIRST_TIMER: u16 = 23;

/// Offsets in `ControlBlock`, and its size.
const ABOVE: u16 = 0;
const STACK_POINTER: u16 = 1;
const LINK: u16 = 3;
const PRIORITY: u16 = 5;
const CONTROL_BLOCK: u16 = 6;

/// What the byte of the priority has besides that in its low bits, where others stand in for a task, and where a control
/// block stands in for a task: what would be its stack pointer is the address of its `Group`.
const PRIORITY_BITS: u8 = 7;
const REPRESENTED: u8 = 0x40;
const STANDS_IN: u8 = 0x20;

/// `above` of a task that is suspended, as of one that stands in for another.
const SUSPENDED: u8 = 0xff;

/// Links of tasks that are in no list: one that has not started or has ended, and the ends of lists of one.
const NONE: u16 = 0;
const END: u16 = 0x8000;
const GROUPED: u16 = END | 0x7e00;

/// Offset in `Group`.
const GROUP_TASK: u16 = 2;

/// More tasks than wait for anything in any image.
const MOST_WAITING: usize = 20;

/// Offset in `Timer`.
const DEADLINE: u16 = 2;

/// What a task's context takes on its stack besides the program counter, in bytes.
const VOLUNTARY: u16 = 2;
const PREEMPTED: u16 = 33;

/// The stack pointer of a task that is being started.
const STARTS: u16 = 1;

/// What a saved stack pointer has set besides when it is a preempted task's.
const PREEMPTED_MARK: u16 = 0x8000;

/// Bytes at the top of the kernel's stack where it has interrupts enabled, as the kernel's `IDLE_STACK`: without return
/// addresses, and how many of those.
const IDLE_STACK: u16 = 52;
const IDLE_RETURN_ADDRESSES: u16 = 6;

/// More timers than any image has.
const MOST_TIMERS: usize = 100;

/// A stack: SP points into it, or at the byte below where it is full.
#[derive(Clone, Debug)]
pub struct Stack {
    pub name: String,
    /// The task's control block. The kernel's stack stands by the idle task's.
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

/// Where an image keeps the kernel's data and its stacks.
pub struct Kernel {
    pub target: &'static Target,
    kernel: u16,
    pub idle: u16,
    scheduler: u16,
    ticks_left: u16,
    /// The kernel's own, and then each task's.
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
            scheduler: find(SCHEDULER),
            ticks_left: find(TICKS_LEFT),
            stacks,
        }
    }

    /// What a preempted context takes, in bytes.
    pub fn preempted_context(&self) -> u16 {
        PREEMPTED + self.target.part.return_address
    }

    fn voluntary_context(&self) -> u16 {
        VOLUNTARY + self.target.part.return_address
    }

    /// Whether SP lies where the kernel itself, or the idle task, has interrupts enabled.
    pub fn is_idle_stack(&self, stack_pointer: u16) -> bool {
        let Part { ram_end, return_address, .. } = *self.target.part;
        let size = IDLE_STACK + IDLE_RETURN_ADDRESSES * return_address;
        (ram_end - size..=ram_end).contains(&stack_pointer)
    }

    pub fn head(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.kernel)
    }

    pub fn running(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.kernel + RUNNING)
    }

    /// Ticks up to the next that does more than to count.
    pub fn ticks_left(&self, mcu: &Mcu) -> u16 {
        word(mcu, self.ticks_left)
    }

    /// The stack of the task with this control block.
    pub fn stack_of(&self, control: u16) -> Option<&Stack> {
        self.stacks.iter().find(|stack| stack.control == control)
    }

    /// The stack pointer of a task that was preempted: what is saved is the lowest byte of its context.
    pub fn preempted_at(&self, mcu: &Mcu, control: u16) -> Option<u16> {
        let saved = word(mcu, control + STACK_POINTER);
        (saved & PREEMPTED_MARK != 0).then_some((saved & !PREEMPTED_MARK).wrapping_sub(1))
    }

    /// Whether there is a task on the stack by this control block.
    pub fn is_started(&self, mcu: &Mcu, control: u16) -> bool {
        word(mcu, control + STACK_POINTER) > STARTS
    }

    pub fn name(&self, control: u16) -> &str {
        self.stack_of(control).map_or("no task", |stack| &stack.name)
    }

    /// What must hold wherever a task runs with interrupts enabled, outside the kernel or on its return from there.
    ///
    /// # Errors
    /// What does not hold.
    pub fn check(&self, mcu: &Mcu) -> Result<(), String> {
        let (head, running) = (self.head(mcu), self.running(mcu));
        if head != running {
            return Err(format!("{} runs where {} should", self.name(running), self.name(head)));
        }
        self.check_lists(mcu)
    }

    /// What must hold wherever interrupts are enabled.
    ///
    /// # Errors
    /// What does not hold.
    pub fn check_lists(&self, mcu: &Mcu) -> Result<(), String> {
        let mut ready = self.preempted(mcu)?;
        let first_above = byte(mcu, self.head(mcu) + ABOVE);
        let arrived = byte(mcu, self.kernel + ARRIVED);
        if arrived & first_above != 0 {
            return Err(format!("{} is the head, but higher ones have arrived", self.name(self.head(mcu))));
        }
        for priority in 0..8 {
            self.check_ring(mcu, priority, arrived & 1 << priority != 0, &mut ready)?;
        }
        self.check_waiting(mcu, &ready)?;
        self.check_contexts(mcu)?;
        self.check_timers(mcu)
    }

    /// The list from the head to the idle task: in falling priority. The scheduler may stand before it.
    fn preempted(&self, mcu: &Mcu) -> Result<Vec<u16>, String> {
        let head = self.head(mcu);
        let mut task = if head == self.scheduler { word(mcu, head + LINK) } else { head };
        let mut list = vec![task];
        while task != self.idle {
            if self.stack_of(task).is_none() {
                return Err(format!("{task:#x} is in the list of preempted tasks"));
            }
            if byte(mcu, task + ABOVE) == SUSPENDED {
                return Err(format!("{} is suspended, but in the list of preempted tasks", self.name(task)));
            }
            let next = word(mcu, task + LINK);
            let [above, next_above] = [task, next].map(|task| byte(mcu, task + ABOVE));
            if next_above <= above {
                return Err(format!("{} is preempted by {}", self.name(next), self.name(task)));
            }
            list.push(next);
            task = next;
        }
        Ok(list)
    }

    /// The ring of the tasks that have arrived at a priority, none of which is in `seen`.
    fn check_ring(&self, mcu: &Mcu, priority: u8, is_there: bool, seen: &mut Vec<u16>) -> Result<(), String> {
        let last = word(mcu, self.kernel + LAST + 2 * u16::from(priority));
        if is_there != (last != 0) {
            return Err(format!("the bit of those that arrived at P{priority} is {is_there}"));
        }
        if !is_there {
            return Ok(());
        }
        let mut task = last;
        loop {
            task = word(mcu, task + LINK);
            if self.stack_of(task).is_none() || task == self.idle {
                return Err(format!("{task:#x} has arrived at P{priority}"));
            }
            if seen.contains(&task) {
                return Err(format!("{} has arrived at P{priority}, but is ready", self.name(task)));
            }
            let is_of_priority = byte(mcu, task + PRIORITY) & PRIORITY_BITS == priority
                && byte(mcu, task + ABOVE) == (1 << priority) - 1;
            if !is_of_priority {
                return Err(format!("{} has arrived at P{priority}", self.name(task)));
            }
            seen.push(task);
            if task == last {
                return Ok(());
            }
        }
    }

    /// The links of all that are not in `ready` lead, by others that wait, to the end of a list.
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
            let is_represented = byte(mcu, stack.control + PRIORITY) & REPRESENTED != 0;
            if word(mcu, stack.control + LINK) == GROUPED && !is_represented {
                return Err(format!("{name} waits for nobody"));
            }
        }
        Ok(())
    }

    /// Whether that is a control block of a task or of what stands in for one.
    fn may_wait(&self, mcu: &Mcu, control: u16) -> bool {
        if self.stack_of(control).is_some() {
            return control != self.idle && self.is_started(mcu, control);
        }
        let task = word(mcu, word(mcu, control + STACK_POINTER).wrapping_add(GROUP_TASK));
        byte(mcu, control + PRIORITY) & STANDS_IN != 0
            && byte(mcu, control + ABOVE) == SUSPENDED
            && self.stack_of(task).is_some()
            && byte(mcu, task + PRIORITY) & REPRESENTED != 0
    }

    /// Each task that does not run has a whole context on its own stack.
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

    /// The list of armed timers: all ahead, in the order of their deadlines, and the countdown leads to the first.
    fn check_timers(&self, mcu: &Mcu) -> Result<(), String> {
        let next = word(mcu, self.kernel + NEXT_DEADLINE);
        if self.ticks_left(mcu) as i16 <= 0 {
            return Ok(()); // some are being posted
        }
        let now = next.wrapping_sub(self.ticks_left(mcu));
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
                return Err(format!("the first timer is due at {deadline}, the countdown ends at {next}"));
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
