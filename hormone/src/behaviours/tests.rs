use tasks::dock::Dock;
use tasks::docking::latch::{End, State as Latch};
use tasks::message::{Address, Letter, Message};
use tasks::motor::Axis;
use tasks::motor::joint::State;
use tasks::post_office::Undelivered;
use tasks::request::{Report, Request};

use super::ac_receive::LOOK;
use super::docks::HOLDS_WITHIN;
use super::joints::{Joints, RETRY};
use super::*;
use crate::action::{Action, posture};
use crate::data::Data::{self, A, B};
use crate::event::Event;
use crate::gait::GaitName;
use crate::hormone::Hormone;
use crate::neighbours::{Neighbours, to_bytes};
use crate::order::{Order, What};
use crate::pace::Pace;
use crate::period::Period;
use crate::probe::Probe;
use crate::random::Random;
use crate::sense::Sense;
use crate::standing::STOP;
use crate::time::until;

/// A module that keeps what its behaviours send.
#[derive(Default)]
struct Here {
    is_full: bool,
    sent: Vec<Letter>,
    refused: usize,
    events: Vec<Event>,
}

impl Module for Here {
    fn send(&mut self, message: Message) -> Result<(), Undelivered> {
        if self.is_full {
            self.refused += 1;
            return Err(Undelivered::NoRoom);
        }
        self.sent.push(Letter::of(message));
        Ok(())
    }

    fn trace(&mut self, event: Event) {
        self.events.push(event);
    }
}

impl Here {
    /// What was sent to this address.
    fn to(&self, to: Address) -> Vec<&[u8]> {
        self.sent.iter().filter(|letter| letter.to() == to).map(Letter::payload).collect()
    }

    fn requests(&self) -> Vec<Request> {
        self.sent
            .iter()
            .filter(|letter| letter.from() == Address::here(TaskCode::HORMONE))
            .filter_map(|letter| Request::from_payload(letter.payload()))
            .collect()
    }
}

const HORMONE: Address = Address::here(TaskCode::HORMONE);

fn behaviours() -> Behaviours {
    Behaviours::new(GaitName::Centipede.gait(), 1, 65_500)
}

fn letter(to: TaskCode, from: Address, payload: &[u8]) -> Letter {
    Letter::of(Message::new(Address::here(to), from, payload).expect("it is short"))
}

/// AC_RECV's report of these neighbours.
fn topology(neighbours: Neighbours) -> Letter {
    letter(TaskCode::HORMONE, Address::here(TaskCode::AC_RECEIVE), &to_bytes(&neighbours))
}

/// A left leg.
fn leg() -> Letter {
    let mut neighbours = [None; 6];
    neighbours[usize::from(Dock::Back.index())] = Some(Dock::Left);
    topology(neighbours)
}

/// A beat that came in at a dock.
fn beat(data: Data, dock: Dock) -> Letter {
    let pace = Pace {
        name: GaitName::Centipede as u8,
        data,
        is_made_good: false,
        number: data as u8,
        rhythm: 0,
        lifetime: None,
    };
    let from = Address::beyond(dock, TaskCode::HORMONE);
    letter(TaskCode::HORMONE, from, Hormone::Pace(pace).to_payload().as_slice())
}

/// Runs for `ticks` milliseconds, and polls only when a poll is due. Returns how often.
fn run(behaviours: &mut Behaviours, now: &mut u16, ticks: u16, here: &mut Here) -> usize {
    let end = now.wrapping_add(ticks);
    let mut polls = 0;
    loop {
        behaviours.poll(*now, here);
        polls += 1;
        let next = behaviours.poll_at(*now);
        assert_ne!(next, *now, "what it was time for is done");
        if until(end, *now) < until(next, *now) {
            *now = end;
            return polls;
        }
        *now = next;
    }
}

#[test]
fn every_dock_is_probed_and_nobody_is_woken_for_nothing() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    let polls = run(&mut behaviours, &mut now, 400, &mut here);
    for dock in Dock::ALL {
        let probes = here.to(Address::beyond(dock, TaskCode::AC_RECEIVE)).len();
        assert!((10..=11).contains(&probes), "{probes} at {dock:?}");
    }
    assert!(polls <= 60 + 20 + 5, "{polls}");
}

