//! All serial lines of an MCU and its bus to the other MCU at full load, while its joint is never at rest.
//!
//! Each line sends frames of bytes that count up, and checks the frames that come: at the other end is
//! another module with this image. The USARTs send without a pause. The UART in software, which can't receive
//! while it sends, sends when it has received a frame. The bus carries the longest packets both ways. `FOR_*`
//! count the received bytes.

use board::Board;
use board::adc::Adc;
use board::interrupts::Serves;
use board::joints::Joints;
use board::serial::{Receiver, Transmitter};
use board::soft_uart::SoftUart;
use board::superbot::{Half, JOINT};
use board::tick::Tick;
use board::twi::Twi;
use board::usart::{Usart0, Usart1};
use kernel::{Boot, Context, MaskedCell, Never, Priority, Semaphore, Stack, Task, Ticks};
use tasks::device::{Bus, Receive, Transfer, Transmit};
use tasks::link::backoff::Backoff;
use tasks::motor::joint::Joint;
use tasks::motor::joints::{self, Order};
use tasks::motor::task::{self as motor, Motors};
use tests_images::start;

/// Bytes of a frame, with its zero: the longest that a link sends.
const FRAME: usize = tasks::link::sizes::MAX_WIRE;

/// Counts of received bytes, little-endian, in the order of the fields.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Counts {
    /// Bytes that came in order.
    right: u32,
    /// Frames with a byte that does not follow the one before.
    wrong: u16,
    /// Received bytes that were lost, as the line counts them.
    lost: u16,
}

impl Counts {
    const NONE: Counts = Counts { right: 0, wrong: 0, lost: 0 };
}

#[unsafe(no_mangle)]
static FOR_USART0: MaskedCell<Counts> = MaskedCell::new(Counts::NONE);
#[unsafe(no_mangle)]
static FOR_USART1: MaskedCell<Counts> = MaskedCell::new(Counts::NONE);
#[unsafe(no_mangle)]
static FOR_SOFT_UART: MaskedCell<Counts> = MaskedCell::new(Counts::NONE);
#[unsafe(no_mangle)]
static FOR_BUS: MaskedCell<Counts> = MaskedCell::new(Counts::NONE);

static RECEIVE: [Stack<180>; 3] = [const { Stack::new() }; 3];
static SEND: [Stack<180>; 3] = [const { Stack::new() }; 3];
static BUS: Stack<220> = Stack::new();
static SIGNAL: Semaphore = Semaphore::new(0);
static MOTORS: Motors<1> = Motors::new();
static CONTROL: Stack<220> = Stack::new();
static DRIVER: Stack<120> = Stack::new();
/// Posted when a joint has changed its state. Nothing here waits for it.
static NEWS: Semaphore = Semaphore::new(0);
/// Posted for each frame that the UART in software has received.
static HEARD: Semaphore = Semaphore::new(0);

