//! Which dock of which module is attached to which.

use std::fmt;

use hormone::module_type::ModuleType;
use hormone::neighbours::Neighbours;
use tasks::dock::{Dock, DockSet};
use thiserror::Error;

/// A dock of a module of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Face {
    /// The module's index. The robot itself has no indices.
    pub module: usize,
    pub dock: Dock,
}

impl fmt::Display for Face {
    /// As in a robot file: `3.Left`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{:?}", self.module, self.dock)
    }
}

/// Modules, and the attachments between their docks.
///
/// A module whose power has failed stays attached, and is no module's [peer](Wiring::peer).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// By module, in the order of [`Dock::ALL`], what is attached there.
    attached: Vec<[Option<Face>; 6]>,
    /// Modules whose power has failed.
    dead: Vec<usize>,
    /// By module, the docks before which something is that reflects what they send.
    obstacles: Vec<DockSet>,
    /// Whether the docks of a link share one light.
    shares_light: bool,
}

/// Why docks can't be attached or detached, or something else can't happen to a module.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WiringError {
    #[error("there is no module {module}: the robot has {modules}, counted from 0")]
    NoSuchModule { module: usize, modules: usize },
    #[error("the power of module {module} has failed before; name another")]
    NoPower { module: usize },
    #[error("module {module} can't change places with itself; name another")]
    SwapWithItself { module: usize },
    #[error("the {dock:?} dock of module {module} is attached already; detach it or use another")]
    DockInUse { module: usize, dock: Dock },
    #[error("an obstacle is before the {dock:?} dock of module {module}; clear it first or use another")]
    Obstacle { module: usize, dock: Dock },
    #[error("module {module} can't be attached to itself; name another")]
    ModuleToItself { module: usize },
    #[error(
        "nothing is attached to the {dock:?} dock of module {module}; attach something first, or name another"
    )]
    NotAttached { module: usize, dock: Dock },
}

impl Wiring {
    /// So many modules, attached to nothing.
    pub fn new(modules: usize) -> Self {
        Self {
            attached: vec![[None; 6]; modules],
            dead: Vec::new(),
            obstacles: vec![DockSet::EMPTY; modules],
            shares_light: false,
        }
    }

    /// Has the docks of each link [share one light](crate::Change::SharedLight), or no longer so.
    pub fn share_light(&mut self, is_shared: bool) {
        self.shares_light = is_shared;
    }

    /// Whether the docks of a link share one light.
    pub fn shares_light(&self) -> bool {
        self.shares_light
    }

    pub fn modules(&self) -> usize {
        self.attached.len()
    }

    /// Attaches two docks to each other.
    ///
    /// # Errors
    /// A module is not there, a dock not free or before an obstacle, or both are of one module.
    pub fn attach(&mut self, one: Face, other: Face) -> Result<(), WiringError> {
        // The errors that no other wiring would avoid come first.
        self.check(one.module)?;
        self.check(other.module)?;
        if one.module == other.module {
            return Err(WiringError::ModuleToItself { module: one.module });
        }
        for face in [one, other] {
            self.expect_free(face)?;
            let Face { module, dock } = face;
            if self.obstacles(module).contains(dock) {
                return Err(WiringError::Obstacle { module, dock });
            }
        }
        *self.attached_mut(one) = Some(other);
        *self.attached_mut(other) = Some(one);
        Ok(())
    }

    /// Detaches what is attached at a dock, with power or without; returns what that was.
    ///
    /// # Errors
    /// The module is not there, has no power, or nothing at its dock.
    pub fn detach(&mut self, face: Face) -> Result<Face, WiringError> {
        let Face { module, dock } = face;
        self.check(module)?;
        let other = self.attached_mut(face).take().ok_or(WiringError::NotAttached { module, dock })?;
        *self.attached_mut(other) = None;
        Ok(other)
    }

