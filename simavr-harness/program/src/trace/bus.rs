//! Shows the transfers on the two-wire bus between a module's MCUs on a timeline.

use serde_json::json;
use simavr_harness::{BusSignal, Slice};

use super::events::{Events, Track};

/// The bytes from a START to the STOP or the next START, the address first, each with whether it was
/// acknowledged.
type Transfer = Slice<Vec<(u8, bool)>>;

/// Writes the transfers of the run.
pub fn write(events: &mut Events, track: Track, signals: &[Slice<BusSignal>]) {
    if signals.is_empty() {
        return;
    }
    events.name_track(track, "two-wire bus");
    for Slice { begin, end, what: bytes } in transfers(signals) {
        let Some((address, data)) = bytes.split_first() else { continue };
        let name = match address {
            (_, false) => format!("nobody at {:#04x}", address.0 >> 1),
            (byte, true) if byte & 1 != 0 => format!("read from {:#04x}", byte >> 1),
            (byte, true) => format!("write to {:#04x}", byte >> 1),
        };
        let hexadecimal: Vec<String> = data.iter().map(|(byte, _)| format!("{byte:02x}")).collect();
        events.begin(track, begin, "bus", &name, json!({ "bytes": hexadecimal.join(" ") }));
        events.end(track, end);
    }
}

fn transfers(signals: &[Slice<BusSignal>]) -> Vec<Transfer> {
    let mut transfers: Vec<Transfer> = Vec::new();
    let mut is_open = false;
    for &Slice { begin, end, what } in signals {
        match (what, transfers.last_mut().filter(|_| is_open)) {
            (BusSignal::Start, _) => {
                transfers.push(Slice { begin, end, what: Vec::new() });
                is_open = true;
            }
            (BusSignal::Byte { value, acknowledged }, Some(transfer)) => {
                transfer.what.push((value, acknowledged));
                transfer.end = end;
            }
            (BusSignal::Stop, Some(transfer)) => {
                transfer.end = end;
                is_open = false;
            }
            _ => {}
        }
    }
    transfers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transfer_goes_from_start_to_stop_or_to_the_next_start() {
        let byte = |value| BusSignal::Byte { value, acknowledged: true };
        let signals = [BusSignal::Start, byte(0x20), byte(1), BusSignal::Start, byte(0x21), BusSignal::Stop];
        let begins = (0..).step_by(100);
        let signals: Vec<_> = signals
            .into_iter()
            .zip(begins)
            .map(|(what, begin)| Slice { begin, end: begin + 90, what })
            .collect();
        let transfers = transfers(&signals);
        let expected = [(0, 290, vec![(0x20, true), (1, true)]), (300, 590, vec![(0x21, true)])];
        assert_eq!(transfers.len(), expected.len());
        for (transfer, (begin, end, bytes)) in transfers.into_iter().zip(expected) {
            assert_eq!((transfer.begin, transfer.end, transfer.what), (begin, end, bytes));
        }
    }
}
