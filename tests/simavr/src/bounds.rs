//! Bounds computed from the robot's images, to be compared with runs of them, and loads that keep their
//! joints' control busy.

use std::path::{Path, PathBuf};

use simavr_harness::Engine;
use stack_bound::{Annotations, Image};
use tasks::motor::Axis;
use time_bound::{Bounds, Limit, Notes, limits};

use crate::images;

/// An image of the robot, with the hand-written notes about it.
pub struct Noted {
    pub image: Image,
    pub annotations: Annotations,
    pub loops: Notes,
    name: String,
}

impl Noted {
    /// The image of this name.
    ///
    /// # Panics
    /// When it can't be read, or its notes do not fit.
    pub fn load(name: &str) -> Self {
        let image = Image::load(images().join(name).with_extension("elf")).expect("the image can be read");
        Noted {
            annotations: Annotations::load(notes(name, "stacks.txt"), &image).expect("the notes fit"),
            loops: Notes::load(notes(name, "loops.txt"), &image).expect("the notes fit"),
            image,
            name: name.to_owned(),
        }
    }

    /// The image's bounds.
    ///
    /// # Panics
    /// When there are none.
    pub fn bounds(&self) -> Bounds {
        let bounds = Bounds::new(&self.image, &self.annotations, &self.loops);
        bounds.unwrap_or_else(|problems| panic!("{}: {problems:?}", self.name))
    }

    /// How often its loops go round at most, and calls are made.
    ///
    /// # Panics
    /// When the notes do not fit.
    pub fn limits(&self) -> Vec<Limit> {
        let limits = limits(&self.image, &self.annotations, &self.loops);
        limits.unwrap_or_else(|problems| panic!("{}: {problems:?}", self.name))
    }
}

/// A file in a folder of the repository.
pub fn notes(folder: &str, file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder).join(file)
}

/// More than the joints' friction, in Nm.
const PULL: f64 = 3.0;

/// Pulls at all joints of a module in one direction, so that they need control.
///
/// # Panics
/// When there is no such module.
pub fn pull(engine: &mut Engine, module: usize, is_back: bool) {
    load(engine, module, if is_back { -PULL } else { PULL });
}

/// Loads all joints of a module with `torque`, in Nm.
///
/// # Panics
/// When there is no such module.
pub fn load(engine: &mut Engine, module: usize, torque: f64) {
    let module = engine.robot_mut().module_mut(module).expect("it is there");
    for axis in Axis::ALL {
        module.body_mut().joint_mut(axis).surroundings.load_torque = torque;
    }
}
