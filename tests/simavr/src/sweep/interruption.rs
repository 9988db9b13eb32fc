//! The sweep of one path.

use std::sync::Arc;

use simavr_harness::{Image, Mcu};

use super::kernel::Kernel;
use super::watch::{AUDITED, CLOSED, OPEN, Source, WRONG, Watch};
use crate::target::Target;

/// The interrupts that are raised at a boundary, one after the other, without an instruction between.
#[derive(Clone, Copy)]
struct Interruption {
    sources: &'static [Source],
    /// Whether the path's timers are due at its first tick, and not at its second.
    is_due: bool,
    /// The interrupt that is raised once more, until the first is dealt with.
    second: Option<Source>,
}

const INTERRUPTIONS: &[Interruption] = &[
    Interruption { sources: &[Source::External], is_due: false, second: None },
    Interruption { sources: &[Source::Tick], is_due: false, second: None },
    Interruption { sources: &[Source::Tick], is_due: true, second: None },
    Interruption { sources: &[Source::External, Source::Tick], is_due: true, second: None },
    Interruption { sources: &[Source::Tick, Source::External], is_due: true, second: None },
];

const PAIRS: &[Interruption] = &[
    Interruption { sources: &[Source::External], is_due: true, second: Some(Source::Tick) },
    Interruption { sources: &[Source::Tick], is_due: true, second: Some(Source::External) },
];

/// The interruptions of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// One, at each boundary.
    Single,
    /// Also a second one, at each boundary until the task that the first interrupted continues.
    Pair,
    /// As `Pair`, but the first only between a task's block and its switch, and the second only until that
    /// switch, at boundaries where it need not wait. This costs far less.
    PairAtSwitch,
}

/// The boundaries whose number, divided by `of`, leaves `number`.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    pub number: usize,
    pub of: usize,
}

/// More instructions than any run from one path to the next takes.
const PATIENCE: usize = 200_000;

/// How many failures are reported for a path.
const TOLD: usize = 3;

/// The findings of a sweep.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Places at which a first interruption was tried.
    pub boundaries: u64,
    /// Runs to the end from there.
    pub runs: u64,
    /// Runs that were not good.
    pub failed: u64,
    /// Descriptions of the first of them.
    pub failures: Vec<String>,
    /// The longest wait of an interrupt that was raised alone, in cycles.
    pub longest_wait: u64,
    /// The most bytes in use of each of the subject's stacks.
    pub depths: Vec<u16>,
}

impl Findings {
    pub fn add(&mut self, other: &Findings) {
        self.boundaries += other.boundaries;
        self.runs += other.runs;
        self.failed += other.failed;
        let room = TOLD.saturating_sub(self.failures.len());
        self.failures.extend(other.failures.iter().take(room).cloned());
        self.longest_wait = self.longest_wait.max(other.longest_wait);
        self.note_depths(&other.depths);
    }

    fn note_depths(&mut self, depths: &[u16]) {
        self.depths.resize(depths.len().max(self.depths.len()), 0);
        for (deepest, &depth) in self.depths.iter_mut().zip(depths) {
            *deepest = depth.max(*deepest);
        }
    }
}

/// An image to be swept.
pub struct Subject {
    image: Arc<Image>,
    kernel: Kernel,
}

impl Subject {
    /// # Panics
    /// When the image is not one of the sweep's.
    pub fn new(target: &'static Target, image: Arc<Image>) -> Self {
        Subject { kernel: Kernel::of(target, &image), image }
    }

    /// The names and sizes of the stacks.
    pub fn stacks(&self) -> impl Iterator<Item = (&str, u16)> {
        self.kernel.stacks.iter().map(|stack| (stack.name.as_str(), stack.size()))
    }

    /// Treats the stack at this index of [`stacks`](Self::stacks) as smaller than it is.
    pub fn shrink_stack(&mut self, place: usize, size: u16) {
        let stack = &mut self.kernel.stacks[place];
        stack.lowest = stack.highest + 1 - size;
    }

    /// How many paths the image has.
    ///
    /// # Panics
    /// When the image does not run to its end.
    pub fn paths(&self) -> usize {
        let mut mcu = self.mcu();
        let mut watch = Watch::new(&self.kernel);
        while mcu.is_alive() {
            assert!(watch.marks.len() < PATIENCE, "the image has an end");
            if watch.step(&mut mcu).is_err() {
                break; // it has ended
            }
        }
        watch.marks.iter().filter(|&&mark| (OPEN..CLOSED).contains(&mark)).count()
    }

    fn mcu(&self) -> Mcu {
        let mut mcu = self.kernel.target.mcu(self.image.clone());
        self.kernel.target.enable_interrupts(&mut mcu);
        mcu
    }

    /// An MCU at the beginning of a path.
    fn reach(&self, path: u8) -> (Mcu, Watch<'_>) {
        let mut mcu = self.mcu();
        let mut watch = Watch::new(&self.kernel);
        for _ in 0..PATIENCE {
            step_uninterrupted(&mut mcu, &mut watch);
            if watch.marked == Some(OPEN + path) {
                watch.marks.clear();
                return (mcu, watch);
            }
        }
        panic!("path {path} does not begin")
    }
}

/// Makes a step without an interrupt, which must not fail.
fn step_uninterrupted(mcu: &mut Mcu, watch: &mut Watch) {
    if let Err(wrong) = watch.step(mcu) {
        panic!("without an interrupt, at {}: {wrong}", place(mcu, mcu.pc()));
    }
}

