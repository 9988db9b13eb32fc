//! Reads the counters of an MCU out of its RAM by name, as a debugger would.

use tasks::bridge::protocol::BridgeCounters;
use tasks::link::counters::LinkCounters;
use tasks::motor::task as motor;

use crate::mcu::Mcu;

/// The links at an MCU's serial ports, by their numbers.
pub(crate) const LINKS: [&str; 3] = ["LINK_USART0", "LINK_USART1", "LINK_SOFT_UART"];

/// The counts of all links of an MCU.
pub(crate) fn links(mcu: &Mcu) -> impl Iterator<Item = LinkCounters> + '_ {
    (0..LINKS.len()).filter_map(|number| link(mcu, number))
}

/// The counts of the link at a serial port of an MCU.
pub(crate) fn link(mcu: &Mcu, number: usize) -> Option<LinkCounters> {
    words(mcu, LINKS.get(number)?).map(LinkCounters::from_words)
}

/// The counts of an MCU's side of the bridge.
pub(crate) fn bridge(mcu: &Mcu) -> Option<BridgeCounters> {
    words(mcu, "BRIDGE").map(BridgeCounters::from_words)
}

/// The counts of an MCU's control of its joints.
pub(crate) fn motors(mcu: &Mcu) -> Option<motor::Counters> {
    words(mcu, "MOTORS").map(motor::Counters::from_words)
}

/// The first `N` little-endian words of a variable.
fn words<const N: usize>(mcu: &Mcu, name: &str) -> Option<[u16; N]> {
    let bytes = mcu.read_symbol(name).ok()?;
    let mut words = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut result = [0; N];
    for word in &mut result {
        *word = words.next()?;
    }
    Some(result)
}
