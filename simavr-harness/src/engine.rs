//! Runs a robot on several threads, with one outcome for any number of them.
//!
//! Time passes in rounds. Within a round each module runs alone; the characters that modules sent are
//! exchanged after it. A window is the shortest frame that any dock is set up to send, or less. No module
//! gets more than a window ahead of the modules at its docks, so no receiver has passed the end of a
//! character before that character is delivered. If the robot divides into two halves without a link inside a
//! half, the halves take turns, and each runs a window past the other. Each module then takes half as many
//! rounds, and its data stay in the host's cache for twice as long.
//!
//! The engine notices at the end of the round that a program has set up a shorter frame. Characters that
//! the program sends before that may arrive late, by less than two windows; the delay is the same in every
//! run.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use simulation::{Bodies, Environment, MILLISECOND};

use crate::Controller;
use crate::physics::Physics;
use crate::robot::{Delivery, Event, LONGEST_WINDOW, Member, Robot};
use crate::rounds::{self, Halves, Round, Rounds};
use crate::shares::Shares;

/// Cycles between two checks of the docks, which take place only if a dock is active: 10.4 ms, a whole number
/// of windows.
const DOCKING_STEP: u64 = 40 * LONGEST_WINDOW;

/// The period at which accelerometers are shown how the modules lie, without a world, and at which it is
/// found out which free docks hear which, in one. In cycles: 104 ms.
const SAMPLE_PERIOD: u64 = 10 * DOCKING_STEP;

/// A robot and the threads that run it.
pub struct Engine {
    robot: Robot,
    threads: usize,
    events: Vec<Event>,
    changes: Vec<simulation::Event>,
}

impl Engine {
    /// An engine at power-up. It uses `threads` threads, at least one.
    pub fn new(robot: Robot, threads: usize) -> Self {
        Self { robot, threads: threads.max(1), events: Vec::new(), changes: Vec::new() }
    }

    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    pub fn robot_mut(&mut self) -> &mut Robot {
        &mut self.robot
    }

    /// Cycles since power-up.
    pub fn cycle(&self) -> u64 {
        self.robot.now
    }

    /// Takes the markers written since the last call: run by run, by cycle, then module and MCU.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Takes the changes that the robot itself has made to its wiring since the last call, in order.
    pub fn take_changes(&mut self) -> Vec<simulation::Event> {
        std::mem::take(&mut self.changes)
    }

    /// Runs the robot up to `cycle`.
    pub fn run_until(&mut self, cycle: u64) {
        while self.robot.now < cycle && !self.robot.members.is_empty() && self.robot.trouble().is_none() {
            if self.robot.now.is_multiple_of(SAMPLE_PERIOD) {
                self.robot.feel();
                self.robot.look_around();
            }
            self.run_modules(cycle.min((self.robot.now + 1).next_multiple_of(SAMPLE_PERIOD)));
            if self.robot.now.is_multiple_of(DOCKING_STEP) {
                let changes = self.robot.settle_docks().into_iter();
                let at = self.robot.now;
                self.changes.extend(changes.map(|change| simulation::Event { at, change }));
            }
        }
    }

    /// Runs the modules and the world up to `cycle`, or to the next check of the docks if that comes first.
    fn run_modules(&mut self, cycle: u64) {
        let Robot { members, physics, now, .. } = &mut self.robot;
        let run = Run::new(members, physics.as_mut(), *now, cycle, self.threads);
        thread::scope(|scope| {
            let run = &run;
            for worker in 1..self.threads {
                scope.spawn(move || run.work(worker));
            }
            run.work(0);
        });
        let end = run.stop.into_inner();
        let mut events: Vec<Event> = self.robot.members.iter_mut().flat_map(take_events).collect();
        events.sort();
        self.events.append(&mut events);
        self.robot.now = end;
    }
}

/// One run of all modules, shared by the threads. A thread that the host preempts delays only the module that
/// it has taken: the other threads take the rest of its [share](Shares).
struct Run<'a> {
    members: Vec<Mutex<&'a mut Member>>,
    step: Option<Step<'a>>,
    /// What was sent in this round.
    mail: Mutex<Vec<Delivery>>,
    target: u64,
    halves: Halves,
    rounds: Mutex<Rounds>,
    /// The cycle at which all modules stop next, for a check of the docks or a step of the world.
    stop: AtomicU64,
    /// The half that runs in this round, and the cycle at which the round ends.
    half: AtomicUsize,
    end: AtomicU64,
    /// The modules of that half that no thread has taken yet. Once none is left, the round waits to be
    /// closed.
    waiting: Shares,
    /// The number of its modules that have run.
    finished: AtomicUsize,
    /// The shortest window that any of them allows, in cycles.
    window: AtomicU64,
    /// At a check of the docks, one of them was active.
    is_docking: AtomicBool,
    /// There are no more rounds, or a thread panicked.
    over: AtomicBool,
}

/// The world's step for the present millisecond. The first thread to come takes it, while the others run
/// modules.
struct Step<'a> {
    physics: Mutex<&'a mut Physics>,
    /// No thread has taken it yet.
    is_due: AtomicBool,
    is_done: AtomicBool,
}

/// Spins before an idle thread yields its core.
const SPINS: u32 = 200;