#[test]
fn no_probe_is_missed_that_found_no_room() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    for ticks in [90, 45, 130, 85, 200] {
        run(&mut behaviours, &mut now, ticks, &mut here);
        here.is_full = !here.is_full;
    }
    for dock in Dock::ALL {
        let probes = here.to(Address::beyond(dock, TaskCode::AC_RECEIVE));
        let odd = probes.iter().map(|probe| Probe::from_payload(probe).expect("it is a probe").is_odd);
        assert!(odd.eq((0..probes.len()).map(|number| number % 2 == 0)), "{dock:?}: {probes:?}");
    }
}

#[test]
fn the_topology_is_told_once_there_is_room() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    run(&mut behaviours, &mut now, 10, &mut here);
    let from = Address::beyond(Dock::Back, TaskCode::AC_RECEIVE);
    here.is_full = true;
    for _ in 0..4 {
        let (dock, hears) = (Dock::Left, Some(Dock::Back));
        let probe = Probe { dock, hears, wants_more: false, is_odd: false };
        behaviours.receive(now, letter(TaskCode::AC_RECEIVE, from, &[probe.to_byte()]), &mut here);
        run(&mut behaviours, &mut now, 40, &mut here);
    }
    assert_eq!(here.to(HORMONE), [&[0_u8; 0]; 0]);
    here.is_full = false;
    run(&mut behaviours, &mut now, LOOK, &mut here);
    let told = here.to(HORMONE);
    assert_eq!(told.len(), 1, "once");
}

#[test]
fn a_hormone_that_finds_no_room_is_counted_and_not_told_of_as_sent() {
    let (mut behaviours, mut here, now) = (behaviours(), Here::default(), 65_500);
    let mut neighbours = [None; 6];
    neighbours[usize::from(Dock::Front.index())] = Some(Dock::Back);
    neighbours[usize::from(Dock::Back.index())] = Some(Dock::Front);
    behaviours.receive(now, topology(neighbours), &mut here);
    behaviours.poll(now, &mut here);
    let (sent, unsent) = (behaviours.status().hormones_sent, behaviours.status().hormones_unsent);
    here.events.clear();
    here.is_full = true;
    behaviours.receive(now, beat(A, Dock::Front), &mut here);
    let status = behaviours.status();
    assert_eq!((status.hormones_sent, status.hormones_unsent), (sent, unsent + 1));
    assert!(!here.events.contains(&Event::HormoneSent(Dock::Back, A)), "{:?}", here.events);
    here.is_full = false;
    behaviours.receive(now.wrapping_add(500), beat(B, Dock::Front), &mut here);
    assert_eq!(behaviours.status().hormones_sent, sent + 1);
    assert!(here.events.contains(&Event::HormoneSent(Dock::Back, B)), "{:?}", here.events);
}

#[test]
fn no_probe_is_in_the_way_of_a_beat() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    run(&mut behaviours, &mut now, 100, &mut here);
    behaviours.receive(now, leg(), &mut here);
    behaviours.receive(now, beat(A, Dock::Back), &mut here);
    let (mut probed, mut others) = (Vec::new(), Vec::new());
    for after in 0..1_100 {
        if after == 503 {
            behaviours.receive(now, beat(B, Dock::Back), &mut here);
        }
        here.sent.clear();
        run(&mut behaviours, &mut now, 1, &mut here);
        if !here.to(Address::beyond(Dock::Back, TaskCode::AC_RECEIVE)).is_empty() {
            probed.push(after);
        }
        let others_now = Dock::ALL.iter().filter(|&&dock| dock != Dock::Back);
        let sent = |dock: &&Dock| !here.to(Address::beyond(**dock, TaskCode::AC_RECEIVE)).is_empty();
        others.extend(others_now.filter(sent).map(|_| after));
    }
    let around = |beat: u16| move |after: &&u16| (beat - 10..beat + 6).contains(*after);
    for beat in [501, 1_001] {
        assert_eq!(probed.iter().filter(around(beat)).count(), 0, "{probed:?}");
        assert_ne!(others.iter().filter(around(beat)).count(), 0, "{others:?}");
    }
    assert!((27..=29).contains(&probed.len()), "{probed:?}");
}

#[test]
fn joints_are_told_again_once_there_is_room_and_then_what_is_new_alone() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    behaviours.receive(now, leg(), &mut here);
    run(&mut behaviours, &mut now, 10, &mut here);
    here.is_full = true;
    behaviours.receive(now, beat(A, Dock::Back), &mut here);
    behaviours.poll(now, &mut here);
    assert_eq!(behaviours.status().action, Action::Swing);
    assert!(here.refused >= 3 && here.requests().is_empty());
    here.is_full = false;
    now = now.wrapping_add(500);
    behaviours.receive(now, beat(B, Dock::Back), &mut here);
    behaviours.poll(now, &mut here);
    assert_eq!(behaviours.status().action, Action::Holding);
    let turned = here.requests().iter().filter(|request| matches!(request, Request::Turn { .. })).count();
    assert_eq!(turned, 3, "all that were not told before");
    let told = here.requests().len();
    behaviours.receive(now, beat(B, Dock::Back), &mut here);
    assert!(behaviours.poll(now, &mut here), "HORMONE looks what there is to do");
    assert_eq!(here.requests().len(), told, "a posture that stays is not told again");
}

