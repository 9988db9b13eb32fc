//! What tasks send one another, and how a task is addressed.

use core::mem::MaybeUninit;
use core::ptr;

use crate::dock::Dock;
use crate::motor::Axis;

/// The most payload bytes that a message carries.
pub const MAX_PAYLOAD: usize = 16;

/// The name of a task within a module, the same in every module: 0x00..=0x06 are behaviours, all that a frame
/// can name; 0x0F..=0x1F are system tasks; the codes between are unused.
///
/// A code need not belong to a task that exists: the router finds out which codes name none.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct TaskCode(u8);

impl TaskCode {
    /// How many behaviours there can be.
    pub const BEHAVIOURS: u8 = 7;

    /// AC_RECV: receives probes (paper, Figure 5).
    pub const AC_RECEIVE: TaskCode = TaskCode(0x00);
    /// HORMONE (paper, Figure 5).
    pub const HORMONE: TaskCode = TaskCode(0x01);
    /// The console: it tells who asks, at whichever dock, how the module's programs do.
    pub const CONSOLE: TaskCode = TaskCode(0x02);
    /// What keeps without power.
    pub const MEMORY: TaskCode = TaskCode(0x0F);
    /// The inspectors of the two MCUs.
    pub const MASTER_INSPECTOR: TaskCode = TaskCode(0x10);
    pub const SLAVE_INSPECTOR: TaskCode = TaskCode(0x1F);
    /// Power management: battery, charging.
    pub const POWER: TaskCode = TaskCode(0x11);
    /// Power management of the MCU without the battery: it sheds load when it is told to.
    pub const POWER_BEYOND: TaskCode = TaskCode(0x12);
    /// The accelerometer.
    pub const ACCELEROMETER: TaskCode = TaskCode(0x13);
    /// The temperatures of the two boards.
    pub const MASTER_TEMPERATURE: TaskCode = TaskCode(0x14);
    pub const SLAVE_TEMPERATURE: TaskCode = TaskCode(0x15);

    /// The task of a joint.
    pub const fn joint(axis: Axis) -> TaskCode {
        TaskCode(0x16 + axis.index())
    }

    /// The task of a dock's devices: its docking motor, guidance, power switch and current.
    pub const fn dock(dock: Dock) -> TaskCode {
        TaskCode(0x19 + dock.index())
    }

    /// The task with this code; `None` above 0x1F.
    pub const fn new(code: u8) -> Option<TaskCode> {
        if code <= Address::TASK { Some(TaskCode(code)) } else { None }
    }

    /// The code, 0x00..=0x1F.
    pub const fn code(self) -> u8 {
        self.0
    }

    /// Whether this is a behaviour: a neighbour may address no other task (paper, section 5).
    pub const fn is_behaviour(self) -> bool {
        self.0 < Self::BEHAVIOURS
    }

    /// The code if this is a behaviour, 0..=6.
    pub const fn behaviour(self) -> Option<u8> {
        if self.is_behaviour() { Some(self.0) } else { None }
    }

    /// The behaviour with this code; `None` above 6.
    pub const fn of_behaviour(code: u8) -> Option<TaskCode> {
        if code < Self::BEHAVIOURS { Some(TaskCode(code)) } else { None }
    }
}

/// Where a message goes or comes from: a task of this module, or of the neighbour beyond a dock.
///
/// "Beyond Back, HORMONE" is the HORMONE task of the module attached to the Back dock. There is no
/// address for any module farther away: modules have no names (paper, section 7).
///
/// One byte: bits 7..5 the dock's index, or 7 for "this module"; bits 4..0 the task's code.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Address(u8);

impl Address {
    const TASK: u8 = 0x1F;
    const HERE: u8 = 7;

    /// A task of this module, on whichever MCU.
    pub const fn here(task: TaskCode) -> Address {
        Address(Self::HERE << 5 | task.0)
    }

