//! The stopped MCU, as gdbstub's target for gdb's remote protocol.

use std::io;
use std::num::NonZeroUsize;
use std::sync::Arc;

use gdbstub::common::{Signal, Tid};
use gdbstub::outputln;
use gdbstub::stub::MultiThreadStopReason;
use gdbstub::target::ext::base::BaseOps;
use gdbstub::target::ext::base::multithread::{
    MultiThreadBase, MultiThreadResume, MultiThreadResumeOps, MultiThreadSchedulerLocking,
    MultiThreadSchedulerLockingOps, MultiThreadSingleStep, MultiThreadSingleStepOps,
};
use gdbstub::target::ext::base::reverse_exec::{
    ReplayLogPosition, ReverseCont, ReverseContOps, ReverseStep, ReverseStepOps,
};
use gdbstub::target::ext::breakpoints::{
    Breakpoints, BreakpointsOps, HwWatchpoint, HwWatchpointOps, SwBreakpoint, SwBreakpointOps, WatchKind,
};
use gdbstub::target::ext::monitor_cmd::{ConsoleOutput, MonitorCmd, MonitorCmdOps};
use gdbstub::target::ext::thread_extra_info::{ThreadExtraInfo, ThreadExtraInfoOps};
use gdbstub::target::{Target, TargetError, TargetResult};
use simavr_harness::Image;
use simulation::CLOCK_HZ;

use super::avr::{Avr, Core, DATA};
use super::order::{Line, Order, Picture, Points, Reason, Report, Task, Watched, Watchpoint, Way};

/// The thread that the MCU is for gdb while no task runs. No control block has this address.
const NO_TASK: Tid = NonZeroUsize::MIN;

/// An MCU that has stopped, or runs again.
pub struct Stopped {
    worker: Line,
    is_running: bool,
    image: Arc<Image>,
    picture: Picture,
    points: Points,
    /// Whether the next resumption is a step.
    is_step: bool,
}

impl Stopped {
    /// `worker` runs an MCU with this image, and has stopped.
    pub fn new(worker: Line, image: Arc<Image>, first: Report) -> Self {
        Stopped {
            worker,
            is_running: false,
            image,
            picture: first.picture,
            points: Points::default(),
            is_step: false,
        }
    }

    /// The worker has stopped again. Returns the reason, in gdb's terms.
    pub fn again(&mut self, Report { reason, picture }: Report) -> MultiThreadStopReason<u32> {
        self.picture = picture;
        self.is_running = false;
        self.reason(reason)
    }

    /// Whether the worker has not stopped again yet.
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Stops the worker where it is.
    ///
    /// # Errors
    /// The worker is gone.
    pub fn interrupt(&self) -> io::Result<()> {
        self.worker.send(&Order::Interrupt)
    }

    /// The thread that runs, in gdb's terms.
    pub fn current(&self) -> Tid {
        self.picture.tasks.iter().find(|task| task.is_running).and_then(tid).unwrap_or(NO_TASK)
    }

    fn reason(&self, reason: Reason) -> MultiThreadStopReason<u32> {
        let tid = self.current();
        match reason {
            Reason::Halt => MultiThreadStopReason::SignalWithThread { tid, signal: Signal::SIGINT },
            Reason::Step => MultiThreadStopReason::SignalWithThread { tid, signal: Signal::SIGTRAP },
            Reason::Breakpoint => MultiThreadStopReason::SwBreak(tid),
            Reason::Watchpoint(address, watched) => {
                let kind = match watched {
                    Watched::Change => WatchKind::Write,
                    Watched::Read => WatchKind::Read,
                    Watched::Either => WatchKind::ReadWrite,
                };
                MultiThreadStopReason::Watch { tid, kind, addr: DATA + u32::from(address) }
            }
            Reason::Begin => {
                MultiThreadStopReason::ReplayLog { tid: Some(tid), pos: ReplayLogPosition::Begin }
            }
            Reason::End => MultiThreadStopReason::ReplayLog { tid: Some(tid), pos: ReplayLogPosition::End },
        }
    }

    fn task(&self, tid: Tid) -> Option<&Task> {
        self.picture.tasks.iter().find(|task| usize::from(task.id) == tid.get())
    }

