//! Messages as I2C transfers: every length, every corruption.

use proptest::prelude::*;
use tasks::bridge::protocol::{MAX_PACKET, PacketError, decode, encode};
use tasks::message::{Address, Letter, MAX_PAYLOAD, Message};

fn packet(message: Message) -> Vec<u8> {
    encode(message, &mut [0xEE; MAX_PACKET]).to_vec()
}

fn address() -> impl Strategy<Value = Address> {
    any::<u8>().prop_filter_map("no address", Address::from_byte)
}

fn letter() -> impl Strategy<Value = Letter> {
    let payload = prop::collection::vec(any::<u8>(), 0..=MAX_PAYLOAD);
    (address(), address(), payload, any::<bool>()).prop_map(|(to, from, payload, datagram)| {
        let make = if datagram { Message::datagram } else { Message::new };
        Letter::of(make(to, from, &payload).unwrap())
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_message_returns_unchanged_for_four_bytes_more(letter in letter()) {
        let packet = packet(letter.message());
        prop_assert_eq!(packet.len(), letter.payload().len() + 4);
        prop_assert_eq!(decode(&packet), Ok(letter.message()));
    }

    /// The CRC's polynomial has a period of 127 bits: it finds any two wrong bits that are closer together.
    #[test]
    fn one_wrong_bit_or_two_within_126_are_found(letter in letter()) {
        let packet = packet(letter.message());
        let flipped = |packet: &[u8], bit: usize| {
            let mut packet = packet.to_vec();
            packet[bit / 8] ^= 0x80 >> (bit % 8);
            packet
        };
        for first in 0..packet.len() * 8 {
            let once = flipped(&packet, first);
            prop_assert!(matches!(decode(&once), Err(PacketError::Crc | PacketError::Length)));
            for second in first.saturating_sub(126)..first {
                prop_assert!(decode(&flipped(&once, second)).is_err(), "bits {} and {}", first, second);
            }
        }
    }

    #[test]
    fn any_bytes_are_a_message_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..=24)) {
        if let Ok(message) = decode(&bytes) {
            prop_assert_eq!(packet(message), bytes);
        }
    }
}
