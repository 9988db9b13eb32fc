//! Behaviours as whole robots: many modules, perfect links with a delay, and probes that may be lost. The
//! modules are the pure state machines of the crate `hormone`, stepped each millisecond.

mod changes;
mod discovery;
mod gait;
mod loops;
mod loss;
mod orders;
mod ring;
mod robot;
mod senses;
mod shapes;
mod tree;
mod walks;
mod waves;