/// Starts everything; `interrupts` proves that the vectors are there.
pub fn begin<I>(boot: &mut Boot, interrupts: I, own: &Half, other: &Half)
where
    I: Serves<Tick> + Serves<Twi> + Serves<Usart0> + Serves<Usart1> + Serves<SoftUart> + Serves<Adc> + Copy,
{
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(interrupts);
    let bus = board.twi.start(interrupts, boot.interrupt(), own.address, other.address, &SIGNAL);
    start(BUS.start(boot, Priority::P3, |task| exchange(task, bus)));
    let (rhythm, _) = board.adc.start(interrupts, boot.interrupt(), &NEWS);
    let motors = Joints::new(rhythm, board.joint_pwm, board.joint_direction, board.control_probe);
    start(CONTROL.start(boot, Priority::P0, |task| {
        motor::run(task, &MOTORS, joints::Joints::new([Joint::new(JOINT)]), motors, &NEWS)
    }));
    start(DRIVER.start(boot, Priority::P4, keep_turning));
    let [receive0, receive1, receive2] = &RECEIVE;
    let [send0, send1, send2] = &SEND;
    let (transmitter, receiver) = board.soft_uart.start(interrupts, boot.interrupt());
    start(
        receive2
            .start(boot, Priority::P1, |task| check(task, receiver, &FOR_SOFT_UART, |task| HEARD.post(task))),
    );
    let mut backoff = Backoff::new(board.nonce);
    start(send2.start(boot, Priority::P2, move |task| {
        send(task, transmitter, move |task| {
            // Earlier frames are no answer. Without an answer it is time to send again. If both ends wait,
            // their random times soon differ by more than a frame.
            while HEARD.try_wait(task) {}
            let _ = HEARD.wait_timeout(task, 20 + 8 * Ticks::from(backoff.next_ms()));
        })
    }));
    let (transmitter, receiver) = board.usart0.start(interrupts);
    start(receive0.start(boot, Priority::P1, |task| check(task, receiver, &FOR_USART0, |_| {})));
    start(send0.start(boot, Priority::P2, |task| send(task, transmitter, |_| {})));
    let (transmitter, receiver) = board.usart1.start(interrupts);
    start(receive1.start(boot, Priority::P1, |task| check(task, receiver, &FOR_USART1, |_| {})));
    start(send1.start(boot, Priority::P2, |task| send(task, transmitter, |_| {})));
}

/// Turns the joint to and fro, in steps that it does not complete.
fn keep_turning(task: &mut Task) -> Never {
    const STEP: Ticks = 100;
    let mut angle = 300;
    loop {
        MOTORS.order(task, 0, Order::Turn { angle, speed: u8::MAX });
        angle = -angle;
        task.delay(STEP);
    }
}

/// The next byte, which is never a zero: a zero would end a frame.
fn next(byte: u8) -> u8 {
    byte.checked_add(1).unwrap_or(1)
}

fn send(task: &mut Task, mut transmitter: Transmitter, mut pause: impl FnMut(&mut Task)) -> Never {
    let mut frame = [0; FRAME];
    let mut byte = 0;
    loop {
        if let Some((_, bytes)) = frame.split_last_mut() {
            for slot in bytes {
                byte = next(byte);
                *slot = byte;
            }
        }
        transmitter.transmit(task, &frame);
        pause(task);
    }
}

fn check(
    task: &mut Task,
    mut receiver: Receiver,
    counts: &MaskedCell<Counts>,
    then: impl Fn(&mut Task),
) -> Never {
    let mut frame = [0; FRAME];
    let mut byte = 0;
    loop {
        let length = receiver.wait(task, &mut frame);
        let (mut right, mut is_right) = (0u32, length == FRAME);
        for received in frame.iter().take(length - 1) {
            byte = next(byte);
            is_right &= *received == byte;
            byte = *received;
            right += 1;
        }
        let lost = receiver.overruns(task);
        task.mask(|masked| {
            let mut now = counts.get(masked);
            if is_right {
                now.right += right + 1;
            } else {
                now.wrong += 1;
            }
            now.lost = lost;
            counts.set(masked, now);
        });
        then(task);
    }
}

/// Sends packets to the other MCU, one after the other, and checks its packets.
fn exchange(task: &mut Task, mut bus: impl Bus) -> Never {
    let (mut packet, mut buffer) = ([0; 20], [0; 24]);
    let (mut sent, mut received) = (0, 0);
    loop {
        packet.fill(sent);
        bus.send(task, &packet);
        let outcome = loop {
            SIGNAL.wait(task);
            if let Some(length) = bus.receive(task, &mut buffer) {
                let is_right =
                    length == packet.len() && buffer.iter().take(length).all(|byte| *byte == received);
                received = buffer.first().copied().unwrap_or(0).wrapping_add(1);
                task.mask(|masked| {
                    let mut now = FOR_BUS.get(masked);
                    if is_right {
                        now.right += length as u32;
                    } else {
                        now.wrong += 1;
                    }
                    FOR_BUS.set(masked, now);
                });
            }
            if let Some(outcome) = bus.outcome(task) {
                break outcome;
            }
        };
        if outcome == Transfer::Done {
            sent = sent.wrapping_add(1);
        }
    }
}
