//! A message is the one owner of a buffer, which moves through queues and returns to its pool when dropped.
#![no_std]
#![no_main]

use board::debug::halt;
use examples::{println, start};
use kernel::{Exhausted, Full, Message, Priority, Queue, Semaphore, Stack};

struct Order {
    table: u8,
    dish: &'static str,
}
kernel::pool!(Order, 3);

/// Room for two; the pool's third buffer is for the order that the cook has in hand.
static KITCHEN: Queue<Order> = Queue::new(2);
static COOK: Stack<128> = Stack::new();
static WAITER: Stack<160> = Stack::new();
static NEVER: Semaphore = Semaphore::new(0);

kernel::main!(|boot| {
    start(WAITER.start(boot, Priority::P2, |task| {
        for (table, dish) in [(1, "soup"), (2, "fish"), (3, "cake")] {
            match Message::new(task, Order { table, dish }) {
                Ok(order) => match KITCHEN.send(task, order) {
                    Ok(()) => println!("waiter: sent {}", dish),
                    Err(Full(order)) => println!("waiter: the kitchen is full, no {}", order.dish),
                },
                Err(Exhausted(order)) => println!("waiter: no paper for {}", order.dish),
            }
        }
        println!("waiter: refused {}", KITCHEN.refused(task));
        loop {
            NEVER.wait(task);
        }
    }));
    start(COOK.start(boot, Priority::P5, |task| {
        for _ in 0..2 {
            let order = KITCHEN.receive(task); // blocks until there is one
            println!("cook: {} for table {}", order.dish, order.table);
        } // dropped here: the buffer is free
        halt()
    }));
});
