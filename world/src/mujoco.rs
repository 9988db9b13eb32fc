//! MuJoCo behind a safe interface: a model, its state, and the few functions that the world calls. All of the
//! package's `unsafe` code except that in [`libm`](crate::libm) is here.

use std::ffi::{CStr, CString, c_char};
use std::ptr::NonNull;
use std::slice;
use std::sync::Once;

use glam::{DQuat, DVec3};

#[allow(non_camel_case_types, non_snake_case, non_upper_case_globals, dead_code, missing_docs)]
#[allow(clippy::all, clippy::undocumented_unsafe_blocks)]
mod bindings {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

use bindings::{mjData, mjModel};

/// Room for a message, in bytes.
const MESSAGE: usize = 1000;

/// MuJoCo's warnings, in its order. The simulation can't continue after one.
const WARNINGS: [&str; 7] = [
    "an inertia matrix that is singular",
    "more contacts than there is room for",
    "more constraints than there is room for",
    "a position that is not a number",
    "a speed that is not a number",
    "an acceleration that is not a number",
    "a control that is not a number",
];

/// A warning, and the index that it names. What the index counts depends on the warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warning {
    pub what: &'static str,
    pub index: usize,
}

/// A contact of a body with another.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The geoms' indices.
    pub geoms: [usize; 2],
    pub position: DVec3,
    /// From the first geom to the second.
    pub normal: DVec3,
    /// The normal force, in N.
    pub force: f64,
    /// The depth of one geom in the other, in m; negative if they do not touch yet.
    pub depth: f64,
}

/// A model and its state.
pub struct Simulation {
    model: NonNull<mjModel>,
    data: NonNull<mjData>,
}

// SAFETY: MuJoCo ties neither a model nor a state to a thread.
unsafe impl Send for Simulation {}

// SAFETY: through a shared reference memory is only read. All that lets MuJoCo write takes an exclusive one.
unsafe impl Sync for Simulation {}

impl Simulation {
    /// The model that `xml` describes, in its initial state.
    ///
    /// # Errors
    /// MuJoCo rejects the text, with its message; or the model does not compile, or there is no memory for
    /// its state.
    pub fn new(xml: &str) -> Result<Self, String> {
        keep_quiet();
        let xml = CString::new(xml).map_err(|error| error.to_string())?;
        let mut message = [0 as c_char; MESSAGE];
        // SAFETY: the text ends with a zero byte, the message buffer has the length that is passed, and no
        // virtual file system is used.
        let spec = unsafe {
            bindings::mj_parseXMLString(
                xml.as_ptr(),
                std::ptr::null(),
                message.as_mut_ptr(),
                message.len() as i32,
            )
        };
        if spec.is_null() {
            // SAFETY: MuJoCo ends the message with a zero byte.
            return Err(unsafe { CStr::from_ptr(message.as_ptr()) }.to_string_lossy().into_owned());
        }
        // SAFETY: the specification is valid, and is not used after it is deleted.
        let model = unsafe {
            let model = bindings::mj_compile(spec, std::ptr::null());
            bindings::mj_deleteSpec(spec);
            model
        };
        let model = NonNull::new(model).ok_or("the model does not compile")?;
        // SAFETY: the model is valid.
        let data = NonNull::new(unsafe { bindings::mj_makeData(model.as_ptr()) });
        let data = data.ok_or("there is no memory for the state");
        if data.is_err() {
            // SAFETY: there is no other pointer to the model.
            unsafe { bindings::mj_deleteModel(model.as_ptr()) };
        }
        Ok(Simulation { model, data: data? })
    }

    /// Computes all that follows from positions and speeds, without a step of time.
    pub fn update(&mut self) {
        // SAFETY: the state is one of the model.
        unsafe { bindings::mj_forward(self.model.as_ptr(), self.data.as_ptr()) };
    }

    /// Advances the simulation by a step of time.
    ///
    /// # Errors
    /// MuJoCo has warned since the simulation began. The error is the first such warning in the order of
    /// `WARNINGS`.
    pub fn step(&mut self) -> Result<(), Warning> {
        // SAFETY: the state is one of the model.
        unsafe { bindings::mj_step(self.model.as_ptr(), self.data.as_ptr()) };
        let warnings = WARNINGS.into_iter().zip(&self.data().warning);
        match warnings.into_iter().find(|(_, warning)| warning.number > 0) {
            Some((what, warning)) => Err(Warning { what, index: warning.lastinfo.max(0) as usize }),
            None => Ok(()),
        }
    }

    fn model(&self) -> &mjModel {
        // SAFETY: the model lives as long as `self`, and it is changed only through an exclusive reference.
        unsafe { self.model.as_ref() }
    }

    fn data(&self) -> &mjData {
        // SAFETY: the state lives as long as `self`, and it is changed only through an exclusive reference.
        unsafe { self.data.as_ref() }
    }

