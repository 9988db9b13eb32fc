use core::num::NonZeroU8;

use super::*;
use crate::action::Posture;
use crate::data::Data;
use crate::election::Token;
use crate::gait::{GAITS, GaitName};
use crate::order::{Course, Order, Steer, What};
use crate::pace::Pace;
use crate::period::Period;
use crate::sense::Sense::UpsideDown;
use crate::sense::{LASTS, between_readings};
use crate::standing::{STOP, Standing};
use Action::{Holding, HoldingOver, Rest, Straight, Swing, SwingOver};
use Data::{A, B};
use Dock::{Back, Down, Front, Left, Right, Up};

const ALONE: Neighbours = [None; 6];
const HEAD: Neighbours = [None, Some(Front), None, None, None, None];
const TAIL: Neighbours = [Some(Back), None, None, None, None, None];
const LEFT_LEG: Neighbours = [None, Some(Left), None, None, None, None];
const RIGHT_LEG: Neighbours = [None, Some(Right), None, None, None, None];
const SPINE: Neighbours = [Some(Back), Some(Front), None, None, None, None];
const BRANCH: Neighbours = [Some(Back), Some(Front), Some(Back), Some(Back), None, None];
/// A spine with one leg, and something on top.
const OTHER: Neighbours = [Some(Back), Some(Front), None, Some(Back), Some(Down), None];

const BEAT: u16 = 500;

const TO_THE_LEFT: Steer = Steer { course: Course::Left, lifetime: NonZeroU8::new(40).unwrap(), held: 0 };

fn module(neighbours: &Neighbours) -> Controller {
    let mut controller = Controller::new(GaitName::Centipede.gait(), 0, 0);
    let _ = attach(&mut controller, neighbours, 0);
    controller
}

/// A module finds these neighbours, which know how the robot walks.
fn attach(controller: &mut Controller, neighbours: &Neighbours, now: u16) -> Response {
    let response = controller.topology(neighbours, now);
    connected(neighbours).iter().for_each(|dock| knows(controller, dock, now));
    response
}

/// The neighbour at `dock` says that it knows the standing order.
fn knows(controller: &mut Controller, dock: Dock, now: u16) {
    let stands = controller.ledger.standing();
    controller.ledger.hear(dock, stands, true, now);
}

/// The pace of the first beat, or of the second.
fn pace(data: Data) -> Pace {
    Pace { name: 1, data, is_made_good: false, number: data as u8, rhythm: 0x10, lifetime: None }
}

/// The centipede's pace of a leader's beat: A and B in turn.
fn nth(beat: u16) -> Hormone {
    let data = if beat.is_multiple_of(2) { A } else { B };
    Hormone::Pace(Pace { number: (beat % 8) as u8, ..pace(data) })
}

/// The centipede's pace.
fn cp(data: Data) -> Hormone {
    Hormone::Pace(pace(data))
}

/// The data that leaves, and its docks.
fn sent(response: Response) -> Option<(Data, DockSet)> {
    response.send.map(|outgoing| (pace_of(outgoing).data, outgoing.docks))
}

fn pace_of(outgoing: Outgoing) -> Pace {
    match outgoing.hormone {
        Hormone::Pace(pace) => pace,
        other => panic!("{other:?} is no pace"),
    }
}

fn by(data: Data, docks: &[Dock]) -> Option<(Data, DockSet)> {
    Some((data, DockSet::of(docks)))
}

#[test]
fn each_type_answers_a_and_b_as_the_text_says() {
    let body = &[Left, Right, Back];
    let rows = [
        (SPINE, [(Some(Straight), by(A, &[Back])), (Some(Straight), by(B, &[Back]))]),
        (BRANCH, [(Some(Straight), by(B, body)), (Some(Straight), by(A, body))]),
        (LEFT_LEG, [(Some(Swing), None), (Some(Holding), None)]),
        (RIGHT_LEG, [(Some(Holding), None), (Some(Swing), None)]),
        (TAIL, [(None, None), (None, None)]),
    ];
    for (neighbours, answers) in rows {
        let mut controller = module(&neighbours);
        for (now, (data, (action, send))) in (1..).zip([A, B].into_iter().zip(answers)) {
            let response = controller.received(Front, cp(data), now * BEAT);
            assert_eq!((response.action, sent(response)), (action, send));
            assert_eq!(response.event, Some(Event::HormoneReceived(Front, data)));
            assert_eq!(controller.status().action, action.unwrap_or(Rest));
            assert_eq!(controller.status().hormone(), Some(data));
        }
        assert_eq!(controller.status().hormones_received, 2);
    }
}

#[test]
fn the_head_beats_a_at_0_and_b_at_half_a_period() {
    let mut head = module(&HEAD);
    for beat in 1..=200_u16 {
        assert_eq!(head.next_due((beat - 1).wrapping_mul(BEAT)), Some(BEAT));
        let now = beat.wrapping_mul(BEAT);
        assert_eq!(head.timer(now.wrapping_sub(1)), None);
        let data = if beat.is_multiple_of(2) { A } else { B };
        let response = head.timer(now).unwrap();
        assert_eq!((response.action, sent(response)), (Some(Straight), by(data, &[Back])));
        assert_eq!(response.event, Some(Event::HormoneGenerated(data)));
        assert_eq!(head.timer(now), None);
        assert_eq!(head.status().hormone(), Some(data));
    }
}

#[test]
fn a_head_listens_to_nobody() {
    let mut head = module(&HEAD);
    let response = head.received(Back, cp(A), 10);
    assert_eq!((response.event, response.send), (Some(Event::HormoneDropped(Back)), None));
    assert_eq!(head.status().dropped, 1);
}

#[test]
fn who_has_heard_no_hormone_waits_for_no_timer() {
    for neighbours in [TAIL, LEFT_LEG, RIGHT_LEG, SPINE, BRANCH, OTHER] {
        let mut controller = module(&neighbours);
        assert_eq!(controller.next_due(0), None);
        assert_eq!(controller.timer(BEAT), None);
    }
}

#[test]
fn a_new_head_does_not_take_up_a_beat_from_before() {
    let mut controller = module(&SPINE);
    assert_eq!(sent(attach(&mut controller, &HEAD, 30_700)), None);
    assert_eq!(controller.timer(30_700), None);
    assert_eq!(controller.next_due(30_700), Some(300));
    assert_eq!(sent(controller.timer(31_000).unwrap()), by(A, &[Back]));
}

#[test]
fn a_head_keeps_its_beat_through_a_flicker() {
    let mut controller = module(&HEAD);
    let _ = controller.timer(BEAT);
    let _ = attach(&mut controller, &[None; 6], 510);
    let _ = attach(&mut controller, &HEAD, 800);
    assert_eq!(sent(controller.timer(1000).unwrap()), by(A, &[Back]));
}

