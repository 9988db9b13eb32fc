//! Reports for other programs.

use std::error::Error;
use std::fs::OpenOptions;
use std::path::Path;

use serde::Serialize;

/// Makes sure, before anything has taken its time, that a report can be written to `path`.
pub fn expect_writable(path: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let Some(path) = path.filter(|path| *path != Path::new("-")) else { return Ok(()) };
    let opened = OpenOptions::new().append(true).create(true).open(path);
    opened.map_err(|error| format!("can't write {}: {error}", path.display()))?;
    Ok(())
}

/// Writes `report` as JSON to the file at `path`, or to the standard output for `-`.
pub fn write(report: &impl Serialize, path: &Path) -> Result<(), Box<dyn Error>> {
    let json = serde_json::to_string_pretty(report)?;
    if path == Path::new("-") {
        println!("{json}");
    } else {
        std::fs::write(path, json + "\n")
            .map_err(|error| format!("can't write {}: {error}", path.display()))?;
    }
    Ok(())
}