#[test]
fn a_joint_that_has_failed_is_told_again_after_a_while_also_where_no_beat_comes() {
    for state in [State::Stalled, State::BrokenPotentiometer] {
        is_told_again(state);
    }
}

/// A leg that was told to stop, at this time.
fn at_rest() -> (Behaviours, Here, u16) {
    let (mut behaviours, mut here, now) = (behaviours(), Here::default(), 65_400);
    behaviours.receive(now, leg(), &mut here);
    behaviours.receive(now, beat(A, Dock::Back), &mut here);
    behaviours.poll(now, &mut here);
    let halt = Hormone::Order(Order { what: What::Walk(STOP, Period::OWN), serial: 1 }).to_payload();
    let remote = Address::beyond(Dock::Up, TaskCode::HORMONE);
    behaviours.receive(now, letter(TaskCode::HORMONE, remote, &halt), &mut here);
    behaviours.poll(now, &mut here);
    assert_eq!(behaviours.status().action, Action::Rest);
    (behaviours, here, now)
}

/// A joint reports its state.
fn report_joint(behaviours: &mut Behaviours, now: u16, axis: Axis, state: State, here: &mut Here) {
    let report = Report::Joint(axis, state).to_payload();
    let joint = Address::here(TaskCode::joint(axis));
    behaviours.receive(now, letter(TaskCode::HORMONE, joint, &report), here);
    behaviours.poll(now, here);
}

fn is_told_again(state: State) {
    let (mut behaviours, mut here, mut now) = at_rest();
    let turned = |here: &Here, axis| {
        here.requests()
            .into_iter()
            .filter(|request| matches!(request, Request::Turn { axis: one, .. } if *one == axis))
            .collect::<Vec<_>>()
    };
    let before = [Axis::Front, Axis::Roll, Axis::Back].map(|axis| turned(&here, axis).len());
    report_joint(&mut behaviours, now, Axis::Roll, state, &mut here);
    here.is_full = true;
    run(&mut behaviours, &mut now, RETRY + 10, &mut here);
    here.is_full = false;
    run(&mut behaviours, &mut now, RETRY - 20, &mut here);
    assert_eq!(turned(&here, Axis::Roll).len(), before[1], "there was no room, and it is not time again");
    run(&mut behaviours, &mut now, 3 * RETRY, &mut here);
    let after = [Axis::Front, Axis::Roll, Axis::Back].map(|axis| turned(&here, axis).len());
    assert_eq!(after, [before[0], before[1] + 1, before[2]], "once, and no other");
    let rolls = turned(&here, Axis::Roll);
    assert_eq!(rolls[rolls.len() - 1], rolls[rolls.len() - 2], "where it was told to be");
}

#[test]
fn a_joint_that_fails_again_and_again_does_not_keep_another_waiting() {
    let (mut behaviours, mut here, mut now) = at_rest();
    let rolls = |here: &Here| {
        let of_roll = |request: &&Request| matches!(request, Request::Turn { axis: Axis::Roll, .. });
        here.requests().iter().filter(of_roll).count()
    };
    let before = rolls(&here);
    report_joint(&mut behaviours, now, Axis::Roll, State::Stalled, &mut here);
    for _ in 0..=RETRY / 50 {
        now = now.wrapping_add(50);
        report_joint(&mut behaviours, now, Axis::Front, State::Stalled, &mut here);
    }
    assert_eq!(rolls(&here), before + 1);
}

