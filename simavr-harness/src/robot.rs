//! Modules, and how they are attached to each other.

use simulation::{Face, Wiring, WiringError};
use tasks::dock::Dock;
use thiserror::Error;

use crate::engine::{Event, LONGEST_WINDOW};
use crate::link::{Channel, Faults, LinkCounts};
use crate::mcu::{McuError, fnv_1a};
use crate::module::{Controller, Images, Module};
use crate::random::Random;
use crate::repair::usart::Character;

/// Modules and the attachments between their docks.
pub struct Robot {
    pub(crate) members: Vec<Member>,
    wiring: Wiring,
    seed: u64,
    /// Channels made so far.
    channels: u64,
}

/// A module and where its docks lead.
pub(crate) struct Member {
    pub module: Module,
    /// In the order of [`Dock::ALL`].
    ports: [Option<Port>; 6],
    /// Markers of this run, in no particular order.
    pub events: Vec<Event>,
}

/// What a dock is attached to, and the way there.
struct Port {
    peer: Face,
    channel: Channel,
    /// How late characters arrive, in cycles.
    delay: u64,
}

/// A character on its way between two modules.
pub(crate) struct Delivery {
    pub from: Face,
    pub to: Face,
    pub character: Character,
}

/// A robot to be built.
#[derive(Clone, Debug)]
pub struct RobotBuilder {
    images: Images,
    modules: usize,
    attachments: Vec<(Face, Face)>,
    seed: u64,
}

/// Why a robot cannot be built so.
#[derive(Debug, Error)]
pub enum RobotError {
    #[error(transparent)]
    Wiring(#[from] WiringError),
    #[error(transparent)]
    Mcu(#[from] McuError),
}

impl RobotBuilder {
    /// A robot of `modules` modules, attached to nothing.
    pub fn new(images: Images, modules: usize) -> Self {
        Self { images, modules, attachments: Vec::new(), seed: 0 }
    }

    /// A robot whose modules are attached as in `wiring`.
    pub fn wired(images: Images, wiring: &Wiring) -> Self {
        Self { attachments: wiring.attachments().collect(), ..Self::new(images, wiring.modules()) }
    }

    /// A chain: the Back of each module is attached to the Front of the next.
    pub fn chain(images: Images, modules: usize) -> Self {
        let link = |behind: usize| {
            let back = Face { module: behind - 1, dock: Dock::Back };
            (back, Face { module: behind, dock: Dock::Front })
        };
        let attachments = (1..modules).map(link).collect();
        Self { attachments, ..Self::new(images, modules) }
    }

    /// Attaches two docks to each other.
    #[must_use]
    pub fn attach(mut self, one: Face, other: Face) -> Self {
        self.attachments.push((one, other));
        self
    }

    /// Sets the seed of all chance in the robot's run: memories at power-up and losses on links.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Builds the robot, all MCUs at power-up.
    ///
    /// # Errors
    /// An attachment names a module that is not there, or a dock twice; an image does not fit.
    pub fn build(self) -> Result<Robot, RobotError> {
        let Self { images, modules, attachments, seed } = self;
        let member = |index| {
            let seed = Random::of_part(seed, index as u64).next_u64();
            let module = Module::new(&images, seed)?;
            Ok(Member { module, ports: Default::default(), events: Vec::new() })
        };
        let members = (0..modules).map(member).collect::<Result<_, McuError>>()?;
        let mut robot = Robot { members, wiring: Wiring::new(modules), seed, channels: 0 };
        for (one, other) in attachments {
            robot.attach(one, other)?;
        }
        Ok(robot)
    }
}

impl Robot {
    pub fn modules(&self) -> usize {
        self.members.len()
    }

    /// The module at `index`; `None` if there is none.
    pub fn module(&self, index: usize) -> Option<&Module> {
        self.members.get(index).map(|member| &member.module)
    }

    pub fn module_mut(&mut self, index: usize) -> Option<&mut Module> {
        self.members.get_mut(index).map(|member| &mut member.module)
    }

    /// What is attached to what, which a module's own view has to equal.
    pub fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    /// What a dock is attached to.
    pub fn neighbour(&self, face: Face) -> Option<Face> {
        self.wiring.peer(face)
    }

    /// Attaches two docks to each other.
    ///
    /// # Errors
    /// A module is not there, or a dock not free.
    pub fn attach(&mut self, one: Face, other: Face) -> Result<(), WiringError> {
        self.wiring.attach(one, other)?;
        // What is sent by pins is known only at its end, and what is received there begins with an edge: modules can
        // run apart for the length of a window only if these come late.
        let ends_on_pins = [one, other].into_iter().filter(|end| Module::is_on_pins(end.dock)).count();
        let delay = ends_on_pins as u64 * LONGEST_WINDOW;
        for (from, peer) in [(one, other), (other, one)] {
            // Apart from the numbers of the modules.
            let random = Random::of_part(self.seed, u64::MAX - self.channels);
            self.channels += 1;
            let port = Port { peer, channel: Channel::new(random), delay };
            self.members[from.module].ports[index(from.dock)] = Some(port);
        }
        Ok(())
    }

    /// Detaches what is attached at a dock. Characters that have left already still arrive.
    ///
    /// # Errors
    /// The module is not there, or nothing is attached to its dock.
    pub fn detach(&mut self, face: Face) -> Result<(), WiringError> {
        let peer = self.wiring.detach(face)?;
        for face in [face, peer] {
            self.members[face.module].ports[index(face.dock)] = None;
        }
        Ok(())
    }

    /// What the link has carried that begins at this dock; `None` if it is attached to nothing.
    pub fn link_counts(&self, from: Face) -> Option<LinkCounts> {
        self.port(from).map(|port| port.channel.counts())
    }

    /// Sets what goes wrong on the link that begins at this dock. Returns `false` if it is attached
    /// to nothing.
    pub fn set_faults(&mut self, from: Face, faults: Faults) -> bool {
        let member = self.members.get_mut(from.module);
        let port = member.and_then(|member| member.ports[index(from.dock)].as_mut());
        port.map(|port| port.channel.faults = faults).is_some()
    }

    /// The MCUs whose programs have crashed, and why.
    pub fn crashes(&self) -> impl Iterator<Item = (usize, Controller, String)> {
        self.members.iter().enumerate().flat_map(|(module, member)| {
            Controller::ALL.into_iter().filter_map(move |controller| {
                let reason = member.module.mcu(controller).crash_reason()?;
                Some((module, controller, reason.to_owned()))
            })
        })
    }

    /// A hash of the state of all MCUs.
    pub fn state_hash(&self) -> u64 {
        let hashes = self.members.iter().map(|member| member.module.state_hash());
        fnv_1a(hashes.flat_map(u64::to_le_bytes))
    }

    fn port(&self, face: Face) -> Option<&Port> {
        self.members.get(face.module)?.ports[index(face.dock)].as_ref()
    }
}

impl Member {
    /// Takes what the module, number `number` of the robot, has sent, as far as it arrives anywhere.
    /// What a dock hears of its own light would be added here.
    pub fn take_deliveries(&mut self, number: usize, mut deliver: impl FnMut(Delivery)) {
        for (dock, port) in Dock::ALL.into_iter().zip(&mut self.ports) {
            let from = Face { module: number, dock };
            for Character { value, start, end } in self.module.take_sent(dock) {
                let Some(port) = port else { continue };
                if port.channel.carries(value) {
                    let character = Character { value, start: start + port.delay, end: end + port.delay };
                    deliver(Delivery { from, to: port.peer, character });
                }
            }
        }
    }
}

fn index(dock: Dock) -> usize {
    usize::from(dock.index())
}