    /// A task of the module attached to `dock`.
    pub const fn beyond(dock: Dock, task: TaskCode) -> Address {
        Address(dock.index() << 5 | task.0)
    }

    /// The address in this byte; `None` if its dock is the one index that means nothing, 6.
    pub const fn from_byte(byte: u8) -> Option<Address> {
        if byte >> 5 == 6 { None } else { Some(Address(byte)) }
    }

    pub const fn byte(self) -> u8 {
        self.0
    }

    /// The dock that the task lies beyond; `None` for a task of this module.
    pub const fn dock(self) -> Option<Dock> {
        Dock::from_index(self.0 >> 5)
    }

    pub const fn task(self) -> TaskCode {
        TaskCode(self.0 & Self::TASK)
    }
}

/// The payload is longer than [`MAX_PAYLOAD`] bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct TooLong;

/// What a link does with a message: bits 7 and 6 of a byte whose other bits may hold the length of the
/// payload.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Kind {
    /// The link repeats it until it is acknowledged, or gives up.
    Lasting = 0,
    /// As [`Lasting`](Kind::Lasting); but a message that was not sent yet gives way to a newer one for the
    /// same task that follows it.
    Latest = 0x40,
    /// The link sends it once and forgets it: for messages that are soon sent anew, as probes are.
    Datagram = 0x80,
}

impl Kind {
    const BITS: u8 = 0xC0;

    /// The kind in a byte; `None` if there is no such.
    pub const fn of_byte(byte: u8) -> Option<Kind> {
        match byte & Self::BITS {
            0 => Some(Kind::Lasting),
            0x40 => Some(Kind::Latest),
            0x80 => Some(Kind::Datagram),
            _ => None,
        }
    }

    /// How many places of a mailbox it leaves free. More probes come than a lossy link can send while it
    /// repeats a message. They must not keep out the next message, which comes only once.
    pub const fn leaves(self) -> u8 {
        match self {
            Kind::Lasting | Kind::Latest => 0,
            Kind::Datagram => 1,
        }
    }
}

/// What one task sends to another. Beyond a dock it is acknowledged and repeated until it arrives
/// or the link gives up, unless it was made as a [datagram](Message::datagram).
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Message<'a> {
    to: Address,
    from: Address,
    kind: Kind,
    payload: &'a [u8],
}

impl<'a> Message<'a> {
    /// A message of up to [`MAX_PAYLOAD`] bytes.
    pub fn new(to: Address, from: Address, payload: &'a [u8]) -> Result<Self, TooLong> {
        Self::of_kind(to, from, payload, Kind::Lasting)
    }

    /// A message that a link sends once and forgets: for messages that are soon sent anew, as probes are.
    pub fn datagram(to: Address, from: Address, payload: &'a [u8]) -> Result<Self, TooLong> {
        Self::of_kind(to, from, payload, Kind::Datagram)
    }

    /// A message of this kind, of up to [`MAX_PAYLOAD`] bytes.
    #[inline(always)]
    pub fn of_kind(to: Address, from: Address, payload: &'a [u8], kind: Kind) -> Result<Self, TooLong> {
        if payload.len() > MAX_PAYLOAD {
            return Err(TooLong);
        }
        Ok(Message { to, from, kind, payload })
    }

    pub fn to(&self) -> Address {
        self.to
    }

    /// The sender. For a message that came in at a dock this is the addressed task's counterpart beyond that
    /// dock: the actual sender does not travel on the wire.
    pub fn from(&self) -> Address {
        self.from
    }

    pub fn payload(&self) -> &'a [u8] {
        self.payload
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }
}

/// A message in writing, as it lies in a buffer.
#[derive(Clone)]
pub struct Letter {
    to: Address,
    from: Address,
    /// Payload bytes in bits 4..0, the [`Kind`] in bits 7 and 6: a letter lives in RAM by the dozen.
    length: u8,
    /// Only as many bytes of it as `length` says are written: clearing the others would cost more than
    /// writing these.
    payload: [MaybeUninit<u8>; MAX_PAYLOAD],
}

