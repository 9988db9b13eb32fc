//! Records what an MCU does, instruction by instruction.
//!
//! The kernel's data are consistent while interrupts are enabled, and where the kernel switches to another
//! task. There the tracer reads them, if any of them has changed. A change takes effect at its first store.

use std::collections::HashMap;

use crate::character::Character;
use crate::cpu::{Core, Cpu};
use crate::image::Image;
use crate::interpreter::Now;
use crate::trace::kernel::{Kernel, LINK};
use crate::trace::names::Names;
use crate::trace::track::{Slice, Track};
use crate::trace::watch::{Meaning, REGISTERS, Watch};
use crate::trace::{Holder, NotTraceable, RegisterWrite, SerialTrace, TaskState, TaskTrace, Trace};

/// The tracer of one MCU.
pub(crate) struct Tracer {
    watch: Watch,
    kernel: Kernel,
    names: Names,
    cpu: Track<Holder>,
    /// The holder of the CPU while the core does not sleep.
    holder: Holder,
    is_asleep: bool,
    /// Interrupts that are over.
    interrupts: Vec<Slice<u8>>,
    /// Interrupts under way: the vectors, and the cycles at which they were accepted.
    under_way: Vec<(u8, u64)>,
    tasks: Vec<Followed>,
    /// Indices of tasks by the addresses of their control blocks.
    indices: HashMap<u16, usize>,
    /// By address, the data that a store there changes.
    watched: Vec<Watched>,
    /// The cycle of the first change to a queue of ready tasks since the last `read`.
    queues_changed: Option<u64>,
    /// Data have changed since the last `read`, or the program is about to begin.
    is_unread: bool,
    /// The cycle at which the last reset is over.
    starts_at: u64,
    serial: Vec<SerialTrace>,
    registers: Vec<RegisterWrite>,
}

struct Followed {
    control_block: u16,
    /// The cycle of the first change to its link since the last `read`.
    changed: Option<u64>,
    /// Its state while it does not have the CPU.
    otherwise: Option<TaskState>,
    states: Track<TaskState>,
}

/// The data that a byte of SRAM or a register belongs to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Watched {
    Nothing,
    Running,
    Queues,
    /// The link of the task with this index.
    Link(u16),
    /// A register that drives motors.
    Register,
}

impl Tracer {
    /// Begins at `cycle`, at which the MCU gets its power.
    pub fn new(cpu: Cpu, image: &Image, cycle: u64) -> Result<Self, NotTraceable> {
        let names = Names::of(image);
        let kernel = Kernel::of(&names, cpu)?;
        let mut watched = vec![Watched::Nothing; cpu.data_size()];
        for address in kernel.queues() {
            watched[usize::from(address)] = Watched::Queues;
        }
        watched[usize::from(kernel.running_changes_at())] = Watched::Running;
        for register in REGISTERS {
            watched[usize::from(register)] = Watched::Register;
        }
        let mut tracer = Self {
            watch: Watch::of(image)?,
            kernel,
            names,
            cpu: Track::new(),
            holder: Holder::Reset,
            is_asleep: false,
            interrupts: Vec::new(),
            under_way: Vec::new(),
            tasks: Vec::new(),
            indices: HashMap::new(),
            watched,
            queues_changed: None,
            is_unread: false,
            starts_at: 0,
            serial: Vec::new(),
            registers: Vec::new(),
        };
        tracer.reset(cycle, cycle);
        Ok(tracer)
    }

    /// The instruction at word `at` was executed.
    #[inline(always)]
    pub fn note(&mut self, cpu: Cpu, at: u32, now: &Now) {
        let meaning = self.watch.meaning(at);
        if meaning != Meaning::Nothing || self.is_unread {
            self.look(cpu, meaning, at, now);
        }
    }

    #[inline(never)]
    fn look(&mut self, cpu: Cpu, meaning: Meaning, at: u32, now: &Now) {
        let cycle = now.cycle();
        match meaning {
            Meaning::Nothing => {}
            Meaning::Store | Meaning::Output => self.stored(cpu, at, cycle),
            Meaning::Return => self.interrupt_ends(cycle),
            Meaning::Save => self.interrupt_ends(cycle),
            Meaning::Switch => {
                self.interrupt_ends(cycle);
                if self.is_starting() {
                    self.begin(cpu, cycle);
                }
                self.read(cpu);
            }
            Meaning::Sleep => {
                self.is_asleep = cpu.core() == Core::Sleeping;
                self.show(cycle);
            }
        }
        if self.holder == Holder::Reset {
            self.hold(self.starts_at, Holder::Start);
        }
        if self.is_unread && now.interrupts_enabled() {
            self.read(cpu);
        }
    }

    /// The core wakes at `cycle`, if it slept.
    pub fn wakes(&mut self, cycle: u64) {
        self.is_asleep = false;
        self.show(cycle);
    }

    /// An interrupt is accepted at `cycle`.
    pub fn accepted(&mut self, vector: u8, cycle: u64) {
        self.wakes(cycle);
        self.under_way.push((vector, cycle));
    }

    /// A reset occurs at `cycle`, and the program begins at `starts_at`.
    pub fn reset(&mut self, cycle: u64, starts_at: u64) {
        while !self.under_way.is_empty() {
            self.interrupt_ends(cycle);
        }
        for task in &mut self.tasks {
            task.changed = None;
            task.otherwise = None;
            task.states.turn(cycle, None);
        }
        for address in REGISTERS {
            self.registers.push(RegisterWrite { cycle, address, value: 0 });
        }
        self.is_asleep = false;
        self.is_unread = true;
        self.starts_at = starts_at;
        self.hold(cycle, Holder::Reset);
    }

