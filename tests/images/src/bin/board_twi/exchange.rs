//! The task of both sides of the two-wire test: it sends, receives and checks packets.
//!
//! Marks: 1 for each packet that was sent and acknowledged, 2 for each that came whole and in order, 3 when
//! all were sent and received, 0x7f for anything wrong. A packet that the other side refused, because it had
//! not taken the one before, is sent again.

use board::debug::mark;
use board::interrupts::Serves;
use board::tick::Tick;
use board::twi::Twi;
use kernel::{Boot, Never, Priority, Semaphore, Stack, Task};
use tasks::device::{Bus, Transfer};
use tests_images::start;

/// How many packets each side sends.
const PACKETS: u8 = 50;

/// From this packet on the task waits for a tick before each. Both MCUs start at the same time, so both send
/// a START at once.
const TOGETHER: u8 = 25;

const SENT: u8 = 1;
const RECEIVED: u8 = 2;
const THROUGH: u8 = 3;
const WRONG: u8 = 0x7f;

static TASK: Stack<200> = Stack::new();
static SIGNAL: Semaphore = Semaphore::new(0);

/// Starts one side; `interrupts` proves that the vectors are there.
pub fn begin(
    boot: &mut Boot,
    interrupts: impl Serves<Tick> + Serves<Twi> + Copy,
    tick: Tick,
    twi: Twi,
    own: u8,
    other: u8,
) {
    tick.start(interrupts);
    let bus = twi.start(interrupts, boot.interrupt(), own, other, &SIGNAL);
    start(TASK.start(boot, Priority::P3, |task| exchange(task, bus)));
}

/// The packet of this number: 1 to 24 bytes that count up from that number.
fn packet(number: u8, bytes: &mut [u8; 24]) -> &[u8] {
    for (byte, value) in bytes.iter_mut().zip(number..) {
        *byte = value;
    }
    bytes.get(..=usize::from(number % 24)).unwrap_or(&[])
}

fn exchange(task: &mut Task, mut bus: impl Bus) -> Never {
    let (mut sent, mut received) = (0, 0);
    let (mut bytes, mut buffer) = ([0; 24], [0; 24]);
    bus.send(task, packet(sent, &mut bytes));
    loop {
        SIGNAL.wait(task);
        if let Some(length) = bus.receive(task, &mut buffer) {
            let is_right = buffer.get(..length) == Some(packet(received, &mut bytes));
            mark(if is_right { RECEIVED } else { WRONG });
            received += 1;
        }
        match bus.outcome(task) {
            Some(Transfer::Done) => {
                mark(SENT);
                sent += 1;
                if sent < PACKETS {
                    if sent >= TOGETHER {
                        task.delay(1);
                    }
                    bus.send(task, packet(sent, &mut bytes));
                }
            }
            Some(Transfer::Refused) => bus.send(task, packet(sent, &mut bytes)),
            Some(Transfer::Fault) => mark(WRONG),
            None => {}
        }
        if sent == PACKETS && received == PACKETS {
            mark(THROUGH);
        }
    }
}
