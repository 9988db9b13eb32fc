//! Runs a robot on several threads, with one outcome for any number of them.
//!
//! Time passes in windows. Within a window each module runs alone; after it, what the modules sent is
//! exchanged. A window is never longer than the shortest frame that any dock is set up to send, so
//! that a character begun in a window ends after it and is delivered in time.
//!
//! A program that sets up a shorter frame is noticed at the end of the window. Characters that it
//! sends before that may be received late, by less than a window, and then too the same in every
//! run.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use simulation::{Bodies, Environment, MILLISECOND};

use crate::controller::Controller;
use crate::physics::Physics;
use crate::robot::{Delivery, Event, LONGEST_WINDOW, Member, Robot};

/// Docks are looked at each time that so many cycles have passed, if any of them does something: 10.4 ms,
/// whole windows.
const DOCKING_STEP: u64 = 40 * LONGEST_WINDOW;

/// How often modules feel how they lie, in cycles: 104 ms.
const FEELING_STEP: u64 = 10 * DOCKING_STEP;

/// A robot and the threads that run it.
pub struct Engine {
    robot: Robot,
    threads: usize,
    cycle: u64,
    events: Vec<Event>,
    changes: Vec<simulation::Event>,
}

impl Engine {
    /// An engine at power-up. It uses `threads` threads, at least one.
    pub fn new(robot: Robot, threads: usize) -> Self {
        Self { robot, threads: threads.max(1), cycle: 0, events: Vec::new(), changes: Vec::new() }
    }

    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    pub fn robot_mut(&mut self) -> &mut Robot {
        &mut self.robot
    }

    /// Cycles since power-up.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Takes the markers written since the last call: run by run, by cycle, then module and MCU.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Takes what the robot itself has changed of its wiring since the last call, in order.
    pub fn take_changes(&mut self) -> Vec<simulation::Event> {
        std::mem::take(&mut self.changes)
    }

    /// Runs the robot up to `cycle`.
    pub fn run_until(&mut self, cycle: u64) {
        while self.cycle < cycle && !self.robot.members.is_empty() && self.robot.trouble().is_none() {
            if self.cycle.is_multiple_of(FEELING_STEP) {
                self.robot.feel();
            }
            self.run_modules(cycle.min((self.cycle + 1).next_multiple_of(FEELING_STEP)));
            if self.cycle.is_multiple_of(DOCKING_STEP) {
                let changes = self.robot.settle_docks().into_iter();
                let at = self.cycle;
                self.changes.extend(changes.map(|change| simulation::Event { at, change }));
            }
        }
    }

    /// Runs the modules and the world up to `cycle`, or to where docks have to be looked at if that comes
    /// first.
    fn run_modules(&mut self, cycle: u64) {
        let Robot { members, physics, .. } = &mut self.robot;
        let run = Run::new(members, physics.as_mut(), self.cycle, cycle);
        thread::scope(|scope| {
            for _ in 1..self.threads {
                scope.spawn(|| run.work());
            }
            run.work();
        });
        let end = run.end.into_inner();
        let mut events: Vec<Event> = self.robot.members.iter_mut().flat_map(take_events).collect();
        events.sort();
        self.events.append(&mut events);
        self.cycle = end;
    }
}

/// One run of all modules, shared by the threads. They take modules as they come, so that a thread
/// that the system holds up holds up no more than the module it has taken.
struct Run<'a> {
    members: Vec<Mutex<&'a mut Member>>,
    step: Option<Step<'a>>,
    /// What was sent in this window.
    mail: Mutex<Vec<Delivery>>,
    target: u64,
    /// End of the window.
    end: AtomicU64,
    /// The next module to be run in this window; with none left, the window waits to be closed.
    next: AtomicUsize,
    /// Modules that have run.
    finished: AtomicUsize,
    /// The shortest frame seen among them.
    shortest_frame: AtomicU64,
    /// At a time when docks are looked at, one of them does something.
    is_docking: AtomicBool,
    /// There are no more windows, or a thread panicked.
    over: AtomicBool,
}

/// The step of the world in the present millisecond, taken by whichever thread comes first while the others
/// run modules.
struct Step<'a> {
    physics: Mutex<&'a mut Physics>,
    /// Nobody has taken it yet.
    is_due: AtomicBool,
    is_done: AtomicBool,
}

/// Rounds of spinning before a thread that has nothing to do gives its core to others.
const SPINS: u32 = 200;

impl<'a> Run<'a> {
    fn new(members: &'a mut [Member], physics: Option<&'a mut Physics>, from: u64, target: u64) -> Self {
        let frames = members.iter().filter_map(|member| member.module.shortest_frame());
        let window = frames.min().unwrap_or(LONGEST_WINDOW).min(LONGEST_WINDOW);
        let has_world = physics.is_some();
        let run = Self {
            members: members.iter_mut().map(Mutex::new).collect(),
            step: physics.map(Step::new),
            mail: Mutex::default(),
            target,
            end: AtomicU64::new(window_end(from, window, has_world).min(target)),
            next: AtomicUsize::new(0),
            finished: AtomicUsize::new(0),
            shortest_frame: AtomicU64::new(LONGEST_WINDOW),
            is_docking: AtomicBool::new(false),
            over: AtomicBool::new(false),
        };
        run.begin_step(from);
        run
    }

