//! A neighbour that floods a module from the front, where it is attached by its dock Back.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use tasks::dock::Dock;
use tests_images::flood::Beside;

tests_images::flood!(Dock::Back, Beside::Probes);