#[test]
fn a_head_told_that_it_still_is_one_misses_no_beat() {
    let mut controller = module(&HEAD);
    let _ = attach(&mut controller, &HEAD, BEAT);
    assert_eq!(sent(controller.timer(BEAT).unwrap()), by(B, &[Back]));
}

#[test]
fn the_unknown_keeps_still_and_passes_on_to_all_others() {
    for (from, others) in [(Front, [Back, Right, Up]), (Right, [Front, Back, Up])] {
        let mut controller = module(&OTHER);
        let response = controller.received(from, cp(B), 0);
        assert_eq!((response.action, sent(response)), (None, by(B, &others)));
        assert_eq!(controller.status().action, Rest);
    }
    let mut alone = module(&[None; 6]);
    assert_eq!(sent(alone.received(Front, cp(A), 0)), None);
}

#[test]
fn no_hormone_goes_back_to_where_it_came_from() {
    let mut spine = module(&SPINE);
    assert_eq!(sent(spine.received(Back, cp(A), 0)), None);
    for beat in [1, 2, 3] {
        assert_eq!(spine.timer(beat * BEAT + 12).unwrap().send, None, "nor what is made good for it");
        knows(&mut spine, Back, beat * BEAT + 12);
    }
    assert_eq!(sent(spine.received(Front, cp(A), 1_600)), by(A, &[Back]));
    let mut branch = module(&BRANCH);
    assert_eq!(sent(branch.received(Left, cp(A), 0)), by(B, &[Right, Back]));
}

#[test]
fn a_hormone_that_does_not_come_is_made_good_and_dropped_when_it_comes_late() {
    let mut branch = module(&BRANCH);
    let first = branch.received(Front, cp(A), 0);
    assert_eq!(branch.timer(BEAT + 11), None);
    let response = branch.timer(BEAT + 12).unwrap();
    assert_eq!(sent(response), by(A, &[Left, Right, Back]));
    assert_eq!(response.event, Some(Event::MadeGood(B)));
    assert_eq!(pace_of(response.send.unwrap()).rhythm, pace_of(first.send.unwrap()).rhythm);
    assert_eq!(branch.timer(BEAT + 12), None);
    assert_eq!(sent(branch.received(Front, cp(B), BEAT + 140)), None);
    assert_eq!((branch.status().made_good, branch.status().dropped), (1, 1));
    assert_eq!(sent(branch.received(Front, nth(2), 2 * BEAT)), by(B, &[Left, Right, Back]));
}

#[test]
fn what_is_sent_says_whether_it_was_made_good_here_or_on_the_way_here() {
    let says = |response: Response| pace_of(response.send.unwrap()).is_made_good;
    assert!(!says(module(&HEAD).timer(BEAT).unwrap()), "it leads");
    let mut spine = module(&SPINE);
    assert!(!says(spine.received(Front, nth(0), 0)));
    assert!(says(spine.timer(BEAT + 12).unwrap()));
    assert!(!says(spine.received(Front, nth(2), 2 * BEAT)));
    let made_good = Pace { is_made_good: true, number: 3, ..pace(B) };
    assert!(says(spine.received(Front, Hormone::Pace(made_good), 3 * BEAT)));
}

#[test]
fn a_letter_that_the_gait_does_not_have_is_dropped() {
    for (gait, data, action) in
        [(1, B, Some(Straight)), (1, Data::C, None), (2, Data::E, Some(Action::Wave)), (2, Data::F, None)]
    {
        let mut spine = module(&SPINE);
        let response = spine.received(Front, Hormone::Pace(Pace { name: gait, ..pace(data) }), 10);
        assert_eq!(response.action, action, "{gait} {data:?}");
        assert_eq!(spine.status().dropped, u16::from(action.is_none()));
    }
}

#[test]
fn after_eight_beats_without_a_hormone_a_leg_rests() {
    let mut leg = module(&LEFT_LEG);
    let _ = leg.received(Back, cp(A), 0);
    let mut now = 0;
    let mut actions = Vec::new();
    while let Some(wait) = leg.next_due(now) {
        now += wait;
        actions.extend(leg.timer(now).and_then(|response| response.action));
        knows(&mut leg, Back, now);
    }
    assert_eq!(actions, [Holding, Swing, Holding, Swing, Holding, Swing, Holding, Rest]);
    assert_eq!(leg.status().action, Rest);
}

/// Another leg may be attached there by now, or another branch, and one of both was ordered to stop.
#[test]
fn after_two_beats_without_a_hormone_a_leg_asks_where_they_came_from_what_stands() {
    let mut leg = module(&LEFT_LEG);
    let stands = leg.ledger.standing();
    let _ = leg.received(Back, cp(A), 0);
    assert_eq!(told(&mut leg, BEAT + 12), [], "one may be late");
    let _ = leg.received(Back, nth(2), 2 * BEAT);
    assert_eq!(told(&mut leg, 3 * BEAT + 12), [], "not in a row");
    assert_eq!(told(&mut leg, 4 * BEAT + 12), [(stands, false, DockSet::of(&[Back]))]);
    let halt = Standing::none(0).next(STOP, Period::OWN).unwrap();
    assert_eq!(leg.received(Back, Hormone::Standing(halt, false), 4 * BEAT + 20).action, Some(Rest));
    assert_eq!(leg.next_due(4 * BEAT + 20), Some(0), "it says that it knows");
}

#[test]
fn another_rhythm_is_taken_up_once_the_present_one_is_silent() {
    let mut leg = module(&LEFT_LEG);
    let other = |data| Hormone::Pace(Pace { rhythm: 0x11, ..pace(data) });
    assert_eq!(leg.received(Back, cp(A), 0).action, Some(Swing));
    assert_eq!(leg.received(Up, other(A), 200).action, None, "the present one still beats");
    assert_eq!(leg.received(Back, cp(B), BEAT).action, Some(Holding));
    assert_eq!(leg.timer(2 * BEAT + 12).unwrap().action, Some(Swing));
    for (beat, action) in [(3, Holding), (4, Swing)] {
        let data = if beat == 3 { B } else { A };
        assert_eq!(leg.received(Up, other(data), beat * BEAT - 400).action, None, "it may be lost, or late");
        assert_eq!(leg.timer(beat * BEAT + 12).unwrap().action, Some(action));
        knows(&mut leg, Back, beat * BEAT + 12);
    }
    assert_eq!(leg.received(Up, other(B), 2_100).action, Some(Holding));
    let third = Hormone::Pace(Pace { number: 2, rhythm: 0x11, ..pace(A) });
    assert_eq!(leg.received(Up, third, 2_600).action, Some(Swing));
    assert_eq!(leg.received(Up, cp(A), 2_725).action, Some(Swing), "by the same dock it is at once");
}

