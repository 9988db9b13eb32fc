//! The observers find what is wrong: a centipede of six that does what the test says.

use hormone::action::Action::{self, Holding, HoldingOver, Roll, Straight, Swing, SwingOver};
use hormone::event::Event;
use hormone::gait::GaitName;
use hormone::hormone::Data::{self, A, B, C};
use hormone::neighbours::to_bytes;
use hormone::status::Status;
use simulation::{
    Angles, BridgeTotals, Change, Event as Happening, Face, LinkTotals, Links, MILLISECOND, Mcus, Observer,
    Robot, Shape, TraceEvent, Wiring, WiringError,
};
use tasks::dock::Dock::{self, Back, Front, Left, Right};

const PERIOD: u64 = 1000 * MILLISECOND;

/// How a leg lifts its foot and presses it down.
const ON_FEET: [Action; 2] = [Swing, Holding];
const ON_BACK: [Action; 2] = [SwingOver, HoldingOver];

/// The head's letter at a beat.
fn letter(beat: u64) -> Data {
    if beat.is_multiple_of(2) { B } else { A }
}

/// Head 0, branch 1 with legs 2 and 3, spine 4, tail 5: what they say of themselves.
struct Script {
    wiring: Wiring,
    statuses: Vec<Status>,
    /// How it lies, in degrees.
    roll: f64,
    trace_events: Vec<TraceEvent>,
    changes: Vec<Happening>,
    now: u64,
}

impl Script {
    fn new() -> (Self, Observer) {
        Self::of(Shape::Centipede)
    }

    /// Six modules of this shape.
    fn of(shape: Shape) -> (Self, Observer) {
        let wiring = shape.wiring(6).unwrap();
        let statuses = vec![Status::POWER_UP; wiring.modules()];
        let script =
            Script { wiring, statuses, roll: 0.0, trace_events: Vec::new(), changes: Vec::new(), now: 0 };
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
        self.trace_events.push(TraceEvent { cycle: at, module, event: Event::TopologyChanged(module_type) });
    }

    fn receives(&mut self, module: usize, dock: Dock, data: Data, at: u64) {
        self.trace_events.push(TraceEvent { cycle: at, module, event: Event::HormoneReceived(dock, data) });
    }

    /// Something that happens now.
    fn happens(&self, change: Change) -> Happening {
        Happening { at: self.now, change }
    }

    /// A module takes up a letter, sends what it has to, and begins an action.
    fn steps(&mut self, observer: &mut Observer, module: usize, data: Data, action: Action, at: u64) {
        self.now = at;
        let taken = match module {
            0 => Event::HormoneGenerated(data),
            2 | 3 => Event::HormoneReceived(Back, data),
            _ => Event::HormoneReceived(Front, data),
        };
        let next = if data == A { B } else { A };
        let sent: &[(Dock, Data)] = match module {
            0 | 4 => &[(Back, data)],
            1 => &[(Left, next), (Right, next), (Back, next)],
            _ => &[],
        };
        let sent = sent.iter().map(|&(dock, data)| Event::HormoneSent(dock, data));
        for event in [taken].into_iter().chain(sent).chain([Event::ActionBegun(action)]) {
            self.trace_events.push(TraceEvent { cycle: at, module, event });
        }
        observer.look(self);
    }

    /// The trunk, head 0, branch 1, spine 4 and tail 5, beats: its head so many half Periods after power-up.
    fn trunk_beats(&mut self, observer: &mut Observer, beat: u64, at: u64) {
        for module in [0, 1] {
            self.steps(observer, module, letter(beat), Straight, at);
        }
        self.steps(observer, 4, letter(beat + 1), Straight, at);
        self.trace_events.push(TraceEvent {
            cycle: at,
            module: 5,
            event: Event::HormoneReceived(Front, letter(beat + 1)),
        });
    }

    /// Both legs step, the right one a millisecond later, and this is how they lift a foot and press it down.
    fn legs_step(&mut self, observer: &mut Observer, beat: u64, [swing, hold]: [Action; 2], at: u64) {
        let data = letter(beat + 1);
        let [left, right] = if data == A { [swing, hold] } else { [hold, swing] };
        self.steps(observer, 2, data, left, at);
        self.steps(observer, 3, data, right, at + MILLISECOND);
    }

    /// All walk, a beat in each half Period, the right leg a millisecond later.
    fn walk(&mut self, observer: &mut Observer, half_periods: std::ops::Range<u64>) {
        self.walk_by(observer, half_periods, ON_FEET);
    }

