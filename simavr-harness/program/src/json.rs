//! Reports for other programs.

use std::error::Error;
use std::fmt::Display;
use std::fs::{File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::{Builder, NamedTempFile};

use super::output::print;

/// Where a report goes.
pub enum Destination {
    StandardOutput,
    /// A device or a named pipe.
    Stream(PathBuf, File),
    /// A file, which is there or not. It is written beside it first, so it is whole or as it was.
    File(PathBuf),
}

impl Destination {
    /// Makes sure, before anything has taken its time, that a report can be written to `path`, which is not
    /// that of the `robot` file. `-` is the standard output.
    ///
    /// # Errors
    /// It can't.
    pub fn of(path: Option<&Path>, robot: Option<&Path>) -> Result<Option<Self>, Box<dyn Error>> {
        let Some(path) = path else { return Ok(None) };
        if path == Path::new("-") {
            return Ok(Some(Destination::StandardOutput));
        }
        Self::file(path, robot, "--json").map(Some)
    }

    /// Likewise, and `-` is a file as any other. `option` is what names it.
    ///
    /// # Errors
    /// It can't be written to.
    pub fn file(path: &Path, robot: Option<&Path>, option: &str) -> Result<Self, Box<dyn Error>> {
        if robot.is_some_and(|robot| is_same(robot, path)) {
            return Err(format!("{} is the robot file: give {option} another", path.display()).into());
        }
        Self::at(path).map_err(|error| {
            format!("can't write {}: {error}; give {option} another path", path.display()).into()
        })
    }

    /// Likewise, and it is not where the `report` goes, which `--json` names.
    ///
    /// # Errors
    /// It can't be written to, or is.
    pub fn besides(
        report: Option<&Self>,
        path: &Path,
        robot: Option<&Path>,
        option: &str,
    ) -> Result<Self, Box<dyn Error>> {
        let destination = Self::file(path, robot, option)?;
        if report.is_some_and(|report| report.is(&destination)) {
            return Err(format!("{} is for --json already: give {option} another", path.display()).into());
        }
        Ok(destination)
    }

    /// Whether both are one file, which the one written last would overwrite.
    pub fn is(&self, other: &Self) -> bool {
        let path = |destination: &Self| match destination {
            Destination::StandardOutput => None,
            Destination::Stream(path, _) | Destination::File(path) => Some(path.clone()),
        };
        let [one, other] = [self, other].map(path);
        one.zip(other).is_some_and(|(one, other)| one == other || is_same(&one, &other))
    }

    fn at(path: &Path) -> io::Result<Self> {
        let path = resolved(path)?;
        match path.metadata() {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(found) if !found.is_file() => {
                // A pipe from which nobody reads would be waited for without end.
                let opened = OpenOptions::new().write(true).custom_flags(libc::O_NONBLOCK).open(&path);
                let _held = opened.map_err(|error| match error.raw_os_error() {
                    Some(libc::ENXIO) => io::Error::other("nobody reads it"),
                    _ => error,
                })?;
                let stream = OpenOptions::new().write(true).open(&path)?;
                Ok(Destination::Stream(path, stream))
            }
            found => {
                if found.is_ok() {
                    OpenOptions::new().append(true).open(&path)?;
                }
                beside(&path)?;
                Ok(Destination::File(path))
            }
        }
    }

    /// Writes `report` as JSON.
    ///
    /// # Errors
    /// It can't be written.
    pub fn write(self, report: &impl Serialize) -> Result<(), Box<dyn Error>> {
        self.write_text(&(serde_json::to_string_pretty(report)? + "\n"))
    }

    /// Writes `text`.
    ///
    /// # Errors
    /// It can't be written.
    pub fn write_text(self, text: &str) -> Result<(), Box<dyn Error>> {
        if let Destination::StandardOutput = self { print(text) } else { self.write_bytes(text.as_bytes()) }
    }

    /// Writes `content`, whatever it is.
    ///
    /// # Errors
    /// It can't be written.
    pub fn write_bytes(self, content: &[u8]) -> Result<(), Box<dyn Error>> {
        let (path, written) = match self {
            Destination::StandardOutput => ("the standard output".into(), io::stdout().write_all(content)),
            Destination::Stream(path, mut stream) => (path, stream.write_all(content)),
            Destination::File(path) => {
                let written = write_beside(&path, content);
                (path, written)
            }
        };
        written.map_err(|error| format!("can't write {}: {error}", path.display()).into())
    }
}

/// Tells a report: as JSON where that is asked for, else by the standard output.
///
/// # Errors
/// It can't be written.
pub fn tell(
    destination: Option<Destination>,
    report: &(impl Serialize + Display),
) -> Result<(), Box<dyn Error>> {
    match destination {
        Some(destination) => destination.write(report),
        None => print(report),
    }
}

fn write_beside(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = beside(path)?;
    file.write_all(content)?;
    file.persist(path)?;
    Ok(())
}

/// The one path of a file, however it is spelled, also of one that is not there yet. A link stays one.
fn resolved(path: &Path) -> io::Result<PathBuf> {
    if let Ok(path) = path.canonicalize() {
        return Ok(path);
    }
    let path = in_directory(path)?;
    match path.read_link() {
        // The link /dev/stdout may lead to a pipe, which is there and has no path.
        Ok(target) if path.metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) => {
            resolved(&directory(&path).join(target))
        }
        _ => Ok(path),
    }
}

/// The path of what is to be in a directory that is there.
fn in_directory(path: &Path) -> io::Result<PathBuf> {
    // Of a path that only a directory can have `file_name` leaves out what says so.
    if [b"/".as_slice(), b"/."].iter().any(|end| path.as_os_str().as_bytes().ends_with(end)) {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    Ok(directory(path).canonicalize()?.join(name))
}

fn directory(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file in the same directory, which is gone again unless it takes the other's place.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let permissions = path.metadata().map_or(Permissions::from_mode(0o666), |found| found.permissions());
    Builder::new().permissions(permissions).tempfile_in(directory(path))
}

/// Whether both are one file.
pub fn is_same(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}