#[test]
fn behind_a_module_that_led_for_a_moment_the_rhythm_is_another_whatever_it_follows_and_back() {
    // As it is on the wire.
    let rhythm_of = |response: Response| pace_of(response.send.unwrap()).rhythm % RHYTHMS;
    for rhythm in 0..RHYTHMS {
        let mut controller = module(&HEAD);
        let led = rhythm_of(controller.timer(BEAT).unwrap());
        let _ = attach(&mut controller, &SPINE, 600);
        let one = |data| Hormone::Pace(Pace { rhythm, ..pace(data) });
        let followed = rhythm_of(controller.received(Front, one(A), 700));
        assert_ne!(followed, led, "{rhythm}");
        assert_eq!(rhythm_of(controller.received(Front, one(B), 700 + BEAT)), followed, "{rhythm}");
        let _ = attach(&mut controller, &HEAD, 1_300);
        assert_ne!(rhythm_of(controller.timer(2_000).unwrap()), followed, "{rhythm}");
    }
}

#[test]
fn behind_a_module_that_changed_its_type_the_rhythm_is_another() {
    let mut controller = module(&SPINE);
    let before = pace_of(controller.received(Front, cp(A), 0).send.unwrap()).rhythm;
    let _ = attach(&mut controller, &BRANCH, 100);
    assert_ne!(pace_of(controller.received(Front, cp(B), BEAT).send.unwrap()).rhythm, before);
}

#[test]
fn another_type_rests_until_told() {
    let mut controller = module(&LEFT_LEG);
    assert_eq!(controller.received(Back, cp(A), 0).action, Some(Swing));
    assert_eq!(attach(&mut controller, &LEFT_LEG, 10).action, None);
    assert_eq!(attach(&mut controller, &RIGHT_LEG, 20).action, Some(Rest));
    assert_eq!(controller.received(Back, cp(B), BEAT).action, Some(Swing));
}

#[test]
fn a_module_walks_the_gait_of_the_hormone_that_comes() {
    let mut controller = module(&SPINE);
    let wave = Pace { name: GaitName::Caterpillar as u8, rhythm: 0, ..pace(Data::E) };
    let response = controller.received(Front, Hormone::Pace(wave), 10);
    assert_eq!((response.action, sent(response)), (Some(Action::Wave), by(A, &[Back])));
    assert_eq!(controller.status().gait, GaitName::Caterpillar as u8);
    let unknown = Pace { name: 11, ..wave };
    assert_eq!(controller.received(Front, Hormone::Pace(unknown), 900).action, None);
    assert_eq!(controller.status().dropped, 1);
}

#[test]
fn a_motion_is_spread_over_the_beats_of_its_rule() {
    let mut leg = module(&LEFT_LEG);
    assert_eq!(leg.posture(0), None);
    let _ = leg.received(Back, cp(A), 0);
    let swing: Vec<Posture> = Swing.motion().iter().collect();
    let at = [0, 124, 125, 250, 499, 511].map(|now| leg.posture(now).unwrap());
    assert_eq!(at, [0, 0, 1, 2, 3, 3].map(|step| swing[step]));

    let mut spine = module(&SPINE);
    let _ = spine.received(Front, Hormone::Pace(Pace { name: 2, ..pace(B) }), 0);
    let wave: Vec<Posture> = Action::Wave.motion().iter().collect();
    let at = [0, 50, 199].map(|now| spine.posture(now).unwrap());
    assert_eq!(at, [4, 5, 7].map(|step| wave[step]), "B is the second of five beats, four steps each");
}

#[test]
fn the_next_posture_is_told_until_the_last_one() {
    let mut leg = module(&LEFT_LEG);
    assert_eq!(leg.until_posture(0), None, "it rests");
    let _ = leg.received(Back, cp(A), 0);
    let waits = [0, 100, 130, 374, 375, 511].map(|now| leg.until_posture(now));
    assert_eq!(waits, [Some(125), Some(25), Some(120), Some(1), None, None]);
}

#[test]
fn a_right_leg_is_a_left_one_in_a_mirror() {
    let (mut left, mut right) = (module(&LEFT_LEG), module(&RIGHT_LEG));
    let _ = (left.received(Back, cp(A), 0), right.received(Back, cp(B), 0));
    for now in [0, 499] {
        let (left, right) = (left.posture(now).unwrap(), right.posture(now).unwrap());
        assert_eq!(right, Posture { roll: -left.roll, ..left });
        assert_ne!(left.roll, 0);
    }
}

#[test]
fn a_module_alone_leads_itself_and_rolls_to_turn() {
    let mut single = Controller::new(GaitName::Single.gait(), 0, 0);
    let _ = attach(&mut single, &HEAD, 0);
    assert!(!single.is_leader(), "it is not alone");
    let _ = attach(&mut single, &ALONE, 0);
    assert!(single.is_leader());
    let response = single.timer(400).unwrap();
    assert_eq!((response.action, response.send), (Some(Action::Inch), None));
    let inch = Action::Inch.motion().get(4).unwrap();
    let rolls = [Course::Ahead, Course::Left, Course::Right].map(|course| {
        let order = Order { what: What::Steer(Steer { course, ..TO_THE_LEFT }), serial: course as u8 };
        let _ = single.order(None, order, 400);
        let posture = single.posture(400).unwrap();
        assert_eq!(Posture { roll: inch.roll, ..posture }, inch);
        posture.roll
    });
    assert_eq!(rolls, [0, inch.roll, -inch.roll]);
}

/// The answers to a beat's question: none, or one from a leg on its feet, or on its back.
const ANSWERS: [Option<i16>; 3] = [None, Some(870), Some(-870)];

/// All rows of answers to so many beats.
fn rows(beats: u32) -> impl Iterator<Item = Vec<Option<i16>>> {
    (0..3_usize.pow(beats))
        .map(move |row| (0..beats).map(|beat| ANSWERS[row / 3_usize.pow(beat) % 3]).collect())
}

#[test]
fn a_leg_that_lies_on_its_back_lifts_the_other_way_until_it_does_not_or_nobody_says_so() {
    for (leg, action_to) in [(LEFT_LEG, [Swing, Holding]), (RIGHT_LEG, [Holding, Swing])] {
        for answers in rows(9) {
            let mut controller = module(&leg);
            // Beats since an answer last said that it lies on its back; `None` once one said that it does
            // not.
            let mut said: Option<usize> = None;
            for (beat, &answer) in answers.iter().enumerate() {
                let beat_of = beat as u16;
                let action = controller.received(Back, nth(beat_of), beat_of * BEAT).action.unwrap();
                let holds = said.is_some_and(|said| beat - said <= usize::from(LASTS));
                let expected = match action_to[beat % 2] {
                    Swing if holds => SwingOver,
                    Holding if holds => HoldingOver,
                    action => action,
                };
                assert_eq!(action, expected, "beat {beat} of {answers:?}");
                let now = beat_of * BEAT;
                let between = between_readings(NonZeroU16::new(BEAT).unwrap());
                for reading in 0..8 {
                    let now = now + reading * between;
                    assert!(controller.asks(now).eq([UpsideDown]));
                    assert_eq!(controller.next_ask(now), Some(between));
                    assert!(controller.asks(now + 1).eq([]), "once");
                }
                if let Some(value) = answer {
                    controller.read(UpsideDown, value);
                    said = (value < 0).then_some(beat);
                }
            }
        }
    }
}

