//! The verdict: what a robot does wrong is found, and nothing else, by the native engine's runs.

use std::num::NonZeroU16;

use hormone::action::Action::{Holding, HoldingOver, Swing, SwingOver};
use hormone::data::Data::{A, B};
use hormone::gait::{Gait, GaitName};
use hormone::module_type::ModuleType::{self, Branch, Head, LeftLeg, RightLeg, Spine};
use hormone::rule::{BACK, LEFT_RIGHT_BACK, Rule, received, timer};
use hormone::sense::Sense::UpsideDown;
use kernel::flash::Flash;
use simulation::{
    Change, Event, Face, MILLISECOND, Native, Random, Robot, Run, Scenario, Shape, Wiring, faults,
};
use tasks::dock::Dock;

mod table;

use table::{RULES, WALK, centipede_docks, mutants, table, walks};

const SECOND: u64 = 1000 * MILLISECOND;

/// The faults of the robot in a file after so many seconds.
fn verdict(file: &str, seconds: u64) -> Vec<String> {
    verdict_by(GaitName::Centipede.gait(), file, seconds)
}

/// As [`verdict`], with modules whose first gait is this.
fn verdict_by(gait: Gait, file: &str, seconds: u64) -> Vec<String> {
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(file).expect("the file is right");
    let robot = Native::with_gait(wiring, 1, 40 * MILLISECOND, gait);
    let mut run = Run::new(robot, timeline, SECOND);
    while run.step(seconds * SECOND).expect("the events can happen") {}
    faults(&run, true)
}

#[track_caller]
fn assert_found(faults: &[String], what: &str) {
    assert!(faults.iter().any(|fault| fault.contains(what)), "{faults:?}");
}

fn repeated(from: f64, every: f64, number: u32, what: &str) -> String {
    let event = |number| format!("[[event]]\nat = {}\n{what}\n", from + every * f64::from(number));
    (0..number).map(event).collect()
}

#[test]
fn a_robot_whose_modules_have_lost_their_power_does_nothing() {
    let kills: String = (0..5).map(|module| format!("[[event]]\nat = 4\nkill = {module}\n")).collect();
    let faults = verdict(&format!("shape = \"chain\"\nmodules = 5\n{kills}"), 8);
    assert_eq!(faults, ["no module has power"]);
    let headless = "shape = \"chain\"\nmodules = 2\n[[event]]\nat = 4\nkill = 0";
    assert_found(&verdict(headless, 8), "nobody leads");
    assert_found(&verdict(headless, 8), "order another gait, as the files in robots/gaits do");
}

#[test]
fn a_robot_that_walks_in_another_period_than_it_has_to_is_found() {
    let beat = |beat| Gait { beat: NonZeroU16::new(beat).unwrap(), ..GaitName::Centipede.gait() };
    let file = "shape = \"centipede\"\nmodules = 10\n";
    for (milliseconds, is_found) in [(250, true), (360, true), (500, false), (800, true), (1_000, true)] {
        let faults = verdict_by(beat(milliseconds), file, 12);
        let says_so =
            faults.iter().any(|fault| fault.contains("about one Period") || fault.contains("whole Period"));
        assert_eq!((says_so, faults.is_empty()), (is_found, !is_found), "{milliseconds} ms: {faults:?}");
    }
}

/// A module without power has no neighbour either, but does not beat its own time.
#[test]
fn a_module_without_power_is_no_module_alone() {
    let file = "modules = 3\ndocks = [[\"0.Back\", \"1.Front\"]]\n\
        [[event]]\nat = 2\ncommand = [0xda, 1, 255]\nto = \"2.Front\"\n\
        [[event]]\nat = 5\nkill = 2\n";
    assert_eq!(verdict(file, 12), [""; 0]);
    let headless = format!("{file}[[event]]\nat = 6\ndetach = \"0.Back\"");
    assert_found(&verdict(&headless, 12), "nobody leads");
}

