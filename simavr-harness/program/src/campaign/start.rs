//! Starts the jobs of a campaign on this machine.

use std::error::Error;
use std::io::IsTerminal;
use std::process::{Command, Stdio};

use super::super::output::say;
use super::jobs::Jobs;

/// Runs all jobs that have no result yet, `at_once` at a time, by GNU parallel or else by xargs.
///
/// # Errors
/// Neither of them is installed, or a signal ended it.
pub fn start(jobs: &Jobs, at_once: Option<usize>) -> Result<(), Box<dyn Error>> {
    let command = if has_parallel() {
        let mut command = jobs.parallel(at_once)?;
        // The progress bar is for terminals only.
        command.retain(|argument| argument != "--bar" || std::io::stderr().is_terminal());
        command
    } else {
        say("superbot-sim: GNU parallel is not installed, so xargs runs the jobs, and shows no progress\n");
        jobs.xargs(at_once)?
    };
    let status = Command::new(&command[0]).args(&command[1..]).status();
    let status = status.map_err(|error| format!("can't run {}: {error}", command[0]))?;
    // An exit status other than 0 only tells that jobs failed, as their results do.
    match status.code() {
        Some(_) => Ok(()),
        None => Err(format!("a signal ended {}: run the same command again to continue", command[0]).into()),
    }
}

/// There are two programs of this name; only GNU's names itself so.
fn has_parallel() -> bool {
    let version =
        Command::new("parallel").arg("--version").stdin(Stdio::null()).stderr(Stdio::null()).output();
    version.is_ok_and(|version| version.stdout.starts_with(b"GNU parallel"))
}