#[test]
fn who_has_no_rule_with_a_condition_asks_nothing() {
    let types = [HEAD, TAIL, LEFT_LEG, RIGHT_LEG, SPINE, BRANCH, OTHER];
    for gait in GAITS.iter() {
        let has_condition =
            |name| [GaitName::Centipede, GaitName::FourLegs, GaitName::SixLegs].contains(&name);
        let has_condition = GaitName::from_byte(gait.name).is_some_and(has_condition);
        for neighbours in types {
            let mut controller = Controller::new(gait, 0, 0);
            let _ = attach(&mut controller, &neighbours, 0);
            assert_eq!(controller.next_ask(0), None, "no beat yet");
            assert!(controller.asks(0).eq([]));
            let _ = controller.received(Front, Hormone::Pace(Pace { name: gait.name, ..pace(A) }), 10);
            let is_leg = [LEFT_LEG, RIGHT_LEG].contains(&neighbours);
            let asks = is_leg && has_condition;
            assert_eq!(controller.asks(10).eq([UpsideDown]), asks, "{}", gait.name);
            assert_eq!(controller.next_ask(10).is_some(), asks, "nobody is woken for nothing");
        }
    }
}

#[test]
fn what_was_sensed_is_forgotten_by_who_rests() {
    let mut leg = module(&LEFT_LEG);
    leg.read(UpsideDown, -1000);
    let _ = attach(&mut leg, &RIGHT_LEG, 10);
    assert_eq!(leg.next_ask(10), None, "nor is it asked any more");
    assert_eq!(leg.received(Back, cp(B), 20).action, Some(Swing));
}

#[test]
fn a_beat_made_good_asks_and_obeys_too() {
    let mut leg = module(&LEFT_LEG);
    let _ = leg.received(Back, cp(B), 0);
    leg.read(UpsideDown, -1000);
    assert!(leg.asks(0).eq([UpsideDown]));
    assert_eq!(leg.timer(BEAT + 12).unwrap().action, Some(SwingOver));
    assert!(leg.asks(BEAT + 12).eq([UpsideDown]));
}

#[test]
fn a_leg_whose_gait_has_no_such_rule_any_more_does_not_ask_again() {
    let mut leg = module(&LEFT_LEG);
    let _ = leg.received(Back, cp(B), 0);
    let late = BEAT - 10;
    assert!(leg.asks(late).eq([UpsideDown]));
    let rolling = GaitName::RollingTrack as u8;
    let _ = leg.received(Back, Hormone::Pace(Pace { name: rolling, ..pace(A) }), BEAT);
    assert_eq!(leg.status().gait, rolling);
    assert!(leg.asks(BEAT).eq([]));
    assert_eq!(leg.next_ask(BEAT), None, "it is not woken without end");
}

#[test]
fn the_status_shows_and_counts() {
    let mut controller = Controller::new(GaitName::Centipede.gait(), 0, 0);
    assert_eq!(*controller.status(), Status { gait: 1, ..Status::POWER_UP });
    let _ = attach(&mut controller, &LEFT_LEG, 0);
    for beat in [0, 1, 2, 2] {
        let _ = controller.received(Back, nth(beat), beat * BEAT);
    }
    let _ = controller.timer(3 * BEAT + 12);
    controller.malformed();
    controller.malformed();
    controller.sent();
    controller.unsent();
    let seen = Status {
        hormones_received: 4,
        hormones_sent: 1,
        topology_changes: 1,
        malformed: 2,
        hormones_unsent: 1,
        made_good: 1,
        dropped: 1,
        neighbours: to_bytes(&LEFT_LEG),
        module_type: ModuleType::LeftLeg,
        hormone: A as u8,
        action: Holding,
        gait: 1,
    };
    assert_eq!(*controller.status(), seen);
}

#[test]
fn an_order_goes_to_all_others_once_and_legs_of_that_side_step_back() {
    let steer = |lifetime| What::Steer(Steer { lifetime: NonZeroU8::new(lifetime).unwrap(), ..TO_THE_LEFT });
    let left = Order { what: steer(40), serial: 9 };
    let mut branch = module(&BRANCH);
    let response = branch.received(Left, Hormone::Order(left), 10);
    let on = Order { what: steer(39), ..left };
    let docks = DockSet::of(&[Front, Back, Right]);
    assert_eq!(response.send, Some(Outgoing { hormone: Hormone::Order(on), docks }));
    assert_eq!(branch.received(Front, Hormone::Order(left), 12).send, None);

    let (mut left_leg, mut right_leg) = (module(&LEFT_LEG), module(&RIGHT_LEG));
    let hips = |left_leg: &mut Controller, right_leg: &mut Controller, now| {
        let _ = (left_leg.received(Back, cp(A), now), right_leg.received(Back, cp(B), now));
        [left_leg.posture(now).unwrap().motor2, right_leg.posture(now).unwrap().motor2]
    };
    assert_eq!(hips(&mut left_leg, &mut right_leg, 0), [-18, -18]);
    for leg in [&mut left_leg, &mut right_leg] {
        let _ = leg.received(Back, Hormone::Order(left), 20);
    }
    assert_eq!([left_leg.posture(20).unwrap().motor2, right_leg.posture(20).unwrap().motor2], [9, -18]);
    for leg in [&mut left_leg, &mut right_leg] {
        assert!(leg.timer(20 + crate::order::HOLDS).is_some(), "the beat");
    }
    assert_eq!(hips(&mut left_leg, &mut right_leg, 2_500), [-18, -18], "the order holds no longer");
}

#[test]
fn a_neighbour_that_starts_while_the_robot_turns_is_told_the_course() {
    let left = Order { what: What::Steer(TO_THE_LEFT), serial: 9 };
    let mut spine = module(&SPINE);
    let _ = spine.received(Up, Hormone::Order(left), 10);
    let told = |spine: &mut Controller, now| {
        let sent = core::iter::from_fn(|| spine.timer(now)).filter_map(|response| response.send);
        let order = |sent: Outgoing| match sent.hormone {
            Hormone::Order(order) => Some((order, sent.docks)),
            _ => None,
        };
        sent.filter_map(order).collect::<Vec<_>>()
    };
    assert_eq!(told(&mut spine, 20), []);
    // A neighbour that is attached.
    let _ = (spine.topology(&HEAD, 100), spine.topology(&SPINE, 100));
    let [(order, docks)] = told(&mut spine, 100)[..] else { panic!("it is told once") };
    assert_eq!(docks, DockSet::of(&[Front]));
    assert!(!spine.ledger.hear(Front, spine.ledger.standing(), true, 101), "it knows");
    let mut started = module(&LEFT_LEG);
    let _ = started.received(Back, Hormone::Order(order), 102);
    assert_eq!(started.course(), Course::Left);
    // A neighbour that was reset without its absence being noticed.
    let _ = spine.received(Back, standing(0, GaitName::Centipede), 200);
    assert_eq!(told(&mut spine, 200), [(order, DockSet::of(&[Back]))]);
    let now = 10 + crate::order::HOLDS;
    let _ = spine.received(Back, standing(0, GaitName::Centipede), now);
    assert_eq!(told(&mut spine, now), [], "it holds no longer");
}

