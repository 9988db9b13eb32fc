//! The router: every task, dock and source on both MCUs, compared with a plain statement of the rules.

use tasks::dock::{Dock, DockSet};
use tasks::message::{Address, TaskCode};
use tasks::router::{Mcu, Residence, Residents, Route, Router, Source, TaskSet};
use tasks::superbot;

const fn task(code: u8) -> TaskCode {
    match TaskCode::new(code) {
        Some(task) => task,
        None => panic!("no such task code"),
    }
}

// Every residence that a task can have: behaviours and system tasks, on the master, on the slave, on both.
const MASTER_TASKS: [TaskCode; 5] = [task(0x00), task(0x01), task(0x06), task(0x10), task(0x11)];
const SLAVE_TASKS: [TaskCode; 4] = [task(0x02), task(0x05), task(0x10), task(0x1F)];
// The dock Right belongs to neither MCU.
const MASTER_DOCKS: [Dock; 2] = [Dock::Front, Dock::Left];
const SLAVE_DOCKS: [Dock; 3] = [Dock::Back, Dock::Up, Dock::Down];

const RESIDENCE: Residence = Residence {
    master: Residents { docks: DockSet::of(&MASTER_DOCKS), tasks: TaskSet::of(&MASTER_TASKS) },
    slave: Residents { docks: DockSet::of(&SLAVE_DOCKS), tasks: TaskSet::of(&SLAVE_TASKS) },
};

fn addresses() -> impl Iterator<Item = Address> {
    (0..=255).filter_map(Address::from_byte)
}

fn route(mcu: Mcu, to: Address, source: Source) -> Route {
    Router::new(mcu, RESIDENCE).route(to, source)
}

fn sources() -> impl Iterator<Item = Source> {
    [Source::Task, Source::Bridge].into_iter().chain(Dock::ALL.map(Source::Dock))
}

#[test]
fn every_combination_goes_by_the_rules() {
    for (mcu, tasks, docks, other_tasks, other_docks) in [
        (Mcu::Master, &MASTER_TASKS[..], &MASTER_DOCKS[..], &SLAVE_TASKS[..], &SLAVE_DOCKS[..]),
        (Mcu::Slave, &SLAVE_TASKS, &SLAVE_DOCKS, &MASTER_TASKS, &MASTER_DOCKS),
    ] {
        for to in addresses() {
            let (here, there, delivered) = match to.dock() {
                Some(dock) => (docks.contains(&dock), other_docks.contains(&dock), Route::Link(dock)),
                None => {
                    let task = to.task();
                    (tasks.contains(&task), other_tasks.contains(&task), Route::Task(task))
                }
            };
            for source in sources() {
                let from_neighbour = matches!(source, Source::Dock(_));
                let is_beyond = to.dock().is_some();
                let is_behaviour = to.task().code() < 7;
                let expected = match (here, there, source) {
                    _ if from_neighbour && (is_beyond || !is_behaviour) => Route::Refused,
                    _ if is_beyond && !is_behaviour => Route::Ignored,
                    (true, _, _) => delivered,
                    (false, true, Source::Task | Source::Dock(_)) => Route::Bridge,
                    (false, true, Source::Bridge) | (false, false, _) => Route::Ignored,
                };
                assert_eq!(route(mcu, to, source), expected, "{mcu:?} {to:?} {source:?}");
            }
        }
    }
}

/// Any frame of a neighbour reaches a behaviour of this module, on one MCU only, or nothing.
#[test]
fn from_a_dock_only_behaviours_are_reached() {
    let mut reached = Vec::new();
    for to in addresses() {
        for (mcu, dock) in [(Mcu::Master, Dock::Front), (Mcu::Slave, Dock::Back)] {
            let other = if mcu == Mcu::Master { Mcu::Slave } else { Mcu::Master };
            let last = match route(mcu, to, Source::Dock(dock)) {
                Route::Bridge => route(other, to, Source::Bridge),
                route => route,
            };
            match last {
                Route::Task(task) => {
                    assert!(task.is_behaviour());
                    reached.push(task.code());
                }
                Route::Ignored | Route::Refused => {}
                Route::Link(_) | Route::Bridge => panic!("{to:?} from {dock:?}: {last:?}"),
            }
        }
    }
    assert_eq!(reached, [0, 0, 1, 1, 2, 2, 5, 5, 6, 6]);
}

