//! The tick, delays, PWM and pins.
//!
//! Marks: 1 to 4 around delays of 5 ms, 300 us and 2 us; 5 when the duty is a quarter and the pin is high; 6
//! when both are off, at least 1.2 ms later; 7 to 11 around 0, 3, 4 and 400 cycles; 0x7f for anything wrong.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::delay::{Delay, cycles};
use board::superbot::{JointDirection, JointPwm};
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{OutputPin, StatefulOutputPin};
use embedded_hal::pwm::SetDutyCycle;
use kernel::{Priority, Stack, Task};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

const WRONG: u8 = 0x7f;

static TASK: Stack<128> = Stack::new();

fn exercise(task: &mut Task, pwm: JointPwm, direction: JointDirection) -> Option<()> {
    let mut delay = Delay::new(task);
    delay.delay_us(500); // into the middle of a tick
    mark(1);
    delay.delay_ms(5);
    mark(2);
    delay.delay_us(300);
    mark(3);
    delay.delay_ns(2_000);
    mark(4);
    let mut pwm = pwm.start();
    let mut direction = direction.into_output();
    pwm.set_duty_cycle_percent(25).ok()?;
    direction.set_high().ok()?;
    mark(if direction.is_set_high().ok()? { 5 } else { WRONG });
    delay.delay_us(1_200);
    pwm.set_duty_cycle_fully_off().ok()?;
    direction.toggle().ok()?;
    mark(if direction.is_set_low().ok()? { 6 } else { WRONG });
    mark(7);
    cycles::<0>();
    mark(8);
    cycles::<3>();
    mark(9);
    cycles::<4>();
    mark(10);
    cycles::<400>();
    mark(11);
    Some(())
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(TASK.start(boot, Priority::P3, |task| {
        if exercise(task, board.joint_pwm, board.joint_direction).is_none() {
            mark(WRONG);
        }
        finish()
    }));
});