/// It was ordered to stop, and has lost its power since. It does not count as a module that stands as
/// ordered.
#[test]
fn a_module_without_power_is_none_that_shall_stop() {
    let headless = "modules = 3\ndocks = [[\"0.Back\", \"1.Front\"]]\n\
        [[event]]\nat = 2\ncommand = [0xd0, 1, 255]\nto = \"2.Front\"\n\
        [[event]]\nat = 5\nkill = 2\n\
        [[event]]\nat = 6\ndetach = \"0.Back\"";
    assert_found(&verdict(headless, 12), "nobody leads");
}

#[test]
fn an_order_that_nobody_hears_is_a_fault_and_nobody_has_to_follow_it() {
    let unheard = |at| {
        let order = format!("an order to walk by Caterpillar at 1.Back after {at} s");
        format!("nobody heard {order}: no program ran there; give it later")
    };
    let both = "[[event]]\nat = 2\nreset = 1\n";
    let [master, slave] = ["master", "slave"].map(|mcu| format!("{both}mcu = \"{mcu}\"\n"));
    for (reset, at, is_heard) in [
        // Its power has not come yet; both its MCUs are reset, or the one that has the dock; they run again
        // the last time that the order is sent.
        ("", 0.0, false),
        (both, 2.01, false),
        (&slave, 2.01, false),
        (both, 2.04, true),
        // The slave takes it, and gives it up before the master runs, or just does not.
        (&master, 2.01, false),
        (&master, 2.045, false),
        (&master, 2.048, true),
    ] {
        let order = format!("[[event]]\nat = {at}\ncommand = [0xd2, 1, 255]\nto = \"1.Back\"");
        let faults = verdict(&format!("shape = \"chain\"\nmodules = 2\n{reset}{order}"), 8);
        let expected = if is_heard { vec![] } else { vec![unheard(at)] };
        assert_eq!(faults, expected, "{reset}{at}");
    }
}

#[test]
fn an_event_that_can_not_happen_is_a_fault_and_the_run_goes_on() {
    let robot = Native::new(Shape::Chain.wiring(3).unwrap(), 1, 40 * MILLISECOND);
    let [free, taken] = [Dock::Front, Dock::Back].map(|dock| Face { module: 0, dock });
    let event = |change| Event { at: SECOND, change };
    let order = Change::Command { at: free, payload: vec![0xd2, 1, 255] };
    let timeline = vec![event(Change::Detach(free)), event(order.clone()), event(Change::Console(taken))];
    let mut run = Run::new(robot, timeline, SECOND);
    while run.step(8 * SECOND).unwrap_or(true) {}
    assert_eq!(run.robot.now(), 8 * SECOND);
    assert_eq!(run.happened(), [event(order)]);
    assert_eq!(
        faults(&run, true),
        [
            "an event could not happen at 1 s (0.Front is detached): nothing is attached to the Front dock \
             of module 0; attach something first, or name another",
            "an event could not happen at 1 s (the console is asked at 0.Back): the Back dock of module 0 is \
             attached already; detach it or use another"
        ]
    );
}

#[test]
fn a_dock_may_be_blind_at_the_end() {
    let blind = "[[event]]\nat = 2\nloss = 1\nfrom = \"1.Front\"";
    assert_eq!(verdict(&format!("shape = \"chain\"\nmodules = 5\n{blind}"), 8), [""; 0]);
}

/// All links lose everything: those that are attached later are mute, too, until lines are good again.
#[test]
fn a_link_is_mute_from_when_it_is_attached() {
    for mute in ["loss", "noise"] {
        let file = format!(
            "modules = 4\ndocks = [[\"0.Back\", \"1.Front\"], [\"2.Back\", \"3.Front\"]]\n\
             [[event]]\nat = 2\n{mute} = 1\n[[event]]\nat = 3\nattach = [\"1.Back\", \"2.Front\"]\n"
        );
        let [fault] = &verdict(&file, 5)[..] else { panic!("{mute}: {:?}", verdict(&file, 5)) };
        assert!(fault.contains("nobody leads"), "{mute}: {fault}");
        assert_eq!(verdict(&format!("{file}[[event]]\nat = 5\n{mute} = 0"), 10), [""; 0], "{mute}");
    }
}

