//! Modules that are flashed with other images than the rest.

use std::collections::BTreeSet;
use std::path::PathBuf;

use serde::Deserialize;

use crate::wiring::Wiring;

/// What some modules are flashed with.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherImages {
    /// The modules, at least one.
    pub modules: Vec<usize>,
    /// The ELF file of the master's image, from the robot file's directory; `None` for that of the rest. At
    /// least one of this and the slave's is given.
    pub master: Option<PathBuf>,
    /// Likewise for the slave's image.
    pub slave: Option<PathBuf>,
}

impl OtherImages {
    /// Whether these can be the images of modules of this robot. `flashed` are the modules that have others
    /// already, and these from now on.
    ///
    /// # Errors
    /// What to do if not.
    pub(crate) fn check(&self, wiring: &Wiring, flashed: &mut BTreeSet<usize>) -> Result<(), String> {
        if self.modules.is_empty() {
            return Err("give `modules`, the numbers of the modules that have these images".into());
        }
        if self.master.is_none() && self.slave.is_none() {
            return Err("give `master`, `slave` or both, the path of an ELF file".into());
        }
        for &module in &self.modules {
            wiring.check(module).map_err(|error| error.to_string())?;
            if !flashed.insert(module) {
                return Err(format!("module {module} has other images already: name it once"));
            }
        }
        Ok(())
    }
}