/// The path of the paper's Figure 6: in at the Back dock of the slave, HORMONE on the master, out at the
/// Front dock.
#[test]
fn a_hormone_passes_through_a_spine() {
    let hormone = Address::here(TaskCode::HORMONE);
    assert_eq!(route(Mcu::Slave, hormone, Source::Dock(Dock::Back)), Route::Bridge);
    assert_eq!(route(Mcu::Master, hormone, Source::Bridge), Route::Task(TaskCode::HORMONE));
    let front = Address::beyond(Dock::Front, TaskCode::HORMONE);
    assert_eq!(route(Mcu::Master, front, Source::Task), Route::Link(Dock::Front));
    let back = Address::beyond(Dock::Back, TaskCode::HORMONE);
    assert_eq!(route(Mcu::Master, back, Source::Task), Route::Bridge);
    assert_eq!(route(Mcu::Slave, back, Source::Bridge), Route::Link(Dock::Back));
}

/// Where a message from `source` on `mcu` ends: the MCU and the route there.
fn end(residence: Residence, mcu: Mcu, to: Address, source: Source) -> (Mcu, Route) {
    match Router::new(mcu, residence).route(to, source) {
        Route::Bridge => {
            let other = if mcu == Mcu::Master { Mcu::Slave } else { Mcu::Master };
            (other, Router::new(other, residence).route(to, Source::Bridge))
        }
        route => (mcu, route),
    }
}

/// In the robot's own residence each task in turn is moved. It is found in its new place from everywhere, and
/// all others in their old ones.
#[test]
fn a_task_that_is_moved_to_the_other_mcu_is_found_there_from_everywhere() {
    let residents = [superbot::RESIDENCE.master, superbot::RESIDENCE.slave];
    let codes = || (0..32).map(task);
    let resides = residents.map(|here| codes().filter(|code| here.tasks.contains(*code)).collect::<Vec<_>>());
    assert!(resides.iter().all(|tasks| tasks.len() >= 8));
    for moved in resides.concat() {
        let [master, slave] = [0, 1].map(|mcu: usize| {
            let stays = resides[mcu].iter().filter(|code| **code != moved);
            let comes = resides[1 - mcu].iter().filter(|code| **code == moved);
            Residents {
                tasks: TaskSet::of(&stays.chain(comes).copied().collect::<Vec<_>>()),
                ..residents[mcu]
            }
        });
        let residence = Residence { master, slave };
        for (mcu, docks) in [(Mcu::Master, master.docks), (Mcu::Slave, slave.docks)] {
            for code in codes() {
                let at = if master.tasks.contains(code) { Mcu::Master } else { Mcu::Slave };
                let is_known = resides.concat().contains(&code);
                let found = end(residence, mcu, Address::here(code), Source::Task);
                assert_eq!(
                    found == (at, Route::Task(code)),
                    is_known,
                    "{code:?} from {mcu:?}, {moved:?} moved"
                );
                for dock in docks.iter() {
                    let found = end(residence, mcu, Address::here(code), Source::Dock(dock));
                    let is_found = found == (at, Route::Task(code));
                    assert_eq!(
                        is_found,
                        is_known && code.is_behaviour(),
                        "{code:?} from {dock:?}, {moved:?} moved"
                    );
                }
            }
        }
        let was_master = residents[0].tasks.contains(moved);
        assert_ne!(master.tasks.contains(moved), was_master);
    }
}
