//! Event flags: a task waits for any of several things, or for all of them.
#![no_std]
#![no_main]

use board::debug::halt;
use examples::{println, start};
use kernel::{EventFlags, Priority, Stack};

const DOOR: u8 = 1 << 0;
const WINDOW: u8 = 1 << 1;
const ARMED: u8 = 1 << 2;
const MOVEMENT: u8 = 1 << 3;

static HOUSE: EventFlags = EventFlags::new();
static LOG: Stack<128> = Stack::new();
static ALARM: Stack<128> = Stack::new();
static DAY: Stack<128> = Stack::new();

kernel::main!(|boot| {
    start(LOG.start(boot, Priority::P3, |task| {
        loop {
            let opened = HOUSE.wait_any(task, DOOR | WINDOW); // takes what it returns
            println!("opened:{}{}", name(opened, DOOR, " door"), name(opened, WINDOW, " window"));
        }
    }));
    start(ALARM.start(boot, Priority::P2, |task| {
        loop {
            HOUSE.wait_all(task, ARMED | MOVEMENT);
            println!("alarm");
        }
    }));
    start(DAY.start(boot, Priority::P5, |task| {
        HOUSE.set(task, DOOR);
        HOUSE.set(task, DOOR | WINDOW);
        HOUSE.set(task, MOVEMENT); // stays set
        println!("nobody home");
        HOUSE.set(task, ARMED);
        halt()
    }));
});

fn name(flags: u8, flag: u8, name: &str) -> &str {
    if flags & flag != 0 { name } else { "" }
}
