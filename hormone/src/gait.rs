//! Gaits: a file each, data only.

pub mod centipede;