    /// The positions, in the order of the model: three numbers and a quaternion for a free joint, an angle in
    /// rad for a hinge.
    pub fn positions(&self) -> &[f64] {
        // SAFETY: the model says how many there are.
        unsafe { slice::from_raw_parts(self.data().qpos, self.model().nq as usize) }
    }

    pub fn positions_mut(&mut self) -> &mut [f64] {
        // SAFETY: the model says how many there are, and the reference is exclusive.
        unsafe { slice::from_raw_parts_mut(self.data().qpos, self.model().nq as usize) }
    }

    /// The speeds, in the order of the model: six numbers for a free joint, one for a hinge, in m/s and
    /// rad/s.
    pub fn speeds(&self) -> &[f64] {
        // SAFETY: the model says how many there are.
        unsafe { slice::from_raw_parts(self.data().qvel, self.model().nv as usize) }
    }

    pub fn speeds_mut(&mut self) -> &mut [f64] {
        // SAFETY: the model says how many there are, and the reference is exclusive.
        unsafe { slice::from_raw_parts_mut(self.data().qvel, self.model().nv as usize) }
    }

    /// The forces and torques from outside, in the order of [`speeds`](Self::speeds).
    pub fn forces_mut(&mut self) -> &mut [f64] {
        // SAFETY: the model says how many there are, and the reference is exclusive.
        unsafe { slice::from_raw_parts_mut(self.data().qfrc_applied, self.model().nv as usize) }
    }

    /// The torques of dry friction, in the order of [`speeds`](Self::speeds).
    pub fn friction_mut(&mut self) -> &mut [f64] {
        // SAFETY: the model says how many there are, and the reference is exclusive.
        unsafe { slice::from_raw_parts_mut(self.model().dof_frictionloss, self.model().nv as usize) }
    }

    /// The readings of the sensors, in the order of the model.
    pub fn sensors(&self) -> &[f64] {
        // SAFETY: the model says how many there are.
        unsafe { slice::from_raw_parts(self.data().sensordata, self.model().nsensordata as usize) }
    }

    /// The position and rotation of a body. The world itself is body 0.
    pub fn pose(&self, body: usize) -> (DVec3, DQuat) {
        let bodies = self.model().nbody as usize;
        // SAFETY: the model says how many there are.
        let (positions, turns) = unsafe {
            (
                slice::from_raw_parts(self.data().xpos, 3 * bodies),
                slice::from_raw_parts(self.data().xquat, 4 * bodies),
            )
        };
        let [w, x, y, z] = [0, 1, 2, 3].map(|index| turns[4 * body + index]);
        (DVec3::from_slice(&positions[3 * body..]), DQuat::from_xyzw(x, y, z, w))
    }

    /// The velocity of a body at the point `at` of the world, in m/s.
    pub fn velocity(&self, body: usize, at: DVec3) -> DVec3 {
        let bodies = self.model().nbody as usize;
        // SAFETY: the model says how many bodies there are, and each body's root is one of them.
        let (velocities, centres, root) = unsafe {
            (
                slice::from_raw_parts(self.data().cvel, 6 * bodies),
                slice::from_raw_parts(self.data().subtree_com, 3 * bodies),
                slice::from_raw_parts(self.model().body_rootid, bodies)[body] as usize,
            )
        };
        // MuJoCo gives the velocity at the centre of mass of the tree to which the body belongs.
        let turning = DVec3::from_slice(&velocities[6 * body..]);
        let moving = DVec3::from_slice(&velocities[6 * body + 3..]);
        moving + turning.cross(at - DVec3::from_slice(&centres[3 * root..]))
    }