#[test]
fn the_mean_of_what_a_sensor_reads_in_a_beat_counts_from_the_next_one_on() {
    for (jolts, action) in [(2, Action::Swing), (7, Action::SwingOver)] {
        let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
        let sensor = Sense::UpsideDown.sensor();
        let from = Address::here(Request::Read(sensor).task());
        behaviours.receive(now, leg(), &mut here);
        behaviours.receive(now, beat(B, Dock::Back), &mut here);
        let mut asked = 0;
        for _ in 0..490 {
            run(&mut behaviours, &mut now, 1, &mut here);
            let asks = here.requests().iter().filter(|request| matches!(request, Request::Read(_))).count();
            if asks > asked {
                asked = asks;
                let value = if asked <= jolts { -1000 } else { 1000 };
                let report = Report::Value(sensor, value).to_payload();
                behaviours.receive(now, letter(TaskCode::HORMONE, from, &report), &mut here);
            }
        }
        assert_eq!(asked, 8);
        behaviours.receive(now, beat(A, Dock::Back), &mut here);
        run(&mut behaviours, &mut now, 1, &mut here);
        assert_eq!(behaviours.status().action, action);
    }
}

#[test]
fn what_devices_report_is_no_topology_and_what_cannot_be_read_is_counted() {
    let (mut behaviours, mut here, now) = (behaviours(), Here::default(), 65_500);
    behaviours.receive(now, leg(), &mut here);
    let before = behaviours.status();
    let sensor = Sense::ALL[0].sensor();
    let report = Report::Value(sensor, 5).to_payload();
    let from = Address::here(Request::Read(sensor).task());
    behaviours.receive(now, letter(TaskCode::HORMONE, from, &report), &mut here);
    let after = behaviours.status();
    assert_eq!((after.topology_changes, after.malformed), (before.topology_changes, before.malformed));
    for (to, payload) in [(TaskCode::HORMONE, [0xff; 5]), (TaskCode::AC_RECEIVE, [0xff; 5])] {
        let from = Address::beyond(Dock::Back, to);
        behaviours.receive(now, letter(to, from, &payload), &mut here);
    }
    assert_eq!(behaviours.status().malformed, before.malformed + 2);
}

/// HORMONE was reset too, and knows no target.
#[test]
fn a_joint_that_is_off_and_was_told_nothing_is_to_stay_where_it_is() {
    let (mut joints, mut here) = (Joints::new(), Here::default());
    joints.hear(0, Axis::Roll, State::Stalled);
    assert_eq!(joints.retry_in(0), Some(RETRY));
    joints.hear(10, Axis::Roll, State::Off);
    assert_eq!(joints.retry_in(10), Some(0));
    joints.turn(10, None, &mut here);
    assert_eq!(here.requests(), [Request::TurnBy { axis: Axis::Roll, by: 0, speed: 60 }]);
    assert_eq!(joints.retry_in(10), None);
    here.sent.clear();
    joints.turn(20, Some(posture(0, 0, 0)), &mut here);
    let straight = |axis| Request::Turn { axis, angle: 0, speed: 60 };
    assert_eq!(here.requests(), Axis::ALL.map(straight));
}

/// An MCU that is reset switches its joints off. A leg of a robot that stands would give way.
#[test]
fn a_joint_that_is_off_while_the_robot_stands_is_told_its_last_target() {
    let (mut joints, mut here) = (Joints::new(), Here::default());
    joints.turn(0, Some(posture(1, 2, 3)), &mut here);
    here.sent.clear();
    joints.hear(700, Axis::Back, State::Off);
    assert_eq!(joints.retry_in(700), Some(0));
    here.is_full = true;
    joints.turn(700, None, &mut here);
    here.is_full = false;
    joints.turn(700 + RETRY, None, &mut here);
    let turned = Request::Turn { axis: Axis::Back, angle: 30, speed: 60 };
    assert_eq!(here.requests(), [turned]);
    assert_eq!(joints.retry_in(700 + RETRY), None);
}

#[test]
fn an_order_that_the_memory_had_no_room_for_is_kept_soon_also_at_rest() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    here.is_full = true;
    let halt = Hormone::Order(Order { what: What::Walk(STOP, Period::OWN), serial: 1 }).to_payload();
    let remote = Address::beyond(Dock::Up, TaskCode::HORMONE);
    behaviours.receive(now, letter(TaskCode::HORMONE, remote, &halt), &mut here);
    run(&mut behaviours, &mut now, 10, &mut here);
    here.is_full = false;
    run(&mut behaviours, &mut now, RETRY, &mut here);
    let kept = here.requests().into_iter().filter(|request| matches!(request, Request::Keep(_)));
    assert_eq!(kept.count(), 1);
}

