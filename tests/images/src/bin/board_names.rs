//! A handler calls a function of the program whose name the macro uses for a function of its own, and the
//! program has a module and a macro of names that the language has.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use ::core::ptr::with_exposed_provenance_mut;

use board::debug::mark;
use tests_images as _; // the panic handler

/// INT4's enable bit, in EIMSK (ATmega128 datasheet, "External Interrupts").
const EIMSK: usize = 0x59;

mod core {}

#[expect(unused_macros)]
macro_rules! assert {
    () => {};
}

/// The macro has a function of this name, too.
fn handler() {
    mark(1);
}

kernel::interrupt! {
    /// INT4.
    fn __vector_5(_interrupt) { handler() }
}

kernel::main!(|_| {
    // SAFETY: nothing else uses the register.
    unsafe { with_exposed_provenance_mut::<u8>(EIMSK).write_volatile(1 << 4) }
});
