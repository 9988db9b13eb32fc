//! A run stops where it has to: what is due happens there, and pauses change nothing.

use std::collections::HashMap;

use plants::motion::Motion;
use simulation::{
    Angles, Body, Change, Environment, Event, Face, Facing, MILLISECOND, Native, Placing, Robot, Run, Shape,
    Trouble, Wiring,
};

/// A chain of two to which something happens at these times, in ms.
fn run(events: &[u64]) -> Run<Native> {
    within(events, None)
}

/// As [`run`], in a world that breaks after so many milliseconds.
fn within(events: &[u64], breaks: Option<u64>) -> Run<Native> {
    let event = |(number, &at)| Event { at: at * MILLISECOND, change: Change::Roll(f64::from(number)) };
    let mut robot = Native::new(Shape::Chain.wiring(2).unwrap(), 1, 0);
    if let Some(left) = breaks {
        robot = robot.within(Box::new(Breaks { left, trouble: None }));
    }
    Run::new(robot, (0..).zip(events).map(event).collect(), 1000 * MILLISECOND)
}

/// A world in which nothing moves, and which breaks.
struct Breaks {
    left: u64,
    trouble: Option<Trouble>,
}

impl Environment for Breaks {
    fn enter(&mut self, _module: usize, _body: &mut Body) {}

    fn exchange(&mut self, _module: usize, _body: &mut Body) {}

    fn step(&mut self) {
        self.left -= 1;
        if self.left == 0 {
            let [place, what] = ["a test", "a test"].map(Into::into);
            self.trouble = Some(Trouble { seconds: 0.0, place, what, last: Vec::new() });
        }
    }

    fn change(&mut self, _change: &Change, _before: &Wiring, _wiring: &Wiring) {}

    fn facing(&self, _wiring: &Wiring, _from: Face) -> Vec<Facing> {
        Vec::new()
    }

    fn in_sight(&self, _wiring: &Wiring) -> HashMap<Face, Face> {
        HashMap::new()
    }

    fn trouble(&self) -> Option<&Trouble> {
        self.trouble.as_ref()
    }

    fn motion(&self) -> Motion {
        Motion { distance: 0.0, sideways: 0.0, heading: 0.0, length: 0.0, slip: 0.0 }
    }

    fn tilt(&self) -> f64 {
        0.0
    }

    fn placing(&self, _module: usize) -> Placing {
        let angles: Angles = [0.0; 3];
        Placing { frame: glam::DAffine3::IDENTITY, angles }
    }

    fn state_hash(&self) -> u64 {
        self.left
    }
}

/// Where a run is, in ms, how many events have happened to it, and how many are to come.
fn place(run: &Run<Native>) -> (u64, usize, usize) {
    (run.robot.now() / MILLISECOND, run.happened().len(), run.events_to_come().len())
}

#[test]
fn a_step_ends_after_250_ms_at_the_next_event_or_at_the_end() {
    for (events, end, stops) in [
        (&[][..], 0, &[(0, 0, 0)][..]),
        (&[], 600, &[(250, 0, 0), (500, 0, 0), (600, 0, 0)]),
        (&[0, 100, 100, 350], 500, &[(0, 1, 3), (100, 3, 1), (350, 4, 0), (500, 4, 0)]),
        (&[250, 251, 300], 300, &[(250, 1, 2), (251, 2, 1), (300, 3, 0)]),
        (&[500, 501], 500, &[(250, 0, 2), (500, 1, 1)]),
    ] {
        let mut run = run(events);
        for (number, &stop) in (1..).zip(stops) {
            let goes_on = run.step(end * MILLISECOND).unwrap();
            assert_eq!((place(&run), goes_on), (stop, number < stops.len()), "{events:?} to {end} ms");
        }
        let happened: Vec<_> = run.happened().iter().chain(run.events_to_come()).cloned().collect();
        assert_eq!(happened, self::run(events).events_to_come().cloned().collect::<Vec<_>>(), "in order");
    }
}

#[test]
fn a_step_that_pauses_ends_where_it_would_have() {
    let mut run = run(&[350]);
    for (pause, stop, goes_on) in [
        (100, (100, 0, 1), true),
        // A pause that is over.
        (50, (100, 0, 1), true),
        (1000, (250, 0, 1), true),
        (300, (300, 0, 1), true),
        (350, (350, 1, 0), true),
        (400, (400, 1, 0), true),
        (600, (600, 1, 0), true),
        (799, (799, 1, 0), true),
        (800, (800, 1, 0), false),
    ] {
        let found = run.step_until(800 * MILLISECOND, pause * MILLISECOND).unwrap();
        assert_eq!((place(&run), found), (stop, goes_on), "a pause at {pause} ms");
    }
}

/// What a world that breaks had been through is kept, and nothing else happens to it.
#[test]
fn a_run_ends_where_its_world_breaks() {
    for pause in [350, u64::MAX / MILLISECOND] {
        let mut run = within(&[200, 400], Some(300));
        run.record(40 * MILLISECOND);
        for (stop, goes_on) in [((200, 1, 1), true), ((300, 1, 1), false), ((300, 1, 1), false)] {
            let found = run.step_until(1000 * MILLISECOND, pause * MILLISECOND).unwrap();
            assert_eq!((place(&run), found), (stop, goes_on), "a pause at {pause} ms");
        }
        assert_eq!(run.robot.trouble().map(|trouble| trouble.what.as_str()), Some("a test"));
        let looks = run.finish_recording().unwrap().placings.len() / 2;
        assert_eq!(looks, 8, "from 0 to 280 ms");
    }
}