    /// Lets two modules change places. Obstacles stay where they are.
    ///
    /// # Errors
    /// One of them is not there, or both are one.
    pub fn swap(&mut self, one: usize, other: usize) -> Result<(), WiringError> {
        self.check(one)?;
        self.check(other)?;
        if one == other {
            return Err(WiringError::SwapWithItself { module: one });
        }
        self.attached.swap(one, other);
        self.obstacles.swap(one, other);
        for face in self.attached.iter_mut().flatten().flatten() {
            if face.module == one {
                face.module = other;
            } else if face.module == other {
                face.module = one;
            }
        }
        Ok(())
    }

    /// A module's power fails: it is no module's neighbour any more. Nothing else can happen to it but that
    /// the modules it is attached to let go of it.
    ///
    /// # Errors
    /// It is not there, or has no power already.
    pub fn kill(&mut self, module: usize) -> Result<(), WiringError> {
        self.check(module)?;
        self.dead.push(module);
        Ok(())
    }

    /// From now on there is an obstacle before a dock, or none.
    ///
    /// # Errors
    /// The module is not there or has no power, or something is attached where an obstacle is to be.
    pub fn set_obstacle(&mut self, at: Face, is_there: bool) -> Result<(), WiringError> {
        self.check(at.module)?;
        if is_there {
            self.expect_free(at)?;
        }
        let obstacles = &mut self.obstacles[at.module];
        if is_there {
            obstacles.insert(at.dock)
        } else {
            obstacles.remove(at.dock)
        }
        Ok(())
    }

    /// The docks of a module before which there is an obstacle: they hear what they send.
    pub fn obstacles(&self, module: usize) -> DockSet {
        self.obstacles.get(module).copied().unwrap_or(DockSet::EMPTY)
    }

    /// The same modules and attachments, and no obstacle.
    #[must_use]
    pub fn without_obstacles(mut self) -> Self {
        self.obstacles.fill(DockSet::EMPTY);
        self
    }

    /// # Errors
    /// The module is not there, or has no power.
    pub fn check(&self, module: usize) -> Result<(), WiringError> {
        let modules = self.modules();
        if module >= modules {
            return Err(WiringError::NoSuchModule { module, modules });
        }
        if self.dead.contains(&module) { Err(WiringError::NoPower { module }) } else { Ok(()) }
    }

    /// # Errors
    /// The module is not there, or something is attached to the dock.
    pub fn expect_free(&self, face: Face) -> Result<(), WiringError> {
        let Face { module, dock } = face;
        self.check(module)?;
        if self.attached(face).is_some() { Err(WiringError::DockInUse { module, dock }) } else { Ok(()) }
    }

    /// # Errors
    /// The module is not there, or nothing is attached to the dock.
    pub fn expect_attached(&self, face: Face) -> Result<(), WiringError> {
        let Face { module, dock } = face;
        self.check(module)?;
        if self.attached(face).is_none() { Err(WiringError::NotAttached { module, dock }) } else { Ok(()) }
    }

    /// The dock that is attached to a dock, with power or without.
    pub fn attached(&self, face: Face) -> Option<Face> {
        self.attached.get(face.module)?[usize::from(face.dock.index())]
    }

    /// The dock that is attached to a dock and hears it. `None` if one of the two modules has no power.
    pub fn peer(&self, face: Face) -> Option<Face> {
        self.attached(face).filter(|peer| self.has_power(peer.module) && self.has_power(face.module))
    }

    /// By dock, which dock of a neighbour hears it there: what the module has to find out.
    pub fn neighbours(&self, module: usize) -> Neighbours {
        Dock::ALL.map(|dock| self.peer(Face { module, dock }).map(|peer| peer.dock))
    }

    /// The modules that hang together with this one, itself among them, by number.
    pub fn body(&self, module: usize) -> Vec<usize> {
        let mut is_found = vec![false; self.modules()];
        self.poses(module, &|_| [0.0; 3], &mut is_found);
        (0..self.modules()).filter(|&module| is_found[module]).collect()
    }

