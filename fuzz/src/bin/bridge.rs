//! A transfer of the bridge: what is understood is, sent again, the same bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tasks::bridge::protocol::{MAX_PACKET, decode, encode};

fuzz_target!(|packet: &[u8]| {
    if let Ok(message) = decode(packet) {
        assert_eq!(encode(message, &mut [0; MAX_PACKET]), packet);
    }
});
