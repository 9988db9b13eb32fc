//! Frames of every length and kind of content, over a wire that flips bits.

use proptest::prelude::*;
use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::link::sizes::{MAX_FRAME, MAX_WIRE};
use tasks::message::{MAX_PAYLOAD, TaskCode};

fn encode(frame: Frame) -> Vec<u8> {
    let mut wire = WireBuffer::new();
    frame.encode(&mut wire).unwrap();
    wire.bytes().to_vec()
}

const TURNS: [Turn; 3] = [Turn::Even, Turn::Odd, Turn::First];

fn label(signature: Signature, number: usize) -> Label {
    Label { signature, turn: TURNS[number % TURNS.len()] }
}

/// Payloads of this length, one for each kind of content that framing could mistake.
fn payloads(length: usize) -> impl Iterator<Item = Vec<u8>> {
    let kinds: [fn(usize) -> u8; 8] = [
        |_| 0x00,
        |_| 0x01,
        |_| 0xFF,
        |place| place as u8,
        |place| place as u8 + 1,
        |place| if place % 2 == 0 { 0x00 } else { 0xAA },
        |place| if place % 2 == 0 { 0x55 } else { 0x00 },
        |place| (place as u8).wrapping_mul(151).wrapping_add(37),
    ];
    kinds.into_iter().map(move |kind| (0..length).map(kind).collect())
}

/// Calls `check` with a data frame and a datagram of every length and content.
fn every_length_and_content(mut check: impl FnMut(Frame)) {
    let to = TaskCode::HORMONE;
    for length in 0..=MAX_PAYLOAD {
        for (dock, payload) in Dock::ALL.into_iter().cycle().zip(payloads(length)) {
            let signature = Signature { dock, epoch: length as u8 };
            check(Frame::Data { label: label(signature, length), to, payload: &payload });
            check(Frame::Datagram { signature, to, payload: &payload });
        }
    }
}

#[test]
fn the_longest_message_fills_a_frame() {
    let signature = Signature { dock: Dock::Front, epoch: 1 };
    let wire =
        encode(Frame::Data { label: label(signature, 0), to: TaskCode::HORMONE, payload: &[1; MAX_PAYLOAD] });
    // COBS adds two bytes where all zeros are near each other.
    assert_eq!(wire.len(), MAX_FRAME + 2);
}

/// The number of frames that a receiver finds in these bytes: a wrong bit can make a delimiter or destroy
/// one.
fn frames_in(wire: &[u8]) -> usize {
    let ended = wire.split_inclusive(|byte| *byte == 0);
    ended.filter(|piece| Frame::decode(&mut piece.to_vec()).is_ok()).count()
}

#[test]
fn every_length_and_content_returns_unchanged_for_five_or_six_bytes_more() {
    every_length_and_content(|frame| {
        let mut wire = encode(frame);
        let (Frame::Data { payload, .. } | Frame::Datagram { payload, .. }) = frame else {
            unreachable!("only these have a payload");
        };
        assert!((5..=6).contains(&(wire.len() - payload.len())));
        assert!(wire.len() <= MAX_WIRE);
        assert_eq!(wire.iter().position(|byte| *byte == 0), Some(wire.len() - 1));
        assert_eq!(Frame::decode(&mut wire), Ok(frame));
    });
}

#[test]
fn every_ack_returns_unchanged_in_five_or_six_bytes() {
    for epoch in 0..=255 {
        for (dock, turn) in Dock::ALL.into_iter().flat_map(|dock| TURNS.map(|turn| (dock, turn))) {
            let ack = Frame::Ack(Label { signature: Signature { dock, epoch }, turn });
            let mut wire = encode(ack);
            assert!((5..=6).contains(&wire.len()));
            assert_eq!(Frame::decode(&mut wire), Ok(ack));
        }
    }
}

#[test]
fn every_single_wrong_bit_on_the_wire_is_found() {
    every_length_and_content(|frame| every_wrong_bit_is_found(&encode(frame)));
    for epoch in 0..=255 {
        for turn in TURNS {
            let signature = Signature { dock: Dock::Back, epoch };
            every_wrong_bit_is_found(&encode(Frame::Ack(Label { signature, turn })));
        }
    }
}

fn every_wrong_bit_is_found(wire: &[u8]) {
    for bit in 0..wire.len() * 8 {
        let mut wrong = wire.to_vec();
        wrong[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(frames_in(&wrong), 0, "{wire:02X?}, bit {bit}");
    }
}

/// Every lost byte is found, and every inserted one.
#[test]
fn no_byte_can_be_lost_or_inserted() {
    every_length_and_content(|frame| {
        let wire = encode(frame);
        for place in 0..wire.len() - 1 {
            let mut lost = wire.clone();
            lost.remove(place);
            assert_eq!(frames_in(&lost), 0, "{wire:02X?} without byte {place}");
            for byte in [0x01, 0x02, 0x80, 0xFF] {
                let mut inserted = wire.clone();
                inserted.insert(place, byte);
                assert_eq!(frames_in(&inserted), 0, "{wire:02X?} with {byte:02X} at {place}");
            }
        }
    });
}

/// Fault (c): where a frame ends in 01 00 on the wire, as one does whose CRC ends in a zero byte, one wrong
/// bit makes that two delimiters and leaves a shorter frame, which must not pass.
#[test]
fn fault_c_a_byte_at_the_end_cannot_be_cut_off() {
    let to = TaskCode::HORMONE;
    let mut cut = 0;
    for data in 0..=u16::MAX {
        let payload = data.to_be_bytes();
        let signature = Signature { dock: Dock::Front, epoch: 0x5A };
        let wire = encode(Frame::Datagram { signature, to, payload: &payload });
        if let [before @ .., 0x01, 0x00] = &wire[..] {
            cut += 1;
            assert_eq!(frames_in(&[before, &[0x00]].concat()), 0, "{wire:02X?}");
        }
    }
    assert!(cut > 512, "one CRC in 256 ends in 0, as many in 1, and of others the first byte is 1: {cut}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_frame_returns_unchanged(
        kind in 0..3,
        dock in 0..6_u8,
        epoch in any::<u8>(),
        turn in 0..3_usize,
        to in (0..TaskCode::BEHAVIOURS).prop_filter_map("no behaviour", TaskCode::of_behaviour),
        payload in prop::collection::vec(any::<u8>(), 0..=MAX_PAYLOAD),
    ) {
        let signature = Signature { dock: Dock::from_index(dock).unwrap(), epoch };
        let frame = match kind {
            0 => Frame::Data { label: label(signature, turn), to, payload: &payload },
            1 => Frame::Ack(label(signature, turn)),
            _ => Frame::Datagram { signature, to, payload: &payload },
        };
        let mut wire = encode(frame);
        prop_assert_eq!(Frame::decode(&mut wire), Ok(frame));
    }

    /// No bytes make the decoder panic, and the bytes that it takes for a frame are one.
    #[test]
    fn any_bytes_are_a_frame_or_an_error(mut wire in prop::collection::vec(any::<u8>(), 0..40)) {
        let received = wire.clone();
        if let Ok(frame) = Frame::decode(&mut wire) {
            prop_assert_eq!(encode(frame), received);
        }
    }
}
