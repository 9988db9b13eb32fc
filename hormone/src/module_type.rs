//! The module types of the centipede (paper, section 7).

use tasks::dock::Dock::{self, Back, Front, Left, Right};

use crate::neighbours::Neighbours;

/// The type of a module, by how it is attached.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash, PartialOrd, Ord))]
#[repr(u8)]
pub enum ModuleType {
    /// One connection: its back to a front.
    Head = 0,
    /// One connection: its front to a back.
    Tail = 1,
    /// One connection: its back to a left dock.
    LeftLeg = 2,
    /// One connection: its back to a right dock.
    RightLeg = 3,
    /// Two connections: its front to a back and its back to a front.
    Spine = 4,
    /// Four connections: its front, left and right to backs, and its back to a front.
    Branch = 5,
    /// Every topology the paper does not name, a module alone among them. It keeps still and passes
    /// hormones on.
    Other = 6,
    /// No connection. A module alone acts by the rules for this, while its type is
    /// [`Other`](ModuleType::Other), as the paper has it.
    Alone = 7,
}

impl ModuleType {
    /// The type of a module with these neighbours.
    pub fn of(neighbours: &Neighbours) -> ModuleType {
        // In the order of the docks: front, back, left, right, up, down.
        match neighbours {
            [None, Some(Front), None, None, None, None] => ModuleType::Head,
            [Some(Back), None, None, None, None, None] => ModuleType::Tail,
            [None, Some(Left), None, None, None, None] => ModuleType::LeftLeg,
            [None, Some(Right), None, None, None, None] => ModuleType::RightLeg,
            [Some(Back), Some(Front), None, None, None, None] => ModuleType::Spine,
            [Some(Back), Some(Front), Some(Back), Some(Back), None, None] => ModuleType::Branch,
            _ => ModuleType::Other,
        }
    }

    /// The type whose rules a module with these neighbours follows. Table 1 has the head send to its left and
    /// right too, where by its definition it has no neighbour. So a module that has no neighbour in front and
    /// its back at a front follows the head's rules, whatever else is attached to it: a body that is cut
    /// before a branch walks on. A module that has a neighbour in front, bears a leg at each side and has no
    /// neighbour behind follows the branch's rules, as the pelvis of a human does. A module without any
    /// neighbour follows the rules of a module alone.
    pub fn acting(neighbours: &Neighbours) -> ModuleType {
        match (ModuleType::of(neighbours), neighbours) {
            (ModuleType::Other, [None, Some(Front), ..]) => ModuleType::Head,
            (ModuleType::Other, [Some(Back), None, Some(Back), Some(Back), None, None]) => ModuleType::Branch,
            (ModuleType::Other, [None, None, None, None, None, None]) => ModuleType::Alone,
            (module_type, _) => module_type,
        }
    }

    /// Whether a module of this type can be the neighbour at another's `dock`.
    pub const fn sits_at(self, dock: Dock) -> bool {
        match self {
            ModuleType::Head => matches!(dock, Front),
            ModuleType::Tail => matches!(dock, Back),
            ModuleType::LeftLeg => matches!(dock, Left),
            ModuleType::RightLeg => matches!(dock, Right),
            ModuleType::Spine | ModuleType::Branch => matches!(dock, Front | Back),
            ModuleType::Other => true,
            ModuleType::Alone => false,
        }
    }

    /// The type with code `byte`, as [`Status`](crate::status::Status) and
    /// [`Event`](crate::event::Event) carry it.
    pub const fn from_byte(byte: u8) -> Option<ModuleType> {
        match byte {
            0 => Some(ModuleType::Head),
            1 => Some(ModuleType::Tail),
            2 => Some(ModuleType::LeftLeg),
            3 => Some(ModuleType::RightLeg),
            4 => Some(ModuleType::Spine),
            5 => Some(ModuleType::Branch),
            6 => Some(ModuleType::Other),
            7 => Some(ModuleType::Alone),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tasks::dock::Dock;

    /// The paper's definition, sentence by sentence.
    fn in_the_papers_words(neighbours: &Neighbours) -> ModuleType {
        let connections = neighbours.iter().flatten().count();
        let connected = |own: Dock, other: Dock| neighbours[usize::from(own.index())] == Some(other);
        // "a module that has only one connection and its back dock is connected to the front dock of
        // another module"
        if connections == 1 && connected(Back, Front) {
            return ModuleType::Head;
        }
        // "only one connection and its front dock is connected to the back of another module"
        if connections == 1 && connected(Front, Back) {
            return ModuleType::Tail;
        }
        // "only one connection and its back dock is connected to the right (left) dock of another"
        if connections == 1 && connected(Back, Left) {
            return ModuleType::LeftLeg;
        }
        if connections == 1 && connected(Back, Right) {
            return ModuleType::RightLeg;
        }
        // "two connections, its front is connected to the back of another module and its back is
        // connected to the front of a different module"
        if connections == 2 && connected(Front, Back) && connected(Back, Front) {
            return ModuleType::Spine;
        }
        // "four connections, its front, left, right docks are connected to the back of other modules
        // respectively, and its back dock is connected to the front of another module"
        let arms = [Front, Left, Right].iter().all(|&arm| connected(arm, Back));
        if connections == 4 && arms && connected(Back, Front) {
            return ModuleType::Branch;
        }
        ModuleType::Other
    }

    #[test]
    fn every_topology_has_the_type_the_paper_gives_it() {
        let mut counts = [0; 7];
        for number in 0..7_u32.pow(6) {
            let neighbours: Neighbours =
                std::array::from_fn(|dock| Dock::from_index((number / 7_u32.pow(dock as u32) % 7) as u8));
            let module_type = ModuleType::of(&neighbours);
            assert_eq!(module_type, in_the_papers_words(&neighbours), "{neighbours:?}");
            counts[module_type as usize] += 1;
        }
        assert_eq!(counts, [1, 1, 1, 1, 1, 1, 117_643]);
    }

    #[test]
    fn only_a_head_beside_whom_something_hangs_a_pelvis_and_a_module_alone_act_as_another_type() {
        for number in 0..7_u32.pow(6) {
            let neighbours: Neighbours =
                std::array::from_fn(|dock| Dock::from_index((number / 7_u32.pow(dock as u32) % 7) as u8));
            let leads = neighbours[0].is_none() && neighbours[1] == Some(Front);
            let is_alone = neighbours.iter().all(Option::is_none);
            let is_pelvis = neighbours == [Some(Back), None, Some(Back), Some(Back), None, None];
            let expected = match (leads, is_alone, is_pelvis) {
                (true, ..) => ModuleType::Head,
                (_, true, _) => ModuleType::Alone,
                (.., true) => ModuleType::Branch,
                _ => ModuleType::of(&neighbours),
            };
            assert_eq!(ModuleType::acting(&neighbours), expected);
        }
    }

    #[test]
    fn every_type_survives_its_byte() {
        for byte in 0..=u8::MAX {
            assert_eq!(
                ModuleType::from_byte(byte).map(|module_type| module_type as u8),
                (byte < 8).then_some(byte)
            );
        }
    }
}
