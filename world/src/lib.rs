//! A physical world for robots that are made of modules: bodies, joints, docks that hold each other, ground.
//!
//! [`World`] takes the volts at motors, and gives angles, speeds, accelerations and the positions of docks.
//! It knows nothing of firmware, hormones or microcontrollers. The rigid bodies are MuJoCo's (Todorov, Erez
//! and Tassa, 2012); motors, gears and geometry are those of [`plants`]. All other assumptions are in
//! [`assumed`].

pub mod assumed;
mod face;
mod ground;
mod history;
mod layout;
mod libm;
mod model;
mod motion;
mod mujoco;
mod weld;
mod world;

pub use assumed::Make;
pub use face::Face;
pub use ground::{Block, Ground, Steps};
pub use model::{Placed, STEP_SECONDS};
pub use plants::motion::Motion;
pub use plants::trouble::{Moment, Trouble};
pub use world::{World, WorldError};