    /// As [`walk`](Self::walk), with legs that lift a foot and press it down like this.
    fn walk_by(&mut self, observer: &mut Observer, half_periods: std::ops::Range<u64>, legs: [Action; 2]) {
        for beat in half_periods {
            let at = beat * PERIOD / 2 + 20 * MILLISECOND;
            self.trunk_beats(observer, beat, at);
            self.legs_step(observer, beat, legs, at);
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

    fn start(&self) -> u64 {
        0
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

    fn take_trace_events(&mut self) -> Vec<TraceEvent> {
        std::mem::take(&mut self.trace_events)
    }

    fn take_changes(&mut self) -> Vec<Happening> {
        std::mem::take(&mut self.changes)
    }

    fn status(&self, module: usize) -> Option<Status> {
        self.statuses.get(module).copied()
    }

    fn acceleration(&self, _module: usize) -> [f64; 3] {
        let (y, z) = self.roll.to_radians().sin_cos();
        [0.0, y, z]
    }

    fn angles(&self, _module: usize) -> Angles {
        [0.0; 3]
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
    assert_eq!(observer.gait.violations(), 0);
    assert_eq!(observer.gait.skew_max, Some(MILLISECOND));
    assert_eq!(observer.gait.recovery_periods(), Some(0.521), "the first step of the right leg");
}

#[test]
fn a_letter_that_comes_twice_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    script.trunk_beats(&mut observer, 9, 9 * PERIOD / 2);
    script.steps(&mut observer, 2, letter(10), Holding, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations(), 0);
    script.steps(&mut observer, 2, letter(10), Holding, 9 * PERIOD / 2 + 10 * MILLISECOND);
    assert_eq!(observer.gait.violations(), 1);
}

#[test]
fn a_module_that_does_nothing_is_wrong_in_each_half_period() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    // Half Periods 9 to 12 pass without a beat: found when each is over.
    script.passes(&mut observer, 12 * PERIOD / 2 + 100 * MILLISECOND);
    // All hear nothing, the tail too.
    assert_eq!(observer.gait.violations(), 6 * 3);
}

#[test]
fn a_module_that_does_what_none_of_its_type_does_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    script.steps(&mut observer, 2, letter(10), Straight, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations(), 1);
    script.steps(&mut observer, 4, letter(10), Holding, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations(), 2, "nor does a spine what a leg does");
    script.steps(&mut observer, 3, letter(10), Holding, 9 * PERIOD / 2);
    assert_eq!(observer.gait.violations(), 3, "nor a right leg what a left one does");
}

#[test]
fn a_module_that_takes_a_letter_up_and_does_nothing_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    script.receives(2, Back, letter(10), 9 * PERIOD / 2);
    script.steps(&mut observer, 3, letter(10), Swing, 9 * PERIOD / 2);
    script.receives(2, Back, letter(11), 10 * PERIOD / 2);
    script.now = 10 * PERIOD / 2;
    observer.look(&mut script);
    assert_eq!(observer.gait.violations(), 1);
}

/// The branch sends to two of its three docks.
#[test]
fn what_is_not_sent_is_wrong() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let taken = Event::HormoneReceived(Front, letter(9));
    let sent = [Left, Back].map(|dock| Event::HormoneSent(dock, letter(10)));
    for event in [taken].into_iter().chain(sent).chain([Event::ActionBegun(Straight)]) {
        script.trace_events.push(TraceEvent { cycle: 9 * PERIOD / 2, module: 1, event });
    }
    script.receives(1, Front, letter(10), 10 * PERIOD / 2);
    script.now = 10 * PERIOD / 2;
    observer.look(&mut script);
    assert_eq!(observer.gait.violations(), 1);
}

#[test]
fn what_no_rule_sends_is_wrong() {
    for (module, dock, data, is_right) in [
        (1, Left, letter(10), true),
        (1, Left, letter(9), false),
        (1, Front, letter(10), false),
        (4, Back, letter(10), true),
        (4, Back, letter(9), false),
        (2, Front, letter(10), false),
        (0, Back, letter(9), true),
    ] {
        let (mut script, mut observer) = Script::discovered();
        script.walk(&mut observer, 1..10);
        script.trace_events.push(TraceEvent {
            cycle: script.now,
            module,
            event: Event::HormoneSent(dock, data),
        });
        observer.look(&mut script);
        assert_eq!(observer.gait.violations(), u64::from(!is_right), "{module} {dock:?} {data:?}");
    }
}

