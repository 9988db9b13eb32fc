//! Messages under way inside a module, between its MCUs and tasks, as its routers say.

use std::hash::{Hash, Hasher};
use std::mem;
use std::ops::Range;

use tasks::bridge::protocol::BridgeCounters;
use tasks::bridge::task::ROOM;
use tasks::dock::Dock;
use tasks::message::{Address, Letter, Message, TaskCode};
use tasks::post_office::Undelivered;
use tasks::router::{Mcu, Route, Router, Source};
use tasks::sensor::Sensor;
use tasks::superbot::RESIDENCE;

use super::devices::Devices;
use super::port::Flight;
use super::time::{CROSS_AFTER, CROSS_BEFORE, READ, TICK, WAKE, transfer};
use crate::hardware::GIVEN_UP_AFTER;

const MASTER: Router = Router::new(Mcu::Master, RESIDENCE);
const SLAVE: Router = Router::new(Mcu::Slave, RESIDENCE);

/// Something that is to happen.
pub enum Input {
    /// The first character of a frame has come in at a dock.
    Begun(Dock, Range<u64>),
    /// A frame has come in at a dock.
    Frame(Dock, Flight),
    /// A message has crossed to an MCU.
    Crossed(Mcu, Letter),
    /// A behaviour takes a message.
    Taken(Letter),
    /// A sensor's value is there, and this task has asked for it.
    Read(Sensor, TaskCode),
    /// A message of a behaviour comes into the mailbox of a dock of its MCU.
    Sent(Dock, Letter),
}

pub struct Inside {
    /// The latest first.
    inputs: Vec<(u64, Input)>,
    /// Until when the two-wire bus is busy.
    bus_until: u64,
    /// Messages that cross to the master and to the slave now.
    crossing: [u8; 2],
    pub bridge: BridgeCounters,
    pub devices: Devices,
}

impl Hash for Inside {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.inputs.iter().for_each(|(at, input)| {
            at.hash(state);
            mem::discriminant(input).hash(state);
        });
        self.bus_until.hash(state);
    }
}

impl Inside {
    /// Nothing is under way, at `now`.
    pub fn new(now: u64) -> Self {
        Inside {
            inputs: Vec::new(),
            bus_until: now,
            crossing: [0; 2],
            bridge: BridgeCounters::default(),
            devices: Devices::default(),
        }
    }

    /// When the next input is due.
    pub fn due(&self) -> u64 {
        self.inputs.last().map_or(u64::MAX, |input| input.0)
    }

    /// The next input, if it is due by `now`.
    pub fn take(&mut self, now: u64) -> Option<Input> {
        let (_, input) = self.inputs.pop_if(|input| input.0 <= now)?;
        if let Input::Crossed(mcu, _) = &input {
            self.crossing[*mcu as usize] -= 1;
        }
        Some(input)
    }

    /// All inputs that are to come.
    pub fn inputs(&self) -> impl Iterator<Item = &Input> {
        self.inputs.iter().map(|(_, input)| input)
    }

    /// Puts an input in its place. Of inputs at the same time frames come first, by dock, then others as they
    /// were put in.
    pub fn insert(&mut self, at: u64, input: Input) {
        let place = self.inputs.partition_point(|other| (other.0, rank(&other.1)) > (at, rank(&input)));
        self.inputs.insert(place, (at, input));
    }

    /// Puts a message into a mailbox, behind those that are on their way there, even if a later sender has
    /// less to do before.
    pub fn post(&mut self, at: u64, input: Input) {
        let same =
            |other: &&(u64, Input)| mailbox(&other.1).is_some() && mailbox(&other.1) == mailbox(&input);
        let last = self.inputs.iter().find(same).map_or(0, |other| other.0);
        self.insert(at.max(last), input);
    }

