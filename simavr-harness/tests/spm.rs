//! Tests that "Store Program Memory Ready" fires as long as it is enabled, after all other interrupts.

use crate::common::{build, marked, mcu};
use simavr_harness::State;

#[test]
fn it_fires_until_it_is_disabled_and_comes_after_others() {
    let mut mcu = mcu(&build("spm.c"));
    assert_eq!(mcu.run_to_end(10_000), State::Done);
    assert_eq!(marked(&mcu), [1, 0xaa, 0xaa, 2, 3, 0xee, 0xaa, 4]);
}
