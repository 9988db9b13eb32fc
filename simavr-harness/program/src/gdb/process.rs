//! Processes that keep a robot as it was: copies of the one that runs it. The system copies what one of them
//! changes, page by page, so that one costs little.

use std::io;
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;

/// Which of two equal processes this is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fork {
    Original,
    Copy,
}

/// Makes a copy of this process, which must have one thread only.
///
/// # Errors
/// The system has no more memory or processes.
pub fn fork() -> io::Result<Fork> {
    // SAFETY: with one thread no lock is held by another, which the copy would not have.
    match unsafe { libc::fork() } {
        -1 => Err(io::Error::last_os_error()),
        0 => Ok(Fork::Copy),
        _ => Ok(Fork::Original),
    }
}

/// Ends this process, and nothing else: what it shares with copies stays as it is.
pub fn leave() -> ! {
    // SAFETY: it takes nothing and does not return.
    unsafe { libc::_exit(0) }
}

/// Leaves Ctrl-C to gdb, which a terminal tells of it, too; and processes that end to the system.
pub fn ignore_signals() {
    // SAFETY: no handler is installed.
    unsafe {
        libc::signal(libc::SIGINT, libc::SIG_IGN);
        libc::signal(libc::SIGCHLD, libc::SIG_IGN);
    }
}

/// Leaves Ctrl-C to gdb.
pub fn ignore_interrupts() {
    // SAFETY: no handler is installed.
    unsafe { libc::signal(libc::SIGINT, libc::SIG_IGN) };
}

/// Whether a stream has something to read, or its end.
pub fn is_ready(stream: &UnixStream) -> bool {
    poll([(stream.as_raw_fd(), libc::POLLIN)], 0)[0]
}

/// Waits until there is something to read. Returns whether there is; `false` when the other end of `life` is
/// gone.
pub fn wait(stream: &UnixStream, life: &UnixStream) -> bool {
    loop {
        // What comes for others over `life` wakes nobody here.
        match poll([(stream.as_raw_fd(), libc::POLLIN), (life.as_raw_fd(), 0)], -1) {
            [_, true] => return false,
            [true, _] => return true,
            _ => {}
        }
    }
}

fn poll<const COUNT: usize>(streams: [(RawFd, i16); COUNT], milliseconds: i32) -> [bool; COUNT] {
    let mut streams = streams.map(|(fd, events)| libc::pollfd { fd, events, revents: 0 });
    // SAFETY: the array is as long as is said.
    unsafe { libc::poll(streams.as_mut_ptr(), COUNT as libc::nfds_t, milliseconds) };
    streams.map(|stream| stream.revents != 0)
}
