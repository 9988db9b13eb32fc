//! Forks copies of the process that runs the robot, which keep the robot as it was. The system copies only
//! the memory pages that one of them changes, so a copy costs little.

use std::io;
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;

/// Tells the two processes apart after a fork.
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
    // SAFETY: there is one thread, so no other thread, which the copy would lack, holds a lock.
    match unsafe { libc::fork() } {
        -1 => Err(io::Error::last_os_error()),
        0 => Ok(Fork::Copy),
        _ => Ok(Fork::Original),
    }
}

/// Ends this process without any cleanup, so that the resources that it shares with copies stay as they are.
pub fn leave() -> ! {
    // SAFETY: `_exit` takes no pointers and does not return.
    unsafe { libc::_exit(0) }
}

/// Leaves Ctrl-C to gdb, which also gets it from the terminal, and leaves ended child processes to the
/// system.
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

/// Waits until `stream` has something to read, and returns `true`. Returns `false` when the other end of
/// `life` is gone.
pub fn wait(stream: &UnixStream, life: &UnixStream) -> bool {
    loop {
        // Without requested events, poll reports only the end of `life`, not data for other processes.
        match poll([(stream.as_raw_fd(), libc::POLLIN), (life.as_raw_fd(), 0)], -1) {
            [_, true] => return false,
            [true, _] => return true,
            _ => {}
        }
    }
}

fn poll<const COUNT: usize>(streams: [(RawFd, i16); COUNT], milliseconds: i32) -> [bool; COUNT] {
    let mut streams = streams.map(|(fd, events)| libc::pollfd { fd, events, revents: 0 });
    // SAFETY: the array has `COUNT` elements.
    unsafe { libc::poll(streams.as_mut_ptr(), COUNT as libc::nfds_t, milliseconds) };
    streams.map(|stream| stream.revents != 0)
}
