//! `superbot-stack-bound IMAGE [NOTES]`: prints what each stack of an image needs, and fails if one is too
//! small or cannot be bounded.

use std::error::Error;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use stack_bound::{Annotations, Image, stacks};

const USAGE: &str = "usage: superbot-stack-bound IMAGE [NOTES]
Prints how many bytes of each stack the program in the ELF file IMAGE needs at most. NOTES is a file that says
where indirect calls lead, and how much recursion uses. A critical section that a call of the kernel would end
early is an error.";

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
    let (path, notes) = match arguments {
        [help] if help == "--help" || help == "-h" => {
            writeln!(std::io::stdout(), "{USAGE}")?;
            return Ok(ExitCode::SUCCESS);
        }
        [image] => (image, None),
        [image, notes] => (image, Some(notes)),
        _ => return Err(USAGE.into()),
    };
    let image = Image::load(path)?;
    let annotations = match notes {
        Some(notes) => {
            Annotations::load(notes, &image).map_err(|error| format!("{}: {error}", notes.display()))?
        }
        None => Annotations::default(),
    };
    let stacks = match stacks(&image, &annotations) {
        Ok(stacks) => stacks,
        Err(problems) => {
            for problem in problems {
                eprintln!("error: in {}, {problem}", path.display());
            }
            return Ok(ExitCode::FAILURE);
        }
    };
    let mut code = ExitCode::SUCCESS;
    for stack in &stacks {
        writeln!(std::io::stdout(), "{stack}")
            .map_err(|error| format!("can't write to the standard output: {error}"))?;
        if stack.is_too_small() {
            eprintln!("error: in {}, a stack is too small: {stack}", path.display());
            code = ExitCode::FAILURE;
        }
    }
    Ok(code)
}
