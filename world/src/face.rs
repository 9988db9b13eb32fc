//! A dock of a module, as the place where it is attached.

use std::fmt;

use plants::geometry::Dock;

/// A dock of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    pub module: usize,
    pub dock: Dock,
}

impl fmt::Display for Face {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{:?}", self.module, self.dock)
    }
}