impl<'a> Run<'a> {
    fn new(
        members: &'a mut [Member],
        physics: Option<&'a mut Physics>,
        from: u64,
        target: u64,
        threads: usize,
    ) -> Self {
        let window = members.iter().map(Member::window).min().unwrap_or(LONGEST_WINDOW);
        let joined: Vec<_> =
            members.iter().enumerate().map(|(number, member)| member.joined(number)).collect();
        let halves = rounds::halves(&joined);
        let run = Self {
            members: members.iter_mut().map(Mutex::new).collect(),
            step: physics.map(Step::new),
            mail: Mutex::default(),
            target,
            rounds: Mutex::new(Rounds::new(&halves, from, window)),
            halves,
            stop: AtomicU64::new(from),
            half: AtomicUsize::new(0),
            end: AtomicU64::new(from),
            waiting: Shares::new(threads),
            finished: AtomicUsize::new(0),
            window: AtomicU64::new(LONGEST_WINDOW),
            is_docking: AtomicBool::new(false),
            over: AtomicBool::new(false),
        };
        run.go_on(&mut lock(&run.rounds), from);
        run
    }

    /// Continues the run once all modules have come to `now`.
    fn go_on(&self, rounds: &mut Rounds, now: u64) {
        let next = |step: u64| (now + 1).next_multiple_of(step);
        let docking = self.target.min(next(DOCKING_STEP));
        let stop = if self.step.is_some() { docking.min(next(MILLISECOND)) } else { docking };
        self.stop.store(stop, Ordering::Relaxed);
        self.begin_step(now);
        self.begin_round(rounds);
    }

    /// Begins the next round on the way to `stop`. Returns `false` if all modules have come there.
    fn begin_round(&self, rounds: &mut Rounds) -> bool {
        let Some(Round { half, end }) = rounds.next(self.stop.load(Ordering::Relaxed)) else { return false };
        self.half.store(half, Ordering::Relaxed);
        self.end.store(end, Ordering::Relaxed);
        self.finished.store(0, Ordering::Relaxed);
        self.waiting.fill(self.halves[half].len());
        true
    }

    /// The modules that run in this round.
    fn modules(&self) -> &[usize] {
        &self.halves[self.half.load(Ordering::Relaxed)]
    }

    /// At the begin of a millisecond, exchanges data between the modules and the world, and makes the world's
    /// next step due. No thread runs a module now.
    fn begin_step(&self, now: u64) {
        let Some(step) = self.step.as_ref().filter(|_| now.is_multiple_of(MILLISECOND)) else { return };
        let mut physics = lock(&step.physics);
        for (module, member) in self.members.iter().enumerate() {
            physics.exchange(module, lock(member).module.body_mut());
        }
        step.is_done.store(false, Ordering::Relaxed);
        step.is_due.store(true, Ordering::Release);
    }

    /// Takes the world's step if no thread has, or waits for the thread that has. Returns whether the world
    /// can continue.
    fn end_step(&self) -> bool {
        let Some(step) = &self.step else { return true };
        while !step.take() && !step.is_done.load(Ordering::Acquire) {
            if self.over.load(Ordering::Acquire) {
                return false; // that thread has panicked
            }
            thread::yield_now();
        }
        lock(&step.physics).trouble().is_none()
    }

    /// The loop of each thread, a worker, until the run is over.
    fn work(&self, worker: usize) {
        let _guard = EndIfPanicking(&self.over);
        let mut idle_spins = 0;
        while !self.over.load(Ordering::Acquire) {
            // The world's step is the longest piece of work, so it comes first. Always the same worker takes
            // it, in whose core's cache the world is.
            if worker == 0 && self.step.as_ref().is_some_and(Step::take) {
                continue;
            }
            match self.waiting.take(worker) {
                Some(place) => {
                    idle_spins = 0;
                    self.run_module(self.modules()[place]);
                }
                None if idle_spins < SPINS => {
                    idle_spins += 1;
                    std::hint::spin_loop();
                }
                None => thread::yield_now(),
            }
        }
    }

    fn run_module(&self, number: usize) {
        // Read before the module counts as finished: after that, another thread may begin the next round.
        let (end, modules) = (self.end.load(Ordering::Relaxed), self.modules().len());
        {
            let mut member = lock(&self.members[number]);
            member.module.run_until(end);
            member.take_deliveries(number, |delivery| lock(&self.mail).push(delivery));
            member.collect_events(number);
            self.window.fetch_min(member.window(), Ordering::Relaxed);
            if end.is_multiple_of(DOCKING_STEP) && member.module.is_docking() {
                self.is_docking.store(true, Ordering::Relaxed);
            }
        }
        if self.finished.fetch_add(1, Ordering::AcqRel) + 1 == modules {
            self.close_round();
        }
    }

    /// Delivers the characters that were sent and begins the next round. Only the thread that ran the round's
    /// last module comes here; the others find no module to run until then.
    fn close_round(&self) {
        let mut mail = std::mem::take(&mut *lock(&self.mail));
        mail.sort_by_key(|delivery| {
            (delivery.character.end, delivery.from.module, delivery.from.dock.index())
        });
        for Delivery { to, character, .. } in mail {
            lock(&self.members[to.module]).module.receive(to.dock, character);
        }
        let mut rounds = lock(&self.rounds);
        rounds.bear(self.window.swap(LONGEST_WINDOW, Ordering::Relaxed));
        if self.begin_round(&mut rounds) {
            return;
        }
        let now = self.stop.load(Ordering::Relaxed);
        let goes_on = now < self.target && !self.is_docking.load(Ordering::Relaxed);
        // A step ends with its millisecond, and no run ends before it.
        let is_whole = (goes_on && !now.is_multiple_of(MILLISECOND)) || self.end_step();
        if goes_on && is_whole {
            self.go_on(&mut rounds, now);
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
        // A plain load first: it is cheaper than the swap, and mostly the step is not due.
        if !self.is_due.load(Ordering::Relaxed) || !self.is_due.swap(false, Ordering::Acquire) {
            return false;
        }
        lock(&self.physics).step();
        self.is_done.store(true, Ordering::Release);
        true
    }
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

/// Locks a mutex, poisoned or not: its data are not used after a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
