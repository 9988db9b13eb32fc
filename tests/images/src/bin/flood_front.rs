//! A neighbour that floods a module from behind, where it is attached by its dock Front.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use tasks::dock::Dock;
use tests_images::flood::Beside;

tests_images::flood!(Dock::Front, Beside::Probes);