impl Letter {
    /// A letter with nothing written on it yet.
    #[inline(always)] // a constant would be copied whole, from RAM
    pub(crate) fn blank() -> Letter {
        let payload = [const { MaybeUninit::uninit() }; MAX_PAYLOAD];
        Letter { to: Address(0), from: Address(0), length: 0, payload }
    }

    /// A letter that says `message`.
    pub fn of(message: Message) -> Letter {
        let mut letter = Letter::blank();
        letter.write(message);
        letter
    }

    /// Writes `message` over what was there.
    pub(crate) fn write(&mut self, message: Message) {
        let Message { to, from, kind, payload } = message;
        (self.to, self.from) = (to, from);
        for (slot, byte) in self.payload.iter_mut().zip(payload) {
            slot.write(*byte);
        }
        self.length = payload.len() as u8 | kind as u8;
    }

    /// Swaps its addresses: it goes back to its sender. What is written stays.
    pub fn turn(&mut self) {
        (self.to, self.from) = (self.from, self.to);
    }

    /// Writes two bytes more, the low one first, if there is room for them.
    #[inline(never)]
    pub fn push(&mut self, word: u16) {
        let length = usize::from(self.length & !Kind::BITS);
        if let Some([low, high]) = self.payload.get_mut(length..length + 2) {
            let bytes = word.to_le_bytes();
            low.write(bytes[0]);
            high.write(bytes[1]);
            self.length += 2;
        }
    }

    /// The message that is written.
    pub fn message(&self) -> Message<'_> {
        Message { to: self.to, from: self.from, kind: self.kind(), payload: self.payload() }
    }

    /// As [`Message::to`].
    pub fn to(&self) -> Address {
        self.to
    }

    /// As [`Message::from`].
    pub fn from(&self) -> Address {
        self.from
    }

    /// As [`Message::payload`].
    pub fn payload(&self) -> &[u8] {
        let length = usize::from(self.length & !Kind::BITS);
        let written = self.payload.get(..length).unwrap_or(&[]);
        // SAFETY: only `blank`, `write` and `push` set the length, to the number of bytes that have been
        // written. A message has no more bytes than there is room for.
        unsafe { &*(ptr::from_ref(written) as *const [u8]) }
    }

    /// As [`Message::kind`].
    pub fn kind(&self) -> Kind {
        Kind::of_byte(self.length).unwrap_or(Kind::Lasting)
    }

    /// Whether it takes the place of `older`, which was not sent yet.
    pub fn replaces(&self, older: &Letter) -> bool {
        let kinds = [self.kind(), older.kind()];
        kinds == [Kind::Latest; 2] && (self.to, self.from) == (older.to, older.from)
    }
}

impl PartialEq for Letter {
    fn eq(&self, other: &Letter) -> bool {
        self.message() == other.message()
    }
}

#[cfg(not(target_arch = "avr"))]
impl core::fmt::Debug for Letter {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.message().fmt(f)
    }
}

/// How many letters one MCU holds at once, over all its queues. Each buffer takes 21 bytes.
pub const BUFFERS: usize = 10;

kernel::pool!(Letter, BUFFERS);

/// A letter in a buffer of the pool. It moves from task to task; dropped, it frees the buffer.
pub type Buffered = kernel::Message<Letter>;

/// The holder of a letter: a buffer of the pool, or on a host the letter's owner.
pub trait Held {
    /// The letter.
    fn letter(&self) -> &Letter;
}

impl Held for Buffered {
    fn letter(&self) -> &Letter {
        self
    }
}