#[test]
fn legs_that_are_not_in_step_are_wrong() {
    let (mut script, mut observer) = Script::discovered();
    for beat in 1..10 {
        script.trunk_beats(&mut observer, beat, beat * PERIOD / 2);
        let data = letter(beat);
        let action = if data == A { Swing } else { Holding };
        script.steps(&mut observer, 2, data, action, beat * PERIOD / 2);
        script.steps(&mut observer, 3, letter(beat + 1), action, beat * PERIOD / 2 + MILLISECOND);
        script.passes(&mut observer, beat * PERIOD / 2 + 300 * MILLISECOND);
    }
    // From 1.3 s on: half Periods 3 to 9.
    assert_eq!(observer.gait.violations(), 7);
}

/// A ring that rolls. From 15 s on a second module may beat by its own clock. Where lines were bad until then
/// it has time to find out.
#[test]
fn a_ring_that_two_modules_lead_is_wrong() {
    for (second, was_lossy, is_right) in [(None, false, true), (Some(5), false, false), (Some(5), true, true)]
    {
        let (mut script, mut observer) = Script::of(Shape::Ring);
        let order = [GaitName::RollingTrack as u8 + 0xd0, 1, 255].to_vec();
        let at = Face { module: 0, dock: Dock::Up };
        observer.changed(&script.happens(Change::Command { at, payload: order }));
        for beat in 1..20 {
            if beat == 15 && was_lossy {
                for probability in [0.5, 0.0] {
                    observer.changed(&script.happens(Change::Loss { links: Links::All, probability }));
                }
            }
            script.now = beat * PERIOD;
            for place in 0..6 {
                let module = (2 + place) % 6;
                let data = [A, B, C][((beat + place as u64) % 3) as usize];
                let is_leader = module == 2 || beat >= 15 && second == Some(module);
                let taken = if is_leader {
                    Event::HormoneGenerated(data)
                } else {
                    Event::HormoneReceived(Front, data)
                };
                let sent = Event::HormoneSent(Back, data.later(1, 3));
                for event in [taken, sent, Event::ActionBegun(Roll)] {
                    script.trace_events.push(TraceEvent { cycle: script.now, module, event });
                }
            }
            observer.look(&mut script);
        }
        let found = observer.gait.first_violation().map(|violation| violation.wrong.to_string());
        let expected = (!is_right).then(|| "led a ring that another module led, too".to_owned());
        assert_eq!(found, expected, "{second:?} {was_lossy}");
    }
}

#[test]
fn what_is_wrong_soon_after_a_change_is_how_long_it_took() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let changed_at = 9 * PERIOD / 2;
    observer.gait.disturbed(&script.wiring, &[0], changed_at);
    script.trunk_beats(&mut observer, 9, changed_at + PERIOD / 4);
    script.legs_step(&mut observer, 9, ON_FEET, changed_at + PERIOD / 4);
    script.trunk_beats(&mut observer, 10, changed_at + 3 * PERIOD / 4);
    script.steps(&mut observer, 2, letter(11), Swing, changed_at + 3 * PERIOD / 4);
    script.steps(&mut observer, 3, letter(11), Straight, changed_at + 3 * PERIOD / 4);
    script.walk(&mut observer, 11..20);
    assert_eq!(observer.gait.violations(), 0);
    assert_eq!(observer.gait.recovery_periods(), Some(0.75));
}

/// A change at the tail gives no time to modules that it does not concern.
#[test]
fn what_a_change_does_not_concern_has_to_walk_on() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    observer
        .changed(&Happening { at: 9 * PERIOD / 2, change: Change::Reset { module: 5, mcus: Mcus::Both } });
    script.steps(&mut observer, 4, letter(10), Holding, 9 * PERIOD / 2 + MILLISECOND);
    assert_eq!(observer.gait.violations(), 0, "the tail's neighbour may be mistaken");
    script.steps(&mut observer, 2, letter(10), Straight, 9 * PERIOD / 2 + MILLISECOND);
    assert_eq!(observer.gait.violations(), 1, "not so a leg");
}

