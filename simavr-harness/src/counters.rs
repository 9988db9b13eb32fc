//! What an MCU counts, read out of its RAM by name, as a debugger would.

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
    Some(link_counters(&words(mcu, LINKS.get(number)?)?))
}

/// The counts of an MCU's side of the bridge.
pub(crate) fn bridge(mcu: &Mcu) -> Option<BridgeCounters> {
    let [messages_sent, messages_received, retries, errors, gave_up, ignored, no_buffer, freed] =
        words(mcu, "BRIDGE")?;
    Some(BridgeCounters {
        messages_sent,
        messages_received,
        retries,
        errors,
        gave_up,
        ignored,
        no_buffer,
        freed,
    })
}

/// What the joints' control of an MCU has counted.
pub(crate) fn motors(mcu: &Mcu) -> Option<motor::Counters> {
    let [periods, missed] = words(mcu, "MOTORS")?;
    Some(motor::Counters { periods, missed })
}

fn link_counters(words: &[u16; 12]) -> LinkCounters {
    let [
        frames_sent,
        frames_received,
        retries,
        errors,
        duplicates,
        gave_up,
        reflections,
        ignored,
        refused,
        no_buffer,
        overruns,
        replaced,
    ] = *words;
    LinkCounters {
        frames_sent,
        frames_received,
        retries,
        errors,
        duplicates,
        gave_up,
        reflections,
        ignored,
        refused,
        no_buffer,
        overruns,
        replaced,
    }
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
