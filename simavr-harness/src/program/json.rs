//! Reports for other programs.

use std::error::Error;
use std::path::Path;

use serde::Serialize;

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