/// An order to walk by a gait, in its own Period.
fn walk(gait: u8, serial: u8) -> Order {
    Order { what: What::Walk(gait, Period::OWN), serial }
}

fn standing(number: u16, gait: GaitName) -> Hormone {
    Hormone::Standing(Standing { number, ..Standing::none(gait as u8) }, false)
}

/// What a module tells its neighbours at `now`: the standing order, whether they are known to know it, and
/// whom.
fn told(controller: &mut Controller, now: u16) -> Vec<(Standing, bool, DockSet)> {
    let mut told = Vec::new();
    while let Some(response) = controller.timer(now) {
        if let Some(Outgoing { hormone: Hormone::Standing(standing, knows), docks }) = response.send {
            told.push((standing, knows, docks));
        }
    }
    told
}

#[test]
fn who_is_ordered_to_walk_by_another_gait_rests_until_it_comes() {
    let mut leg = module(&LEFT_LEG);
    let _ = leg.received(Back, cp(A), 0);
    let _ = leg.received(Back, standing(0, GaitName::Centipede), 0);
    let response = leg.received(Up, Hormone::Order(walk(GaitName::FourLegs as u8, 0)), 10);
    assert_eq!(response.action, Some(Rest));
    let now_stands = Standing::none(0).next(GaitName::FourLegs as u8, Period::OWN).unwrap();
    assert_eq!(told(&mut leg, 10), [(now_stands, false, DockSet::of(&[Back]))]);
    assert_eq!(leg.received(Back, cp(B), BEAT).action, None, "whoever walks as before");
    assert_eq!(told(&mut leg, BEAT), [(now_stands, false, DockSet::of(&[Back]))], "is told");
    assert_eq!(leg.received(Up, Hormone::Order(walk(11, 1)), BEAT).action, Some(Rest));
    assert_eq!((leg.status().gait, leg.status().dropped), (GaitName::FourLegs as u8, 2));
    let mut head = module(&HEAD);
    let _ = head.order(None, walk(GaitName::FourLegs as u8, 0), 10);
    assert_eq!(told(&mut head, 10).len(), 1);
    assert!(!head.ledger.hear(Back, head.ledger.standing(), true, 20), "it knows");
    assert_eq!(head.timer(10 + GaitName::FourLegs.gait().beat.get()).unwrap().action, Some(Straight));
}

#[test]
fn a_head_that_was_reset_learns_how_the_robot_walks_before_it_beats() {
    let mut head = Controller::new(GaitName::Centipede.gait(), 0, 0);
    let _ = head.topology(&HEAD, 0);
    assert_eq!(told(&mut head, 0), [(Standing::none(1), false, DockSet::of(&[Back]))], "it asks");
    assert_eq!(head.received(Back, standing(7, GaitName::Caterpillar), 3).action, Some(Rest));
    let stands = Standing { number: 7, ..Standing::none(GaitName::Caterpillar as u8) };
    assert_eq!(told(&mut head, 3), [(stands, true, DockSet::of(&[Back]))], "and says that it knows");
    let response = head.timer(3 + GaitName::Caterpillar.gait().beat.get()).unwrap();
    assert_eq!(pace_of(response.send.unwrap()).name, GaitName::Caterpillar as u8);
}

/// It may have come there from another robot before anybody missed it.
#[test]
fn a_neighbour_that_is_attached_by_another_dock_than_the_one_before_is_told_what_stands() {
    let mut head = module(&HEAD);
    assert_eq!(told(&mut head, 10), []);
    let _ = head.topology(&RIGHT_LEG, 10);
    assert_eq!(told(&mut head, 10), [(Standing::none(1), false, DockSet::of(&[Back]))]);
    knows(&mut head, Back, 20);
    let _ = head.topology(&RIGHT_LEG, 30);
    assert_eq!(told(&mut head, 30), [], "it is the same");
}

#[test]
fn what_was_kept_stands_where_nothing_was_given_since_and_what_is_given_is_to_be_kept() {
    let caterpillar = Standing { number: 7, ..Standing::none(GaitName::Caterpillar as u8) };
    let mut head = module(&HEAD);
    assert_eq!(head.recall(caterpillar, 3).action, Some(Rest));
    assert_eq!(told(&mut head, 3), [(caterpillar, false, DockSet::of(&[Back]))]);
    assert_eq!((head.status().gait, head.to_keep()), (GaitName::Caterpillar as u8, None), "it is kept");
    let _ = head.received(Back, standing(6, GaitName::FourLegs), 10);
    assert_eq!(head.status().gait, GaitName::Caterpillar as u8, "an older one");
    // An order that was given since wins, whatever its number.
    let given = Standing::none(0).next(GaitName::FourLegs as u8, Period::OWN).unwrap();
    let _ = head.received(Back, Hormone::Standing(given, false), 20);
    assert_eq!(head.status().gait, GaitName::FourLegs as u8);
    assert_eq!(head.recall(caterpillar, 30), NOTHING, "it comes late");
    assert_eq!(head.to_keep().and_then(Standing::from_record), Some(Standing { number: 1, ..given }));
    head.kept();
    assert_eq!(head.to_keep(), None);
}

#[test]
fn an_order_sets_the_period_and_stops_the_robot() {
    let order =
        |gait, serial, period| Order { what: What::Walk(gait, Period::from_byte(period).unwrap()), serial };
    let (mut head, mut leg) = (module(&HEAD), module(&LEFT_LEG));
    let _ = leg.received(Back, cp(A), 0);
    let _ = head.order(None, order(1, 0, 80), 10);
    assert_eq!(told(&mut head, 10).len(), 1);
    let stands = head.ledger.standing();
    head.ledger.hear(Back, stands, true, 11);
    assert_eq!(head.timer(10 + 1_999), None);
    assert_eq!(head.timer(10 + 2_000).unwrap().action, Some(Straight), "half of 4 s");
    let _ = head.order(None, walk(STOP, 1), 2_020);
    let _ = leg.order(None, walk(STOP, 1), 2_020);
    assert_eq!((head.status().action, leg.status().action), (Rest, Rest));
    assert_eq!(leg.received(Back, cp(A), 2_100).action, None);
    for now in (2_020..60_000).step_by(10) {
        for module in [&mut head, &mut leg] {
            assert!(module.timer(now).is_none_or(|response| response.action.is_none()), "at {now}");
        }
    }
    let _ = head.order(None, walk(1, 1), 60_000);
    let stands = head.ledger.standing();
    head.ledger.hear(Back, stands, true, 60_000);
    let beats: Vec<u16> = (60_000..62_000)
        .filter(|&now| head.timer(now).is_some_and(|response| response.action.is_some()))
        .collect();
    assert_eq!(beats, [60_500, 61_000, 61_500]);
}

