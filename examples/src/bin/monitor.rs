//! The monitor, with a script in place of a serial line.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::Board;
use board::debug::{halt, mark};
use examples::start;
use kernel::monitor::{self, Line, Tasks};
use kernel::{Priority, Stack, Task};

board::interrupts!(Interrupts: Tick, Trap);

static MONITOR: Stack<256> = Stack::new();
static BLINKER: Stack<96> = Stack::new();
static WORKER: Stack<96> = Stack::new();

/// The tasks that the monitor knows.
static TASKS: Tasks = &[("MONITOR", MONITOR.task()), ("BLINKER", BLINKER.task()), ("WORKER", WORKER.task())];

kernel::flash! {
    /// The commands, as somebody would type them.
    static SCRIPT: [u8; 40] = *b"l\ns BLINKER\np WORKER 3\nl\nw 900 2a\nr 900\n";
}

struct Script {
    read: usize,
}

impl Line for Script {
    fn read(&mut self, task: &mut Task) -> u8 {
        task.delay(1);
        let Some(byte) = SCRIPT.get(self.read) else {
            mark(b'\n');
            halt()
        };
        self.read += 1;
        mark(byte); // as the terminal would echo it
        byte
    }

    fn write(&mut self, _: &mut Task, bytes: &[u8]) {
        bytes.iter().copied().for_each(mark);
    }
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let mut stepper = board.trap.start(Interrupts);
    start(MONITOR.start(boot, Priority::P2, move |task| {
        // SAFETY: the script writes only to an unused address.
        unsafe {
            monitor::run(task, &mut Script { read: 0 }, TASKS, &mut |task, stepped| {
                stepper.step(task, stepped)
            })
        }
    }));
    start(BLINKER.start(boot, Priority::P4, |task| {
        loop {
            task.delay(5);
        }
    }));
    start(WORKER.start(boot, Priority::P6, |_| {
        loop {
            black_box(());
        }
    }));
});
