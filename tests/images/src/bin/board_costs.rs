//! Measured: the documented costs of mutexes, of tables in flash, and of event flags that an interrupt sets.
//! The program never ends. Its name does not begin with `bench_`, because here a task that masks interrupts
//! stands for an interrupt, and `./x bench` would take it for a task.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use kernel::{Context, EventFlags, Interrupt, Mutex, Never, Priority, Semaphore, Stack, Task};
use tests_images::bench::{begin, end};
use tests_images::start;

const LOCK_AT_CEILING: u8 = 1;
const UNLOCK_AT_CEILING: u8 = 2;
const LOCK_BELOW: u8 = 3;
const UNLOCK_BELOW: u8 = 4;
const TABLE_1: u8 = 5;
const TABLE_2: u8 = 6;
const TABLE_4: u8 = 7;
const TABLE_8: u8 = 8;
const SET_FOR_NOBODY: u8 = 9;
const SET_FOR_FOUR: u8 = 10;
const SET_FOR_FOUR_WITH_TIMEOUTS: u8 = 11;

static MEASURING: Stack<192> = Stack::new();
static WAITING: [Stack<128>; 4] = [const { Stack::new() }; 4];
static WAITING_WITH_TIMEOUT: [Stack<160>; 4] = [const { Stack::new() }; 4];
static LAST: Stack<96> = Stack::new();

static GO: Semaphore = Semaphore::new(0);
static AT_CEILING: Mutex<u16> = Mutex::new(Priority::P3, 0);
static BELOW: Mutex<u16> = Mutex::new(Priority::P1, 0);
static NOBODY: EventFlags = EventFlags::new();
static FOUR: EventFlags = EventFlags::new();
static FOUR_WITH_TIMEOUTS: EventFlags = EventFlags::new();

kernel::flash! {
    static OF_1: [u8; 4] = [1; 4];
    static OF_2: [u16; 4] = [1; 4];
    static OF_4: [u32; 4] = [1; 4];
    static OF_8: [[u8; 8]; 4] = [[1; 8]; 4];
}

// No timer drives the tick, so no tick disturbs the measurement.
kernel::tick_interrupt!(__vector_15);

kernel::main!(|boot| {
    start(MEASURING.start(boot, Priority::P3, measure));
    for stack in &WAITING {
        start(stack.start(boot, Priority::P5, |task| {
            loop {
                FOUR.wait_any(task, 2);
            }
        }));
    }
    for stack in &WAITING_WITH_TIMEOUT {
        start(stack.start(boot, Priority::P5, |task| {
            loop {
                let _ = FOUR_WITH_TIMEOUTS.wait_any_timeout(task, 2, 100);
            }
        }));
    }
    // It runs once all the others wait.
    start(LAST.start(boot, Priority::P6, |task| {
        loop {
            GO.post(task);
        }
    }));
});

fn measure(task: &mut Task) -> Never {
    loop {
        GO.wait(task);
        begin::<LOCK_AT_CEILING>();
        let guard = AT_CEILING.lock(task);
        end::<LOCK_AT_CEILING>();
        begin::<UNLOCK_AT_CEILING>();
        drop(guard);
        end::<UNLOCK_AT_CEILING>();
        begin::<LOCK_BELOW>();
        let guard = BELOW.lock(task);
        end::<LOCK_BELOW>();
        begin::<UNLOCK_BELOW>();
        drop(guard);
        end::<UNLOCK_BELOW>();
        look_up(black_box(3));
        set::<SET_FOR_NOBODY>(task, &NOBODY);
        set::<SET_FOR_FOUR>(task, &FOUR);
        set::<SET_FOR_FOUR_WITH_TIMEOUTS>(task, &FOUR_WITH_TIMEOUTS);
    }
}

/// Looks up an element in each table. The element is used after the measured stretch.
#[inline(never)]
fn look_up(index: usize) {
    begin::<TABLE_1>();
    let one = OF_1.get(index);
    end::<TABLE_1>();
    black_box(one.unwrap_or(0));
    begin::<TABLE_2>();
    let two = OF_2.get(index);
    end::<TABLE_2>();
    black_box(two.unwrap_or(0));
    begin::<TABLE_4>();
    let four = OF_4.get(index);
    end::<TABLE_4>();
    black_box(four.unwrap_or(0));
    begin::<TABLE_8>();
    let eight = OF_8.get(index);
    end::<TABLE_8>();
    black_box(eight.unwrap_or([0; 8]));
}

/// Sets a flag for which no task waits, as an interrupt does.
#[inline(never)]
fn set<const STRETCH: u8>(task: &mut Task, flags: &EventFlags) {
    task.mask(|_| {
        // SAFETY: interrupts are masked as in a handler, and no task becomes ready that outranks this one.
        let interrupt = &mut unsafe { Interrupt::assume() };
        begin::<STRETCH>();
        flags.set(interrupt, 1);
        end::<STRETCH>();
    });
}