    /// Hands a message on as the router of this MCU says. Returns the dock that it leaves by, if it leaves.
    pub fn deliver(
        &mut self,
        now: u64,
        mcu: Mcu,
        message: Message,
        source: Source,
    ) -> Result<Option<Dock>, Undelivered> {
        let router = if mcu == Mcu::Master { MASTER } else { SLAVE };
        match router.route(message.to(), source) {
            Route::Task(task) if task.is_behaviour() => {
                self.post(now + WAKE, Input::Taken(Letter::of(message)));
            }
            Route::Task(_) => {
                if let Some((sensor, client)) = self.devices.serve(now, mcu, message) {
                    self.insert(now + READ, Input::Read(sensor, client));
                }
            }
            Route::Link(dock) => return Ok(Some(dock)),
            Route::Bridge => {
                let other = if mcu == Mcu::Master { Mcu::Slave } else { Mcu::Master };
                self.cross(now, other, message)?;
            }
            Route::Ignored => return Err(Undelivered::Ignored),
            Route::Refused => return Err(Undelivered::Refused),
        }
        Ok(None)
    }

    /// Sends a message over the bridge.
    fn cross(&mut self, now: u64, to: Mcu, message: Message) -> Result<(), Undelivered> {
        let crossing = &mut self.crossing[to as usize];
        if *crossing > ROOM - message.kind().leaves() {
            return Err(Undelivered::NoRoom);
        }
        *crossing += 1;
        self.bus_until = self.bus_until.max(now + CROSS_BEFORE) + transfer(message.payload().len());
        count(&mut self.bridge.messages_sent);
        self.insert(self.bus_until + CROSS_AFTER, Input::Crossed(to, Letter::of(message)));
        Ok(())
    }

    /// A message has come to an MCU whose program runs from `live` on. It is sent again until then, or given
    /// up before, and those behind it wait.
    pub fn send_again(&mut self, now: u64, to: Mcu, message: Letter, live: u64) {
        let begun_at = self.bus_until.max(now);
        self.bus_until = live.min(begun_at + GIVEN_UP_AFTER).max(begun_at);
        let again = (self.bus_until - begun_at) / TICK;
        self.bridge.retries = self.bridge.retries.wrapping_add(again as u16);
        if self.bus_until < live {
            return count(&mut self.bridge.gave_up);
        }
        self.crossing[to as usize] += 1;
        self.insert(self.bus_until, Input::Crossed(to, message));
    }

    /// Counts what became of a message that has crossed.
    pub fn count_crossed(&mut self, delivered: Result<(), Undelivered>) {
        count(match delivered {
            Ok(()) => &mut self.bridge.messages_received,
            Err(Undelivered::NoRoom) => &mut self.bridge.no_buffer,
            Err(Undelivered::Ignored | Undelivered::Refused) => &mut self.bridge.ignored,
        });
    }

    /// MCUs are reset. Messages that cross the bridge are lost, whichever end of it is reset.
    pub fn reset(&mut self, is_reset: impl Fn(Mcu) -> bool, mcu_of: impl Fn(Dock) -> Mcu) {
        self.crossing = [0; 2];
        self.inputs.retain(|(_, input)| match input {
            Input::Begun(dock, _) | Input::Frame(dock, _) => !is_reset(mcu_of(*dock)),
            Input::Crossed(..) => false,
            Input::Taken(_) | Input::Read(..) | Input::Sent(..) => !is_reset(Mcu::Master),
        });
    }
}

/// The address whose mailbox a message comes into.
fn mailbox(input: &Input) -> Option<Address> {
    match input {
        Input::Taken(letter) => Some(Address::here(letter.to().task())),
        Input::Sent(dock, _) => Some(Address::beyond(*dock, TaskCode::HORMONE)),
        _ => None,
    }
}

fn rank(input: &Input) -> u8 {
    match input {
        Input::Begun(dock, _) | Input::Frame(dock, _) => dock.index(),
        _ => u8::MAX,
    }
}

/// Counts one more.
fn count(counter: &mut u16) {
    *counter = counter.wrapping_add(1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mailbox_keeps_the_order_in_which_messages_were_sent() {
        let mut inside = Inside::new(0);
        let to = Address::here(TaskCode::HORMONE);
        for (at, byte) in [(500, 1), (300, 2), (400, 3)] {
            let payload = [byte];
            let message = Message::new(to, Address::here(TaskCode::AC_RECEIVE), &payload).unwrap();
            assert_eq!(inside.deliver(at, Mcu::Master, message, Source::Task), Ok(None));
        }
        let taken = std::iter::from_fn(|| inside.take(u64::MAX - 1)).map(|input| match input {
            Input::Taken(letter) => letter.payload()[0],
            _ => 0,
        });
        assert_eq!(taken.collect::<Vec<_>>(), [1, 2, 3]);
    }
}