#[test]
fn who_is_ordered_to_walk_as_it_does_goes_on() {
    let mut head = module(&HEAD);
    let _ = head.timer(BEAT);
    let period = Period::of_milliseconds(2 * BEAT).unwrap();
    let what = What::Walk(GaitName::Centipede as u8, period);
    assert_eq!(head.order(None, Order { what, serial: 1 }, BEAT + 20), NOTHING);
    assert_eq!(told(&mut head, BEAT + 20).len(), 1, "it is an order");
    knows(&mut head, Back, BEAT + 30);
    assert_eq!(head.status().action, Straight);
    assert_eq!(head.timer(2 * BEAT).and_then(|response| response.action), Some(Straight));
}

/// The number is that of a gait which other programs may have.
#[test]
fn who_is_ordered_to_walk_by_a_gait_that_it_does_not_have_rests_and_leads_nobody() {
    let (mut head, mut leg) = (module(&HEAD), module(&LEFT_LEG));
    assert_eq!(head.timer(BEAT).unwrap().action, Some(Straight));
    let _ = leg.received(Back, cp(B), BEAT);
    for module in [&mut head, &mut leg] {
        assert_eq!(module.order(None, walk(11, 1), BEAT + 20).action, Some(Rest));
        assert_eq!(told(module, BEAT + 20).len(), 1, "others may have it");
        module.ledger.hear(Back, module.ledger.standing(), true, BEAT + 30);
        assert_eq!(module.timer(3 * BEAT), None);
    }
    let _ = head.order(None, walk(GaitName::Centipede as u8, 2), 3 * BEAT);
    assert_eq!(told(&mut head, 3 * BEAT).len(), 1);
    head.ledger.hear(Back, head.ledger.standing(), true, 3 * BEAT);
    assert_eq!(head.timer(4 * BEAT).unwrap().action, Some(Straight), "it walks on when it is ordered so");
}

#[test]
fn a_module_that_leads_for_a_moment_while_a_chain_closes_does_not_take_it_for_a_ring() {
    let mut spine = Controller::new(GaitName::CloseRing.gait(), 3, 0);
    let _ = attach(&mut spine, &HEAD, 0);
    let _ = attach(&mut spine, &SPINE, 400);
    let tokens = |spine: &mut Controller, from: u16, to: u16| {
        let sent = (from..to).filter_map(|now| spine.timer(now).and_then(|response| response.send));
        sent.filter(|sent| matches!(sent.hormone, Hormone::Token(_))).collect::<Vec<_>>()
    };
    assert_eq!(tokens(&mut spine, 400, 1_000).len(), 1, "it asks round the ring");
    let beat = |spine: &mut Controller, now| {
        let name = GaitName::CloseRing as u8;
        spine.received(Front, Hormone::Pace(Pace { name, number: (now / 1_000 % 8) as u8, ..pace(A) }), now)
    };
    for now in (1_000..30_000).step_by(1_000) {
        let _ = beat(&mut spine, now);
        assert_eq!(tokens(&mut spine, now, now + 1_000), []);
    }
    assert_eq!(spine.status().gait, GaitName::CloseRing as u8);
}

#[test]
fn a_head_that_gets_a_neighbour_in_front_rolls_once_its_token_comes_back() {
    let mut spine = Controller::new(GaitName::CloseRing.gait(), 3, 0);
    let _ = attach(&mut spine, &HEAD, 0);
    let _ = attach(&mut spine, &SPINE, 400);
    let mut sent = (400..410).filter_map(|now| spine.timer(now).and_then(|response| response.send));
    let token = sent.find_map(|sent| match sent.hormone {
        Hormone::Token(token) => Some(token),
        _ => None,
    });
    let token = Token { hops: 6, ..token.unwrap() };
    let _ = spine.received(Front, Hormone::Token(token), 420);
    assert_eq!(spine.status().gait, GaitName::RollingTrack as u8);
    assert!(spine.is_leader());
}

/// Runs the leader of a ring of six, in which each of its tokens comes back at once. Returns the gait that it
/// walks by at `to`.
fn in_ring(leader: &mut Controller, from: u16, to: u16) -> u8 {
    for now in from..=to {
        if let Some(Outgoing { hormone: Hormone::Token(own), .. }) =
            leader.timer(now).and_then(|said| said.send)
        {
            let _ = leader.received(Front, Hormone::Token(Token { hops: 6, ..own }), now);
        }
    }
    leader.status().gait
}