#[test]
fn an_order_that_all_follow_is_none() {
    for (gait, shape, modules) in [(2, "chain", 5), (3, "chain", 5), (6, "four-legs", 8), (7, "six-legs", 11)]
    {
        let file = format!(
            "shape = \"{shape}\"\nmodules = {modules}\n[[event]]\nat = 2\ncommand = [{}, 1, 255]\nto = \"0.Front\"",
            0xd0 + gait
        );
        assert_eq!(verdict(&file, 10), [""; 0], "gait {gait}");
    }
}

/// A ring is ordered to close, and a chain to open. A chain that is joined to a ring later crawls no more.
#[test]
fn a_robot_goes_on_where_it_has_the_shape_that_it_is_ordered_to_take() {
    let ordered = |shape: &str, order: u8| {
        format!(
            "shape = \"{shape}\"\nmodules = 6\n\
             [[event]]\nat = 1\ncommand = [{order}, 1, 255]\nto = \"0.Up\"\n"
        )
    };
    assert_eq!(verdict(&ordered("ring", 0xd8), 15), [""; 0]);
    let chain = ordered("chain", 0xd9);
    assert_eq!(verdict(&chain, 15), [""; 0]);
    let joined = verdict(&format!("{chain}[[event]]\nat = 8\nattach = [\"0.Front\", \"5.Back\"]"), 20);
    assert!(matches!(&joined[..], [fault] if fault.contains("nobody leads")), "{joined:?}");
}

/// A chain that is to close becomes a ring, and comes apart soon after: it stands by the gait of rings, if it
/// had found out by then, and else goes on to close.
#[test]
fn a_robot_may_roll_as_soon_as_it_is_a_ring() {
    let file = "shape = \"chain\"\nmodules = 6\n\
        [[event]]\nat = 1\ncommand = [0xd8, 1, 255]\nto = \"0.Front\"\n\
        [[event]]\nat = 2\nattach = [\"0.Front\", \"5.Back\"]\n";
    let mut rolled = 0;
    let apart = [2.005, 2.06, 2.3, 2.9, 3.2, 3.49, 3.55, 3.8, 4.2, 4.6];
    for at in apart {
        match &verdict(&format!("{file}[[event]]\nat = {at}\ndetach = \"3.Back\""), 15)[..] {
            [] => {}
            [fault] if fault.contains("nobody leads") => rolled += 1,
            faults => panic!("{at}: {faults:?}"),
        }
    }
    assert!(rolled > 0 && rolled < apart.len(), "{rolled}");
}

/// The module that led the ring does not take the chain for one.
#[test]
fn a_ring_that_is_cut_closes_again() {
    for cut in 0..6 {
        let file = format!(
            "shape = \"ring\"\nmodules = 6\n\
             [[event]]\nat = 1\ncommand = [0xd4, 1, 255]\nto = \"0.Up\"\n\
             [[event]]\nat = 8\ndetach = \"{cut}.Back\"\n\
             [[event]]\nat = 9\ncommand = [0xd8, 2, 255]\nto = \"0.Up\"\n"
        );
        assert_eq!(verdict(&file, 30), [""; 0], "{cut}");
    }
}

/// A ring that opens is cut elsewhere before: its two parts find out one after the other.
#[test]
fn each_part_of_a_ring_crawls_once_it_has_noticed() {
    let file = "shape = \"ring\"\nmodules = 6\n\
        [[event]]\nat = 1\ncommand = [0xd9, 1, 255]\nto = \"2.Up\"\n";
    for milliseconds in (2_600..3_100).step_by(50) {
        let at = f64::from(milliseconds) / 1000.0;
        let faults = verdict(&format!("{file}[[event]]\nat = {at}\ndetach = \"0.Back\""), 9);
        assert_eq!(faults, [""; 0], "{at}");
    }
}

#[test]
fn resets_that_leave_no_time_for_a_beat_are_found() {
    let resets = repeated(2.0, 0.2, 40, "reset = 0");
    assert_found(&verdict(&format!("shape = \"centipede\"\nmodules = 14\n{resets}"), 10), "no letter");
}

