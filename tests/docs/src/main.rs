//! `docs [--check] [PAGE...]`: runs the commands whose output pages show, and replaces the shown output with
//! the new one. With `--check` it only reports differences. It covers all pages that show such output, unless
//! some are named.
//!
//! A page names the command in a comment before the block or the table: `<!-- ./x response -->`. If a picture
//! follows, the command writes the picture; `--check` skips it.
//!
//! A command that fails is named at the end; the others still run.
//!
//! Exit status: 1 where a page differs and `--check` was given, 2 where a command fails or a page can't be
//! read.

mod figures;
#[cfg(test)]
mod links;
mod page;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::{env, fs};

use figures::{Stale, gone};
use page::{Page, Shown};

/// The sources.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn main() -> ExitCode {
    match run(&Path::new(ROOT).canonicalize().unwrap_or_else(|_| ROOT.into())) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("docs: {error}");
            ExitCode::from(2)
        }
    }
}

/// Runs the commands. Returns false only if `--check` has found a difference.
fn run(root: &Path) -> Result<bool, String> {
    let arguments = || env::args_os().skip(1);
    let is_check = arguments().any(|argument| argument == "--check");
    let named: Vec<PathBuf> =
        arguments().filter(|argument| argument != "--check").map(PathBuf::from).collect();
    let all = pages(root)?;
    if let Some(unknown) = named.iter().find(|name| !all.contains(name)) {
        return Err(format!("there is no page {}; give README.md, or a page in docs/", unknown.display()));
    }
    let (mut changed, mut failed) = (Vec::new(), Vec::new());
    for path in all.iter().filter(|path| named.is_empty() || named.contains(path)) {
        let mut page = read(root, path)?;
        let before = page.text();
        for shown in page.shown() {
            if is_check && shown.is_picture {
                continue;
            }
            eprintln!("docs: {}: {}", path.display(), shown.command);
            match refresh(root, &mut page, &shown) {
                Ok(figures) => changed.extend(figures),
                Err(error) => failed.push(format!("{}: {error}", path.display())),
            }
        }
        if !is_check && page.text() != before {
            fs::write(root.join(path), page.text())
                .map_err(|error| format!("{}: {error}", path.display()))?;
        }
    }
    for (old, new) in &changed {
        println!("-{old}\n+{new}");
    }
    let old = gone(&changed);
    for path in &all {
        for Stale { line, figure, text } in read(root, path)?.stale(&old) {
            println!("{}:{line}: {figure} has changed, check whether this has: {text}", path.display());
        }
    }
    if failed.is_empty() { Ok(changed.is_empty() || !is_check) } else { Err(failed.join("\ndocs: ")) }
}

/// Replaces the shown output of a command with its new output. Returns the lines that have changed, old and
/// new.
fn refresh(root: &Path, page: &mut Page, shown: &Shown) -> Result<Vec<(String, String)>, String> {
    let printed = printed_by(root, &shown.command).map_err(|error| format!("`{}` {error}", shown.command))?;
    if shown.is_picture { Ok(Vec::new()) } else { page.replace(shown, &printed) }
}

/// The pages that may show what commands print, from the root.
fn pages(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut pages = vec![PathBuf::from("README.md")];
    let folder = fs::read_dir(root.join("docs")).map_err(|error| format!("docs: {error}"))?;
    let names = folder.filter_map(|entry| Some(Path::new("docs").join(entry.ok()?.file_name())));
    pages.extend(names.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    pages.sort();
    Ok(pages)
}

fn read(root: &Path, path: &Path) -> Result<Page, String> {
    let text = fs::read_to_string(root.join(path)).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(Page::new(&text))
}

/// The standard output of a command.
fn printed_by(root: &Path, command: &str) -> Result<String, String> {
    let mut bash = Command::new("bash");
    bash.args(["-o", "pipefail", "-c", command]).current_dir(root).stdin(Stdio::null());
    let output = bash.stderr(Stdio::inherit()).output().map_err(|error| format!("can't run: {error}"))?;
    if !output.status.success() {
        return Err(format!("fails with {}", output.status));
    }
    String::from_utf8(output.stdout).map_err(|_| "prints what is not UTF-8".into())
}
