//! The observers find what is wrong: a centipede of six that does what the test says.

use hormone::action::Action::{self, Holding, Straight, Swing, SwingOver};
use hormone::event::Event;
use hormone::hormone::Data::{self, A, B};
use hormone::status::Status;
use hormone::topology::to_bytes;
use simulation::{
    BridgeTotals, Change, Deed, Event as Happening, Face, LinkTotals, Links, MILLISECOND, Observer, Robot,
    Shape, Wiring, WiringError,
};
use tasks::dock::Dock::{self, Back, Left, Right};

const PERIOD: u64 = 1000 * MILLISECOND;

/// Head 0, branch 1 with legs 2 and 3, tail 4: what they say of themselves.
struct Script {
    wiring: Wiring,
    statuses: Vec<Status>,
    deeds: Vec<Deed>,
    changes: Vec<Happening>,
    now: u64,
}

impl Script {
    fn new() -> (Self, Observer) {
        let wiring = Shape::Centipede.wiring(6).unwrap();
        let statuses = vec![Status::POWER_UP; wiring.modules()];
        let script = Script { wiring, statuses, deeds: Vec::new(), changes: Vec::new(), now: 0 };
        let observer = Observer::new(&script, PERIOD);
        (script, observer)
    }

    /// All modules know what they are, 50 ms after power-up.
    fn discovered() -> (Self, Observer) {
        let (mut script, mut observer) = Self::new();
        for module in 0..6 {
            script.knows(module, 50 * MILLISECOND);
        }
        observer.look(&mut script);
        (script, observer)
    }

    fn knows(&mut self, module: usize, at: u64) {
        let module_type = self.wiring.module_type(module);
        self.statuses[module].neighbours = to_bytes(&self.wiring.neighbours(module));
        self.statuses[module].module_type = module_type;
        self.deeds.push(Deed { cycle: at, module, event: Event::TopologyChanged(module_type) });
    }

    fn receives(&mut self, module: usize, dock: Dock, data: Data, at: u64) {
        self.deeds.push(Deed { cycle: at, module, event: Event::HormoneReceived(dock, data) });
    }

    /// Something that happens now.
    fn happens(&self, change: Change) -> Happening {
        Happening { at: self.now, change }
    }

    /// A module begins an action.
    fn steps(&mut self, observer: &mut Observer, module: usize, action: Action, at: u64) {
        self.now = at;
        self.deeds.push(Deed { cycle: at, module, event: Event::ActionBegun(action) });
        observer.look(self);
    }

    /// The trunk, head 0, branch 1 and spine 4, beats.
    fn trunk_beats(&mut self, observer: &mut Observer, at: u64) {
        for module in [0, 1, 4] {
            self.steps(observer, module, Straight, at);
        }
    }

    /// All walk, a beat in each half Period, the right leg a millisecond later.
    fn walk(&mut self, observer: &mut Observer, half_periods: std::ops::Range<u64>) {
        self.walk_by(observer, half_periods, Swing);
    }

    /// Likewise, with this for a swing.
    fn walk_by(&mut self, observer: &mut Observer, half_periods: std::ops::Range<u64>, swing: Action) {
        for beat in half_periods {
            let at = beat * PERIOD / 2 + 20 * MILLISECOND;
            let [left, right] = if beat % 2 == 0 { [swing, Holding] } else { [Holding, swing] };
            self.trunk_beats(observer, at);
            self.steps(observer, 2, left, at);
            self.steps(observer, 3, right, at + MILLISECOND);
        }
    }

    fn passes(&mut self, observer: &mut Observer, to: u64) {
        self.now = to;
        observer.look(self);
    }
}

impl Robot for Script {
    fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    fn now(&self) -> u64 {
        self.now
    }

    fn powered_up_at(&self, module: usize) -> u64 {
        module as u64 * MILLISECOND
    }

