//! Prints results to the standard output, and all else to the standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{self, Write};

use super::closed::expect_output;

/// Prints a result.
///
/// # Errors
/// The standard output is closed, or can't be written to.
pub fn print(result: impl Display) -> Result<(), Box<dyn Error>> {
    expect_output()?;
    let mut output = io::stdout().lock();
    let printed = write!(output, "{result}").and_then(|()| output.flush());
    printed.map_err(|error| format!("can't write to the standard output: {error}").into())
}

/// Prints a message to the standard error. A message that can't be written is dropped.
pub fn say(text: impl Display) {
    let _ = write!(io::stderr(), "{text}");
}