/// The leader of a ring that walks by `gait`, and is ordered to close after 2,100 ms; and when that counts:
/// 2.5 s later.
fn ordered_to_close(gait: GaitName) -> (Controller, u16) {
    let mut leader = Controller::new(gait.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let _ = in_ring(&mut leader, 0, 2_099);
    let _ = leader.order(None, walk(GaitName::CloseRing as u8, 1), 2_100);
    (leader, 4_600)
}

/// The module led a ring that was cut elsewhere, and has not found that out.
#[test]
fn a_token_that_is_not_its_own_tells_nobody_that_the_chain_has_closed() {
    let (mut leader, late) = ordered_to_close(GaitName::RollingTrack);
    (2_100..=late).for_each(|now| _ = leader.timer(now));
    let candidate = Token { rank: 1, hops: 3 };
    let _ = leader.received(Front, Hormone::Token(candidate), late);
    assert_eq!(leader.status().gait, GaitName::CloseRing as u8);
    assert_eq!(in_ring(&mut leader, late + 1, late + 2_000), GaitName::RollingTrack as u8);
}

/// The module led a ring that it was about to open.
#[test]
fn a_ring_that_is_to_close_is_closed_once_no_latch_can_be_opening_any_more() {
    let (mut leader, late) = ordered_to_close(GaitName::OpenRing);
    assert_eq!(in_ring(&mut leader, 2_100, late - 1), GaitName::CloseRing as u8);
    assert_eq!(in_ring(&mut leader, late, late + 2_000), GaitName::RollingTrack as u8);
}

#[test]
fn a_ring_is_open_once_its_leader_has_been_head_for_a_while() {
    let open = || {
        let mut leader = Controller::new(GaitName::OpenRing.gait(), 3, 0);
        let _ = attach(&mut leader, &SPINE, 0);
        let own = leader.election.round(2_000).unwrap();
        let _ = leader.received(Front, Hormone::Token(Token { hops: 6, ..own }), 2_010);
        assert!(leader.is_leader());
        let _ = attach(&mut leader, &HEAD, 3_000);
        leader
    };
    let run = |leader: &mut Controller, to: u16| {
        (3_000..to).for_each(|now| _ = leader.timer(now));
    };
    let mut flickers = open();
    run(&mut flickers, 3_500);
    let _ = attach(&mut flickers, &SPINE, 3_500);
    run(&mut flickers, 9_000);
    assert_eq!(flickers.status().gait, GaitName::OpenRing as u8);
    let mut opens = open();
    run(&mut opens, 3_000 + OPEN_AFTER);
    assert_eq!(opens.status().gait, GaitName::OpenRing as u8);
    run(&mut opens, 3_001 + OPEN_AFTER);
    assert_eq!(opens.status().gait, GaitName::Caterpillar as u8);
}

#[test]
fn a_robot_that_was_ordered_to_stop_stands_whatever_shape_it_takes() {
    let stops = |module: &mut Controller, neighbours: &Neighbours| {
        let _ = module.order(None, walk(STOP, 1), 3_100);
        let _ = attach(module, neighbours, 3_200);
        let sends = (3_200..20_000).filter_map(|now| module.timer(now).and_then(|response| response.send));
        let tokens = sends.filter(|sent| matches!(sent.hormone, Hormone::Token(_))).count();
        assert_eq!((tokens, module.ledger.standing().gait, module.status().action), (0, STOP, Rest));
    };
    let mut closes = Controller::new(GaitName::CloseRing.gait(), 3, 0);
    let _ = attach(&mut closes, &HEAD, 0);
    stops(&mut closes, &SPINE);
    let mut opens = Controller::new(GaitName::OpenRing.gait(), 3, 0);
    let _ = attach(&mut opens, &SPINE, 0);
    let _ = attach(&mut opens, &HEAD, 3_000);
    stops(&mut opens, &HEAD);
}

#[test]
fn a_leader_whose_token_comes_back_no_more_rests() {
    let mut leader = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let own = leader.election.round(2_000).unwrap();
    let _ = leader.received(Front, Hormone::Token(Token { hops: 6, ..own }), 2_010);
    for now in 2_010..60_000 {
        let _ = leader.timer(now);
    }
    assert_eq!((leader.is_leader(), leader.status().action), (false, Rest));
}

/// The ring may have been cut while it walked another way.
#[test]
fn who_led_a_ring_leads_no_chain_that_is_ordered_to_roll_later() {
    let mut spine = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut spine, &SPINE, 0);
    let own = spine.election.round(2_000).unwrap();
    let _ = spine.received(Front, Hormone::Token(Token { hops: 6, ..own }), 2_010);
    assert!(spine.is_leader());
    let _ = spine.order(None, walk(GaitName::Caterpillar as u8, 1), 3_000);
    while spine.timer(3_000).is_some() {}
    let _ = spine.order(None, walk(GaitName::RollingTrack as u8, 2), 9_000);
    assert!(!spine.is_leader());
}

#[test]
fn who_comes_into_a_ring_waits_for_its_leader_also_where_it_has_led_before() {
    let mut module = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let first_token = |module: &mut Controller, from: u16| {
        let is_token =
            |response: Response| response.send.is_some_and(|sent| matches!(sent.hormone, Hormone::Token(_)));
        (from..from + 10_000).find(|&now| module.timer(now).is_some_and(is_token))
    };
    let _ = attach(&mut module, &SPINE, 100);
    assert_eq!(first_token(&mut module, 100), Some(2_000));
    assert_eq!(in_ring(&mut module, 12_000, 14_000), GaitName::RollingTrack as u8);
    assert!(module.is_leader());
    let _ = attach(&mut module, &TAIL, 14_000);
    let _ = attach(&mut module, &SPINE, 15_000);
    assert!(!module.is_leader());
    assert_eq!(first_token(&mut module, 15_000), Some(16_000), "two seconds after it left");
}

#[test]
fn a_leader_whose_tokens_come_back_rolls_on_as_its_rounds_begin() {
    let mut leader = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let mut rounds = 0;
    for now in 2_000..6_000 {
        let Some(Response { send, action, .. }) = leader.timer(now) else { continue };
        if let Some(Outgoing { hormone: Hormone::Token(token), .. }) = send {
            assert_eq!(action, None, "at {now}");
            let _ = leader.received(Front, Hormone::Token(Token { hops: 6, ..token }), now + 10);
            rounds += 1;
        }
    }
    assert!(rounds > 3 && leader.is_leader(), "{rounds}");
}

#[test]
fn a_token_that_ends_makes_nobody_forget_the_beat() {
    let name = GaitName::RollingTrack as u8;
    let mut follower = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut follower, &SPINE, 0);
    let pace = Pace { name, rhythm: 0, lifetime: NonZeroU16::new(20), ..pace(A) };
    let _ = follower.received(Front, Hormone::Pace(pace), 100);
    let token = Token { rank: 5, hops: 3 };
    assert!(follower.received(Front, Hormone::Token(token), 150).send.is_some());
    assert!(follower.received(Front, Hormone::Token(Token { hops: 7, ..token }), 160) == NOTHING);
    assert!(follower.beats().is_some());

    let mut leader = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let own = Token { hops: 6, ..leader.election.round(2_000).unwrap() };
    let _ = leader.received(Front, Hormone::Token(own), 2_010);
    let due = 2_010 + leader.pacemaker.until_beat(2_010);
    let _ = leader.received(Front, Hormone::Token(own), due);
    let is_beat = |response: Response| matches!(response.event, Some(Event::HormoneGenerated(_)));
    assert!(core::iter::from_fn(|| leader.timer(due)).any(is_beat));
}

#[test]
fn a_token_that_comes_to_no_ring_goes_no_further() {
    let mut spine = module(&SPINE);
    assert!(spine.received(Front, Hormone::Token(Token { rank: 1, hops: 3 }), 10) == NOTHING);
    assert_eq!(spine.status().dropped, 1);
}

/// A leader that stands down does not go on with the beats of the leader before it, which it made good until
/// it was elected.
#[test]
fn a_leader_who_has_followed_rests_at_once_when_it_stands_down() {
    let name = GaitName::RollingTrack as u8;
    let mut leader = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let pace = Pace { name, rhythm: 0, lifetime: NonZeroU16::new(20), ..pace(A) };
    let _ = leader.received(Front, Hormone::Pace(pace), 100);
    let mut own = None;
    for now in 100..4_000 {
        let sent = leader.timer(now).and_then(|response| response.send);
        if let Some(Hormone::Token(token)) = sent.map(|outgoing| outgoing.hormone) {
            own = Some((token, now));
            break;
        }
    }
    let (token, at) = own.expect("it stands as a candidate");
    let _ = leader.received(Front, Hormone::Token(Token { hops: 6, ..token }), at + 10);
    assert!(leader.is_leader());
    let mut has_rested = false;
    for now in at + 10..60_000 {
        let response = leader.timer(now);
        if !leader.is_leader() {
            has_rested = true;
            let paces = response.and_then(|response| response.send);
            assert!(!paces.is_some_and(|sent| matches!(sent.hormone, Hormone::Pace(_))), "at {now}");
            assert_eq!(leader.status().action, Rest, "at {now}");
        }
    }
    assert!(has_rested);
}

