//! A transfer of the bridge: one that is understood encodes to the same bytes again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tasks::bridge::protocol::{MAX_PACKET, decode, encode};

fuzz_target!(|packet: &[u8]| {
    if let Ok(message) = decode(packet) {
        assert_eq!(encode(message, &mut [0; MAX_PACKET]), packet);
    }
});
