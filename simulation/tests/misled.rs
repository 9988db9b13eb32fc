//! The verdict names what is wrong with a robot that tells what it should not: one that runs as it should, of
//! which one thing is told otherwise.

use hormone::event::Event;
use hormone::status::Status;
use simulation::{
    Angles, BridgeTotals, Change, Event as Happening, Face, LinkTotals, MILLISECOND, Motion, Native, Robot,
    Run, Shape, TraceEvent, Wiring, WiringError, faults,
};
use tasks::dock::Dock;

const SECOND: u64 = 1000 * MILLISECOND;

/// What is told otherwise.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    AsItIs,
    /// The first so many modules see nobody.
    Alone(usize),
    /// These modules have not begun.
    NotBegun(usize),
    /// Module 3 has not heard the hormone that came at 5.5 s.
    Unheard,
    /// Nobody has heard any.
    NeverHeard,
    Crash,
    /// After 5 s module 2 lets go, as nobody has asked it to.
    LetsGo,
    /// It has come so far, in mm.
    Moved(i32),
}

struct Misled {
    robot: Native,
    told: Told,
    changes: Vec<Happening>,
}

/// The faults of a robot that has run for 13 s.
fn verdict(shape: Shape, modules: usize, told: Told) -> Vec<String> {
    let robot = Native::new(shape.wiring(modules).unwrap(), 1, 40 * MILLISECOND);
    let mut run = Run::new(Misled { robot, told, changes: Vec::new() }, Vec::new(), SECOND);
    while run.step(13 * SECOND).expect("nothing happens") {}
    faults(&run, true)
}

#[test]
fn each_module_that_does_not_see_its_wiring_is_found() {
    assert_eq!(verdict(Shape::Centipede, 7, Told::AsItIs), [""; 0]);
    let faults = verdict(Shape::Centipede, 7, Told::Alone(1));
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert!(fault.starts_with("module 0 is wired [") && fault.contains("but sees Some((Head, "), "{fault}");
    let faults = verdict(Shape::Centipede, 7, Told::Alone(7));
    assert_eq!((faults.len(), &faults[5][..]), (6, "2 more modules do not see their wiring"), "{faults:?}");
    let faults = verdict(Shape::Centipede, 7, Told::NotBegun(6));
    assert!(
        matches!(&faults[..], [fault] if fault.starts_with("module 6 is wired") && fault.contains("None"))
    );
}

#[test]
fn hormones_that_do_not_come_are_found() {
    let faults = verdict(Shape::Centipede, 7, Told::Unheard);
    assert!(faults.iter().any(|fault| fault == "1 hormones were lost"), "{faults:?}");
    let faults = verdict(Shape::Centipede, 7, Told::NeverHeard);
    assert!(faults.iter().any(|fault| fault.starts_with("no hormone was delivered")), "{faults:?}");
}

#[test]
fn a_program_that_crashed_is_found() {
    assert_eq!(verdict(Shape::Centipede, 7, Told::Crash), ["module 2: it crashed"]);
}

#[test]
fn a_module_that_comes_off_by_itself_is_found() {
    let fault =
        "2.Back is detached after 5.00 s by the robot itself, which was not ordered to take another shape";
    assert_eq!(verdict(Shape::Centipede, 7, Told::LetsGo), [fault]);
}

/// Ten seconds of walking, 17 mm in each.
#[test]
fn a_robot_that_does_not_come_far_enough_is_found() {
    assert_eq!(verdict(Shape::Centipede, 7, Told::Moved(169)), [""; 0]);
    let faults = verdict(Shape::Centipede, 7, Told::Moved(167));
    let least = "the robot does not walk: it moved 0.167 m ahead, but must move at least 0.168 m";
    assert_eq!(faults, [least]);
    assert_eq!(verdict(Shape::Centipede, 7, Told::Moved(-500)).len(), 1);
    // It has no legs, and nobody has told it to walk.
    assert_eq!(verdict(Shape::Chain, 3, Told::Moved(0)), [""; 0]);
}

impl Robot for Misled {
    fn wiring(&self) -> &Wiring {
        self.robot.wiring()
    }

    fn now(&self) -> u64 {
        self.robot.now()
    }

    fn powered_up_at(&self, module: usize) -> u64 {
        self.robot.powered_up_at(module)
    }

    fn start(&self) -> u64 {
        self.robot.start()
    }

    fn is_on(&self, module: usize) -> bool {
        self.robot.is_on(module)
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        self.robot.change(change)
    }

    fn run_until(&mut self, cycle: u64) {
        self.robot.run_until(cycle);
        let change = Change::Detach(Face { module: 2, dock: Dock::Back });
        if self.told == Told::LetsGo && cycle >= 5 * SECOND && self.robot.change(&change).is_ok() {
            self.changes.push(Happening { at: self.now(), change });
        }
    }

    fn take_trace_events(&mut self) -> Vec<TraceEvent> {
        let mut trace_events = self.robot.take_trace_events();
        trace_events.retain(|&TraceEvent { cycle, module, event }| match (self.told, event) {
            (Told::Unheard, Event::HormoneReceived(..)) => {
                module != 3 || !(5_200 * MILLISECOND..5_700 * MILLISECOND).contains(&cycle)
            }
            (Told::NeverHeard, Event::HormoneReceived(..)) => false,
            _ => true,
        });
        trace_events
    }

    fn take_changes(&mut self) -> Vec<Happening> {
        std::mem::take(&mut self.changes)
    }

    fn status(&self, module: usize) -> Option<Status> {
        let status = self.robot.status(module)?;
        match self.told {
            Told::Alone(number) if module < number => {
                Some(Status { neighbours: Status::POWER_UP.neighbours, ..status })
            }
            Told::NotBegun(other) if module == other => None,
            _ => Some(status),
        }
    }

    fn acceleration(&self, module: usize) -> [f64; 3] {
        self.robot.acceleration(module)
    }

    fn angles(&self, module: usize) -> Angles {
        self.robot.angles(module)
    }

    fn links(&self) -> LinkTotals {
        self.robot.links()
    }

    fn bridges(&self) -> BridgeTotals {
        self.robot.bridges()
    }

    fn crashes(&self) -> Vec<String> {
        if self.told == Told::Crash { vec!["module 2: it crashed".into()] } else { Vec::new() }
    }

    fn motion(&self) -> Option<Motion> {
        let Told::Moved(millimetres) = self.told else { return None };
        let distance = f64::from(millimetres) / 1000.0;
        Some(Motion { distance, length: 1.0, sideways: 0.0, heading: 0.0, slip: 0.0 })
    }

    fn state_hash(&self) -> u64 {
        self.robot.state_hash()
    }
}
