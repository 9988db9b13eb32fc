//! A neighbour that floods a module at a side, by its dock Back, and does not probe, so the module does not
//! count it as a neighbour.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use tasks::dock::Dock;
use tests_images::flood::Beside;

tests_images::flood!(Dock::Back, Beside::Nothing);
