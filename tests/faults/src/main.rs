//! `faults [--check] [NAME...]`: plants faults into a copy of the kernel, one after the other, and prints
//! which test in simavr finds each. It plants all faults of the list, unless some are named. `--check` only
//! checks that the named faults exist.
//!
//! Fails when a fault is not found and the list gives no reason, or when a fault is found that the list calls
//! not caught.

mod fault;
mod scratch;
mod trial;

use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use fault::Fault;
use scratch::Scratch;
use trial::Verdict;

/// The sources.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The list of faults.
const LIST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/faults.toml");

fn main() -> ExitCode {
    // A name that is not UTF-8 becomes one that no fault has.
    let names = std::env::args_os().skip(1).map(|name| name.to_string_lossy().into_owned());
    let mut names = names.peekable();
    let only_checks = names.next_if(|first| first == "--check").is_some();
    let names: Vec<_> = names.collect();
    let faults = fault::read(Path::new(LIST)).and_then(|faults| chosen(faults, &names));
    match faults.and_then(|faults| if only_checks { Ok(true) } else { run(&faults) }) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// Plants the faults. Returns whether each is found or not as the list says.
fn run(faults: &[Fault]) -> Result<bool, String> {
    let root = Path::new(ROOT).canonicalize().map_err(|error| format!("{ROOT}: {error}"))?;
    let scratch = Scratch::new(&root, root.join("target/faults"))?;
    let try_it = |test: &str| trial::run(test, &root, scratch.root());
    for test in faults.iter().flat_map(|fault| &fault.tests).collect::<BTreeSet<_>>() {
        let start = Instant::now();
        if let Verdict::Failed(complaint) = try_it(test)? {
            return Err(format!("{test} fails on the kernel as it is: {complaint}"));
        }
        println!("{test} passes on the kernel as it is ({} s)", start.elapsed().as_secs());
    }
    let (mut not_caught, mut not_to_list) = (Vec::new(), Vec::new());
    let (mut caught, mut listed) = (0, 0);
    for fault in faults {
        let start = Instant::now();
        let found = scratch.with(fault, || find(fault, try_it))??;
        let (told, wrong) = match (found, &fault.not_caught) {
            (Some(by), None) => {
                caught += 1;
                (format!("caught by {by}"), None)
            }
            (None, Some(reason)) => {
                listed += 1;
                (format!("NOT CAUGHT, as listed: {reason}"), None)
            }
            (None, None) => ("NOT CAUGHT".to_owned(), Some(&mut not_caught)),
            (Some(by), Some(_)) => {
                (format!("listed as not caught, but caught by {by}"), Some(&mut not_to_list))
            }
        };
        println!("{:28} {told} ({} s)", fault.name, start.elapsed().as_secs());
        if let Some(wrong) = wrong {
            println!("    {}: {}", fault.file, fault.means);
            wrong.push(&fault.name[..]);
        }
    }
    println!(
        "{} faults: {caught} caught, {listed} not caught for the listed reasons, {} wrong",
        faults.len(),
        not_caught.len() + not_to_list.len()
    );
    print!("{}", advice(&not_caught, &not_to_list));
    Ok(not_caught.is_empty() && not_to_list.is_empty())
}

/// What to do about the faults that were not found, and about those that were found though they are listed as
/// not caught.
fn advice(not_caught: &[&str], not_to_list: &[&str]) -> String {
    let mut advice = String::new();
    if !not_caught.is_empty() {
        let names = not_caught.join(" ");
        advice +=
            &format!("not caught: {names}. Write a test that finds each, or give the reason in {LIST}\n");
    }
    if !not_to_list.is_empty() {
        let names = not_to_list.join(" ");
        advice += &format!("caught: {names}. Take the reason why each is not caught out of {LIST}\n");
    }
    advice
}

/// The faults of these names; all if there is no name.
fn chosen(mut faults: Vec<Fault>, names: &[String]) -> Result<Vec<Fault>, String> {
    let known = faults.iter().map(|fault| &fault.name);
    if let Some(unknown) = names.iter().find(|&name| !known.clone().any(|known| known == name)) {
        let known: Vec<_> = known.map(String::as_str).collect();
        return Err(format!("there is no fault {unknown}; give one of {}", known.join(", ")));
    }
    faults.retain(|fault| names.is_empty() || names.contains(&fault.name));
    Ok(faults)
}

/// The test that finds `fault`, which is planted in the kernel, and its message.
fn find(fault: &Fault, try_it: impl Fn(&str) -> Result<Verdict, String>) -> Result<Option<String>, String> {
    for test in &fault.tests {
        let verdict = try_it(test).map_err(|error| format!("fault {}: {error}", fault.name))?;
        if let Verdict::Failed(complaint) = verdict {
            return Ok(Some(format!("{test}: {complaint}")));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::advice;

    #[test]
    fn advice_fits_what_is_wrong() {
        assert_eq!(advice(&[], &[]), "");
        let missing = advice(&["one", "other"], &[]);
        assert!(missing.starts_with("not caught: one other. Write a test") && missing.lines().count() == 1);
        let listed = advice(&[], &["one"]);
        assert!(listed.starts_with("caught: one. Take the reason") && listed.lines().count() == 1);
    }
}
