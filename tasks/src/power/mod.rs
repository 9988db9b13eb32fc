//! Power: what the docks carry, the battery, charging (paper, section 5).
//!
//! | file | what |
//! |---|---|
//! | [`switch`] | the switch that joins a dock's supply to the neighbour's |
//! | [`battery`] | how full it is |
//! | [`allowance`] | what may be switched on, and no longer when it gets empty |
//! | [`charger`] | charging from a neighbour |

pub mod allowance;
pub mod battery;
pub mod charger;
pub mod switch;
