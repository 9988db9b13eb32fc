//! The names of cases and styles, for tables and plots.

use simavr_harness::bench::concurrency::{Case, Style};

/// The name of a case in tables.
pub fn title(case: Case) -> &'static str {
    match case {
        Case::Control => "joints alone",
        Case::Saturated => "six docks saturated",
        Case::Crowded => "four docks saturated",
        Case::Babble => "babble at six docks",
        Case::Computes => "50 ms computed",
        Case::ComputesInPieces => "50 ms, cut in pieces",
        Case::ComputesUnknown => "0 to 80 ms computed",
        Case::Hangs => "a behaviour hangs",
    }
}

/// The name of a style in tables.
pub fn name(style: Style) -> &'static str {
    match style {
        Style::Tasks => "tasks",
        Style::Loop => "loop",
    }
}
