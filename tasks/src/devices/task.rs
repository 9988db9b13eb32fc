//! The devices' task, one on each MCU: it drives [their state machine](super::Devices).

use kernel::{Never, Task, Ticks, now};

use super::memory::Cells;
use super::surroundings::Surroundings;
use super::{Devices, Mail};
use crate::counter::{Counter, counters};
use crate::device::{Peripherals, Quantity};
use crate::dock::Dock;
use crate::docking::latch::{End, EndSwitches};
use crate::mailbox::Mailbox;
use crate::message::{Address, Message, TaskCode};
use crate::motor::Axis;
use crate::motor::joint::State;
use crate::motor::joints::Order;
use crate::motor::task::Motors;
use crate::post_office::PostOffice;
use crate::request::Payload;
use crate::router::Source;
use crate::superbot::Half;

/// The longest time between two calls of `alive`, in ticks of 1 ms.
pub const ALIVE: Ticks = 50;

/// The devices' task as others see it. A `static`: readers of RAM find the `Counters` at its start.
#[repr(C)]
pub struct Desk<const N: usize> {
    counters: Counters<Counter>,
    motors: &'static Motors<N>,
    office: &'static PostOffice,
}

counters! {
    /// The task's counts. Both wrap.
    pub struct Counters {
        /// Reports, and requests to other devices, that found no room.
        unsent,
        /// Messages that were neither a request to their device nor, on the MCU with the battery, a report.
        malformed,
    }
}

impl<const N: usize> Desk<N> {
    /// The desk of a task that turns the joints of `motors`, and whose mail goes through `office`.
    pub const fn new(motors: &'static Motors<N>, office: &'static PostOffice) -> Self {
        Desk { counters: Counters::new(), motors, office }
    }

    /// Its counts, in the order of [`Counters`].
    pub const fn counts(&self) -> &[Counter] {
        self.counters.all()
    }

    /// Devices of `board` with joints by `axes` in the order of their indices, from now on.
    #[inline(always)] // a frame of its own would take stack
    pub fn begin<P: Peripherals>(
        &'static self,
        task: &mut Task,
        board: &mut P,
        axes: [Axis; N],
    ) -> Devices<N> {
        let start = now(task);
        Devices::new(axes, start, &mut Here { task, board, desk: self })
    }

    /// Does all that there is to do. Call it at first, after each signal of `mailbox`, and after as many
    /// ticks as it returns.
    #[inline(always)] // a frame of its own would take stack
    pub fn turn<P: Peripherals>(
        &'static self,
        task: &mut Task,
        mailbox: &'static Mailbox,
        board: &mut P,
        devices: &mut Devices<N>,
    ) -> Ticks {
        let mut here = Here { task, board, desk: self };
        while let Some(message) = mailbox.take(here.task) {
            let mail = Mail::of::<Here<P, N>>(&message);
            // The messages that go out need its buffer.
            drop(message);
            let time = now(here.task);
            match mail {
                Some(mail) => devices.receive(time, mail, &mut here),
                None => self.counters.malformed.count(here.task),
            }
        }
        let time = now(here.task);
        devices.poll(time, &mut here);
        devices.next_due::<Here<P, N>>(time).unwrap_or(ALIVE).min(ALIVE)
    }
}

/// Runs the task of `desk` on `mailbox`: the devices of `board`, and joints by `axes` in the order of their
/// indices. `alive` is called every [`ALIVE`] ticks or sooner.
pub fn run<P: Peripherals, const N: usize>(
    task: &mut Task,
    mailbox: &'static Mailbox,
    mut board: P,
    axes: [Axis; N],
    desk: &'static Desk<N>,
    mut alive: impl FnMut(&mut Task),
) -> Never {
    let mut devices = desk.begin(task, &mut board, axes);
    loop {
        let rest = desk.turn(task, mailbox, &mut board, &mut devices);
        alive(task);
        mailbox.wake_in(task, rest);
        mailbox.wait(task);
    }
}

/// The surroundings of the devices, for the task that runs.
struct Here<'a, P, const N: usize> {
    task: &'a mut Task,
    board: &'a mut P,
    desk: &'static Desk<N>,
}

impl<P: Peripherals, const N: usize> Cells for Here<'_, P, N> {
    fn is_ready(&mut self) -> bool {
        self.board.is_memory_ready(self.task)
    }

    fn recall(&mut self, address: u16) -> u8 {
        self.board.recall(address)
    }

    fn store(&mut self, address: u16, byte: u8) {
        self.board.store(self.task, address, byte);
    }
}

impl<P: Peripherals, const N: usize> Surroundings for Here<'_, P, N> {
    const HALF: Half = P::HALF;

    fn look(&mut self, quantity: Quantity) {
        self.board.look(self.task, quantity);
    }

    fn seen(&mut self, quantity: Quantity) -> Option<i16> {
        self.board.seen(self.task, quantity)
    }

    fn end_switches(&mut self, dock: Dock) -> EndSwitches {
        self.board.end_switches(dock)
    }

    fn drive_latch(&mut self, dock: Dock, to: Option<End>) {
        self.board.drive_latch(dock, to);
    }

    fn set_power(&mut self, dock: Dock, is_on: bool) {
        self.board.set_power(self.task, dock, is_on);
    }

    fn take_tripped(&mut self) -> u8 {
        self.board.take_tripped(self.task)
    }

    fn set_emitters(&mut self, is_on: bool) {
        self.board.set_emitters(is_on);
    }

    fn set_charger(&mut self, is_on: bool) {
        self.board.set_charger(is_on);
    }

    fn order(&mut self, joint: usize, order: Order) {
        self.desk.motors.order(self.task, joint, order);
    }

    fn state(&mut self, joint: usize) -> Option<State> {
        self.desk.motors.state(self.task, joint)
    }

    fn angle(&mut self, joint: usize) -> Option<i16> {
        self.desk.motors.angle(self.task, joint)
    }

    #[inline(never)] // called from many places, each copy would take flash
    fn send(&mut self, from: TaskCode, to: TaskCode, payload: Payload) -> bool {
        let Desk { office, counters, .. } = self.desk;
        let message = Message::new(Address::here(to), Address::here(from), &payload);
        if message.map(|message| office.deliver(self.task, message, Source::Task)) == Ok(Ok(())) {
            return true;
        }
        counters.unsent.count(self.task);
        false
    }
}
