//! How much a link carries.

use simavr_harness::bench::module::link_efficiency;
use superbot_tests_simavr::test_images;

#[test]
fn a_link_carries_nine_tenths_of_what_stop_and_wait_can() {
    for bit_errors in [0.0, 1e-4, 1e-3] {
        let efficiency =
            link_efficiency(&test_images(), bit_errors).unwrap_or_else(|error| panic!("{error}"));
        assert!(efficiency >= 0.9, "{bit_errors:e}: {efficiency}");
    }
}
