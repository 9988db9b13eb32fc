//! `superbot-time-bound IMAGE NOTES LOOPS [--json]`: prints how long each interrupt of an image takes and
//! masks the others, and fails if that cannot be bounded. NOTES tells where indirect calls lead, as for
//! `superbot-stack-bound`, LOOPS how often loops go round.

use std::error::Error;
use std::ffi::OsString;
use std::process::ExitCode;

use stack_bound::{Annotations, Image};
use time_bound::{Bounds, Interrupt, Job, Notes, Task};

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
    let (files, prints): (_, fn(&Bounds)) = match arguments {
        [files @ .., option] if option == "--json" => (files, print_json),
        files => (files, print_table),
    };
    let [path, notes, loops] = files else {
        return Err("usage: superbot-time-bound IMAGE NOTES LOOPS [--json]".into());
    };
    let image = Image::load(path)?;
    let annotations =
        Annotations::load(notes, &image).map_err(|error| format!("{}: {error}", notes.display()))?;
    let loops_of = Notes::load(loops, &image).map_err(|error| format!("{}: {error}", loops.display()))?;
    match Bounds::new(&image, &annotations, &loops_of) {
        Ok(bounds) => {
            prints(&bounds);
            Ok(ExitCode::SUCCESS)
        }
        Err(problems) => {
            for problem in problems {
                eprintln!("error: in {}, {problem}", path.display());
            }
            eprintln!("error: notes stand in {}", loops.display());
            Ok(ExitCode::FAILURE)
        }
    }
}

fn print_table(bounds: &Bounds) {
    println!("cycles  masked  again  interrupt");
    for interrupt in &bounds.interrupts {
        let Interrupt { vector, cycles, masked, masked_again } = interrupt;
        println!("{cycles:6}  {masked:6}  {masked_again:5}  {vector} {}", interrupt.name());
    }
    println!("cycles                 job");
    for Job { function, address, cycles } in &bounds.jobs {
        println!("{cycles:6}                 {function}, at {address:#x}");
    }
    println!("        masked         task");
    for Task { name, masked } in &bounds.tasks {
        println!("{masked:14}         {name}");
    }
}

fn print_json(bounds: &Bounds) {
    println!("{}", serde_json::to_string(bounds).expect("names and numbers"));
}