    /// Where a millisecond begins, shows modules where the world has them, and has the world take its next
    /// step. Nobody runs a module now.
    fn begin_step(&self, now: u64) {
        let Some(step) = self.step.as_ref().filter(|_| now.is_multiple_of(MILLISECOND)) else { return };
        let mut physics = lock(&step.physics);
        for (module, member) in self.members.iter().enumerate() {
            physics.exchange(module, lock(member).module.body_mut());
        }
        step.is_done.store(false, Ordering::Relaxed);
        step.is_due.store(true, Ordering::Release);
    }

    /// Takes the world's step if nobody has, or waits for whoever has. Returns whether the world can go on.
    fn end_step(&self) -> bool {
        let Some(step) = &self.step else { return true };
        while !step.take() && !step.is_done.load(Ordering::Acquire) {
            thread::yield_now();
        }
        lock(&step.physics).trouble().is_none()
    }

    /// What each thread does until the run is over.
    fn work(&self) {
        let _guard = EndIfPanicking(&self.over);
        let mut idle_spins = 0;
        while !self.over.load(Ordering::Acquire) {
            // The longest piece of work comes first.
            if self.step.as_ref().is_some_and(Step::take) {
                continue;
            }
            match self.take_module() {
                Some(number) => {
                    idle_spins = 0;
                    self.run_module(number);
                }
                None if idle_spins < SPINS => {
                    idle_spins += 1;
                    std::hint::spin_loop();
                }
                None => thread::yield_now(),
            }
        }
    }

    fn take_module(&self) -> Option<usize> {
        let is_there = |&number: &usize| number < self.members.len();
        // A look first: to count on while there is none would only keep the others from theirs.
        Some(self.next.load(Ordering::Relaxed))
            .filter(is_there)
            .map(|_| self.next.fetch_add(1, Ordering::Acquire))
            .filter(is_there)
    }

    fn run_module(&self, number: usize) {
        {
            let mut member = lock(&self.members[number]);
            member.module.run_until(self.end.load(Ordering::Relaxed));
            member.take_deliveries(number, |delivery| lock(&self.mail).push(delivery));
            member.collect_events(number);
            let frame = member.module.shortest_frame().unwrap_or(LONGEST_WINDOW);
            self.shortest_frame.fetch_min(frame, Ordering::Relaxed);
            if self.end.load(Ordering::Relaxed).is_multiple_of(DOCKING_STEP) && member.module.is_docking() {
                self.is_docking.store(true, Ordering::Relaxed);
            }
        }
        if self.finished.fetch_add(1, Ordering::AcqRel) + 1 == self.members.len() {
            self.close_window();
        }
    }

    /// Exchanges what was sent and opens the next window. Only the thread that ran the window's last
    /// module comes here; the others find no module to run until `next` is set back.
    fn close_window(&self) {
        let mut mail = std::mem::take(&mut *lock(&self.mail));
        mail.sort_by_key(|delivery| {
            (delivery.character.end, delivery.from.module, delivery.from.dock.index())
        });
        for Delivery { to, character, .. } in mail {
            lock(&self.members[to.module]).module.receive(to.dock, character);
        }
        let window = self.shortest_frame.swap(LONGEST_WINDOW, Ordering::Relaxed);
        self.finished.store(0, Ordering::Relaxed);
        let end = self.end.load(Ordering::Relaxed);
        let goes_on = end < self.target && !self.is_docking.load(Ordering::Relaxed);
        // A step ends with its millisecond, and no run ends before it.
        let is_whole = (goes_on && !end.is_multiple_of(MILLISECOND)) || self.end_step();
        if goes_on && is_whole {
            self.begin_step(end);
            self.end.store(window_end(end, window, self.step.is_some()).min(self.target), Ordering::Relaxed);
            self.next.store(0, Ordering::Release);
        } else {
            self.over.store(true, Ordering::Release);
        }
    }
}

impl<'a> Step<'a> {
    fn new(physics: &'a mut Physics) -> Self {
        let physics = Mutex::new(physics);
        Step { physics, is_due: AtomicBool::new(false), is_done: AtomicBool::new(true) }
    }

    /// Takes the step if it is due. Returns whether it was.
    fn take(&self) -> bool {
        // A look first, as for modules.
        if !self.is_due.load(Ordering::Relaxed) || !self.is_due.swap(false, Ordering::Acquire) {
            return false;
        }
        lock(&self.physics).step();
        self.is_done.store(true, Ordering::Release);
        true
    }
}

/// Where a window ends that begins at `from`: no later than docks are to be looked at, or a world takes its
/// next step.
fn window_end(from: u64, window: u64, has_world: bool) -> u64 {
    let next = |step: u64| (from + 1).next_multiple_of(step);
    let end = (from + window).min(next(DOCKING_STEP));
    if has_world { end.min(next(MILLISECOND)) } else { end }
}

impl Member {
    /// Moves the markers of both MCUs to the module's events.
    fn collect_events(&mut self, module: usize) {
        for controller in Controller::ALL {
            let markers = self.module.mcu_mut(controller).take_markers();
            self.events.extend(markers.into_iter().map(|marker| Event {
                cycle: marker.cycle,
                module,
                controller,
                value: marker.value,
            }));
        }
    }
}

fn take_events(member: &mut Member) -> Vec<Event> {
    std::mem::take(&mut member.events)
}

/// Keeps the other threads from waiting for one that panicked.
struct EndIfPanicking<'a>(&'a AtomicBool);

impl Drop for EndIfPanicking<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(true, Ordering::Release);
        }
    }
}

/// Locks what no two threads use at once, and what is of no use after a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
