//! The pages of docs/examples; see `build.rs`.

#[cfg(doctest)]
include!(concat!(env!("OUT_DIR"), "/pages.rs"));