/// A robot with wrong rules, and events that have nothing to do with the modules that walk wrong.
#[test]
fn an_inert_event_hides_no_fault() {
    let file = format!("modules = 16\ndocks = [{}]\n", centipede_docks(14));
    let expected = verdict_by(swapped(), &file, 8);
    assert_found(&expected, "the gait was wrong");
    for inert in [
        "reset = 14",
        "kill = 15",
        "obstacle = \"14.Up\"",
        "attach = [\"14.Back\", \"15.Front\"]",
        "command = [0xd1, 1, 255]\nto = \"14.Up\"",
        "command = [0xd1, 1, 255]\nto = \"0.Up\"",
        "roll = 0",
        "noise = 0",
        "loss = 0",
    ] {
        let events = repeated(4.3, 0.5, 1, inert);
        assert_eq!(verdict_by(swapped(), &format!("{file}{events}"), 8), expected, "{inert}");
    }
}

#[test]
fn an_event_after_the_end_changes_nothing() {
    for (file, is_right) in
        [("shape = \"cross\"\nmodules = 8\n", true), ("shape = \"ring\"\nmodules = 6\n", false)]
    {
        let before = verdict(file, 8);
        assert_eq!(before.is_empty(), is_right, "{before:?}");
        assert_eq!(verdict(&format!("{file}[[event]]\nat = 1000\nroll = 0"), 8), before);
    }
}

/// A leg at a body that lies on its back by the way it is attached.
#[test]
fn a_leg_that_hangs_upside_down_is_judged_by_how_it_lies() {
    let file = "modules = 4\ndocks = [[\"0.Back\", \"1.Front\"], [\"1.Down\", \"2.Down\"], [\"2.Left\", \"3.Back\"]]";
    assert_eq!(verdict(file, 10), [""; 0]);
    assert_eq!(verdict(&format!("{file}\n[[event]]\nat = 4.2\nroll = 180"), 10), [""; 0]);
}

/// The robot walks on before its sensors are looked at again.
#[test]
fn a_robot_that_is_turned_over_may_walk_on_within_a_short_period() {
    let file = "shape = \"six-legs\"\nmodules = 11\n\
        [[event]]\nat = 2\ncommand = [0xd7, 1, 10]\nto = \"0.Front\"\n";
    for milliseconds in (5_000..5_250).step_by(50) {
        let at = f64::from(milliseconds) / 1000.0;
        assert_eq!(verdict(&format!("{file}[[event]]\nat = {at}\nroll = 180"), 8), [""; 0], "{at}");
    }
}

/// An order to stop, and to walk on in another Period.
#[test]
fn a_robot_stops_and_walks_on_as_it_is_ordered() {
    let file = "shape = \"centipede\"\nmodules = 14\n[[event]]\nat = 3\ncommand = [0xd0, 1, 255]\nto = \"13.Back\"\n";
    assert_eq!(verdict(file, 8), [""; 0]);
    let on = format!("{file}[[event]]\nat = 6\ncommand = [0xd1, 2, 14]\nto = \"13.Back\"\n");
    assert_eq!(verdict(&on, 12), [""; 0]);
}

#[test]
fn parts_that_join_walk_or_rest_as_the_one_that_was_ordered_more_often() {
    let joined = |orders: &[(u64, u8, &str)]| {
        let order = |number: usize, &(at, gait, to): &(u64, u8, &str)| {
            format!("[[event]]\nat = {at}\ncommand = [{:#x}, {number}, 255]\nto = \"{to}\"\n", 0xd0 + gait)
        };
        let orders: String = orders.iter().enumerate().map(|(number, it)| order(number, it)).collect();
        let file = "shape = \"chain\"\nmodules = 6\n[[event]]\nat = 2\ndetach = \"2.Back\"\n";
        verdict(&format!("{file}{orders}[[event]]\nat = 8\nattach = [\"2.Back\", \"3.Front\"]\n"), 14)
    };
    // To stop counts as several.
    assert_eq!(joined(&[(3, 0, "0.Up"), (5, 2, "5.Up")]), [""; 0]);
    assert_eq!(
        joined(&[(3, 2, "5.Up"), (4, 3, "5.Up"), (5, 1, "0.Up"), (6, 2, "0.Up"), (7, 3, "0.Up")]),
        [""; 0]
    );
    assert_eq!(joined(&[(3, 2, "0.Up"), (4, 3, "0.Up"), (5, 2, "5.Up")]), [""; 0]);
}