    fn is_on(&self, _module: usize) -> bool {
        true
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        change.apply(&mut self.wiring)
    }

    fn run_until(&mut self, cycle: u64) {
        self.now = cycle;
    }

    fn take_deeds(&mut self) -> Vec<Deed> {
        std::mem::take(&mut self.deeds)
    }

    fn take_changes(&mut self) -> Vec<Happening> {
        std::mem::take(&mut self.changes)
    }

    fn status(&self, module: usize) -> Option<Status> {
        self.statuses.get(module).copied()
    }

    fn links(&self) -> LinkTotals {
        LinkTotals::default()
    }

    fn bridges(&self) -> BridgeTotals {
        BridgeTotals::default()
    }

    fn state_hash(&self) -> u64 {
        0
    }
}

#[test]
fn legs_that_alternate_are_right() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..40);
    assert_eq!((observer.gait.legs(), observer.gait.beats), (2, 39 * 5));
    assert_eq!(observer.gait.violations, 0);
    assert_eq!(observer.gait.skew_max, Some(MILLISECOND));
    assert_eq!(observer.gait.recovery_periods(), Some(0.521), "the first step of the right leg");
}

#[test]
fn a_leg_that_does_the_same_twice_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    script.trunk_beats(&mut observer, 9 * PERIOD / 2);
    script.steps(&mut observer, 2, Holding, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations, 0);
    script.steps(&mut observer, 2, Holding, 9 * PERIOD / 2 + 10 * MILLISECOND);
    assert_eq!(observer.gait.violations, 1);
}

#[test]
fn a_module_that_does_nothing_is_wrong_in_each_half_period() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    // Half Periods 9 to 12 pass without a beat: found when each is over.
    script.passes(&mut observer, 12 * PERIOD / 2 + 100 * MILLISECOND);
    // The legs, and all of the trunk but the tail.
    assert_eq!(observer.gait.violations, 5 * 3);
}

#[test]
fn a_module_that_does_what_none_of_its_type_does_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    script.steps(&mut observer, 2, Straight, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations, 1);
    script.steps(&mut observer, 4, Holding, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations, 2, "nor does a spine what a leg does");
}

#[test]
fn legs_that_do_the_same_at_once_are_wrong() {
    let (mut script, mut observer) = Script::discovered();
    for beat in 1..10 {
        let action = if beat % 2 == 0 { Swing } else { Holding };
        script.trunk_beats(&mut observer, beat * PERIOD / 2);
        script.steps(&mut observer, 2, action, beat * PERIOD / 2);
        script.steps(&mut observer, 3, action, beat * PERIOD / 2 + MILLISECOND);
        script.passes(&mut observer, beat * PERIOD / 2 + 300 * MILLISECOND);
    }
    // From 1.3 s on: half Periods 3 to 9.
    assert_eq!(observer.gait.violations, 7);
}

#[test]
fn what_is_wrong_soon_after_a_change_is_how_long_it_took() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let changed_at = 9 * PERIOD / 2;
    observer.gait.disturbed(&script.wiring, changed_at);
    script.trunk_beats(&mut observer, changed_at + PERIOD / 4);
    script.steps(&mut observer, 2, Swing, changed_at + PERIOD / 4);
    script.steps(&mut observer, 3, Holding, changed_at + 3 * PERIOD / 4);
    script.walk(&mut observer, 11..20);
    assert_eq!(observer.gait.violations, 0);
    assert_eq!(observer.gait.recovery_periods(), Some(0.75));
}