/// Sweeps a share of one path of an image.
///
/// # Panics
/// When the image has no such path, or is wrong without an interrupt.
pub fn sweep_path(subject: &Subject, path: u8, order: Order, share: Share) -> Findings {
    let mut findings = Findings::default();
    for is_due in [false, true] {
        let (mut mcu, mut watch) = subject.reach(path);
        if is_due {
            if !mcu.interrupts_enabled() {
                continue; // the kernel's start: no tick can come before, so its timers are due at its first
            }
            watch.raise(&mut mcu, Source::Tick);
            while !watch.is_settled() {
                step_uninterrupted(&mut mcu, &mut watch);
            }
        }
        let interruptions = match order {
            Order::Single => INTERRUPTIONS,
            Order::Pair | Order::PairAtSwitch => PAIRS,
        };
        let interruptions: Vec<_> =
            interruptions.iter().copied().filter(|interruption| interruption.is_due == is_due).collect();
        if !interruptions.is_empty() {
            let sweep = Sweep { order, interruptions, share, expected: Vec::new(), findings: &mut findings };
            sweep.run(&mut mcu, watch);
        }
    }
    findings
}

/// The sweep of one path, with its timers due at its first tick or not.
struct Sweep<'f> {
    order: Order,
    interruptions: Vec<Interruption>,
    share: Share,
    /// The marks without an interrupt.
    expected: Vec<u8>,
    findings: &'f mut Findings,
}

/// An interrupt and the address that it interrupted.
type Interrupted = (Source, u32);

impl Sweep<'_> {
    fn run(mut self, mcu: &mut Mcu, mut watch: Watch) {
        let uninterrupted = mcu.explore(|mcu| finish(mcu, watch.clone()));
        self.expected = uninterrupted.unwrap_or_else(|wrong| panic!("without an interrupt: {wrong}")).marks;
        assert!(
            self.expected.iter().all(|&mark| mark < WRONG),
            "without an interrupt: {:02x?}",
            self.expected
        );
        let mut number = 0;
        while watch.marked != Some(CLOSED) {
            if watch.is_boundary && (self.order != Order::PairAtSwitch || watch.is_before_switch(mcu)) {
                if number % self.share.of == self.share.number {
                    self.findings.boundaries += 1;
                    self.interruption(mcu, &watch);
                }
                number += 1;
            }
            step_uninterrupted(mcu, &mut watch);
        }
    }

    fn interruption(&mut self, mcu: &mut Mcu, watch: &Watch) {
        for interruption in self.interruptions.clone() {
            let at = mcu.pc();
            mcu.explore(|mcu| {
                let mut interrupted = watch.clone();
                for &source in interruption.sources {
                    interrupted.raise(mcu, source);
                }
                let log = interruption.sources.iter().map(|&source| (source, at)).collect();
                match interruption.second {
                    None => self.try_out(mcu, interrupted, log),
                    Some(second) => self.interruption_again(mcu, interrupted, watch.accepted, log, second),
                }
            });
        }
    }

    /// Whether an interruption is dealt with, as the sweep's order requires. `accepted` interrupts were
    /// accepted before it.
    fn is_dealt_with(&self, mcu: &Mcu, watch: &Watch, accepted: usize) -> bool {
        watch.accepted > accepted
            && match self.order {
                Order::PairAtSwitch => !watch.is_switch_due(mcu),
                _ => watch.is_settled(),
            }
    }

    /// Interrupts once more at each boundary until the first interruption is dealt with. `accepted` counts
    /// the interrupts before it.
    fn interruption_again(
        &mut self,
        mcu: &mut Mcu,
        mut watch: Watch,
        accepted: usize,
        log: Vec<Interrupted>,
        second: Source,
    ) {
        while watch.marked != Some(CLOSED) && !self.is_dealt_with(mcu, &watch, accepted) {
            if watch.is_boundary && (self.order != Order::PairAtSwitch || mcu.interrupts_enabled()) {
                let mut log = log.clone();
                log.push((second, mcu.pc()));
                mcu.explore(|mcu| {
                    let mut interrupted = watch.clone();
                    interrupted.raise(mcu, second);
                    self.try_out(mcu, interrupted, log);
                });
            }
            if watch.step(mcu).is_err() {
                return; // every run from here finds that, too
            }
        }
    }

    /// Runs to the end and notes the result.
    fn try_out(&mut self, mcu: &mut Mcu, watch: Watch, log: Vec<Interrupted>) {
        self.findings.runs += 1;
        let wrong = match finish(mcu, watch) {
            Ok(watch) => {
                self.findings.note_depths(&watch.depths);
                if log.len() == 1 {
                    self.findings.longest_wait = self.findings.longest_wait.max(watch.longest_wait);
                }
                if watch.marks == self.expected {
                    return;
                }
                format!("marks {:02x?} instead of {:02x?}", watch.marks, self.expected)
            }
            Err(wrong) => wrong,
        };
        self.findings.failed += 1;
        if self.findings.failures.len() < TOLD {
            let interrupted: Vec<_> =
                log.iter().map(|&(source, at)| format!("{source:?} before {}", place(mcu, at))).collect();
            let told = format!("{}: at {}: {wrong}", interrupted.join(", "), place(mcu, mcu.pc()));
            self.findings.failures.push(told);
        }
    }
}

/// Runs to the end of the audit.
fn finish<'k>(mcu: &mut Mcu, mut watch: Watch<'k>) -> Result<Watch<'k>, String> {
    for _ in 0..PATIENCE {
        watch.step(mcu)?;
        if watch.marked == Some(AUDITED) {
            return watch.check_end(mcu).map(|()| watch);
        }
    }
    Err("it does not end".to_owned())
}

/// An address in flash, with the function that it is in.
fn place(mcu: &Mcu, pc: u32) -> String {
    match mcu.image().function_at(pc) {
        Some((name, offset)) => format!("{pc:#x} ({:#}+{offset:#x})", rustc_demangle::demangle(name)),
        None => format!("{pc:#x}"),
    }
}
