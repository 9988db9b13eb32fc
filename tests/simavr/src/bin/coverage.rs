//! `coverage [--accept]`: prints the instructions of the kernel that no test in simavr executes and the
//! branches that go one way only. It fails if one of them is not on the list with its reason, or the list has
//! others. `--accept` writes the list.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;

use superbot_tests_simavr::arguments;
use superbot_tests_simavr::coverage::{List, functions};

fn main() -> ExitCode {
    let arguments: Vec<_> = arguments().collect();
    let accepts = match &arguments[..] {
        [] => false,
        [argument] if argument == "--accept" => true,
        _ => {
            eprintln!("coverage takes --accept or nothing, not {}", arguments.join(" "));
            return ExitCode::from(2);
        }
    };
    match run(accepts) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Checks or writes the list. Returns whether it is right.
fn run(accepts: bool) -> Result<bool, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/expected/coverage.txt");
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let list = match std::fs::read_to_string(&path) {
        Ok(text) => List::parse(&text).map_err(|error| in_file(&error))?,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => List::default(),
        Err(error) => return Err(in_file(&error)),
    };
    let functions = functions()?;
    let gaps = functions.gaps();
    if accepts {
        let (list, dropped) = list.accept(&gaps);
        std::fs::write(&path, list.to_string()).map_err(|error| in_file(&error))?;
        for (gap, reason) in dropped {
            eprintln!("no longer listed: {gap}: {reason}");
        }
        println!("{}\n{} gaps listed", functions.summary(), gaps.len());
        return Ok(true);
    }
    let complaints = list.check(&gaps);
    complaints.iter().for_each(|complaint| println!("{complaint}"));
    println!("{}\n{} gaps, {} complaints", functions.summary(), gaps.len(), complaints.len());
    let kinds: BTreeSet<_> = complaints.iter().map(|complaint| complaint.advice(&path)).collect();
    kinds.iter().for_each(|advice| println!("{advice}"));
    Ok(complaints.is_empty())
}
