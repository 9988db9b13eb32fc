//! A copy of the sources, in which faults are planted.

use std::collections::HashSet;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

use crate::fault::Fault;

/// Builds' output and git's data, which are not copied.
const LEFT_OUT: [&str; 2] = ["target", ".git"];

/// A copy of the sources, with a folder `target` of its own.
pub struct Scratch {
    root: PathBuf,
}

impl Scratch {
    /// A copy in `root` of the sources in `original`. A file that is already there and the same stays
    /// untouched, so that Cargo does not rebuild for it.
    pub fn new(original: &Path, root: PathBuf) -> Result<Self, String> {
        copy(original, &root)?;
        Ok(Scratch { root })
    }

    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Does `work` while `fault` is planted in the kernel.
    pub fn with<R>(&self, fault: &Fault, work: impl FnOnce() -> R) -> Result<R, String> {
        let file = self.root.join("kernel/src").join(&fault.file);
        let text = fs::read_to_string(&file).map_err(|error| say(&file, error))?;
        let planted = fault.plant(&text)?;
        fs::write(&file, planted).map_err(|error| say(&file, error))?;
        let result = work();
        fs::write(&file, text).map_err(|error| say(&file, error))?;
        Ok(result)
    }
}

fn say(path: &Path, error: std::io::Error) -> String {
    format!("{}: {error}", path.display())
}

/// Makes the folder `to` a copy of `from`, without the names in [`LEFT_OUT`].
fn copy(from: &Path, to: &Path) -> Result<(), String> {
    fs::create_dir_all(to).map_err(|error| say(to, error))?;
    let names = names(from)?;
    for extra in self::names(to)?.difference(&names) {
        let path = to.join(extra);
        let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        removed.map_err(|error| say(&path, error))?;
    }
    for name in &names {
        let (from, to) = (from.join(name), to.join(name));
        if from.is_dir() {
            copy(&from, &to)?;
        } else {
            let same = fs::read(&to).is_ok_and(|there| fs::read(&from).is_ok_and(|here| here == there));
            if !same {
                fs::copy(&from, &to).map_err(|error| say(&from, error))?;
            }
        }
    }
    Ok(())
}

fn names(folder: &Path) -> Result<HashSet<OsString>, String> {
    let entries = fs::read_dir(folder).map_err(|error| say(folder, error))?;
    let mut names = HashSet::new();
    for entry in entries {
        let name = entry.map_err(|error| say(folder, error))?.file_name();
        if !LEFT_OUT.map(OsStr::new).contains(&name.as_os_str()) {
            names.insert(name);
        }
    }
    Ok(names)
}