/// A module is reset and attached, and so is a part whose modules are all reset together. If one of them is
/// not reset, it tells the others, and all go by the gait of a module alone, which no module leads.
#[test]
fn parts_that_join_do_not_walk_as_one_that_recalls_its_orders() {
    let joined = |last: usize, reset: usize| {
        let resets: String =
            (0..reset).map(|module| format!("[[event]]\nat = 5\nreset = {module}\n")).collect();
        let file = format!(
            "shape = \"chain\"\nmodules = 6\n[[event]]\nat = 2\ndetach = \"{last}.Back\"\n\
             [[event]]\nat = 3\ncommand = [0xd3, 1, 255]\nto = \"0.Up\"\n\
             [[event]]\nat = 4\ncommand = [0xda, 2, 255]\nto = \"0.Up\"\n{resets}\
             [[event]]\nat = 7\ncommand = [0xd2, 3, 255]\nto = \"5.Up\"\n\
             [[event]]\nat = 9\nattach = [\"{last}.Back\", \"{}.Front\"]\n",
            last + 1
        );
        verdict(&file, 14)
    };
    for (last, reset) in [(0, 0), (2, 2)] {
        assert_found(&joined(last, reset), "nobody leads");
    }
    for (last, reset) in [(0, 1), (2, 3)] {
        assert_eq!(joined(last, reset), [""; 0], "{last}");
    }
}

/// A module keeps no order for a gait that it does not have.
#[test]
fn a_robot_rests_by_an_order_for_a_gait_that_no_module_has() {
    let order = |at: u32, gait: u8| {
        format!("[[event]]\nat = {at}\ncommand = [{}, {at}, 255]\nto = \"2.Up\"\n", 0xd0 + gait)
    };
    let resets: String = (0..6).map(|module| format!("[[event]]\nat = 9\nreset = {module}\n")).collect();
    for (gait, later) in [(11, String::new()), (11, order(6, 2)), (11, resets)] {
        let file = format!("shape = \"chain\"\nmodules = 6\n{}{later}", order(3, gait));
        assert_eq!(verdict(&file, 15), [""; 0], "{file}");
    }
}

/// A short Period is ordered before the robot has had its time to walk by a long one.
#[test]
fn an_order_for_a_shorter_period_leaves_time_to_follow_it() {
    let file = "shape = \"centipede\"\nmodules = 10\n\
        [[event]]\nat = 5\ncommand = [0xd1, 1, 80]\nto = \"0.Front\"\n\
        [[event]]\nat = 6.95\ncommand = [0xd1, 2, 5]\nto = \"0.Front\"";
    assert_eq!(verdict(file, 10), [""; 0]);
}

/// Modules joined at random, with two heads: a module that hears both follows one of them.
#[test]
fn robots_with_two_heads_have_no_fault() {
    let mut judged = 0;
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let Some(wiring) = tree_with_two_heads(&mut random, 12) else { continue };
        let robot = Native::new(wiring.clone(), seed, 40 * MILLISECOND);
        let mut run = Run::new(robot, Vec::new(), SECOND);
        while run.step(8 * SECOND).expect("nothing happens") {}
        assert_eq!(
            faults(&run, true),
            [""; 0],
            "seed {seed}: {:?}",
            wiring.attachments().collect::<Vec<_>>()
        );
        judged += 1;
    }
    assert!(judged > 5, "{judged}");
}

/// A tree of so many modules, if it has two heads.
fn tree_with_two_heads(random: &mut Random, modules: usize) -> Option<Wiring> {
    let mut wiring = Wiring::new(modules);
    let mut pick = |count: usize| (random.next_u64() % count as u64) as usize;
    for module in 1..modules {
        loop {
            let face = simulation::Face { module: pick(module), dock: Dock::ALL[pick(6)] };
            let own = simulation::Face { module, dock: [Dock::Front, Dock::Back][pick(2)] };
            if wiring.attach(face, own).is_ok() {
                break;
            }
        }
    }
    let heads = (0..modules).filter(|&module| ModuleType::acting(&wiring.neighbours(module)) == Head);
    (heads.count() == 2).then_some(wiring)
}