impl Held for Letter {
    fn letter(&self) -> &Letter {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn task_codes_have_five_bits_and_the_first_seven_are_behaviours() {
        for code in 0..=255u8 {
            match TaskCode::new(code) {
                Some(task) => {
                    assert!(code < 32);
                    assert_eq!(task.code(), code);
                    assert_eq!(task.behaviour(), Some(code).filter(|code| *code < 7));
                    assert_eq!(TaskCode::of_behaviour(code), Some(task).filter(|task| task.is_behaviour()));
                }
                None => assert!(code >= 32 && TaskCode::of_behaviour(code).is_none()),
            }
        }
    }

    #[test]
    fn an_address_is_its_byte() {
        for byte in 0..=255u8 {
            let Some(address) = Address::from_byte(byte) else {
                assert_eq!(byte >> 5, 6);
                continue;
            };
            assert_eq!(address.byte(), byte);
            assert_eq!(address.task().code(), byte & 0x1F);
            assert_eq!(address.dock().map(Dock::index), Some(byte >> 5).filter(|dock| *dock != 7));
            let rebuilt = match address.dock() {
                Some(dock) => Address::beyond(dock, address.task()),
                None => Address::here(address.task()),
            };
            assert_eq!(rebuilt, address);
        }
    }

    #[test]
    fn a_message_keeps_what_it_was_given_and_refuses_too_much() {
        let to = Address::beyond(Dock::Back, TaskCode::HORMONE);
        let from = Address::here(TaskCode::HORMONE);
        let bytes: [u8; MAX_PAYLOAD + 1] = core::array::from_fn(|index| index as u8 + 1);
        for length in 0..=MAX_PAYLOAD {
            for kind in [Kind::Lasting, Kind::Latest, Kind::Datagram] {
                let message = Message::of_kind(to, from, &bytes[..length], kind).unwrap();
                assert_eq!((message.to(), message.from()), (to, from));
                assert_eq!((message.payload(), message.kind()), (&bytes[..length], kind));
                let mut letter = Letter::of(Message::new(from, to, &[0xEE; MAX_PAYLOAD]).unwrap());
                letter.write(message);
                assert_eq!(letter.message(), message);
                assert_eq!((letter.to(), letter.from()), (to, from));
                assert_eq!((letter.payload(), letter.kind()), (&bytes[..length], kind));
            }
        }
        assert_eq!(Message::new(to, from, &bytes), Err(TooLong));
        assert_eq!(Message::datagram(to, from, &bytes), Err(TooLong));
    }

    #[test]
    fn a_letter_goes_back_with_more_on_it() {
        let (to, from) = (Address::here(TaskCode::MASTER_INSPECTOR), Address::here(TaskCode::CONSOLE));
        let mut letter = Letter::of(Message::new(to, from, &[1, 2, 3]).unwrap());
        letter.turn();
        assert_eq!((letter.to(), letter.from()), (from, to));
        for word in 0..6 {
            letter.push(0x1000 + word);
            assert_eq!(letter.payload().len(), 5 + 2 * usize::from(word));
        }
        assert_eq!(letter.payload()[..7], [1, 2, 3, 0, 0x10, 1, 0x10]);
        let full = letter.clone();
        letter.push(0xffff); // 15 bytes are written
        assert_eq!(letter, full);
        letter.turn();
        assert_ne!(letter, full);
        assert_eq!(letter.kind(), Kind::Lasting);
    }

    #[test]
    fn the_latest_replaces_its_like_alone() {
        let (to, from) = (Address::beyond(Dock::Back, TaskCode::HORMONE), Address::here(TaskCode::HORMONE));
        let letter = |to, kind| Letter::of(Message::of_kind(to, from, &[1], kind).unwrap());
        let newer = letter(to, Kind::Latest);
        assert!(newer.replaces(&letter(to, Kind::Latest)));
        assert!(!newer.replaces(&letter(Address::here(TaskCode::HORMONE), Kind::Latest)));
        for kind in [Kind::Lasting, Kind::Datagram] {
            assert!(!newer.replaces(&letter(to, kind)));
            assert!(!letter(to, kind).replaces(&newer));
        }
    }
}
