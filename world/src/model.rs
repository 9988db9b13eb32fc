//! Writes the text from which MuJoCo makes a model: modules as bodies and hinges, unused welds, and the
//! ground.
//!
//! A module has four bodies, each a box of half a cube: two on the roll's axis, and on each of these, by a
//! hinge, the half with the docks. Each module is a kinematic tree of its own: a long chain as one tree would
//! make the solver's matrices dense. Docks that hold each other are welds between halves.

use std::fmt::{self, Write};

use glam::{DAffine3, DQuat, DVec3};
use plants::geometry::{Angles, Dock, EDGE, Half};
use plants::motor::{Motor, STOP};

use crate::assumed::{BACKLASH_FRICTION, Make, SHELL, SLIMMER, STIFFNESS_SECONDS};
use crate::ground::Ground;
use crate::layout::Layout;

/// A step, in s.
pub const STEP_SECONDS: f64 = 1e-3;

/// Bodies of a module, in the order of the model.
pub const BODIES: usize = 4;

/// The least backlash of a gear whose module is beside one that has backlash, in degrees: MuJoCo takes no
/// hinge that can't turn.
const LEAST_BACKLASH: f64 = 1e-3;

/// The time constant, as MuJoCo takes it, of the dry friction that holds a joint, and of a gear's teeth: two
/// steps, so that they stop the joint within a step, the shortest possible. So the constraint may be softer
/// (an impedance of 0.9, not 0.95) for the same creep under load, and Newton's method takes 6 to 7 iterations
/// a step for 100 modules, not 9.
const STOPPING_SECONDS: f64 = 2.0 * STEP_SECONDS;

/// The least improvement by an iteration of Newton's method; after a smaller one the step is done. This is
/// MuJoCo's measure, which is relative to the model's size. With MuJoCo's default of 1e-8 the last iterations
/// change nothing visible.
const TOLERANCE: f64 = 1e-6;

/// The fraction of the slope that a line search may leave. The next iteration corrects a rough search, and
/// takes less time than a precise one.
const SEARCH_TOLERANCE: f64 = 0.5;

/// Millimetres in a metre.
pub const MILLI: f64 = 1e-3;

/// A module at the beginning: its frame, in mm, the angles of its joints, in degrees, and its make.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub frame: DAffine3,
    pub angles: Angles,
    pub make: Make,
}

/// The body of a module without a hinge: the one behind Motor0.
pub fn root(module: usize) -> usize {
    // Body 0 is the world.
    1 + BODIES * module
}

/// The body that is a half of a module.
pub fn half(module: usize, half: Half) -> usize {
    root(module) + if half == Half::Front { 1 } else { 3 }
}

/// The module that a body is a part of.
pub fn module(body: usize) -> usize {
    (body - 1) / BODIES
}

/// The name of a body, for messages.
pub fn name(body: usize) -> String {
    let parts =
        ["front of the roll", "half with the Front dock", "back of the roll", "half with the Back dock"];
    match body.checked_sub(1) {
        Some(index) => format!("module {}, {}", index / BODIES, parts[index % BODIES]),
        None => "the ground".into(),
    }
}

/// The most welds that `modules` modules may need: each takes two docks.
pub fn welds(modules: usize) -> usize {
    modules * Dock::ALL.len() / 2
}

/// Where the numbers of these modules are.
pub fn layout(modules: &[Placed]) -> Layout {
    Layout::new(modules.iter().any(|module| module.make.backlash > 0.0))
}

/// The text of a model with these modules on this ground. All joints are straight.
pub fn text(modules: &[Placed], ground: &Ground) -> Result<String, fmt::Error> {
    let mut xml = String::new();
    let [gx, gy, gz] = ground.gravity();
    // A robot is usually one island: searching for islands takes longer than it saves.
    write!(
        xml,
        "<mujoco><compiler angle='radian'/>
        <option timestep='{STEP_SECONDS}' integrator='implicitfast' solver='Newton' jacobian='sparse'
            cone='elliptic'
            gravity='{gx} {gy} {gz}' iterations='50' tolerance='{TOLERANCE}'
            ls_tolerance='{SEARCH_TOLERANCE}'><flag autoreset='disable' island='disable'/></option>
        <default>
            <geom type='box' contype='0' conaffinity='1' solref='{STIFFNESS_SECONDS} 1'/>
            <joint solreffriction='{STOPPING_SECONDS} 1' solimpfriction='0.9 0.9 0.001 0.5 2'
                limited='true' range='-{stop} {stop}'/>
            <equality solref='{STIFFNESS_SECONDS} 1' solimp='0.99 0.999 0.001 0.5 2'/>
        </default>
        <worldbody>",
        stop = STOP.to_radians()
    )?;
    ground.write(&mut xml)?;
    let layout = layout(modules);
    for module in modules {
        write_module(&mut xml, module, layout, ground.friction)?;
    }
    writeln!(xml, "</worldbody><equality>")?;
    for _ in 0..welds(modules.len()) {
        // `weld` sets the bodies of a weld when docks are attached.
        writeln!(xml, "<weld body1='0root' body2='0back' relpose='0 0 0 1 0 0 0' active='false'/>")?;
    }
    writeln!(xml, "</equality><sensor>")?;
    for module in 0..modules.len() {
        writeln!(xml, "<accelerometer site='{module}'/>")?;
    }
    writeln!(xml, "</sensor></mujoco>")?;
    Ok(xml)
}

