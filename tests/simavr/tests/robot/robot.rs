//! A chain of five with the images that the robot is flashed with: a head, three spines, a tail.

use std::sync::LazyLock;

use hormone::event::Event as Behaviour;
use hormone::hormone::Data;
use hormone::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine, Tail};
use simavr_harness::{Controller, Face, Faults, RobotBuilder};
use simulation::START_UP;
use superbot_tests_simavr::chain::{Chain, Count, TraceEvent};
use superbot_tests_simavr::hormones::{HOP_AT_MOST, Hormones};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock;
use tasks::link::sender::ACK_TIMEOUT;

const MODULES: usize = 5;
const SECOND: u64 = 1000 * MILLISECOND;

/// A module finds its neighbours and type within this time from power-up, and from the start after a reset.
const DISCOVERY: u64 = 150 * MILLISECOND;

#[test]
fn every_module_finds_its_neighbours_and_its_type() {
    for seed in 0..24 {
        let mut chain = Chain::new(MODULES, seed);
        assert_eq!(chain.mistaken().len(), MODULES, "nobody knows anything at power-up");
        chain.run(DISCOVERY);
        chain.assert_right(&format!("seed {seed}"));
        let types = [0, 1, 2, 3, 4].map(|module| chain.status(module).map(|status| status.module_type));
        assert_eq!(types, [Head, Spine, Spine, Spine, Tail].map(Some));
    }
}

/// A branch with two legs, a head and a tail: the right leg is at a UART in software.
#[test]
fn a_branch_finds_its_legs() {
    let back_of = |module| Face { module, dock: Dock::Back };
    let of_branch = |dock| Face { module: 1, dock };
    let robot = RobotBuilder::new(firmware(), MODULES)
        .attach(back_of(0), of_branch(Dock::Front))
        .attach(of_branch(Dock::Back), Face { module: 2, dock: Dock::Front })
        .attach(of_branch(Dock::Left), back_of(3))
        .attach(of_branch(Dock::Right), back_of(4))
        .seed(1);
    let mut branch = Chain::of_robot(robot.build().expect("the docks are free"), 1);
    branch.run(DISCOVERY);
    branch.assert_right("at the start");
    let types = [0, 1, 2, 3, 4].map(|module| branch.status(module).map(|status| status.module_type));
    assert_eq!(types, [Head, Branch, Tail, LeftLeg, RightLeg].map(Some));
    let trace_events = branch.run(5 * SECOND);
    let received_by = |wanted| {
        trace_events.iter().filter(move |trace_event| {
            trace_event.module == wanted && matches!(trace_event.event, Behaviour::HormoneReceived(..))
        })
    };
    for leg in [3, 4] {
        assert_eq!(received_by(leg).count(), 10, "module {leg}");
    }
    branch.assert_right("after 5 s");
}

#[test]
fn hormones_reach_the_tail_in_turn() {
    let repeated = (1..=10).map(|seed| {
        let mut chain = Chain::new(MODULES, seed);
        let trace_events = chain.run(5 * SECOND);
        chain.assert_right("after 5 s");
        Hormones::follow(MODULES, &trace_events, chain.cycle()).assert_whole(9);
        let repeated = chain.sum(Count::RETRIES);
        assert_eq!(repeated, chain.sum(Count::DUPLICATES), "seed {seed}: on a good link nothing is lost");
        repeated
    });
    // Now and then an ACK begins too late: docs/decisions.md, "Links".
    let repeated = repeated.sum::<u64>();
    assert!(repeated <= 3, "{repeated} frames are repeated");
}

#[test]
fn the_outcome_depends_on_the_seed_only() {
    let outcome = |seed, threads| {
        let mut chain = Chain::on_threads(MODULES, seed, threads);
        chain.lose_frames(0.1);
        let trace_events = chain.run(SECOND);
        (chain.robot().state_hash(), trace_events)
    };
    let expected = outcome(1, 1);
    for threads in 1..=3 {
        assert_eq!(outcome(1, threads), expected, "{threads} threads");
    }
    let other = outcome(2, 1);
    assert_ne!(other.0, expected.0);
    assert_ne!(other.1, expected.1, "other frames are lost");
}