    /// Serial port `number` has sent `characters`.
    pub fn sent(&mut self, number: usize, characters: &[Character]) {
        self.serial(number).sent.extend_from_slice(characters);
    }

    /// `character` comes in at serial port `number`.
    pub fn receives(&mut self, number: usize, character: Character) {
        self.serial(number).received.push(character);
    }

    fn serial(&mut self, number: usize) -> &mut SerialTrace {
        if number >= self.serial.len() {
            self.serial.resize_with(number + 1, SerialTrace::default);
        }
        &mut self.serial[number]
    }

    /// Ends the trace at `cycle`, and with it all open slices.
    pub fn finish(mut self, cycle: u64) -> Trace {
        if self.holder == Holder::Reset && self.starts_at < cycle {
            self.hold(self.starts_at, Holder::Start);
        }
        while !self.under_way.is_empty() {
            self.interrupt_ends(cycle);
        }
        let mut interrupts = self.interrupts;
        // Of two with the same begin the longer one first: an interrupt lies within the one that it
        // interrupts.
        interrupts.sort_by_key(|interrupt| (interrupt.begin, u64::MAX - interrupt.end));
        let names = &mut self.names;
        let tasks = self.tasks.into_iter().map(|task| TaskTrace {
            name: names.name(task.control_block),
            states: task.states.finish(cycle),
        });
        let (tasks, cpu) = (tasks.collect(), self.cpu.finish(cycle));
        Trace { cpu, interrupts, tasks, serial: self.serial, registers: self.registers, end: cycle }
    }

    /// The kernel does not run yet.
    fn is_starting(&self) -> bool {
        matches!(self.holder, Holder::Reset | Holder::Start)
    }

    /// The kernel runs from now on.
    fn begin(&mut self, cpu: Cpu, cycle: u64) {
        self.hold(cycle, Holder::Idle);
        self.queues_changed = Some(cycle);
        for task in &mut self.tasks {
            task.changed = Some(cycle);
        }
        self.read(cpu);
    }

    fn stored(&mut self, cpu: Cpu, at: u32, cycle: u64) {
        let Some(address) = self.watch.stored_at(cpu, at) else { return };
        let watched = self.watched.get(usize::from(address)).copied().unwrap_or(Watched::Nothing);
        let changed = match watched {
            Watched::Nothing => return,
            Watched::Register => {
                return self.registers.push(RegisterWrite { cycle, address, value: cpu.data(address) });
            }
            // Before the kernel runs, such a store only initialises its data.
            _ if self.is_starting() => return,
            Watched::Running => return self.switch(cpu, cycle),
            Watched::Queues => &mut self.queues_changed,
            Watched::Link(index) => &mut self.tasks[usize::from(index)].changed,
        };
        changed.get_or_insert(cycle);
        self.is_unread = true;
    }

    /// The kernel gives the CPU to a task, or idles.
    fn switch(&mut self, cpu: Cpu, cycle: u64) {
        let holder = match self.kernel.chosen(cpu) {
            Some(task) => Holder::Task(self.index(task, cycle)),
            None => Holder::Idle,
        };
        self.hold(cycle, holder);
    }

    fn hold(&mut self, cycle: u64, holder: Holder) {
        let before = std::mem::replace(&mut self.holder, holder);
        if before != holder {
            for holder in [before, holder] {
                if let Holder::Task(index) = holder {
                    self.show_task(index, cycle);
                }
            }
        }
        self.show(cycle);
    }

    fn show(&mut self, cycle: u64) {
        self.cpu.turn(cycle, Some(if self.is_asleep { Holder::Sleep } else { self.holder }));
    }

    fn show_task(&mut self, index: usize, cycle: u64) {
        let task = &mut self.tasks[index];
        let has_cpu = self.holder == Holder::Task(index);
        task.states.turn(cycle, if has_cpu { Some(TaskState::Running) } else { task.otherwise.clone() });
    }

    /// Ends the innermost interrupt under way. There may be none: a preempted task resumes by the same
    /// instruction as one that was only interrupted.
    fn interrupt_ends(&mut self, cycle: u64) {
        if let Some((what, begin)) = self.under_way.pop() {
            self.interrupts.push(Slice { begin, end: cycle, what });
        }
    }

    /// Reads the kernel's data.
    fn read(&mut self, cpu: Cpu) {
        if self.is_starting() {
            return;
        }
        let ready = self.kernel.ready(cpu);
        if let Some(cycle) = self.queues_changed.take() {
            for &task in &ready {
                self.index(task, cycle);
            }
        }
        for index in 0..self.tasks.len() {
            let Some(cycle) = self.tasks[index].changed.take() else { continue };
            let task = self.tasks[index].control_block;
            self.tasks[index].otherwise = if ready.contains(&task) {
                Some(TaskState::Ready)
            } else {
                self.kernel.kept(cpu, task).state(&mut self.names)
            };
            self.show_task(index, cycle);
        }
        self.is_unread = false;
    }

    /// The index of a task. A new task is added, and its link is watched from now on; its first state begins
    /// at `cycle`.
    fn index(&mut self, control_block: u16, cycle: u64) -> usize {
        if let Some(&index) = self.indices.get(&control_block) {
            return index;
        }
        let index = self.tasks.len();
        self.indices.insert(control_block, index);
        self.tasks.push(Followed {
            control_block,
            changed: Some(cycle),
            otherwise: None,
            states: Track::new(),
        });
        let link = usize::from(control_block.wrapping_add(LINK));
        if let Some(bytes) = self.watched.get_mut(link..link + 2) {
            bytes.fill(Watched::Link(index as u16));
        }
        self.is_unread = true;
        index
    }
}