    /// An MCU that runs goes on as it does.
    fn go(&mut self, way: Way) -> io::Result<()> {
        if std::mem::replace(&mut self.is_running, true) {
            return Ok(());
        }
        self.worker.send(&Order::Go { way, points: self.points.clone() })
    }

    /// The address in the data space for an address of gdb; `None` if that is not in the data space.
    fn data_address(&self, address: u32) -> Option<usize> {
        let address = address.checked_sub(DATA)? as usize;
        (address < self.picture.data.len()).then_some(address)
    }
}

fn tid(task: &Task) -> Option<Tid> {
    NonZeroUsize::new(task.id.into())
}

impl Target for Stopped {
    type Arch = Avr;
    type Error = io::Error;

    fn base_ops(&mut self) -> BaseOps<'_, Avr, io::Error> {
        BaseOps::MultiThread(self)
    }

    fn support_breakpoints(&mut self) -> Option<BreakpointsOps<'_, Self>> {
        Some(self)
    }

    fn support_monitor_cmd(&mut self) -> Option<MonitorCmdOps<'_, Self>> {
        Some(self)
    }
}

impl MultiThreadBase for Stopped {
    fn read_registers(&mut self, registers: &mut Core, tid: Tid) -> TargetResult<(), Self> {
        let of_task = self.task(tid).map(|task| &task.registers);
        *registers = Core(of_task.unwrap_or(&self.picture.registers).clone());
        Ok(())
    }

    /// Writes the registers of the MCU only: those of other tasks are saved on their stacks. The worker takes
    /// nothing while it runs.
    fn write_registers(&mut self, Core(registers): &Core, tid: Tid) -> TargetResult<(), Self> {
        if self.is_running || tid != self.current() {
            return Err(TargetError::NonFatal);
        }
        self.worker.send(&Order::SetRegisters(registers.clone()))?;
        self.picture.set_registers(registers);
        Ok(())
    }

    fn read_addrs(&mut self, start: u32, data: &mut [u8], _: Tid) -> TargetResult<usize, Self> {
        let from = match self.data_address(start) {
            Some(address) => &self.picture.data[address..],
            None => self.image.flash().get(start as usize..).ok_or(TargetError::NonFatal)?,
        };
        let length = data.len().min(from.len());
        data[..length].copy_from_slice(&from[..length]);
        Ok(length)
    }

    fn write_addrs(&mut self, start: u32, data: &[u8], _: Tid) -> TargetResult<(), Self> {
        if self.is_running {
            return Err(TargetError::NonFatal);
        }
        let address = self.data_address(start).ok_or(TargetError::NonFatal)?;
        self.picture.write(address, data).ok_or(TargetError::NonFatal)?;
        self.worker.send(&Order::Write { address: address as u16, bytes: data.to_vec() })?;
        Ok(())
    }

    fn list_active_threads(&mut self, is_active: &mut dyn FnMut(Tid)) -> io::Result<()> {
        let current = self.current();
        // gdb takes the first thread for the one that has stopped.
        is_active(current);
        self.picture.tasks.iter().filter_map(tid).filter(|&tid| tid != current).for_each(is_active);
        Ok(())
    }

    fn support_resume(&mut self) -> Option<MultiThreadResumeOps<'_, Self>> {
        Some(self)
    }

    fn support_thread_extra_info(&mut self) -> Option<ThreadExtraInfoOps<'_, Self>> {
        Some(self)
    }
}

impl ThreadExtraInfo for Stopped {
    fn thread_extra_info(&self, tid: Tid, buffer: &mut [u8]) -> io::Result<usize> {
        let info = match self.task(tid) {
            Some(task) => format!("{}: {}", task.name, task.state),
            None => "no task".into(),
        };
        let length = info.len().min(buffer.len());
        buffer[..length].copy_from_slice(&info.as_bytes()[..length]);
        Ok(length)
    }
}

/// There is one CPU: whichever task gdb resumes, the MCU runs on.
impl MultiThreadResume for Stopped {
    fn resume(&mut self) -> io::Result<()> {
        self.go(if self.is_step { Way::Step } else { Way::Continue })
    }

    fn clear_resume_actions(&mut self) -> io::Result<()> {
        self.is_step = false;
        Ok(())
    }