/// Writes a module. Its number is the number of modules that are already in `xml`.
fn write_module(
    xml: &mut String,
    Placed { frame, make, .. }: &Placed,
    layout: Layout,
    friction: f64,
) -> fmt::Result {
    let module = xml.matches("<freejoint").count();
    let friction = friction * make.grip;
    let hinges = |axis| hinges(axis, make, layout);
    let [x, y, z] = (frame.translation * MILLI).to_array();
    let DQuat { x: i, y: j, z: k, w } = DQuat::from_mat3(&frame.matrix3);
    writeln!(xml, "<body name='{module}root' pos='{x} {y} {z}' quat='{w} {i} {j} {k}'><freejoint/>")?;
    let shell = |half, side| Shell { half, side, mass: make.mass / BODIES as f64, friction };
    shell(inner_half(), 1.0).write(xml)?;
    let at = EDGE / 2.0 * MILLI;
    writeln!(xml, "<body pos='{at} 0 0'>{}<site name='{module}'/>", hinges("0 -1 0"))?;
    shell(outer_half(), 1.0).write(xml)?;
    writeln!(xml, "</body><body>{}", hinges("1 0 0"))?;
    shell(inner_half(), -1.0).write(xml)?;
    writeln!(xml, "<body name='{module}back' pos='-{at} 0 0'>{}", hinges("0 1 0"))?;
    shell(outer_half(), -1.0).write(xml)?;
    writeln!(xml, "</body></body></body>")
}

/// The hinges of a joint.
fn hinges(axis: &str, make: &Make, layout: Layout) -> String {
    let Motor { gear_inertia, sliding_friction, .. } = make.motor;
    let motor = format!(
        "<joint axis='{axis}' armature='{gear_inertia}' damping='{}' frictionloss='{sliding_friction}'/>",
        make.motor.braking()
    );
    if !layout.has_backlash() {
        return motor;
    }
    let way = make.backlash.max(LEAST_BACKLASH).to_radians() / 2.0;
    format!(
        "{motor}<joint axis='{axis}' range='-{way} {way}' frictionloss='{BACKLASH_FRICTION}'
            solreflimit='{STOPPING_SECONDS} 1' solimplimit='0.95 0.99 0.001 0.5 2'/>"
    )
}

/// Half a cube, on one side of its frame along x.
struct Shell {
    half: DVec3,
    side: f64,
    mass: f64,
    friction: f64,
}

impl Shell {
    fn write(self, xml: &mut String) -> fmt::Result {
        let Shell { half: DVec3 { x, y, z }, side, mass, friction } = self;
        writeln!(
            xml,
            "<geom pos='{} 0 0' size='{x} {y} {z}' mass='{mass}' friction='{friction} 0 0'/>",
            side * x
        )
    }
}

/// Half the edges of a half cube with docks, in m.
fn outer_half() -> DVec3 {
    let half = (EDGE / 2.0 - SHELL) * MILLI;
    DVec3::new(half / 2.0, half, half)
}

/// Half the edges of a half cube at the roll, in m. It is slimmer, so that a module lies on its ends.
fn inner_half() -> DVec3 {
    let across = (EDGE / 2.0 - SHELL - SLIMMER) * MILLI;
    DVec3::new((EDGE / 2.0 - SHELL) / 2.0 * MILLI, across, across)
}

/// The corners of the two boxes with docks, front and back, in the frames of their bodies, in m.
pub fn corners() -> [[DVec3; 8]; 2] {
    let half = outer_half();
    [1.0, -1.0].map(|side| {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            DVec3::new(side * half.x, 0.0, 0.0) + half * DVec3::new(sign(0), sign(1), sign(2))
        })
    })
}