/// A search would go on for seconds, and latch.
#[test]
fn a_robot_that_is_to_stop_searches_no_dock_any_more() {
    let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
    here.is_full = true;
    let remote = Address::beyond(Dock::Up, TaskCode::HORMONE);
    for (gait, expected) in [(STOP, 2), (GaitName::Centipede as u8, 0), (STOP, 2)] {
        let order = Hormone::Order(Order { what: What::Walk(gait, Period::OWN), serial: 1 }).to_payload();
        here.sent.clear();
        behaviours.receive(now, letter(TaskCode::HORMONE, remote, &order), &mut here);
        run(&mut behaviours, &mut now, 10, &mut here);
        here.is_full = false;
        run(&mut behaviours, &mut now, RETRY, &mut here);
        let mut ended = here.requests();
        ended.retain(|request| matches!(request, Request::Leave(_)));
        assert_eq!(ended, [Dock::Front, Dock::Back].map(Request::Leave)[..expected]);
    }
}

/// Another dock whose hooks miss, too, would otherwise be its neighbour.
#[test]
fn a_latch_that_has_closed_and_holds_no_neighbour_opens_in_time_or_once_there_is_room() {
    for (state, holds, is_full, opens) in [
        (Latch::At(End::Latched), Dock::Back, false, 0),
        (Latch::At(End::Latched), Dock::Front, false, 1),
        (Latch::At(End::Latched), Dock::Front, true, 1),
        (Latch::At(End::Released), Dock::Front, false, 0),
    ] {
        let (mut behaviours, mut here, mut now) = (behaviours(), Here::default(), 65_500);
        let report = Report::Latch(Dock::Back, state).to_payload();
        let from = Address::here(TaskCode::dock(Dock::Back));
        behaviours.receive(now, letter(TaskCode::HORMONE, from, &report), &mut here);
        let mut neighbours = [None; 6];
        neighbours[usize::from(holds.index())] = Some(Dock::Left);
        behaviours.receive(now, topology(neighbours), &mut here);
        let opened = |here: &Here| {
            let release = Request::Latch(Dock::Back, End::Released);
            here.requests().iter().filter(|request| **request == release).count()
        };
        run(&mut behaviours, &mut now, HOLDS_WITHIN - 1, &mut here);
        assert_eq!(opened(&here), 0, "a link takes its time");
        here.is_full = is_full;
        run(&mut behaviours, &mut now, 2, &mut here);
        assert_eq!(opened(&here), if is_full { 0 } else { opens }, "{state:?}, a neighbour at {holds:?}");
        here.is_full = false;
        run(&mut behaviours, &mut now, 2 * RETRY, &mut here);
        assert_eq!(opened(&here), opens, "{state:?}, a neighbour at {holds:?}");
    }
}

/// Anything that a neighbour may send to HORMONE, and at times what AC_RECV may report.
fn anything(random: &mut Random) -> Letter {
    if random.below(8) == 0 {
        return topology([(); 6].map(|()| Dock::from_index(random.below(12) as u8)));
    }
    let length = 2 + random.below(3) as usize;
    let payload = [(); 4].map(|()| random.below(256) as u8);
    let from = Address::beyond(Dock::ALL[random.below(6) as usize], TaskCode::HORMONE);
    letter(TaskCode::HORMONE, from, &payload[..length])
}

/// Whatever neighbours have sent, whenever, and whether or not there was room.
#[test]
fn a_leg_that_is_ordered_to_walk_walks_whatever_came_before() {
    for seed in 0..300 {
        let (mut random, mut here) = (Random::new(seed), Here::default());
        let mut now = random.below(0x1_0000) as u16;
        let mut behaviours = Behaviours::new(GaitName::Centipede.gait(), seed as u16, now);
        for _ in 0..300 {
            here.is_full = random.below(8) == 0;
            behaviours.receive(now, anything(&mut random), &mut here);
            let pause = [0, 1, 40, 300, 2_000, 30_000][random.below(6) as usize];
            if pause >= 1_000 {
                // The task was kept from running.
                now = now.wrapping_add(pause);
            }
            run(&mut behaviours, &mut now, pause % 1_000, &mut here);
        }
        here.is_full = false;
        behaviours.receive(now, leg(), &mut here);
        let order = Order { what: What::Walk(GaitName::Centipede as u8, Period::OWN), serial: 0 };
        let from = Address::beyond(Dock::Up, TaskCode::HORMONE);
        let order = letter(TaskCode::HORMONE, from, Hormone::Order(order).to_payload().as_slice());
        behaviours.receive(now, order, &mut here);
        for data in [A, B, A, B, A] {
            behaviours.receive(now, beat(data, Dock::Back), &mut here);
            run(&mut behaviours, &mut now, 500, &mut here);
        }
        let action = behaviours.controller().status().action;
        assert!(matches!(action, Action::Swing | Action::SwingOver), "seed {seed}: {action:?}");
    }
}
