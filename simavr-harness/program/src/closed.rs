//! Notices that the program was started with its standard output closed.
//!
//! Rust's runtime opens `/dev/null` in place of a closed standard output, so results would be lost without an
//! error.

use std::sync::atomic::{AtomicBool, Ordering};

static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// The C library calls this before Rust's runtime begins.
#[used]
// SAFETY: the section holds functions without arguments, as this one is; it needs nothing of the runtime.
#[unsafe(link_section = ".init_array")]
static NOTE: extern "C" fn() = note;

extern "C" fn note() {
    // SAFETY: the call reads the flags of a descriptor, and fails if that is not open.
    let flags = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) };
    IS_CLOSED.store(flags == -1, Ordering::Relaxed);
}

/// Makes sure that the program was started with a standard output.
///
/// # Errors
/// It was closed.
pub fn expect_output() -> Result<(), String> {
    if IS_CLOSED.load(Ordering::Relaxed) {
        return Err("the standard output is closed: open it, or send it to /dev/null".into());
    }
    Ok(())
}
