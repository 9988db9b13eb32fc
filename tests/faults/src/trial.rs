//! Tests in simavr, on a kernel built from the copy of the sources.

use std::path::Path;
use std::process::{Command, Output};

/// The test that plays scripts of kernel calls: the number of sequences, and the first seed after it, 0 by
/// default. Any other name is the sweep of the image of that name.
pub const MODEL: &str = "model 6000";

/// The seconds after which a test that does not end is killed.
const PATIENCE: &str = "600";

/// How a test ended.
pub enum Verdict {
    Passed,
    /// The test's first complaint.
    Failed(String),
}

/// Builds the image of `test` from the sources in `scratch` and runs it with a simulator built from `root`.
pub fn run(test: &str, root: &Path, scratch: &Path) -> Result<Verdict, String> {
    let mut words = test.split(' ');
    let image = words.next().unwrap_or_default();
    let numbers: Vec<_> = words.collect();
    build(image, scratch)?;
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", PATIENCE, "cargo", "run", "--locked", "--quiet"]);
    command.args(["-p", "superbot-tests-simavr", "--bin"]);
    if numbers.is_empty() {
        command.args(["sweep", "--", "--quick", image]);
    } else {
        command.args([image, "--", "atmega128"]).args(numbers);
    }
    command.current_dir(root).env("SUPERBOT_IMAGES", scratch.join("target/images"));
    let output = outcome(&mut command)?;
    match output.status.code() {
        Some(0) => Ok(Verdict::Passed),
        // The image lacks a symbol that the test needs, so it was not built as it should be.
        Some(101) if told(&output).contains("build it again") => Err(told(&output)),
        // 1 is the test's own verdict, 101 a panic.
        Some(1 | 101) => Ok(Verdict::Failed(complaint(&output))),
        Some(124 | 137) => Ok(Verdict::Failed(format!("it did not end within {PATIENCE} s"))),
        _ => Err(format!("{command:?}: {}\n{}", output.status, told(&output))),
    }
}

fn build(image: &str, scratch: &Path) -> Result<(), String> {
    let mut command = Command::new("./x");
    command.args(["image", image]).current_dir(scratch);
    // The copy has a target folder of its own.
    command.env_remove("CARGO_TARGET_DIR");
    let output = outcome(&mut command)?;
    if output.status.success() {
        return Ok(());
    }
    Err(format!("{image} can't be built in {}:\n{}", scratch.display(), told(&output)))
}

fn outcome(command: &mut Command) -> Result<Output, String> {
    command.output().map_err(|error| format!("{command:?}: {error}"))
}

fn told(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// The line in which a test says what is wrong.
fn complaint(output: &Output) -> String {
    let told = told(output);
    // Before that line the model prints the steps that led to it, the sweep the number of good runs of a
    // path, and a panic its place.
    let before = ["again:", "Setup ", "while ", "thread "];
    let is_about =
        |line: &str| before.iter().any(|begin| line.starts_with(begin)) || line.contains(" boundaries ");
    let mut lines = told.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.find(|line| !is_about(line)).unwrap_or_default().to_owned()
}
