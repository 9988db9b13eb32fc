//! A frame as it comes over the wire: one that is understood encodes to the same bytes again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::Frame;

fuzz_target!(|wire: &[u8]| {
    let mut bytes = wire.to_vec();
    if let Ok(frame) = Frame::decode(&mut bytes) {
        let mut again = WireBuffer::new();
        frame.encode(&mut again).expect("it was on a wire");
        assert_eq!(again.bytes(), wire);
    }
});