    /// The type that a module has to find itself to be.
    pub fn module_type(&self, module: usize) -> ModuleType {
        ModuleType::of(&self.neighbours(module))
    }

    /// All faces that are attached to another.
    pub fn faces(&self) -> impl Iterator<Item = Face> {
        self.docks().filter(|&face| self.attached(face).is_some())
    }

    /// All docks of all modules.
    pub fn docks(&self) -> impl Iterator<Item = Face> {
        (0..self.modules()).flat_map(|module| Dock::ALL.map(|dock| Face { module, dock }))
    }

    /// All attachments, each once.
    pub fn attachments(&self) -> impl Iterator<Item = (Face, Face)> {
        let pairs = self.faces().filter_map(|face| Some((face, self.attached(face)?)));
        pairs.filter(|(one, other)| (one.module, one.dock.index()) < (other.module, other.dock.index()))
    }

    /// The attachments by which modules hear each other, each once.
    pub fn links(&self) -> impl Iterator<Item = (Face, Face)> {
        self.attachments().filter(|&(one, _)| self.peer(one).is_some())
    }

    /// The modules that hear each other, directly or by way of others, body by body.
    pub fn bodies(&self) -> Vec<Vec<usize>> {
        let mut is_found = vec![false; self.modules()];
        let mut bodies = Vec::new();
        for first in 0..self.modules() {
            let mut body = Vec::new();
            let mut next = vec![first];
            while let Some(module) = next.pop() {
                if !std::mem::replace(&mut is_found[module], true) {
                    body.push(module);
                    next.extend(self.peers(module));
                }
            }
            bodies.push(body);
        }
        bodies.retain(|body| !body.is_empty());
        bodies
    }

    /// The modules that hear others at their docks than in `other`, a wiring of as many modules.
    pub fn differences(&self, other: &Wiring) -> Vec<usize> {
        let peers = |wiring: &Wiring, module| Dock::ALL.map(|dock| wiring.peer(Face { module, dock }));
        (0..self.modules()).filter(|&module| peers(self, module) != peers(other, module)).collect()
    }

    /// The modules that hear a module.
    pub fn peers(&self, module: usize) -> impl Iterator<Item = usize> {
        Dock::ALL.into_iter().filter_map(move |dock| Some(self.peer(Face { module, dock })?.module))
    }

    /// Whether a module has not lost its power.
    pub fn has_power(&self, module: usize) -> bool {
        !self.dead.contains(&module)
    }

    /// The module has to be there.
    fn attached_mut(&mut self, Face { module, dock }: Face) -> &mut Option<Face> {
        &mut self.attached[module][usize::from(dock.index())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;

    #[test]
    fn modules_that_change_places_are_held_there_by_what_held_the_other() {
        for (one, other, expected) in [
            (0, 3, ["0.Front 2.Back", "1.Front 3.Back", "1.Back 2.Front"]),
            (1, 2, ["0.Back 2.Front", "1.Front 2.Back", "1.Back 3.Front"]),
            (3, 2, ["0.Back 1.Front", "1.Back 3.Front", "2.Front 3.Back"]),
        ] {
            let mut wiring = Shape::Chain.wiring(4).unwrap();
            wiring.set_obstacle(Face { module: one, dock: Dock::Up }, true).unwrap();
            wiring.swap(one, other).unwrap();
            let attached: Vec<_> =
                wiring.attachments().map(|(one, other)| format!("{one} {other}")).collect();
            assert_eq!(attached, expected, "{one} and {other}");
            let [here, there] = [one, other].map(|module| wiring.obstacles(module).contains(Dock::Up));
            assert_eq!([here, there], [false, true], "obstacles stay where they are");
            assert!(wiring.faces().all(|face| wiring.attached(wiring.attached(face).unwrap()) == Some(face)));
        }
    }
}
