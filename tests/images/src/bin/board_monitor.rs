//! The monitor over USART0, and tasks for it to inspect.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use core::hint::black_box;

use board::serial::{Receiver, Transmitter};
use embedded_io::Read;
use kernel::monitor::{self, Line, Tasks};
use kernel::{Context, MaskedCell, Priority, Semaphore, Stack, Task};
use tasks::device::Transmit;
use tests_images::start;

board::interrupts!(Interrupts: Tick, Usart0, Trap);

static MONITOR: Stack<288> = Stack::new();
static COUNTER: Stack<96> = Stack::new();
static WAITER: Stack<96> = Stack::new();
static ABSENT: Stack<96> = Stack::new();
static NEVER: Semaphore = Semaphore::new(0);

/// The test finds this variable by its name, as the monitor's user does by the image's symbols.
#[unsafe(no_mangle)]
static COUNT: MaskedCell<u16> = MaskedCell::new(0);

static TASKS: Tasks = &[
    ("MONITOR", MONITOR.task()),
    ("COUNTER", COUNTER.task()),
    ("WAITER", WAITER.task()),
    ("ABSENT", ABSENT.task()),
];

struct Serial {
    transmitter: Transmitter,
    receiver: Receiver,
}

impl Line for Serial {
    fn read(&mut self, task: &mut Task) -> u8 {
        let mut byte = [0];
        let Ok(_) = self.receiver.with(task).read(&mut byte);
        let [byte] = byte;
        byte
    }

    fn write(&mut self, task: &mut Task, bytes: &[u8]) {
        self.transmitter.transmit(task, bytes);
    }
}

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let mut stepper = board.trap.start(Interrupts);
    let (transmitter, receiver) = board.usart0.start(Interrupts);
    let mut serial = Serial { transmitter, receiver };
    start(MONITOR.start(boot, Priority::P2, move |task| {
        // SAFETY: the test writes to COUNT only.
        unsafe { monitor::run(task, &mut serial, TASKS, &mut |task, stepped| stepper.step(task, stepped)) }
    }));
    start(WAITER.start(boot, Priority::P4, |task| {
        loop {
            NEVER.wait(task);
        }
    }));
    start(COUNTER.start(boot, Priority::P6, |task| {
        loop {
            task.mask(|masked| COUNT.count(masked));
            // Something to step through with interrupts enabled.
            black_box(0);
        }
    }));
});