    fn set_resume_action_continue(&mut self, _: Tid, _: Option<Signal>) -> io::Result<()> {
        Ok(())
    }

    fn support_single_step(&mut self) -> Option<MultiThreadSingleStepOps<'_, Self>> {
        Some(self)
    }

    fn support_scheduler_locking(&mut self) -> Option<MultiThreadSchedulerLockingOps<'_, Self>> {
        Some(self)
    }

    fn support_reverse_step(&mut self) -> Option<ReverseStepOps<'_, Tid, Self>> {
        Some(self)
    }

    fn support_reverse_cont(&mut self) -> Option<ReverseContOps<'_, Tid, Self>> {
        Some(self)
    }
}

impl MultiThreadSingleStep for Stopped {
    fn set_resume_action_step(&mut self, _: Tid, _: Option<Signal>) -> io::Result<()> {
        self.is_step = true;
        Ok(())
    }
}

impl MultiThreadSchedulerLocking for Stopped {
    fn set_resume_action_scheduler_lock(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl ReverseCont<Tid> for Stopped {
    fn reverse_cont(&mut self) -> io::Result<()> {
        self.go(Way::Back)
    }
}

impl ReverseStep<Tid> for Stopped {
    fn reverse_step(&mut self, _: Tid) -> io::Result<()> {
        self.go(Way::StepBack)
    }
}

impl Breakpoints for Stopped {
    fn support_sw_breakpoint(&mut self) -> Option<SwBreakpointOps<'_, Self>> {
        Some(self)
    }

    fn support_hw_watchpoint(&mut self) -> Option<HwWatchpointOps<'_, Self>> {
        Some(self)
    }
}

impl SwBreakpoint for Stopped {
    fn add_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        self.points.breakpoints.push(address);
        Ok(true)
    }

    fn remove_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        Ok(remove(&mut self.points.breakpoints, &address))
    }
}

impl HwWatchpoint for Stopped {
    fn add_hw_watchpoint(&mut self, address: u32, length: u32, kind: WatchKind) -> TargetResult<bool, Self> {
        let watchpoint = self.watchpoint(address, length, kind);
        self.points.watchpoints.extend(watchpoint);
        Ok(watchpoint.is_some())
    }

    fn remove_hw_watchpoint(
        &mut self,
        address: u32,
        length: u32,
        kind: WatchKind,
    ) -> TargetResult<bool, Self> {
        let watchpoint = self.watchpoint(address, length, kind);
        Ok(watchpoint.is_some_and(|watchpoint| remove(&mut self.points.watchpoints, &watchpoint)))
    }
}

impl Stopped {
    fn watchpoint(&self, address: u32, length: u32, kind: WatchKind) -> Option<Watchpoint> {
        let length = u16::try_from(length).ok()?;
        let address = self.data_address(address)?;
        if address + usize::from(length) > self.picture.data.len() {
            return None;
        }
        let watched = match kind {
            WatchKind::Write => Watched::Change,
            WatchKind::Read => Watched::Read,
            WatchKind::ReadWrite => Watched::Either,
        };
        Some(Watchpoint { address: address as u16, length, watched })
    }
}

/// Removes an element that equals `what`. Returns whether there was one.
fn remove<T: PartialEq>(from: &mut Vec<T>, what: &T) -> bool {
    let place = from.iter().position(|one| one == what);
    place.map(|place| from.remove(place)).is_some()
}

impl MonitorCmd for Stopped {
    fn handle_monitor_cmd(&mut self, command: &[u8], mut out: ConsoleOutput<'_>) -> io::Result<()> {
        match command {
            b"time" => {
                let seconds = self.picture.cycle as f64 / f64::from(CLOCK_HZ);
                outputln!(out, "{seconds:.6} s, cycle {}", self.picture.cycle);
            }
            b"tasks" => {
                for Task { id, name, state, registers, .. } in &self.picture.tasks {
                    let pc = registers.pc;
                    outputln!(out, "{name:<16} at {pc:#07x}  control block {id:#06x}  {state}");
                }
            }
            _ => outputln!(out, "monitor tasks: what each task does; monitor time: the time since power-up"),
        }
        Ok(())
    }
}
