//! All tests in simavr but [those of the robot](robot/main.rs), in one program: it is linked once, and keeps
//! its threads busy to the end.
//! `cargo test -p superbot-tests-simavr kernel::` runs those of one file.

mod alone;
mod any_image;
mod bench;
mod board;
mod bridge;
mod canary;
mod console;
mod cores;
mod costs;
mod coverage;
mod cpu_time;
mod devices;
mod examples;
mod kernel;
mod link;
mod loops;
mod model;
mod monitor;
mod programs;
mod qemu;
mod serial_load;
mod skips;
mod soft_uart;
mod stack;
mod stack_bound;
mod stack_check;
mod step;
mod storm;
mod sweep;
mod tick;
mod tickless;
mod time_bound;
mod trace;
