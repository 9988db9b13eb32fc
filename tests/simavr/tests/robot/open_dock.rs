//! A dock that is open, or whose latch moves, has no neighbour.

use simavr_harness::{Controller, Engine, RobotBuilder};
use simulation::{MILLISECOND, Robot};
use superbot_tests_simavr::firmware;
use tasks::dock::Dock;

/// PORTC in data memory, and its bit that drives the latch of Back towards latched.
const PORTC: u16 = 0x35;
const DRIVE_BACK: u8 = 1 << 3;

#[test]
fn a_dock_whose_latch_is_driven_passes_the_probes_of_its_neighbour_over() {
    let robot = RobotBuilder::chain(firmware(), 2).seed(1).build().expect("it can be built");
    let mut engine = Engine::new(robot, 1);
    let mut ignored = 0;
    for (is_driven, neighbour) in [(false, Dock::Front.index()), (true, 0xFF), (false, Dock::Front.index())] {
        let slave = engine.robot_mut().module_mut(0).expect("there is one").mcu_mut(Controller::Slave);
        let others = slave.read(PORTC).expect("it is a register") & !DRIVE_BACK;
        slave.write(PORTC, if is_driven { others | DRIVE_BACK } else { others });
        engine.run_until(engine.cycle() + 1_000 * MILLISECOND);
        let module = engine.robot().module(0).expect("there is one");
        assert!(module.body().latch(Dock::Back).is_latched(), "it is driven to where it is");
        let before = ignored;
        ignored = module.link_counters(Dock::Back).expect("it has a link").ignored;
        assert_eq!(ignored != before, is_driven, "{ignored} probes, {before} before");
        let status = engine.status(0).expect("it runs");
        assert_eq!(status.neighbours[usize::from(Dock::Back.index())], neighbour, "driven: {is_driven}");
    }
}