/// At a stop a user may act on the robot or inspect it.
#[test]
fn where_a_run_is_stopped_changes_nothing_of_it() {
    const END: u64 = SECOND / 2;
    let outcome = |seed, stops: &[u64]| {
        let mut chain = Chain::new(MODULES, seed);
        chain.lose_frames(0.1);
        for stop in stops {
            chain.run(stop - chain.cycle());
        }
        let of_module = |module| {
            let module = chain.robot().module(module).expect("it is there");
            Controller::ALL.map(|controller| module.mcu(controller).awake_cycles())
        };
        (chain.robot().state_hash(), (0..MODULES).map(of_module).collect::<Vec<_>>())
    };
    let mut noise = 12_345u32;
    for seed in 0..40 {
        let mut stops: Vec<_> = (0..40)
            .map(|_| {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (u64::from(noise) * END) >> 32
            })
            .chain([END])
            .collect();
        stops.sort();
        stops.dedup();
        assert_eq!(outcome(seed, &stops), outcome(seed, &[END]), "seed {seed}");
    }
}

/// Where one frame is lost in the tests below: from a spine to the next, and back.
const SENDER: Face = Face { module: 1, dock: Dock::Back };
const RECEIVER: Face = Face { module: 2, dock: Dock::Front };

/// The hormone whose frame or ACK is lost is the first with this data.
const HIT: Data = Data::A;

/// Runs to the millisecond with the awaited event, and returns all events of that millisecond.
fn run_to(chain: &mut Chain, is_it: impl Fn(&TraceEvent) -> bool) -> Vec<TraceEvent> {
    let end = chain.cycle() + 2 * SECOND;
    loop {
        let trace_events = chain.run(MILLISECOND);
        if trace_events.iter().any(&is_it) {
            return trace_events;
        }
        assert!(chain.cycle() < end, "what was waited for did not happen");
    }
}

fn is_generated(trace_event: &TraceEvent) -> bool {
    matches!(trace_event.event, Behaviour::HormoneGenerated(_))
}

/// When a module first had this event.
fn time_of(trace_events: &[TraceEvent], module: usize, event: Behaviour) -> u64 {
    let trace_event =
        trace_events.iter().find(|trace_event| trace_event.module == module && trace_event.event == event);
    trace_event.unwrap_or_else(|| panic!("module {module}: no {event:?}")).cycle
}

/// A chain that repeats nothing by itself, in 5 s. In one run of twenty an ACK begins too late.
fn undisturbed() -> Chain {
    static SEED: LazyLock<u64> = LazyLock::new(|| {
        let is_undisturbed = |seed: &u64| {
            let mut chain = Chain::new(MODULES, *seed);
            chain.run(5 * SECOND);
            chain.sum(Count::RETRIES) == 0
        };
        (1..=5).find(is_undisturbed).expect("one of five is undisturbed")
    });
    Chain::new(MODULES, *SEED)
}

/// A run in which one frame from the dock `from` is lost, for which a hormone is repeated. It is one of the
/// frames sent about the time of the trace event `event`; the others are probes, which are not repeated.
fn lose_one(from: Face, event: Behaviour) -> (Chain, Vec<TraceEvent>) {
    let mut chain = undisturbed();
    run_to(&mut chain, |trace_event| trace_event.module == from.module && trace_event.event == event);
    let next = chain.robot().link_counts(from).expect("the dock is attached").frames;
    let runs = (next - 2..next + 3).map(|frame| {
        let mut chain = undisturbed();
        chain.set_faults(from, Faults { lost_frames: [frame].into(), ..Faults::default() });
        let trace_events = chain.run(2 * SECOND);
        (chain, trace_events)
    });
    let mut repeated = runs.filter(|(chain, _)| chain.sum(Count::RETRIES) > 0);
    let (chain, trace_events) = repeated.next().expect("one of these frames is repeated when it is lost");
    assert_eq!(chain.robot().link_counts(from).map(|counts| counts.lost_frames), Some(1));
    (chain, trace_events)
}

#[test]
fn a_hormone_whose_frame_is_lost_is_repeated() {
    let whole = undisturbed().run(2 * SECOND);
    let (chain, trace_events) = lose_one(SENDER, Behaviour::HormoneSent(Dock::Back, HIT));
    assert_eq!((chain.count(SENDER, Count::RETRIES), chain.sum(Count::RETRIES)), (1, 1));
    assert_eq!(chain.sum(Count::DUPLICATES), 0);
    Hormones::follow(MODULES, &trace_events, chain.cycle()).assert_whole(3);
    // The repetition comes after the frame of 1.8 ms and the wait for an ACK, whose first tick may come at
    // once. The limit is lower by the time that higher tasks may delay HORMONE in the run without a loss.
    let soonest = u64::from(ACK_TIMEOUT - 1) * MILLISECOND + 3 * MILLISECOND / 2;
    let received = Behaviour::HormoneReceived(Dock::Front, HIT);
    let [late, in_time] =
        [&trace_events, &whole].map(|trace_events| time_of(trace_events, RECEIVER.module, received));
    assert!(late >= in_time + soonest && late <= in_time + 10 * MILLISECOND, "{late} {in_time}");
}

