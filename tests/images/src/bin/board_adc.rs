//! Conversions in the joints' rounds of measurement, conversions of other inputs without rounds, and the
//! watch on the current of a power switch.
//!
//! Marks, each reading as two bytes, the low one first: the potentiometer of the roll joint, which is
//! measured first; both potentiometers, each after the current of its motor; then the multiplexer's inputs 0
//! to 7 in turn; 0x71 once the third round was posted as a period; 0x74 when a reading that was asked for
//! while rounds began or ended was one from after the request; 0x73 when interrupts were held up at each
//! moment of a round, and no reading was taken for that of another input; 0x72 when the power switch of the
//! first dock was opened because of its current; 0x7f for anything wrong.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::adc::{Analog, Rhythm};
use board::debug::mark;
use board::gpio::Port;
use board::input::Input;
use board::superbot::{
    JOINT_CURRENT, JOINT_POTENTIOMETER, PowerPort, ROLL_CURRENT, ROLL_POTENTIOMETER, power_switch,
};
use kernel::{Context, Priority, Semaphore, Stack, Task};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, Adc);

const JOINTS: [Input; 4] = [JOINT_CURRENT, JOINT_POTENTIOMETER, ROLL_CURRENT, ROLL_POTENTIOMETER];

/// Iterations of a loop that take more than a round, and a part of a round.
const ROUND: u16 = 1_600;
const MOMENT: u16 = 50;
const MOMENTS: u16 = 24;

static TASK: Stack<128> = Stack::new();
static PERIOD: Semaphore = Semaphore::new(0);
static TRIP: Semaphore = Semaphore::new(0);

fn mark_reading(reading: u16) {
    for byte in reading.to_le_bytes() {
        mark(byte);
    }
}

/// Whether each joint's readings stay the same while interrupts are held up for more than a round, each time
/// from another moment of a round.
fn are_kept_apart(task: &mut Task, analog: &mut Analog) -> bool {
    let right = JOINTS.map(|input| analog.seen(task, input));
    (0..MOMENTS).all(|moment| {
        PERIOD.wait(task);
        pass(moment * MOMENT);
        task.mask(|_| pass(ROUND));
        (0..3).all(|_| {
            PERIOD.wait(task);
            JOINTS.map(|input| analog.seen(task, input)) == right
        })
    })
}

/// Whether a reading that is asked for as the joints' rounds begin is awaited, also beyond their end, and
/// comes.
fn is_awaited_across(task: &mut Task, rhythm: &mut Rhythm, analog: &mut Analog) -> bool {
    rhythm.begin(task, &PERIOD, ROLL_CURRENT);
    analog.look(task, JOINT_CURRENT);
    let is_awaited = analog.seen(task, JOINT_CURRENT).is_none();
    rhythm.end(task);
    is_awaited && analog.seen(task, JOINT_CURRENT).is_none() && {
        task.delay(3);
        analog.seen(task, JOINT_CURRENT).is_some()
    }
}

fn pass(turns: u16) {
    (0..turns).for_each(|turn| _ = black_box(turn));
}

fn exercise(task: &mut Task, rhythm: &mut Rhythm, analog: &mut Analog) {
    rhythm.begin(task, &PERIOD, ROLL_CURRENT);
    for _ in 0..2 {
        PERIOD.wait(task);
    }
    mark_reading(analog.seen(task, ROLL_POTENTIOMETER).unwrap_or(0xffff));
    PERIOD.wait(task);
    for input in JOINTS {
        mark_reading(analog.seen(task, input).unwrap_or(0xffff));
    }
    rhythm.end(task);
    for number in 0..8 {
        let input = Input::multiplexed(number);
        analog.look(task, input);
        let reading = loop {
            task.delay(1);
            if let Some(reading) = analog.seen(task, input) {
                break reading;
            }
        };
        mark_reading(reading);
    }
    mark(0x71);
    mark(if is_awaited_across(task, rhythm, analog) { 0x74 } else { 0x7f });
    PowerPort::set_output(power_switch(0), true);
    analog.watch(task, 0, true);
    rhythm.begin(task, &PERIOD, ROLL_CURRENT);
    let are_kept = are_kept_apart(task, analog);
    rhythm.end(task);
    mark(if are_kept && analog.take_tripped(task) == 0 { 0x73 } else { 0x7f });
    TRIP.wait(task);
    mark(if analog.take_tripped(task) == 1 { 0x72 } else { 0x7f });
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let (mut rhythm, mut analog) = board.adc.start(Interrupts, boot.interrupt(), &TRIP);
    PowerPort::set_direction(power_switch(0), true);
    start(TASK.start(boot, Priority::P3, move |task| {
        exercise(task, &mut rhythm, &mut analog);
        finish()
    }));
});
