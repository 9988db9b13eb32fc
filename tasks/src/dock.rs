//! The six docks of a module and sets of them.

/// One of a module's six docks. The numbers are those of the lab's own simulator.
#[repr(u8)]
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum Dock {
    Front = 0,
    Back = 1,
    Left = 2,
    Right = 3,
    Up = 4,
    Down = 5,
}

impl Dock {
    /// All docks, in the order of their indices.
    pub const ALL: [Dock; 6] = [Dock::Front, Dock::Back, Dock::Left, Dock::Right, Dock::Up, Dock::Down];

    /// The dock with this index; `None` above 5.
    pub const fn from_index(index: u8) -> Option<Dock> {
        match index {
            0 => Some(Dock::Front),
            1 => Some(Dock::Back),
            2 => Some(Dock::Left),
            3 => Some(Dock::Right),
            4 => Some(Dock::Up),
            5 => Some(Dock::Down),
            _ => None,
        }
    }

    /// The dock's number, 0..=5.
    pub const fn index(self) -> u8 {
        self as u8
    }
}

/// A set of docks in one byte.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct DockSet(u8);

impl DockSet {
    pub const EMPTY: DockSet = DockSet(0);

    /// The set of the docks listed.
    pub const fn of(mut docks: &[Dock]) -> DockSet {
        let mut set = DockSet::EMPTY;
        while let [first, rest @ ..] = docks {
            set.insert(*first);
            docks = rest;
        }
        set
    }

    pub const fn contains(self, dock: Dock) -> bool {
        self.0 & Self::bit(dock) != 0
    }

    pub const fn insert(&mut self, dock: Dock) {
        self.0 |= Self::bit(dock);
    }

    pub const fn remove(&mut self, dock: Dock) {
        self.0 &= !Self::bit(dock);
    }

    /// The docks of either set.
    pub const fn union(self, other: DockSet) -> DockSet {
        DockSet(self.0 | other.0)
    }

    /// The docks of both sets.
    pub const fn intersection(self, other: DockSet) -> DockSet {
        DockSet(self.0 & other.0)
    }

    /// The docks of this set that are not in the other.
    pub const fn without(self, other: DockSet) -> DockSet {
        DockSet(self.0 & !other.0)
    }

    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The docks of the set, in the order of their indices.
    pub fn iter(self) -> impl Iterator<Item = Dock> {
        // Bit by bit: the AVR shifts by one place at a time, so `contains` costs more the higher the index.
        let mut left = self.0;
        let mut index = 0;
        core::iter::from_fn(move || {
            while left != 0 {
                let dock = if left & 1 != 0 { Dock::from_index(index) } else { None };
                left >>= 1;
                index += 1;
                if dock.is_some() {
                    return dock;
                }
            }
            None
        })
    }

    const fn bit(dock: Dock) -> u8 {
        1 << dock.index()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn indices_and_docks_correspond() {
        for (index, dock) in (0u8..).zip(Dock::ALL) {
            assert_eq!(dock.index(), index);
            assert_eq!(Dock::from_index(index), Some(dock));
        }
        for index in 6..=255 {
            assert_eq!(Dock::from_index(index), None);
        }
    }

    #[test]
    fn every_set_holds_exactly_what_was_put_in() {
        for bits in 0..64u8 {
            let listed: Vec<Dock> =
                Dock::ALL.into_iter().filter(|dock| bits >> dock.index() & 1 == 1).collect();
            let set = DockSet::of(&listed);
            assert_eq!(set.iter().collect::<Vec<_>>(), listed);
            assert_eq!(set.is_empty(), listed.is_empty());
            assert_eq!(set.union(DockSet::EMPTY), set);
            for other in 0..64u8 {
                assert_eq!(set.without(DockSet(other)), DockSet(bits - (bits & other)));
            }
            assert_eq!(set.intersection(DockSet::of(&Dock::ALL)), set);
            assert_eq!(set.intersection(DockSet::EMPTY), DockSet::EMPTY);
            assert_eq!(set.union(DockSet::of(&Dock::ALL)), DockSet::of(&Dock::ALL));
            for dock in Dock::ALL {
                assert_eq!(set.contains(dock), listed.contains(&dock));
                let mut with = set;
                with.insert(dock);
                assert!(with.contains(dock));
                let mut without = with;
                without.remove(dock);
                assert!(!without.contains(dock));
                assert!(without == set || with == set);
            }
        }
    }
}