/// Whoever is turned over swings on, with no beat left out, and within a Period the other way.
#[test]
fn feet_that_are_lifted_the_wrong_way_are_wrong_a_period_after_the_robot_was_turned() {
    for (roll, before, after) in
        [(180.0, Swing, SwingOver), (-151.0, Swing, SwingOver), (74.0, SwingOver, Swing)]
    {
        let turned_at = 9 * PERIOD / 2;
        let turned = |wrong_until| {
            let (mut script, mut observer) = Script::discovered();
            let first = if before == Swing { 0.0 } else { 180.0 };
            observer.changed(&Happening { at: 0, change: Change::Roll(first) });
            script.walk_by(&mut observer, 1..9, before);
            observer.changed(&Happening { at: turned_at, change: Change::Roll(roll) });
            script.walk_by(&mut observer, 9..wrong_until, before);
            script.walk_by(&mut observer, wrong_until..20, after);
            (observer.gait.violations, observer.gait.recovery_periods())
        };
        // The left leg swings in even half Periods, 20 ms after they begin, until the next one begins.
        assert_eq!(turned(9), (0, Some(0.521)), "the left leg's last swing was over 20 ms after that");
        assert_eq!(turned(10), (0, Some(0.521)), "the right leg swung once more");
        assert_eq!(turned(11), (0, Some(1.02)), "and the left leg");
        assert_eq!(turned(12), (1, Some(1.521)), "too late");
        assert_eq!(turned(13).0, 2);
    }
}

#[test]
fn on_its_side_a_robot_may_lift_its_feet_either_way() {
    for roll in [75.0, -90.0, 150.0] {
        let (mut script, mut observer) = Script::discovered();
        observer.changed(&Happening { at: 0, change: Change::Roll(roll) });
        script.walk_by(&mut observer, 1..9, Swing);
        script.walk_by(&mut observer, 9..20, SwingOver);
        assert_eq!(observer.gait.violations, 0);
    }
}

#[test]
fn what_no_hormone_reaches_need_not_walk() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    // With nobody in front and nobody behind a branch is none, and has no rule: nobody beats the time.
    let mut wiring = script.wiring.clone();
    wiring.kill(0).unwrap();
    wiring.kill(4).unwrap();
    observer.gait.disturbed(&wiring, script.now);
    script.passes(&mut observer, 9 * PERIOD);
    assert_eq!((observer.gait.legs(), observer.gait.violations), (0, 0));
}

#[test]
fn a_dock_that_is_mute_counts_as_detached() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let mute =
        |probability| Change::Loss { links: Links::From(Face { module: 1, dock: Right }), probability };
    observer.changed(&script.happens(mute(1.0)));
    assert_eq!(observer.gait.legs(), 1, "the branch is none any more, and the leg at its right is cut off");
    observer.changed(&script.happens(mute(0.5)));
    assert_eq!(observer.gait.legs(), 2);
}

#[test]
fn where_frames_are_lost_a_robot_has_more_time_to_begin_and_no_more_to_walk_on() {
    let lossy = Change::Loss { links: Links::All, probability: 0.5 };
    let (mut script, mut observer) = Script::discovered();
    observer.changed(&script.happens(lossy.clone()));
    // Four tries: 1 s, and 1.2 s for discovery, and 20 ms or 40 ms for hops to the branch, and to its legs
    // and the spine.
    script.passes(&mut observer, 2_190 * MILLISECOND);
    assert_eq!(observer.gait.violations, 0);
    script.passes(&mut observer, 2_250 * MILLISECOND);
    assert_eq!(observer.gait.violations, 5);

    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    observer.changed(&script.happens(lossy.clone()));
    script.passes(&mut observer, 10 * PERIOD / 2 + 100 * MILLISECOND);
    assert_eq!(observer.gait.violations, 5);
}

