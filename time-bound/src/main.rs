//! `superbot-time-bound IMAGE NOTES LOOPS [RELEASES...] [--json]`: prints how long each interrupt of an image
//! takes and masks the others, and fails if there is no bound. NOTES says where indirect calls lead, as for
//! `superbot-stack-bound`; LOOPS says how often loops go round. With RELEASES, which list how often events
//! come, it prints how soon tasks respond, and fails if a task is not listed.

use std::error::Error;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use serde::Serialize;
use stack_bound::{Annotations, Image};
use time_bound::{Bounds, Costs, Interrupt, Job, Notes, Releases, Responses, Task};

const USAGE: &str = "usage: superbot-time-bound IMAGE NOTES LOOPS [RELEASES...] [--json]
Prints how long each interrupt of the program in the ELF file IMAGE takes and masks the others, in cycles. The
file NOTES is as for superbot-stack-bound, and LOOPS says how often loops go round. With RELEASES, which list
how often events come, prints how soon tasks respond.";

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    match run(&arguments) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[OsString]) -> Result<ExitCode, Box<dyn Error>> {
    let (files, is_json) = match arguments {
        [files @ .., option] if option == "--json" => (files, true),
        files => (files, false),
    };
    if let [help] = files
        && (help == "--help" || help == "-h")
    {
        writeln!(std::io::stdout(), "{USAGE}")?;
        return Ok(ExitCode::SUCCESS);
    }
    let [path, notes, loops, releases @ ..] = files else {
        return Err(USAGE.into());
    };
    let image = Image::load(path)?;
    let annotations =
        Annotations::load(notes, &image).map_err(|error| format!("{}: {error}", notes.display()))?;
    let loops_of = Notes::load(loops, &image).map_err(|error| format!("{}: {error}", loops.display()))?;
    let bounds = Bounds::new(&image, &annotations, &loops_of);
    let printed = if releases.is_empty() {
        bounds.map(|bounds| if is_json { json(&bounds) } else { table(&bounds) })
    } else {
        let releases_of = Releases::load(releases)?;
        let responses = bounds.and_then(|bounds| {
            let costs = Costs::new(&image, &annotations, &loops_of)?;
            Responses::new(&releases_of, &costs, &bounds)
        });
        responses.map(|responses| if is_json { json(&responses) } else { responses.to_string() })
    };
    match printed {
        Ok(printed) => {
            write!(std::io::stdout(), "{printed}")
                .map_err(|error| format!("can't write to the standard output: {error}"))?;
            Ok(ExitCode::SUCCESS)
        }
        Err(problems) => {
            for problem in problems {
                eprintln!("error: in {}, {problem}", path.display());
            }
            for notes in [loops].into_iter().chain(releases) {
                eprintln!("error: the notes are in {}", notes.display());
            }
            Ok(ExitCode::FAILURE)
        }
    }
}

fn table(bounds: &Bounds) -> String {
    let mut lines = vec!["cycles  masked  again  last  interrupt".to_owned()];
    for interrupt in &bounds.interrupts {
        let Interrupt { vector, name, cycles, masked, masked_again, masked_last } = interrupt;
        let masked = format!("{masked:6}  {masked_again:5}  {masked_last:4}");
        lines.push(format!("{cycles:6}  {masked}  {vector} {name}"));
    }
    lines.push("cycles                       job".to_owned());
    for Job { function, address, cycles } in &bounds.jobs {
        lines.push(format!("{cycles:6}                       {function}, at {address:#x}"));
    }
    lines.push("        masked               task".to_owned());
    for Task { name, masked } in &bounds.tasks {
        lines.push(format!("{masked:14}               {name}"));
    }
    lines.join("\n") + "\n"
}

fn json(figures: &impl Serialize) -> String {
    serde_json::to_string(figures).expect("names and numbers") + "\n"
}
