//! The highest task that is ready runs; equals take turns when they yield.
#![no_std]
#![no_main]

use board::debug::halt;
use examples::{println, start};
use kernel::{Priority, Semaphore, Stack};

static PAINTERS: [Stack<128>; 2] = [const { Stack::new() }; 2];
static FIRE_BRIGADE: Stack<128> = Stack::new();
static NEVER: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    for (stack, name) in PAINTERS.iter().zip(["Anna", "Bert"]) {
        start(stack.start(boot, Priority::P5, move |task| {
            for wall in 1..=2 {
                println!("{} paints wall {}", name, wall);
                task.yield_now(); // the other one's turn
            }
            println!("{} smells fire", name);
            // Higher, so it runs before `start` is back.
            start(FIRE_BRIGADE.start(task, Priority::P0, |task| {
                println!("the fire brigade puts it out");
                loop {
                    NEVER.wait(task); // blocked, so that lower ones run
                }
            }));
            println!("{} goes home", name);
            halt()
        }));
    }
});
