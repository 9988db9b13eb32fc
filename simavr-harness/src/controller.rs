//! Which of a module's MCUs is meant.

/// One of a module's two MCUs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Controller {
    Master,
    Slave,
}

impl Controller {
    pub const ALL: [Controller; 2] = [Self::Master, Self::Slave];
}