#[test]
fn a_hormone_whose_ack_is_lost_is_acknowledged_again_and_delivered_once() {
    let whole = undisturbed().run(2 * SECOND);
    let (chain, trace_events) = lose_one(RECEIVER, Behaviour::HormoneReceived(Dock::Front, HIT));
    assert_eq!((chain.count(SENDER, Count::RETRIES), chain.sum(Count::RETRIES)), (1, 1));
    assert_eq!((chain.count(RECEIVER, Count::DUPLICATES), chain.sum(Count::DUPLICATES)), (1, 1));
    Hormones::follow(MODULES, &trace_events, chain.cycle()).assert_whole(3);
    let received = Behaviour::HormoneReceived(Dock::Front, HIT);
    let [late, in_time] =
        [&trace_events, &whole].map(|trace_events| time_of(trace_events, RECEIVER.module, received));
    assert_eq!(late, in_time, "the hormone itself was not lost");
}

/// Cuts one direction of the link while a hormone is on its way to it, until the hormone is given up.
fn cut(from: Face) -> (Chain, Hormones) {
    let mut chain = undisturbed();
    chain.run(SECOND * 3 / 4);
    let mut trace_events = run_to(&mut chain, is_generated);
    chain.set_faults(from, Faults { frame_loss: 1.0, ..Faults::default() });
    trace_events.extend(chain.run(HOP_AT_MOST + 50 * MILLISECOND));
    assert_eq!((chain.count(SENDER, Count::GAVE_UP), chain.sum(Count::GAVE_UP)), (1, 1));
    let hormones = Hormones::follow(MODULES, &trace_events, chain.cycle());
    chain.set_faults(from, Faults::default());
    chain.run(DISCOVERY);
    chain.assert_right("the link is whole again");
    (chain, hormones)
}

#[test]
fn a_hormone_that_does_not_get_through_is_given_up_and_counted() {
    let (chain, hormones) = cut(SENDER);
    // The module behind makes the beat good, and passes on the hormone that it did not get.
    assert_eq!((hormones.sent, hormones.delivered, hormones.lost), (4, 3, 1), "{hormones:?}");
    assert_eq!(chain.sum(Count::DUPLICATES), 0);
}

#[test]
fn a_hormone_without_any_ack_is_given_up_and_yet_delivered_once() {
    let (chain, hormones) = cut(RECEIVER);
    assert_eq!((hormones.sent, hormones.delivered, hormones.unsent), (4, 4, 0), "{hormones:?}");
    assert_eq!(chain.count(RECEIVER, Count::DUPLICATES), chain.count(SENDER, Count::RETRIES));
}

/// A third of all frames is lost, both ways, for 20 s.
#[test]
fn no_hormone_is_lost_without_notice() {
    for seed in 1..=3 {
        let mut chain = Chain::new(MODULES, seed);
        chain.lose_frames(0.3);
        let trace_events = chain.run(20 * SECOND);
        chain.assert_alive();
        let hormones = Hormones::follow(MODULES, &trace_events, chain.cycle());
        let given_up = chain.sum(Count::GAVE_UP);
        assert_eq!(hormones.unsent, 0, "seed {seed}: no hormone comes twice: {hormones:?}");
        assert!(hormones.lost as u64 <= given_up, "seed {seed}: {given_up} given up: {hormones:?}");
        assert!(hormones.delivered > 30 * (MODULES - 1), "seed {seed}: {hormones:?}");
        assert!(
            chain.sum(Count::RETRIES) > 50 && chain.sum(Count::DUPLICATES) > 20,
            "seed {seed}: too few losses"
        );
        chain.lose_frames(0.0);
        chain.run(SECOND / 2);
        chain.assert_right(&format!("seed {seed}"));
    }
}

const MASTER: &[Controller] = &[Controller::Master];
const SLAVE: &[Controller] = &[Controller::Slave];
const BOTH: &[Controller] = &Controller::ALL;

