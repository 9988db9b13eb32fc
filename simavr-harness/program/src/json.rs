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

use super::closed::expect_output;
use super::output::print;

/// The destination of a report.
pub enum Destination {
    StandardOutput,
    /// A device or a named pipe.
    Stream(PathBuf, File),
    /// A file, which may exist already. The report is first written to a temporary file beside it, so the
    /// file is either complete or unchanged, unless it can be written only in place.
    File(PathBuf),
}

impl Destination {
    /// Makes sure, before the run takes its time, that a report can be written to `path`, and that this is
    /// not the `robot` file. `-` is the standard output.
    ///
    /// # Errors
    /// The report can't be written there.
    pub fn of(path: Option<&Path>, robot: Option<&Path>) -> Result<Option<Self>, Box<dyn Error>> {
        let Some(path) = path else { return Ok(None) };
        if path == Path::new("-") {
            expect_output()?;
            return Ok(Some(Destination::StandardOutput));
        }
        Self::file(path, robot, "--json").map(Some)
    }

    /// Makes sure of the same for a file that `option` names. Here `-` is a file like any other.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn file(path: &Path, robot: Option<&Path>, option: &str) -> Result<Self, Box<dyn Error>> {
        if robot.is_some_and(|robot| is_same(robot, path)) {
            return Err(format!("{} is the robot file: give {option} another path", path.display()).into());
        }
        Self::at(path).map_err(|error| {
            format!("can't write {}: {error}; give {option} another path", path.display()).into()
        })
    }

    /// Makes sure of the same, and that the file is not the destination of the `report`, which `--json`
    /// names.
    ///
    /// # Errors
    /// The file can't be written, or is the report's.
    pub fn besides(
        report: Option<&Self>,
        path: &Path,
        robot: Option<&Path>,
        option: &str,
    ) -> Result<Self, Box<dyn Error>> {
        let destination = Self::file(path, robot, option)?;
        if report.is_some_and(|report| report.is(&destination)) {
            let path = path.display();
            return Err(format!("--json already writes {path}: give {option} another path").into());
        }
        Ok(destination)
    }

    /// Whether both are the same file, so that the second write would overwrite the first.
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
                // Opening a pipe without a reader would block for ever.
                let opened = OpenOptions::new().write(true).custom_flags(libc::O_NONBLOCK).open(&path);
                let _held = opened.map_err(|error| match error.raw_os_error() {
                    Some(libc::ENXIO) => io::Error::other("no program reads it"),
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
    /// The report can't be written.
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

    /// Writes `content`, which may be binary.
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

/// Writes a report as JSON to `destination`, or without one as text to the standard output.
///
/// # Errors
/// The report can't be written.
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
    // What is mounted into a container, or is another user's in a directory such as /tmp, can't be replaced.
    file.persist(path).map(drop).or_else(|_| std::fs::write(path, content))
}

/// The canonical path of a file, even if the file does not exist yet. A link stays a link.
fn resolved(path: &Path) -> io::Result<PathBuf> {
    if let Ok(path) = path.canonicalize() {
        return Ok(path);
    }
    let path = in_directory(path)?;
    match path.read_link() {
        // The link /dev/stdout may lead to a pipe, which exists and has no path.
        Ok(target) if path.metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) => {
            resolved(&directory(&path).join(target))
        }
        _ => Ok(path),
    }
}

/// The path of a new file in an existing directory.
fn in_directory(path: &Path) -> io::Result<PathBuf> {
    // `file_name` drops a trailing `/` or `/.`, which marks a directory.
    if [b"/".as_slice(), b"/."].iter().any(|end| path.as_os_str().as_bytes().ends_with(end)) {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    Ok(directory(path).canonicalize()?.join(name))
}

fn directory(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A temporary file in the same directory. It is removed unless it replaces the file at `path`.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let permissions = path.metadata().map_or(Permissions::from_mode(0o666), |found| found.permissions());
    Builder::new().permissions(permissions).tempfile_in(directory(path))
}

/// Whether both paths lead to the same file.
pub fn is_same(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}
