//! Why there is no bound.

use thiserror::Error;

/// A reason why the use of a stack can't be computed. Addresses are in bytes, as `avr-objdump` prints them.
#[derive(Clone, Debug, Error, PartialEq, Eq, PartialOrd, Ord)]
pub enum Problem {
    #[error("recursion: {}; if you know how many bytes it uses in all, note \"{} = bytes\"", .0.join(" calls "), .0[0])]
    Recursion(Vec<String>),
    #[error(
        "{function} jumps or calls indirectly at {address:#x}; note \"{function} => callee\", a line for \
         each callee{}", instead_of_table(.function)
    )]
    Indirect { function: String, address: u32 },
    #[error(
        "{function} loads a stack pointer at {address:#x} that cannot be followed; note \"{function} = bytes\""
    )]
    StackPointer { function: String, address: u32 },
    #[error(
        "{function} returns at {address:#x} with something left on the stack; note \"{function} = bytes\""
    )]
    Return { function: String, address: u32 },
    #[error(
        "{function} pushes without end, or pops more than it pushed, at {address:#x}; note \"{function} = bytes\""
    )]
    Depth { function: String, address: u32 },
    #[error(
        "{function} reads its return address at {address:#x}: rustc takes a return address of 3 bytes for an \
         argument; pass no more than 18 bytes of arguments"
    )]
    ReturnAddress { function: String, address: u32 },
    #[error(
        "{function} enables interrupts at {address:#x}, by {by}, within a critical section that restores \
         SREG; put the call of the kernel before it or behind it"
    )]
    SectionEnded { function: String, address: u32, by: String },
    #[error("{function} runs into data at {address:#x}, which is not an instruction")]
    NoCode { function: String, address: u32 },
}

/// What helps where a `switch` of avr-gcc jumps by a table: its targets have no names that could be noted.
fn instead_of_table(function: &str) -> &'static str {
    if function.starts_with("__tablejump") {
        "; if a switch jumps there, build with -fno-jump-tables"
    } else {
        ""
    }
}
