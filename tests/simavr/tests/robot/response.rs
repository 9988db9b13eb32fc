//! The joints' control never takes longer than its bound, and no interrupt waits longer than its bound, with
//! any traffic at the docks. `SUPERBOT_BUSY=80` measures for 80 s of each kind of traffic.

use std::sync::LazyLock;

use simavr_harness::Controller;
use simavr_harness::bench::module::busy::{self, Seen};
use superbot_tests_simavr::bounds::{Noted, notes};
use superbot_tests_simavr::{images, setting};
use time_bound::{Costs, Releases, Responses};

/// The bounds computed from the image of each MCU, in the order of [`Controller::ALL`].
static COMPUTED: LazyLock<[Responses; 2]> = LazyLock::new(|| Controller::ALL.map(compute));

fn compute(controller: Controller) -> Responses {
    let name = match controller {
        Controller::Master => "firmware-master",
        Controller::Slave => "firmware-slave",
    };
    let noted = Noted::load(name);
    let releases = Releases::load(&["board", name].map(|folder| notes(folder, "releases.toml")));
    let releases = releases.unwrap_or_else(|error| panic!("{error}"));
    let costs = Costs::new(&noted.image, &noted.annotations, &noted.loops).expect("the notes fit");
    let responses = Responses::new(&releases, &costs, &noted.bounds());
    responses.unwrap_or_else(|problems| panic!("{name}: {problems:?}"))
}

#[test]
fn no_byte_is_lost_at_any_line_for_an_interrupt_that_is_too_late() {
    for (controller, Responses { interrupts, .. }) in Controller::ALL.into_iter().zip(&*COMPUTED) {
        let slack = |vector: u8| interrupts.iter().find(|one| one.vector == vector)?.slack();
        for vector in [6, 8, 18, 30] {
            let slack =
                slack(vector).unwrap_or_else(|| panic!("{controller:?}: no bound of vector {vector}"));
            assert!(slack >= 0, "{controller:?}: vector {vector} may be {} cycles late", -slack);
        }
    }
}

#[test]
fn neither_the_joints_control_nor_interrupts_take_longer_than_was_computed() {
    let seconds = setting("SUPERBOT_BUSY").unwrap_or(busy::SECONDS);
    let seen = busy::measure(&images(), seconds).expect("the module is busy");
    println!("MCU     what                  bound  longest  bound over longest");
    for (Seen { controller, control, waited }, responses) in seen.into_iter().zip(&*COMPUTED) {
        let hold = |what: &str, bound: Option<u64>, longest: u64| {
            let bound = bound.unwrap_or_else(|| panic!("{controller:?}: no bound of {what}"));
            let over = bound as f64 / longest as f64;
            println!("{:7} {what:20} {bound:6} {longest:8} {over:19.2}", format!("{controller:?}"));
            assert!(longest <= bound, "{controller:?}, {what}: {longest} cycles, {bound} at most");
        };
        let joints = responses.tasks.iter().find(|task| task.task == "MOTORS").expect("it is listed");
        for (load, longest) in control {
            hold(&format!("control, {load}"), joints.response, longest);
        }
        for (vector, longest) in waited {
            let of_vector = responses.interrupts.iter().find(|interrupt| interrupt.vector == vector);
            hold(&format!("vector {vector}"), of_vector.and_then(|one| one.latency), longest);
        }
    }
}