/// The events of the next `seconds`, from a moment when no hormone is under way.
fn from_a_quiet_moment(chain: &mut Chain, seconds: u64) -> Vec<TraceEvent> {
    run_to(chain, is_generated);
    chain.run(HOP_AT_MOST);
    chain.run(seconds * SECOND)
}

/// Resets MCUs of one module again and again, at arbitrary moments.
fn recovers_from_resets(module: usize, mcus: &[Controller]) {
    let mut chain = Chain::new(MODULES, 1);
    chain.run(SECOND);
    for number in 0..12 {
        chain.run(number * 777);
        for &mcu in mcus {
            chain.reset(module, mcu);
        }
        chain.run(START_UP + DISCOVERY);
        chain.assert_right(&format!("reset {number} of {mcus:?} in module {module}"));
    }
    let trace_events = from_a_quiet_moment(&mut chain, 2);
    Hormones::follow(MODULES, &trace_events, chain.cycle()).assert_whole(4);
}

#[test]
fn resets_of_a_head_are_recovered_from() {
    for mcus in [MASTER, SLAVE, BOTH] {
        recovers_from_resets(0, mcus);
    }
}

#[test]
fn resets_of_a_spine_are_recovered_from() {
    for mcus in [MASTER, SLAVE, BOTH] {
        recovers_from_resets(2, mcus);
    }
}

#[test]
fn resets_of_a_tail_are_recovered_from() {
    for mcus in [MASTER, SLAVE, BOTH] {
        recovers_from_resets(4, mcus);
    }
}

/// Its RAM still has the values from before the reset.
#[test]
fn a_module_in_reset_says_nothing() {
    let mut chain = Chain::new(MODULES, 1);
    chain.run(SECOND);
    chain.hold_in_reset(2, MASTER, 10 * MILLISECOND);
    assert_eq!(chain.status(2), None);
    chain.run(START_UP + DISCOVERY);
    assert!(chain.status(2).is_some_and(|status| status.module_type == Spine));
}

/// The chain falls in two where an MCU is gone, and comes together again.
#[test]
fn an_mcu_held_in_reset_is_missed_and_found_again() {
    for mcus in [MASTER, SLAVE, BOTH] {
        let mut chain = Chain::new(MODULES, 1);
        chain.run(SECOND);
        chain.hold_in_reset(2, mcus, 400 * MILLISECOND);
        chain.assert_alive();
        let types = [0, 1, 3, 4].map(|module| chain.status(module).map(|status| status.module_type));
        // Without its slave the module in the middle still answers at its Front.
        let second = if mcus == SLAVE { Spine } else { Tail };
        let expected = [Head, second, Head, Tail];
        assert_eq!(types, expected.map(Some), "{mcus:?}");
        chain.run(START_UP + DISCOVERY);
        chain.assert_right(&format!("{mcus:?} are back"));
        let trace_events = from_a_quiet_moment(&mut chain, 2);
        Hormones::follow(MODULES, &trace_events, chain.cycle()).assert_whole(4);
    }
}

/// Three frames of four are lost, both ways, for 40 s; in the first half modules find out that links are
/// lossy.
#[test]
fn every_module_keeps_the_beat_while_three_frames_of_four_are_lost() {
    const HALF_PERIOD: u64 = 500;
    let mut chain = Chain::new(MODULES, 1);
    chain.run(SECOND / 2);
    chain.lose_frames(0.75);
    chain.run(20 * SECOND);
    let trace_events = chain.run(20 * SECOND);
    chain.assert_right("with losses");
    assert!(
        trace_events.iter().all(|trace_event| !matches!(trace_event.event, Behaviour::TopologyChanged(_))),
        "a neighbour was missed"
    );
    for module in 0..MODULES - 1 {
        let acted = |trace_event: &&TraceEvent| {
            trace_event.module == module && matches!(trace_event.event, Behaviour::ActionBegun(_))
        };
        let beats: Vec<u64> =
            trace_events.iter().filter(acted).map(|trace_event| trace_event.cycle / MILLISECOND).collect();
        assert_eq!(beats.len(), 40, "module {module}");
        let is_even = |pair: &[u64]| (pair[1] - pair[0]).abs_diff(HALF_PERIOD) < HALF_PERIOD / 4;
        assert!(beats.windows(2).all(is_even), "module {module}: {beats:?}");
    }
}