#[test]
fn a_robot_that_is_too_long_for_the_run_is_not_passed() {
    assert_found(&verdict("shape = \"centipede\"\nmodules = 1000", 3), "were not judged");
    assert_eq!(verdict("shape = \"centipede\"\nmodules = 1000", 5), [""; 0]);
}

/// An order, or a module that comes back, does not replace the time that all have from power-up.
#[test]
fn what_happens_early_does_not_pass_a_robot_that_is_too_long_for_the_run() {
    for event in ["command = [0xd2, 1, 255]\nto = \"0.Front\"", "reset = 0"] {
        let file = format!("shape = \"chain\"\nmodules = 1000\n[[event]]\nat = 0.5\n{event}");
        assert_found(&verdict(&file, 2), "were not judged");
    }
}

/// Modules still have the time that the loss gave them, as far as it reaches into what came then.
#[test]
fn a_loss_that_gets_less_makes_nobody_late_after_the_fact() {
    for kind in ["loss = 0.85", "noise = 0.15"] {
        let (name, _) = kind.split_once(' ').expect("a name comes first");
        let events = format!("[[event]]\nat = 0\n{kind}\n[[event]]\nat = 1.6\n{name} = 0");
        let file = format!("shape = \"centipede\"\nmodules = 100\n{events}");
        assert_eq!(verdict(&file, 12), [""; 0], "{kind}");
    }
}

fn gait_of(rules: [Rule; RULES]) -> Gait {
    // SAFETY: only on the AVR does it matter where the rules lie.
    let rules: &'static Flash<[Rule]> = Box::leak(Box::new(unsafe { Flash::new(rules) }));
    Gait { rules, ..GaitName::Centipede.gait() }
}

#[test]
fn the_table_itself_is_right() {
    assert_eq!(verdict_by(gait_of(table()), &walks(), WALK), [""; 0]);
}

#[test]
fn every_mutant_of_every_rule_is_found() {
    let mut count = 0;
    for place in 0..RULES {
        for mutant in mutants(place) {
            let mut rules = table();
            let rule = std::mem::replace(&mut rules[place], mutant);
            let faults = verdict_by(gait_of(rules), &walks(), WALK);
            assert!(
                faults.iter().any(|it| it.contains("the gait was wrong")),
                "{mutant:?} for {rule:?}: {faults:?}"
            );
            count += 1;
        }
    }
    assert_eq!(count, 80);
}

/// The table with some rules replaced.
fn with(replace: impl Fn(Rule) -> Option<Rule>) -> Gait {
    gait_of(table().map(|rule| replace(rule).unwrap_or(rule)))
}

/// Legs that swing when they are to hold.
fn swapped() -> Gait {
    with(|rule| match rule.action() {
        Swing => Some(rule.perform(Holding)),
        Holding => Some(rule.perform(Swing)),
        SwingOver => Some(rule.perform(HoldingOver)),
        HoldingOver => Some(rule.perform(SwingOver)),
        _ => None,
    })
}

#[test]
fn tables_that_are_wrong_in_themselves_are_found() {
    let of = |rule: &Rule| rule.case().module_type();
    let no_branch_alternates = with(|rule| {
        let data = if rule.covers(A, 2) { A } else { B };
        (of(&rule) == Branch).then(|| rule.send(data, LEFT_RIGHT_BACK))
    });
    let spines_alternate = with(|rule| {
        let data = if rule.covers(A, 2) { B } else { A };
        (of(&rule) == Spine).then(|| rule.send(data, BACK))
    });
    for gait in [swapped(), no_branch_alternates, spines_alternate] {
        assert_found(&verdict_by(gait, "shape = \"six-legs\"\nmodules = 13", 5), "the gait was wrong");
    }
    // The places of rules in `table()` are as the test takes them.
    assert_eq!(table()[0], timer(Head, A).send(A, LEFT_RIGHT_BACK));
    assert_eq!(table()[7], received(LeftLeg, A).given(UpsideDown).perform(SwingOver));
    assert_eq!(table()[8], received(RightLeg, A).perform(Holding));
}