    /// The contacts of the last step that are part of the solver's constraints.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> {
        let data = self.data();
        let contacts = match data.ncon {
            0 => &[],
            // SAFETY: the state says how many there are.
            number => unsafe { slice::from_raw_parts(data.contact, number as usize) },
        };
        (0..).zip(contacts).filter(|(_, contact)| contact.efc_address >= 0).map(|(index, contact)| {
            let mut force = [0.0; 6];
            // SAFETY: there is a contact with this index, and the result has six numbers.
            unsafe {
                bindings::mj_contactForce(self.model.as_ptr(), self.data.as_ptr(), index, force.as_mut_ptr());
            }
            Contact {
                geoms: contact.geom.map(|geom| geom.max(0) as usize),
                position: DVec3::from_array(contact.pos),
                normal: DVec3::from_slice(&contact.frame),
                force: force[0],
                depth: -contact.dist,
            }
        })
    }

    /// Holds two bodies together so that their `points` coincide and the second body is turned by `turn`
    /// against the first. `weld` is the constraint's index.
    pub fn weld(&mut self, weld: usize, bodies: [usize; 2], points: [DVec3; 2], turn: DQuat) {
        const ROW: usize = bindings::mjNEQDATA as usize;
        let model = self.model();
        let welds = model.neq as usize;
        let [one, other] = bodies.map(|body| {
            assert!(body < model.nbody as usize, "a body of the model");
            body as i32
        });
        // SAFETY: the model says how many there are, and the reference is exclusive.
        let (ones, others, numbers, active) = unsafe {
            (
                slice::from_raw_parts_mut(model.eq_obj1id, welds),
                slice::from_raw_parts_mut(model.eq_obj2id, welds),
                slice::from_raw_parts_mut(model.eq_data, ROW * welds),
                slice::from_raw_parts_mut(self.data().eq_active, welds),
            )
        };
        ones[weld] = one;
        others[weld] = other;
        let row = &mut numbers[ROW * weld..][..ROW];
        row[..3].copy_from_slice(&points[1].to_array());
        row[3..6].copy_from_slice(&points[0].to_array());
        row[6..10].copy_from_slice(&[turn.w, turn.x, turn.y, turn.z]);
        active[weld] = true;
    }

    /// Releases the bodies that a weld holds.
    pub fn release(&mut self, weld: usize) {
        let welds = self.model().neq as usize;
        // SAFETY: the model says how many there are, and the reference is exclusive.
        unsafe { slice::from_raw_parts_mut(self.data().eq_active, welds)[weld] = false };
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        // SAFETY: there are no other pointers to model and state.
        unsafe {
            bindings::mj_deleteData(self.data.as_ptr());
            bindings::mj_deleteModel(self.model.as_ptr());
        }
    }
}

/// Keeps MuJoCo from writing warnings to a file: [`Simulation::step`] returns them.
fn keep_quiet() {
    extern "C" fn ignore(_: *const c_char) {}
    static ONCE: Once = Once::new();
    // SAFETY: MuJoCo reads the pointer only when it warns, and every model is made after this.
    ONCE.call_once(|| unsafe { bindings::mju_user_warning = Some(ignore) });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rod of 0.5 m on a hinge at its end, `angle` rad from hanging.
    fn pendulum(angle: f64) -> Simulation {
        let xml = "<mujoco><compiler angle='radian'/><option timestep='0.001' integrator='implicitfast'/>
            <worldbody><body><joint axis='0 1 0'/><geom type='box' pos='0 0 -0.25' size='0.01 0.01 0.25'
            mass='0.3'/></body></worldbody></mujoco>";
        let mut simulation = Simulation::new(xml).unwrap();
        simulation.positions_mut()[0] = angle;
        simulation
    }

    /// The period of a swing, from one crossing of the middle to the next in the same direction.
    fn period(angle: f64) -> f64 {
        let mut simulation = pendulum(angle);
        let mut crossings = Vec::new();
        for step in 0..10_000 {
            let before = simulation.positions()[0];
            simulation.step().unwrap();
            let after = simulation.positions()[0];
            if before > 0.0 && after <= 0.0 {
                crossings.push((f64::from(step) + before / (before - after)) * 1e-3);
            }
        }
        crossings[1] - crossings[0]
    }

    /// By the arithmetic-geometric mean (Gauss): exact for any angle.
    fn formula(angle: f64) -> f64 {
        // The inertia of a box about its end, by Steiner's theorem.
        let [mass, edge, height] = [0.3, 0.02_f64, 0.5_f64];
        let inertia = mass * ((edge * edge + height * height) / 12.0 + height * height / 4.0);
        let (mut one, mut other) = (1.0, (angle / 2.0).cos());
        for _ in 0..10 {
            (one, other) = ((one + other) / 2.0, f64::sqrt(one * other));
        }
        2.0 * std::f64::consts::PI * (inertia / (mass * 9.81 * height / 2.0)).sqrt() / one
    }

    #[test]
    fn a_pendulum_swings_by_the_formula() {
        for degrees in [5.0_f64, 90.0, 150.0] {
            let angle = degrees.to_radians();
            let error = period(angle) / formula(angle) - 1.0;
            assert!(error.abs() < 1e-3, "{degrees} degrees: {error}");
        }
    }

    #[test]
    fn what_is_no_number_is_told_and_no_file_is_written_of_it() {
        const LOG: &str = "MUJOCO_LOG.TXT";
        let _ = std::fs::remove_file(LOG);
        let mut simulation = pendulum(1.0);
        simulation.speeds_mut()[0] = f64::NAN;
        assert_eq!(simulation.step(), Err(Warning { what: "a speed that is not a number", index: 0 }));
        assert!(!std::fs::exists(LOG).unwrap());
    }

    #[test]
    fn a_model_that_is_none_is_refused() {
        let error = Simulation::new("<mujoco><worldbody><geom type='cloud'/></worldbody></mujoco>").err();
        assert!(error.is_some_and(|error| error.contains("cloud")));
    }
}