/// The head is reset again and again, before its first beat.
#[test]
fn changes_that_come_one_upon_the_other_give_no_more_than_three_times_the_time() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let first = 9 * PERIOD / 2;
    for number in 0..20 {
        let change = Change::Reset { module: 0, mcus: Mcus::Both };
        observer.changed(&Happening { at: first + number * PERIOD / 5, change });
    }
    // 3.9 s for the head.
    script.passes(&mut observer, first + 3_890 * MILLISECOND);
    assert_eq!(observer.gait.violations(), 0);
    script.passes(&mut observer, first + 3_910 * MILLISECOND);
    assert_eq!(observer.gait.violations(), 1);
}

/// An order for a short Period comes before the robot has had its time for a long one.
#[test]
fn a_change_gives_its_own_time_and_no_more_though_the_one_before_gave_longer() {
    let order = |period: u8, at: u64| {
        let at_tail = Face { module: 5, dock: Back };
        Happening { at, change: Change::Command { at: at_tail, payload: vec![0xd1, 1, period] } }
    };
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let first = 9 * PERIOD / 2;
    observer.changed(&order(80, first));
    observer.changed(&order(5, first + 2 * PERIOD));
    // 250 ms for the Period, 300 ms for discovery, 5 ms for each hop.
    script.passes(&mut observer, first + 2 * PERIOD + 540 * MILLISECOND);
    assert_eq!(observer.gait.violations(), 0);
    script.passes(&mut observer, first + 2 * PERIOD + 560 * MILLISECOND);
    assert!(observer.gait.violations() > 0);
}

/// A robot that is turned over steps on, with no beat left out, and within a Period the other way.
#[test]
fn feet_that_are_lifted_the_wrong_way_are_wrong_a_period_after_the_robot_was_turned() {
    for (roll, before, after) in
        [(180.0, ON_FEET, ON_BACK), (-151.0, ON_FEET, ON_BACK), (74.0, ON_BACK, ON_FEET)]
    {
        let turned_at = 9 * PERIOD / 2;
        let turned = |wrong_until| {
            let (mut script, mut observer) = Script::discovered();
            script.roll = if before == ON_FEET { 0.0 } else { 180.0 };
            script.walk_by(&mut observer, 1..9, before);
            script.roll = roll;
            observer.changed(&Happening { at: turned_at, change: Change::Roll(roll) });
            script.walk_by(&mut observer, 9..wrong_until, before);
            script.walk_by(&mut observer, wrong_until..20, after);
            (observer.gait.violations(), observer.gait.recovery_periods())
        };
        // Legs step 20 ms and 21 ms after each half Period begins; the first time 521 ms after power-up.
        assert_eq!(turned(9), (0, Some(0.521)), "the last wrong step was over 21 ms after that");
        assert_eq!(turned(10), (0, Some(0.521)), "they stepped once more");
        assert_eq!(turned(11), (0, Some(1.021)), "and again");
        assert_eq!(turned(12), (2, Some(1.521)), "too late, both");
        assert_eq!(turned(13).0, 4);
    }
}

#[test]
fn on_its_side_a_robot_may_lift_its_feet_either_way() {
    for roll in [97.0, -110.0, 129.0] {
        let (mut script, mut observer) = Script::discovered();
        script.roll = roll;
        script.walk_by(&mut observer, 1..9, ON_FEET);
        script.walk_by(&mut observer, 9..20, ON_BACK);
        assert_eq!(observer.gait.violations(), 0);
    }
}

#[test]
fn what_no_hormone_reaches_need_not_walk() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    // With no module in front and none behind, a branch is none any more, and has no rule: no module leads.
    let mut wiring = script.wiring.clone();
    wiring.kill(0).unwrap();
    wiring.kill(4).unwrap();
    observer.gait.disturbed(&wiring, &[], script.now);
    script.passes(&mut observer, 9 * PERIOD);
    assert_eq!((observer.gait.legs(), observer.gait.violations()), (0, 0));
    assert!(!observer.gait.is_led());
}

#[test]
fn a_dock_that_is_mute_counts_as_detached() {
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    let links = Links::From(Face { module: 1, dock: Right });
    let loss = |probability| Change::Loss { links, probability };
    let noise = |probability| Change::Noise { links, probability };
    let why = "the branch is none any more, and the leg at its right is cut off";
    for (change, legs) in
        [(loss(1.0), 1), (noise(1.0), 1), (loss(0.5), 1), (noise(0.5), 2), (noise(1.0), 1), (noise(0.0), 2)]
    {
        observer.changed(&script.happens(change.clone()));
        assert_eq!(observer.gait.legs(), legs, "{change}: {why}");
    }
}

