//! What is measured in rounds, the joints' motors, and the peripherals that need neither.
//!
//! Marks, each reading as two bytes, the low one first: both potentiometers, each after the current of its
//! motor; then the multiplexer's inputs 0 to 7 in turn; 0x71 once the third round was posted as a period;
//! 0x72 when the power switch of the first dock was opened for its current; 0x7f for anything wrong.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::Board;
use board::adc::{Analog, Input, Rhythm};
use board::debug::mark;
use board::gpio::Port;
use board::superbot::{
    JOINT_CURRENT, JOINT_POTENTIOMETER, PowerPort, ROLL_CURRENT, ROLL_POTENTIOMETER, power_switch,
};
use kernel::{Priority, Semaphore, Stack, Task};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, Adc);

static TASK: Stack<128> = Stack::new();
static PERIOD: Semaphore = Semaphore::new(0);
static TRIP: Semaphore = Semaphore::new(0);

fn mark_reading(reading: u16) {
    for byte in reading.to_le_bytes() {
        mark(byte);
    }
}

fn exercise(task: &mut Task, rhythm: &mut Rhythm, analog: &mut Analog) {
    rhythm.begin(task, &PERIOD, ROLL_CURRENT);
    for _ in 0..3 {
        PERIOD.wait(task);
    }
    for input in [JOINT_CURRENT, JOINT_POTENTIOMETER, ROLL_CURRENT, ROLL_POTENTIOMETER] {
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
    PowerPort::set_output(power_switch(0), true);
    analog.watch(task, 0, true);
    TRIP.wait(task);
    mark(if analog.take_tripped(task) == 1 { 0x72 } else { 0x7f });
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    kernel::run(|boot| {
        let Some(board) = Board::take(boot) else { return };
        board.tick.start(Interrupts);
        let (mut rhythm, mut analog) = board.adc.start(Interrupts, boot.interrupt(), &TRIP);
        PowerPort::set_direction(power_switch(0), true);
        start(TASK.start(boot, Priority::P3, move |task| {
            exercise(task, &mut rhythm, &mut analog);
            finish()
        }));
    })
}
