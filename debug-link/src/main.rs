//! `superbot-debug-link ARGS`: links with avr-gcc, called by rustc as its linker, so that an image with
//! debugging information has the same code as without it.
//!
//! The linker alone keeps a `ret` to which debugging information refers, or seems to refer
//! (docs/toolchain.md). Here the program's object file is the only one with such information, so its
//! references from one part to another can be resolved before the link. A reference to a `ret` that the
//! linker may remove is redirected to the instruction before.

mod object_file;

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use tempfile::TempDir;

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    match link(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("superbot-debug-link: {error}");
            ExitCode::FAILURE
        }
    }
}

fn link(arguments: &[OsString]) -> Result<bool, Box<dyn Error>> {
    let directory = tempfile::tempdir()?;
    replace_start_up(arguments, &directory)?;
    let mut compiler = Command::new("avr-gcc");
    compiler.arg("-B").arg(directory.path());
    for (number, argument) in arguments.iter().enumerate() {
        let path = Path::new(argument);
        let copy = directory.path().join(number.to_string());
        compiler.arg(match path.extension().and_then(|extension| extension.to_str()) {
            Some("o") => {
                let mut bytes = std::fs::read(path)?;
                object_file::settle(&mut bytes).map_err(|error| format!("{}: {error}", path.display()))?;
                let copy = copy.with_extension("o");
                std::fs::write(&copy, bytes)?;
                copy
            }
            Some("rlib") => {
                let copy = copy.with_extension("a");
                strip(path, &copy)?;
                copy
            }
            _ => path.into(),
        });
    }
    Ok(compiler.status()?.success())
}

/// Puts the start-up code, without debugging information, where the compiler finds it through `-B`.
fn replace_start_up(arguments: &[OsString], directory: &TempDir) -> Result<(), Box<dyn Error>> {
    let mcu = arguments.iter().filter_map(|argument| argument.to_str()?.strip_prefix("-mmcu=")).next();
    let mcu = mcu.ok_or("there is no -mmcu among the arguments")?;
    let name = format!("crt{mcu}.o");
    let mut asked = Command::new("avr-gcc");
    let answer = asked.arg(format!("-mmcu={mcu}")).arg(format!("-print-file-name={name}")).output()?;
    let path = PathBuf::from(String::from_utf8(answer.stdout)?.trim_end());
    // The compiler looks for it in a folder that is named for the architecture.
    let architecture = path.parent().and_then(Path::file_name).ok_or("avr-gcc has no start-up code")?;
    let folder = directory.path().join(architecture);
    std::fs::create_dir(&folder)?;
    strip(&path, &folder.join(name))
}

fn strip(from: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    let status = Command::new("avr-objcopy").arg("--strip-debug").args([from, to]).status()?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("avr-objcopy could not strip {}", from.display()).into())
    }
}