#[test]
fn where_frames_are_lost_a_robot_has_more_time_to_begin_and_no_more_to_walk_on() {
    let links = Links::All;
    let lossy = Change::Loss { links, probability: 0.5 };
    // With this noise, too, a quarter of all rounds of a frame of seven bytes and an ACK of five come
    // through.
    let noisy = Change::Noise { links, probability: 1.0 - 0.25_f64.powf(1.0 / 12.0) };
    for change in [&lossy, &noisy] {
        let (mut script, mut observer) = Script::discovered();
        observer.changed(&script.happens(change.clone()));
        // Four tries: 1 s, and 1.2 s for discovery, and 20 ms for each hop, 60 ms to the tail.
        script.passes(&mut observer, 2_190 * MILLISECOND);
        assert_eq!(observer.gait.violations(), 0, "{change}");
        script.passes(&mut observer, 2_270 * MILLISECOND);
        assert_eq!(observer.gait.violations(), 6, "{change}");
    }

    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    observer.changed(&script.happens(lossy.clone()));
    script.passes(&mut observer, 10 * PERIOD / 2 + 100 * MILLISECOND);
    assert_eq!(observer.gait.violations(), 6);
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
    let sent =
        |module, dock, data, at| TraceEvent { cycle: at, module, event: Event::HormoneSent(dock, data) };
    let generated = TraceEvent { cycle: 1000, module: 0, event: Event::HormoneGenerated(A) };
    script.trace_events.extend([generated, sent(0, Back, A, 2000)]);
    script.receives(1, Dock::Front, A, 61_000);
    script.trace_events.extend([sent(1, Left, B, 62_000), sent(1, Back, B, 63_000)]);
    script.receives(2, Back, B, 131_000);
    observer.look(&mut script);
    let hops = &observer.hops;
    assert_eq!((hops.sent, hops.delivered, hops.lost(), hops.out_of_turn), (3, 2, 0, 0));
    assert_eq!(hops.latency(), Some((65_000.0, 70_000)));
    // A frame of 7 characters, 1822.9 us, and one transfer of 65 bits on the bus, 162.5 us.
    let over_wire = hops.latency_over_wire().unwrap();
    assert!((over_wire - 65_000.0 / 31_766.0).abs() < 1e-6, "{over_wire}");

    // The next one overtakes the one to the tail, which is lost; the leg's comes twice.
    script.trace_events.push(sent(1, Back, A, 200_000));
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
    // The tail comes off: its events before that are judged as it was wired then, and after it no module
    // sends to it.
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

/// Its joints go on by an action that it does not end, and it tells of nothing.
#[test]
fn a_module_that_was_ordered_to_stop_and_does_not_rest_is_wrong() {
    for (action, is_right) in [(Action::Rest, true), (Swing, false)] {
        let (mut script, mut observer) = Script::discovered();
        script.walk(&mut observer, 1..9);
        script.statuses[2].action = action;
        let change = Change::Command { at: Face { module: 5, dock: Back }, payload: vec![0xd0, 1, 255] };
        observer.changed(&Happening { at: 9 * PERIOD / 2, change });
        script.passes(&mut observer, 5 * PERIOD);
        assert_eq!(observer.gait.violations(), 0);
        script.passes(&mut observer, 9 * PERIOD);
        assert_eq!(observer.gait.violations() == 0, is_right, "{action:?}");
    }
}

/// Within the time that a change gives, at power-up and after each order.
#[test]
fn a_robot_that_was_ordered_to_walk_otherwise_is_judged_by_the_rules_of_that_gait() {
    let order = |gait: u8, at: u64| {
        let change =
            Change::Command { at: Face { module: 5, dock: Back }, payload: vec![0xd0 | gait, 1, 255] };
        Happening { at, change }
    };
    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    observer.changed(&order(2, 9 * PERIOD / 2));
    assert_eq!(observer.gait.legs(), 0, "for which that gait has no rules");
    script.walk(&mut observer, 9..11);
    assert_eq!(observer.gait.violations(), 0);
    script.walk(&mut observer, 13..14);
    assert!(observer.gait.violations() > 0, "nobody follows the order");

    let (mut script, mut observer) = Script::discovered();
    script.walk(&mut observer, 1..9);
    observer.changed(&order(1, 9 * PERIOD / 2));
    script.steps(&mut observer, 2, letter(10), Straight, 9 * PERIOD / 2 + MILLISECOND);
    assert_eq!(observer.gait.violations(), 1, "an order to go on gives no time");
}
