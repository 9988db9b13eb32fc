//! The ground on which robots move.

use std::fmt::{self, Write};

use crate::assumed::{FRICTION, GRAVITY};

/// The ground: a plane, on which there may be steps, obstacles and walls. Their positions are relative to the
/// initial middle of a robot's first module.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// The coefficient of friction.
    pub friction: f64,
    /// The slope in degrees, positive if the ground rises ahead.
    pub slope: f64,
    pub steps: Option<Steps>,
    pub blocks: Vec<Block>,
}

/// A stair that rises ahead, across the whole ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// The distance ahead at which the first step begins, in m.
    pub from: f64,
    /// The height of each, in m.
    pub height: f64,
    /// The length of each, in m.
    pub length: f64,
    pub number: usize,
}

/// An upright box on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Its middle, in m ahead and to the left.
    pub at: [f64; 2],
    /// Its edges along x, y and z, in m.
    pub size: [f64; 3],
    /// The angle by which it is turned to the left, in degrees.
    pub turn: f64,
}

/// Half the width of a step, in m.
const HALF_WIDTH: f64 = 50.0;

impl Default for Ground {
    fn default() -> Self {
        Ground { friction: FRICTION, slope: 0.0, steps: None, blocks: Vec::new() }
    }
}

impl Ground {
    /// Gravity in the frame of the ground, in m/s². For a slope the plane stays level, and the direction of
    /// gravity is turned instead.
    pub(crate) fn gravity(&self) -> [f64; 3] {
        let slope = self.slope.to_radians();
        [-GRAVITY * slope.sin(), 0.0, -GRAVITY * slope.cos()]
    }

    /// The number of its geoms.
    pub(crate) fn geoms(&self) -> usize {
        1 + self.steps.as_ref().map_or(0, |steps| steps.number) + self.blocks.len()
    }

    /// Writes its geoms, which collide with modules but not with each other.
    pub(crate) fn write(&self, xml: &mut String) -> fmt::Result {
        // MuJoCo takes the greater of two friction coefficients. The ground's geoms have 0, because each
        // module's coefficient has the ground's as a factor.
        let common = "contype='1' conaffinity='0' friction='0 0 0'";
        writeln!(xml, "<geom type='plane' size='0 0 1' {common}/>")?;
        if let Some(Steps { from, height, length, number }) = &self.steps {
            for step in 0..*number {
                // Each step reaches to the end of the stair, on top of the steps before it.
                let begin = from + step as f64 * length;
                let half = (number - step) as f64 * length / 2.0;
                let z = (step as f64 + 0.5) * height;
                let [middle, half_height] = [begin + half, height / 2.0];
                writeln!(
                    xml,
                    "<geom type='box' pos='{middle} 0 {z}' size='{half} {HALF_WIDTH} {half_height}' {common}/>"
                )?;
            }
        }
        for Block { at: [x, y], size, turn } in &self.blocks {
            let [length, width, height] = size.map(|edge| edge / 2.0);
            let turn = turn.to_radians();
            writeln!(
                xml,
                "<geom type='box' pos='{x} {y} {height}' euler='0 0 {turn}' size='{length} {width} {height}' \
                 {common}/>"
            )?;
        }
        Ok(())
    }
}