#[test]
fn how_to_walk_is_ordered_whatever_number_somebody_steers_by() {
    let steer = What::Steer(TO_THE_LEFT);
    let mut head = module(&HEAD);
    let _ = head.received(Back, Hormone::Order(Order { what: steer, serial: 100 }), 10);
    let _ = head.order(None, walk(STOP, 3), 20);
    assert_eq!((head.ledger.standing().gait, head.course()), (STOP, Course::Left));
    // An order to walk does not make the course last longer, either.
    let _ = head.order(None, walk(1, 4), 1_000);
    let _ = head.timer(10 + crate::order::HOLDS);
    assert_eq!(head.course(), Course::Ahead);
}

#[test]
fn in_a_ring_a_hormone_dies_and_what_is_made_good_lives_no_longer() {
    let mut spine = module(&SPINE);
    let name = GaitName::RollingTrack as u8;
    let beat = GaitName::RollingTrack.gait().beat.get();
    let roll = |data, lifetime| {
        Hormone::Pace(Pace { name, rhythm: 0, lifetime: NonZeroU16::new(lifetime), ..pace(data) })
    };
    let sent = |response: Response| response.send.map(|outgoing| pace_of(outgoing).lifetime);
    assert_eq!(sent(spine.received(Front, roll(A, 2), 0)), Some(NonZeroU16::new(1)));
    assert_eq!(spine.status().action, Action::Roll);
    assert_eq!(sent(spine.timer(beat + 12).unwrap()), Some(NonZeroU16::new(1)));
    assert_eq!(sent(spine.received(Front, roll(Data::C, 1), 2 * beat)), None);
    assert_eq!(spine.timer(3 * beat + 12).unwrap().send, None);
}

#[test]
fn when_the_neighbour_that_the_rhythm_came_from_is_gone_any_other_is_followed_at_once() {
    let mut controller = module(&OTHER);
    assert_eq!(sent(controller.received(Up, cp(A), 0)), by(A, &[Front, Back, Right]));
    let _ = attach(&mut controller, &[Some(Back), Some(Front), None, Some(Back), None, None], 100);
    assert_eq!(controller.next_due(100), None);
    assert_eq!(sent(controller.received(Front, cp(B), 200)), by(B, &[Back, Right]));
}

#[test]
fn a_module_of_another_type_says_so_and_follows_any_way_at_once_though_its_neighbour_is_still_there() {
    let mut controller = module(&SPINE);
    let _ = controller.received(Front, cp(A), 0);
    let response = attach(&mut controller, &BRANCH, 100);
    assert_eq!(response.event, Some(Event::TopologyChanged(ModuleType::Branch)));
    assert_eq!(controller.next_due(100), None);
    assert_eq!(controller.received(Back, cp(B), 200).event, Some(Event::HormoneReceived(Back, B)));
}

#[test]
fn who_is_stopped_as_a_beat_comes_asks_nothing() {
    let mut leg = module(&LEFT_LEG);
    let _ = leg.received(Back, cp(A), 0);
    let _ = leg.order(None, walk(STOP, 1), 0);
    assert!(leg.asks(0).eq([]));
    assert_eq!(leg.next_ask(0), None, "nor later");
}

#[test]
fn a_leader_that_gives_way_to_another_rests() {
    let mut leader = Controller::new(GaitName::RollingTrack.gait(), 3, 0);
    let _ = attach(&mut leader, &SPINE, 0);
    let _ = in_ring(&mut leader, 0, 5_000);
    assert!(leader.is_leader() && leader.status().action == Action::Roll);
    let higher = Token { rank: u16::MAX, hops: 3 };
    let response = leader.received(Front, Hormone::Token(higher), 5_001);
    let passed_on =
        Outgoing { hormone: Hormone::Token(Token { hops: 4, ..higher }), docks: crate::rule::BACK };
    assert_eq!((response.send, response.action), (Some(passed_on), Some(Rest)));
    assert_eq!((leader.is_leader(), leader.status().action), (false, Rest));
}

#[test]
fn who_has_no_rule_in_the_gait_of_the_hormone_that_comes_rests() {
    let mut tail = Controller::new(GaitName::Caterpillar.gait(), 0, 0);
    let _ = attach(&mut tail, &TAIL, 0);
    let wave = Hormone::Pace(Pace { name: GaitName::Caterpillar as u8, ..pace(A) });
    assert_eq!(tail.received(Front, wave, 10).action, Some(Action::Wave));
    let _ = tail.received(Front, cp(A), 210);
    assert_eq!((tail.status().gait, tail.status().action), (1, Rest));
    assert_eq!(tail.posture(210), None);
}

#[test]
fn a_head_beats_to_where_its_beats_came_from_once_it_leads() {
    let mut head = Controller::new(GaitName::RollingTrack.gait(), 0, 0);
    let _ = attach(&mut head, &HEAD, 0);
    let rolls = Pace { name: GaitName::RollingTrack as u8, ..pace(A) };
    let is_taken = |response: Response| matches!(response.event, Some(Event::HormoneReceived(Back, _)));
    assert!(is_taken(head.received(Back, Hormone::Pace(rolls), 10)));
    let _ = head.order(None, walk(1, 1), 20);
    let by_back = |outgoing: Outgoing| outgoing.docks.contains(Back);
    let is_pace = |outgoing: &Outgoing| matches!(outgoing.hormone, Hormone::Pace(_));
    let mut sent = (20..2_000).filter_map(|now| head.timer(now)?.send).filter(is_pace);
    assert!(sent.next().is_some_and(by_back));
}

/// Else it would begin its motion again each time that the clock wraps.
#[test]
fn who_loses_the_neighbour_that_the_rhythm_came_from_rests_whatever_its_type() {
    let mut spine = Controller::new(GaitName::Caterpillar.gait(), 0, 0);
    let _ = attach(&mut spine, &SPINE, 0);
    // It came by a dock whose neighbour is not there any more.
    let wave = Hormone::Pace(Pace { name: GaitName::Caterpillar as u8, ..pace(A) });
    assert_eq!(spine.received(Up, wave, 10).action, Some(Action::Wave));
    assert_eq!(attach(&mut spine, &SPINE, 20).action, Some(Rest));
    assert_eq!(spine.posture(20), None);
}
