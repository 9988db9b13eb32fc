//! The router, compared with a plain statement of its rules.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tasks::dock::{Dock, DockSet};
use tasks::message::{Address, TaskCode};
use tasks::router::{Mcu, Residence, Residents, Route, Router, Source, TaskSet};

/// The docks and tasks whose bits are set.
fn residents(docks: u8, tasks: [u8; 4]) -> Residents {
    let docks: Vec<Dock> = Dock::ALL.into_iter().filter(|dock| docks >> dock.index() & 1 != 0).collect();
    let tasks = u32::from_le_bytes(tasks);
    let tasks: Vec<TaskCode> =
        (0..32).filter(|code| tasks >> code & 1 != 0).filter_map(TaskCode::new).collect();
    Residents { docks: DockSet::of(&docks), tasks: TaskSet::of(&tasks) }
}

fuzz_target!(|input: [u8; 13]| {
    let [docks, a, b, c, d, other_docks, e, f, g, h, to, _, source] = input;
    let here = residents(docks, [a, b, c, d]);
    let other = residents(other_docks, [e, f, g, h]);
    let Some(to) = Address::from_byte(to) else { return };
    let source = match (source, Dock::from_index(source & 7)) {
        (_, Some(dock)) => Source::Dock(dock),
        (source, None) if source & 1 == 0 => Source::Bridge,
        _ => Source::Task,
    };
    let (is_here, is_there, home) = match to.dock() {
        Some(dock) => (here.docks.contains(dock), other.docks.contains(dock), Route::Link(dock)),
        None => (here.tasks.contains(to.task()), other.tasks.contains(to.task()), Route::Task(to.task())),
    };
    let expected = match source {
        Source::Dock(_) if to.dock().is_some() || !to.task().is_behaviour() => Route::Refused,
        _ if to.dock().is_some() && !to.task().is_behaviour() => Route::Ignored,
        _ if is_here => home,
        Source::Task | Source::Dock(_) if is_there => Route::Bridge,
        _ => Route::Ignored,
    };
    let as_master = Router::new(Mcu::Master, Residence { master: here, slave: other });
    let as_slave = Router::new(Mcu::Slave, Residence { master: other, slave: here });
    assert_eq!(as_master.route(to, source), expected);
    assert_eq!(as_slave.route(to, source), expected);
});
