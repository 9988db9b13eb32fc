//! The neighbours of a module: which dock of a neighbour is attached to each of its own.

use tasks::dock::{Dock, DockSet};

/// For each of the module's docks, by index, the neighbour's dock that is attached to it.
pub type Neighbours = [Option<Dock>; 6];

/// Stands for "no neighbour" where [`Neighbours`] are bytes.
pub const NO_NEIGHBOUR: u8 = 0xFF;

/// `neighbours` as bytes: per dock the index of the neighbour's dock or [`NO_NEIGHBOUR`]. This is the
/// payload of AC_RECV's message to HORMONE and the field in [`Status`](crate::status::Status).
pub fn to_bytes(neighbours: &Neighbours) -> [u8; 6] {
    neighbours.map(|neighbour| neighbour.map_or(NO_NEIGHBOUR, Dock::index))
}

/// The docks that have a neighbour.
pub fn connected(neighbours: &Neighbours) -> DockSet {
    docks_where(neighbours.iter().map(Option::is_some))
}

/// The docks at which neighbours, as bytes, differ.
pub fn differences(before: &[u8; 6], after: &[u8; 6]) -> DockSet {
    docks_where(before.iter().zip(after).map(|(before, after)| before != after))
}

/// The docks, by index, of which something is so.
fn docks_where(is_so: impl Iterator<Item = bool>) -> DockSet {
    let mut docks = DockSet::EMPTY;
    for (index, _) in (0..).zip(is_so).filter(|(_, is_so)| *is_so) {
        if let Some(dock) = Dock::from_index(index) {
            docks.insert(dock);
        }
    }
    docks
}

/// The inverse of [`to_bytes`], or `None` if `bytes` are not six or one of them is no dock.
pub fn from_bytes(bytes: &[u8]) -> Option<Neighbours> {
    if bytes.len() != 6 {
        return None;
    }
    let mut neighbours = [None; 6];
    for (neighbour, &byte) in neighbours.iter_mut().zip(bytes) {
        if byte != NO_NEIGHBOUR {
            *neighbour = Some(Dock::from_index(byte)?);
        }
    }
    Some(neighbours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Dock::{Back, Down, Front, Left};

    #[test]
    fn neighbours_survive_their_bytes() {
        let neighbours = [Some(Down), None, Some(Front), None, None, Some(Back)];
        assert_eq!(to_bytes(&neighbours), [5, 0xFF, 0, 0xFF, 0xFF, 1]);
        assert_eq!(from_bytes(&to_bytes(&neighbours)), Some(neighbours));
        assert_eq!(connected(&neighbours), DockSet::of(&[Front, Left, Down]));
        assert_eq!(from_bytes(&[0, 1, 2, 3, 4, 6]), None);
        assert_eq!(from_bytes(&[0; 5]), None);
        assert_eq!(from_bytes(&[0; 7]), None);
    }
}