#[test]
fn discovery_is_the_time_of_the_last_module_to_know() {
    let (mut script, mut observer) = Script::new();
    for module in 0..6 {
        script.knows(module, 52 * MILLISECOND);
    }
    script.now = 70 * MILLISECOND;
    observer.look(&mut script);
    assert_eq!(
        observer.discovery.found_after,
        Some(51 * MILLISECOND),
        "the head, whose neighbour came 1 ms later"
    );
    assert_eq!(observer.discovery.lost_after, None);

    // The right leg goes: it and the branch have to notice.
    script.wiring.detach(Face { module: 1, dock: Right }).unwrap();
    observer.discovery.rewired(&script.wiring, 1000 * MILLISECOND);
    script.knows(1, 1240 * MILLISECOND);
    observer.look(&mut script);
    assert_eq!(observer.discovery.lost_after, Some(240 * MILLISECOND));
    script.knows(3, 1250 * MILLISECOND);
    observer.look(&mut script);
    assert_eq!(observer.discovery.lost_after, Some(250 * MILLISECOND));
    assert_eq!(observer.discovery.lapses, 0);
    script.knows(0, 1300 * MILLISECOND);
    observer.look(&mut script);
    assert_eq!(observer.discovery.lapses, 1);
}

#[test]
fn hormones_are_followed_over_their_wires() {
    let (mut script, mut observer) = Script::discovered();
    let sent = |module, dock, data, at| Deed { cycle: at, module, event: Event::HormoneSent(dock, data) };
    let generated = Deed { cycle: 1000, module: 0, event: Event::HormoneGenerated(A) };
    script.deeds.extend([generated, sent(0, Back, A, 2000)]);
    script.receives(1, Dock::Front, A, 61_000);
    script.deeds.extend([sent(1, Left, B, 62_000), sent(1, Back, B, 63_000)]);
    script.receives(2, Back, B, 131_000);
    observer.look(&mut script);
    let hops = &observer.hops;
    assert_eq!((hops.sent, hops.delivered, hops.lost(), hops.out_of_turn), (3, 2, 0, 0));
    assert_eq!(hops.latency(), Some((65_000.0, 70_000)));
    // A frame of 7 characters, 1822.9 us, and one transfer of 65 bits on the bus, 162.5 us.
    let over_wire = hops.latency_over_wire().unwrap();
    assert!((over_wire - 65_000.0 / 31_766.0).abs() < 1e-6, "{over_wire}");

    // The next one overtakes the one to the tail, which is lost; the leg's comes twice.
    script.deeds.push(sent(1, Back, A, 200_000));
    script.receives(4, Dock::Front, A, 260_000);
    script.receives(2, Back, B, 270_000);
    observer.look(&mut script);
    let hops = &observer.hops;
    assert_eq!((hops.sent, hops.delivered, hops.lost(), hops.out_of_turn), (4, 3, 1, 1));
}

#[test]
fn what_the_robot_changes_itself_counts_as_a_change() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    // The tail lets go: what it says before that is looked at as it was, and after it has nobody to hear
    // from.
    let change = Change::Detach(Face { module: 4, dock: Back });
    change.apply(&mut script.wiring).unwrap();
    let at = 9 * PERIOD / 2;
    script.changes.push(Happening { at, change });
    for module in [4, 5] {
        script.knows(module, at + 200 * MILLISECOND);
    }
    script.passes(&mut observer, at + 250 * MILLISECOND);
    assert_eq!(observer.own_changes.len(), 1);
    assert_eq!((observer.discovery.lost_after, observer.discovery.lapses), (Some(200 * MILLISECOND), 0));
}

#[test]
fn a_robot_that_was_ordered_to_walk_otherwise_is_not_judged_by_table_1() {
    let (mut script, mut observer) = Script::discovered();
    let at = Face { module: 5, dock: Back };
    let order = |gait: u8| Change::Command { at, payload: vec![0xd0 | gait, 1, 255] };
    observer.changed(&script.happens(order(2)));
    script.steps(&mut observer, 0, Action::Wave, PERIOD);
    script.passes(&mut observer, 10 * PERIOD);
    assert_eq!(observer.gait.violations, 0);
    observer.changed(&script.happens(order(1)));
    script.passes(&mut observer, 12 * PERIOD);
    assert_eq!(observer.gait.violations, 2 * 5, "nobody walks, in two half Periods");
}
