//! A table that stays in flash costs no RAM, which is where the AVR keeps every other constant.
#![no_std]
#![no_main]

use board::debug::halt;
use examples::{println, start};
use kernel::{Priority, Stack};

kernel::flash! {
    /// A quarter of a sine, 0 to 127.
    static QUARTER_SINE: [u8; 9] = [0, 25, 49, 71, 90, 106, 117, 125, 127];

    /// Coins in cents, and how many there are of each.
    static TILL: [(u16, u8); 4] = [(200, 3), (100, 5), (50, 0), (20, 12)];
}

static READER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    start(READER.start(boot, Priority::P3, |_| {
        // `get` returns a copy of an element, if it exists.
        println!("sine of 45 degrees, of 127: {:?}", QUARTER_SINE.get(4));
        println!("behind the end: {:?}", QUARTER_SINE.get(9));
        let total = TILL.iter().map(|(cents, count)| cents * u16::from(count)).sum::<u16>();
        println!("{} kinds of coins, {} cents", TILL.len(), total);
        halt()
    }));
});
