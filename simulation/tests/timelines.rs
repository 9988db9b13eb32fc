//! Random robots go through random timelines: the judges find no fault with modules that do what they should.

use simulation::{Face, MILLISECOND, Native, Random, Robot, Run, Scenario, Wiring, faults};
use tasks::dock::Dock;

const SECOND: u64 = 1000 * MILLISECOND;

/// The faults of the robot in a file after so many seconds, and once all modules have been judged.
fn verdict(file: &str, seed: u64, seconds: u64) -> Vec<String> {
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(file).expect("the file is right");
    let mut run = Run::new(Native::new(wiring, seed, 40 * MILLISECOND), timeline, SECOND);
    while run.step(seconds * SECOND).unwrap_or(true) {}
    if let Some((_, until)) = run.observer.gait.unjudged(run.robot.now()) {
        while run.step(until).unwrap_or(true) {}
    }
    // A robot that docks by itself may have no room for an event.
    run.impossible.clear();
    faults(&run, true)
}

/// Fails where the judges find a fault with a robot to which these events happen.
fn expect_no_fault(robot: &str, events: &str, seed: u64, seconds: u64) {
    let file = format!("{robot}\n[[event]]\n{events}\n");
    assert_eq!(verdict(&file, seed, seconds), [""; 0], "{file}");
}

/// A robot file: the robot, and what happens to it at these times, in ms.
fn file(robot: &str, events: &[(usize, String)]) -> String {
    let event = |(at, what): &(usize, String)| format!("[[event]]\nat = {}\n{what}\n", *at as f64 / 1000.0);
    robot.to_owned() + &events.iter().map(event).collect::<String>()
}

fn dock(random: &mut Random) -> Dock {
    Dock::ALL[random.below(6)]
}

/// A known shape, or modules that are joined anyhow.
fn robot(random: &mut Random) -> String {
    let modules = 3 + random.below(9);
    match random.below(6) {
        0 => format!("shape = \"chain\"\nmodules = {modules}\n"),
        1 => format!("shape = \"centipede\"\nmodules = {}\n", 8 + modules),
        2 => format!("shape = \"ring\"\nmodules = {modules}\n"),
        3 => format!("shape = \"cross\"\nmodules = {}\n", 8 + modules),
        _ => joined_anyhow(random, modules),
    }
}

/// A tree with up to two loops.
fn joined_anyhow(random: &mut Random, modules: usize) -> String {
    let mut wiring = Wiring::new(modules);
    for module in 1..modules {
        loop {
            let face = Face { module: random.below(module), dock: dock(random) };
            let own = Face { module, dock: [Dock::Front, Dock::Back][random.below(2)] };
            if wiring.attach(face, own).is_ok() {
                break;
            }
        }
    }
    for _ in 0..random.below(3) {
        let mut face = || Face { module: random.below(modules), dock: dock(random) };
        // One that can't be joined is left out.
        let _ = wiring.attach(face(), face());
    }
    let docks = wiring.attachments().map(|(one, other)| [one.to_string(), other.to_string()]);
    format!("modules = {modules}\ndocks = {:?}\n", docks.collect::<Vec<_>>())
}

/// Something that may happen to a robot of so many modules; it may be impossible.
fn change(random: &mut Random, modules: usize) -> String {
    let (module, other) = (random.below(modules), random.below(modules));
    let face = format!("{module}.{:?}", dock(random));
    match random.below(11) {
        0 => format!("attach = [\"{face}\", \"{other}.{:?}\"]", dock(random)),
        1 => format!("detach = \"{face}\""),
        2 => format!("swap = [{module}, {other}]"),
        3 => format!("reset = {module}\nmcu = \"{}\"", ["master", "slave", "both"][random.below(3)]),
        4 => format!("kill = {module}"),
        5 => format!("loss = {}", [0.0, 0.1, 0.3, 0.5][random.below(4)]),
        6 => format!("noise = {}", [0.0, 0.01, 0.03][random.below(3)]),
        7 => format!("loss = {}\nfrom = \"{face}\"", [0, 1, 1][random.below(3)]),
        8 => format!("{} = \"{face}\"", ["obstacle", "clear"][random.below(2)]),
        9 => format!("roll = {}", [0, 90, 180, -120][random.below(4)]),
        _ => {
            let (gait, period) = (random.below(11), [255, 255, 10, 20, 40][random.below(5)]);
            format!("command = [{}, {}, {period}]\nto = \"{face}\"", 0xd0 + gait, random.below(256))
        }
    }
}

/// A random robot file, and how many seconds it takes.
fn plan(seed: u64) -> (String, u64) {
    let mut random = Random::new(seed);
    let robot = robot(&mut random);
    let modules = Scenario::from_toml(&robot).expect("the robot is right").wiring.modules();
    let (mut at, mut events) = (1000 + random.below(5000), Vec::new());
    let wanted = 1 + random.below(6);
    let is_possible = |file: &str| Scenario::from_toml(file).is_ok();
    for _ in 0..200 {
        events.push((at, change(&mut random, modules)));
        // An obstacle takes its turn also where there is no room for it.
        if is_possible(&file(&robot, &events).replace("obstacle", "clear")) {
            at += if random.chance(0.3) { random.below(60) } else { random.below(9000) };
        } else {
            events.pop();
        }
        if events.len() == wanted {
            break;
        }
    }
    let mut possible = Vec::new();
    for event in events {
        possible.push(event);
        if !is_possible(&file(&robot, &possible)) {
            possible.pop();
        }
    }
    (file(&robot, &possible), at as u64 / 1000 + 20)
}

/// A random robot file with bursts of orders, cuts, joins and resets, each burst within some 300 ms.
fn meeting(seed: u64) -> (String, u64) {
    let mut random = Random::new(seed);
    let robot = robot(&mut random);
    let modules = Scenario::from_toml(&robot).expect("the robot is right").wiring.modules();
    let gaits = [random.below(8), random.below(8), 0];
    let (mut at, mut events) = (1000 + random.below(3000), Vec::new());
    for _ in 0..1 + random.below(2) {
        for _ in 0..40 {
            let event = if random.chance(0.7) {
                let gait = gaits[random.below(3)];
                let period = [255, 255, 10, 40, 80][random.below(5)];
                let to = format!("{}.{:?}", random.below(modules), dock(&mut random));
                format!("command = [{}, {}, {period}]\nto = \"{to}\"", 0xd0 + gait, random.below(256))
            } else {
                change(&mut random, modules)
            };
            events.push((at, event));
            if Scenario::from_toml(&file(&robot, &events)).is_err() {
                events.pop();
                continue;
            }
            at += random.below(100);
            if random.chance(0.2) {
                break;
            }
        }
        at += 8000 + random.below(8000);
    }
    (file(&robot, &events), at as u64 / 1000 + 20)
}

/// The robot may have no head, or may not hear an order: that is the file's.
fn is_of_file(fault: &str) -> bool {
    let starts = ["nobody leads", "nobody heard", "no hormone was delivered", "no module has power"];
    starts.iter().any(|start| fault.starts_with(start))
}

/// Fails where the judges find a fault with any of these robots, of which none does anything wrong.
/// `SUPERBOT_TIMELINES=FROM..TO` tries other seeds.
fn expect_no_faults(plan: impl Fn(u64) -> (String, u64)) {
    let range = std::env::var("SUPERBOT_TIMELINES").unwrap_or("100..160".into());
    let (from, to) = range.split_once("..").expect("FROM..TO");
    let number = |text: &str| text.parse::<u64>().expect("a number");
    let mut found = Vec::new();
    for seed in number(from)..number(to) {
        let (file, seconds) = plan(seed);
        let mut faults = verdict(&file, seed, seconds);
        faults.retain(|fault| !is_of_file(fault));
        if !faults.is_empty() {
            found.push(format!("seed {seed}, {seconds} s: {faults:?}\n{file}"));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn random_timelines_have_no_fault() {
    expect_no_faults(plan);
}

#[test]
fn orders_that_meet_changes_and_other_orders_have_no_fault() {
    expect_no_faults(meeting);
}

/// Where hormones came by one way and then come by another, a module waits: the one before it makes good
/// eight beats whose leader is gone, and then three are silent.
#[test]
fn a_module_has_time_to_follow_hormones_that_come_another_way() {
    for (robot, at, event, seed, seconds) in [
        ("shape = \"cross\"\nmodules = 17", 14.583, "kill = 0", 87, 25),
        ("shape = \"cross\"\nmodules = 11", 5.529, "kill = 8", 93, 16),
        ("shape = \"cross\"\nmodules = 11", 4.654, "detach = \"7.Back\"", 1295, 15),
        ("shape = \"cross\"\nmodules = 17", 4.677, "loss = 1\nfrom = \"4.Front\"", 1927, 15),
        ("shape = \"cross\"\nmodules = 19", 2.45, "kill = 7", 2069, 13),
        (
            "modules = 7\ndocks = [[\"0.Left\", \"1.Front\"], [\"0.Down\", \"2.Back\"], \
             [\"1.Left\", \"4.Back\"], [\"2.Front\", \"3.Up\"], [\"2.Right\", \"3.Back\"], \
             [\"3.Front\", \"5.Back\"], [\"4.Front\", \"6.Back\"]]",
            3.668,
            "swap = [4, 3]\n[[event]]\nat = 14.323\nkill = 4",
            1293,
            25,
        ),
        // Another module comes to the dock that hormones came by, and stays their way for a while.
        (
            "modules = 6\ndocks = [[\"0.Back\", \"1.Back\"], [\"1.Left\", \"2.Back\"], \
             [\"2.Front\", \"3.Back\"], [\"2.Left\", \"4.Down\"], [\"2.Down\", \"5.Front\"], \
             [\"3.Left\", \"4.Back\"]]",
            3.697,
            "swap = [1, 0]",
            1994,
            14,
        ),
        (
            "modules = 9\ndocks = [[\"0.Front\", \"1.Back\"], [\"0.Back\", \"5.Back\"], \
             [\"0.Right\", \"2.Back\"], [\"1.Down\", \"3.Front\"], [\"2.Right\", \"7.Front\"], \
             [\"3.Right\", \"4.Back\"], [\"4.Up\", \"6.Back\"], [\"5.Left\", \"8.Front\"]]",
            2.187,
            "swap = [2, 0]",
            8199,
            12,
        ),
    ] {
        expect_no_fault(robot, &format!("at = {at}\n{event}"), seed, seconds);
    }
}

/// The beat of a loop goes on by itself there, while the head's hormones come to one of its modules by
/// another way.
#[test]
fn a_loop_that_cuts_off_the_head_gives_way_to_it() {
    for (modules, events, seed) in [
        (
            12,
            "at = 5.689\nswap = [1, 10]\n[[event]]\nat = 11.813\nattach = [\"9.Up\", \"6.Left\"]\n\
             [[event]]\nat = 16.969\nreset = 5",
            30261,
        ),
        (
            19,
            "at = 1.391\ncommand = [0xd1, 237, 80]\nto = \"10.Left\"\n\
             [[event]]\nat = 2.807\ncommand = [0xd1, 60, 20]\nto = \"8.Up\"\n\
             [[event]]\nat = 9.86\nswap = [7, 2]\n[[event]]\nat = 11.383\nreset = 17\n\
             [[event]]\nat = 19.818\nattach = [\"12.Right\", \"17.Right\"]",
            32039,
        ),
    ] {
        expect_no_fault(&format!("shape = \"centipede\"\nmodules = {modules}"), events, seed, 40);
    }
}

/// Modules that have a choice decide one after the other. In the first robot each of them makes good the
/// beats of the dead leader. In the others a module follows a new way once the one before it does.
#[test]
fn modules_choose_another_way_in_turn() {
    for (robot, events, seed) in [
        (
            "modules = 10\ndocks = [[\"0.Front\", \"4.Back\"], [\"0.Right\", \"1.Front\"], \
             [\"0.Down\", \"3.Back\"], [\"1.Left\", \"2.Back\"], [\"2.Down\", \"8.Front\"], \
             [\"3.Front\", \"9.Back\"], [\"3.Right\", \"5.Front\"], [\"4.Left\", \"6.Back\"], \
             [\"6.Front\", \"7.Back\"], [\"8.Right\", \"9.Right\"]]",
            "at = 11.274\nnoise = 0.03\n[[event]]\nat = 15.632\nswap = [4, 1]\n\
             [[event]]\nat = 15.637\nkill = 9",
            59354,
        ),
        ("shape = \"cross\"\nmodules = 19", "at = 1.345\nswap = [15, 17]", 63942),
        ("shape = \"cross\"\nmodules = 14", "at = 7.075\nattach = [\"3.Down\", \"13.Front\"]", 65316),
        (
            "modules = 6\ndocks = [[\"0.Front\", \"3.Back\"], [\"0.Back\", \"1.Back\"], \
             [\"1.Up\", \"2.Back\"], [\"2.Front\", \"4.Front\"], [\"4.Left\", \"5.Front\"]]",
            "at = 2.333\nswap = [2, 5]\n[[event]]\nat = 11.321\nswap = [4, 5]\n\
             [[event]]\nat = 13.761\nattach = [\"0.Up\", \"1.Right\"]\n\
             [[event]]\nat = 13.766\nswap = [4, 0]\n[[event]]\nat = 17.255\nnoise = 0.01",
            63997,
        ),
    ] {
        expect_no_fault(robot, events, seed, 30);
    }
}

/// Between two changes it may do by the old way what is right by the new one.
#[test]
fn a_further_change_leaves_a_module_the_time_to_choose() {
    for (robot, events, seed) in [
        (
            "shape = \"cross\"\nmodules = 16",
            "at = 5.505\nkill = 0\n[[event]]\nat = 5.553\ndetach = \"2.Back\"\n\
             [[event]]\nat = 5.602\ncommand = [0xd5, 123, 255]\nto = \"14.Down\"",
            63305,
        ),
        (
            "modules = 6\ndocks = [[\"0.Back\", \"1.Front\"], [\"0.Right\", \"5.Right\"], \
             [\"1.Back\", \"2.Back\"], [\"1.Right\", \"4.Back\"], [\"2.Left\", \"3.Back\"], \
             [\"4.Up\", \"5.Front\"]]",
            "at = 3.501\ndetach = \"0.Right\"\n[[event]]\nat = 3.541\nkill = 2",
            64615,
        ),
    ] {
        expect_no_fault(robot, events, seed, 20);
    }
}

/// Module 3 makes good the beats that came from module 2, until three are silent.
#[test]
fn a_module_that_nothing_comes_to_between_two_changes_has_a_choice_too() {
    for at in [2.749, 5.2] {
        let robot = "modules = 5\ndocks = [[\"0.Front\", \"1.Back\"], [\"0.Right\", \"2.Front\"], \
                     [\"1.Right\", \"4.Back\"], [\"2.Left\", \"3.Front\"]]";
        let events = format!(
            "at = 2.747\ndetach = \"0.Right\"\n[[event]]\nat = {at}\nattach = [\"0.Back\", \"3.Right\"]"
        );
        expect_no_fault(robot, &events, 71238, 20);
    }
}

/// In the first two the part behind hears the order, or the other one of two; in the third it does not.
#[test]
fn where_an_order_and_a_change_meet_the_robot_decides_what_it_has_heard() {
    for (robot, events, seed) in [
        (
            "shape = \"cross\"\nmodules = 14",
            "at = 1.25\nloss = 1\nfrom = \"4.Back\"\n\
             [[event]]\nat = 1.308\ncommand = [0xd8, 190, 255]\nto = \"1.Right\"",
            57042,
        ),
        (
            "shape = \"centipede\"\nmodules = 14",
            "at = 9.015\ncommand = [0xd9, 87, 20]\nto = \"6.Right\"\n\
             [[event]]\nat = 9.015\ncommand = [0xd3, 68, 255]\nto = \"13.Back\"",
            57977,
        ),
        (
            "shape = \"centipede\"\nmodules = 19",
            "at = 2.989\ncommand = [0xd6, 178, 255]\nto = \"4.Left\"\n[[event]]\nat = 2.99\nkill = 13",
            40789,
        ),
        // By the last one the robot becomes a chain, which it is, and then walks as by the first two.
        (
            "shape = \"chain\"\nmodules = 4",
            "at = 3\ncommand = [0xd2, 38, 40]\nto = \"3.Up\"\n\
             [[event]]\nat = 3.05\ncommand = [0xd2, 123, 10]\nto = \"2.Up\"\n\
             [[event]]\nat = 3.14\ncommand = [0xd2, 75, 10]\nto = \"1.Up\"\n\
             [[event]]\nat = 3.17\ncommand = [0xd9, 223, 20]\nto = \"3.Left\"",
            83153,
        ),
        // The slave that hears it is reset before it has passed it on, and after.
        (
            "shape = \"chain\"\nmodules = 4",
            "at = 3\ncommand = [0xd7, 60, 80]\nto = \"2.Up\"\n\
             [[event]]\nat = 3.002\nreset = 2\nmcu = \"slave\"",
            80248,
        ),
        (
            "shape = \"chain\"\nmodules = 4",
            "at = 3\ncommand = [0xd7, 60, 80]\nto = \"2.Up\"\n\
             [[event]]\nat = 3.02\nreset = 2\nmcu = \"slave\"",
            80248,
        ),
        // It comes to a dock that still sends to the module that was there.
        (
            "modules = 6\ndocks = [[\"0.Back\", \"2.Front\"], [\"0.Down\", \"1.Back\"], \
             [\"2.Right\", \"3.Front\"], [\"3.Back\", \"4.Back\"], [\"3.Right\", \"5.Back\"]]",
            "at = 2.475\ndetach = \"3.Right\"\n\
             [[event]]\nat = 2.577\ncommand = [0xd0, 14, 255]\nto = \"3.Right\"",
            4,
        ),
        // The head recalls another order than that to stop.
        (
            "shape = \"chain\"\nmodules = 10",
            "at = 1.589\ncommand = [0xd5, 150, 80]\nto = \"9.Up\"\n\
             [[event]]\nat = 14.44\nreset = 0\nmcu = \"master\"\n\
             [[event]]\nat = 14.487\ncommand = [0xd0, 170, 80]\nto = \"2.Up\"\n\
             [[event]]\nat = 14.489\ncommand = [0xd5, 215, 80]\nto = \"1.Up\"",
            1,
        ),
        // Where frames are lost it shows later whether it stops.
        (
            "shape = \"ring\"\nmodules = 5",
            "at = 2.889\nloss = 0.3\n\
             [[event]]\nat = 13.027\ncommand = [0xd0, 192, 10]\nto = \"2.Down\"\n\
             [[event]]\nat = 13.058\ncommand = [0xd3, 115, 255]\nto = \"4.Right\"\n\
             [[event]]\nat = 13.111\nkill = 0",
            5,
        ),
    ] {
        expect_no_fault(robot, events, seed, 30);
    }
}

/// A module may be ordered before it knows the standing order of its body, and orders may meet on their way.
#[test]
fn which_of_two_orders_counts_is_decided_by_the_robot() {
    let chain = "shape = \"chain\"\nmodules = 8";
    let two_chains = "modules = 6\ndocks = [[\"0.Back\", \"1.Front\"], [\"1.Back\", \"2.Front\"], \
                      [\"3.Back\", \"4.Front\"], [\"4.Back\", \"5.Front\"]]";
    let order = |at: f64, gait: u8, to: &str| {
        format!("at = {at}\ncommand = [{}, 1, 255]\nto = \"{to}\"\n", 0xd0 + gait)
    };
    let join = "at = 3\nattach = [\"2.Back\", \"3.Front\"]\n".to_owned();
    let reset = "at = 3\nreset = 7\n".to_owned();
    for (robot, events) in [
        (two_chains, [order(2.0, 5, "0.Up"), join.clone(), order(3.01, 2, "4.Up")]),
        (two_chains, [order(2.99, 0, "0.Up"), join.clone(), order(3.01, 2, "4.Up")]),
        (two_chains, [join, order(3.0, 0, "0.Up"), order(3.01, 2, "4.Up")]),
        (chain, [reset, order(3.002, 0, "1.Right"), order(3.062, 3, "7.Left")]),
        // Both docks hear at once.
        (chain, [order(2.0, 2, "1.Up"), order(3.0, 3, "1.Down"), order(3.0, 4, "1.Up")]),
        (chain, [order(2.0, 2, "0.Up"), order(3.0, 0, "0.Up"), order(3.002, 3, "7.Up")]),
    ] {
        expect_no_fault(robot, &events.join("[[event]]\n"), 1, 20);
    }
}

/// Until it finds out that it is no head any more, it may beat. Who hears that follows it for three beats.
#[test]
fn a_head_that_has_moved_may_beat_once_more_where_it_is() {
    for (docks, event, seed) in [
        (r#"["0.Left", "1.Back"], ["1.Front", "2.Back"]"#, "at = 2.798\nswap = [0, 2]", 55702),
        (
            r#"["0.Left", "1.Back"], ["1.Front", "2.Back"], ["2.Front", "3.Back"]"#,
            "at = 2.375\nswap = [0, 3]",
            57522,
        ),
        // It is joined elsewhere before it finds out.
        (
            r#"["0.Back", "1.Front"], ["1.Back", "2.Front"], ["2.Back", "3.Front"], ["3.Back", "4.Front"]"#,
            "at = 2.8\nkill = 1\n[[event]]\nat = 2.85\nattach = [\"0.Left\", \"3.Down\"]",
            1,
        ),
    ] {
        let modules = docks.matches("], ").count() + 2;
        expect_no_fault(&format!("modules = {modules}\ndocks = [{docks}]"), event, seed, 16);
    }
}

/// A leg reads otherwise once it has adapted: as it did before the robot was turned.
#[test]
fn legs_of_a_robot_that_is_turned_have_time_to_adapt_whatever_they_read_since() {
    for (roll, at) in [(-120, 5.255), (120, 5.765), (115, 5.51)] {
        let events =
            format!("at = 1\ncommand = [0xd7, 1, 20]\nto = \"0.Left\"\n[[event]]\nat = {at}\nroll = {roll}");
        expect_no_fault("shape = \"centipede\"\nmodules = 10", &events, 1, 9);
    }
}

/// Round a ring by a chain's gait the last beat goes on by itself, and a hormone may be overtaken by the
/// next.
#[test]
fn hormones_are_not_lost_where_no_leader_sends_any() {
    let file = "shape = \"ring\"\nmodules = 7\n[[event]]\nat = 6.663\n\
        command = [0xd2, 123, 10]\nto = \"0.Down\"\n[[event]]\nat = 11.292\nreset = 1\n";
    let mut faults = verdict(file, 30007, 25);
    faults.retain(|fault| !is_of_file(fault));
    assert_eq!(faults, [""; 0]);
}

/// For 300 ms a module that comes there says that it hears its neighbour of before.
#[test]
fn a_module_may_come_to_a_dock_that_is_heard_in_one_direction_only() {
    for (robot, blind, at, pair, seed, seconds) in [
        ("shape = \"ring\"\nmodules = 8", (1.295, "3.Front"), 2.455, [1, 2], 8686, 14),
        ("shape = \"cross\"\nmodules = 11", (4.878, "5.Back"), 19.48, [1, 4], 5578, 30),
    ] {
        let (blind_at, from) = blind;
        let events =
            format!("at = {blind_at}\nloss = 1\nfrom = \"{from}\"\n[[event]]\nat = {at}\nswap = {pair:?}");
        expect_no_fault(robot, &events, seed, seconds);
    }
}

/// The loop cuts a head off. Its last beat would go round for ever if each module took it for a leader's.
#[test]
fn a_loop_without_a_leader_does_not_keep_out_the_other_leaders() {
    let cross = "shape = \"cross\"\nmodules = 11";
    let joined = "modules = 6\ndocks = [[\"0.Front\", \"2.Back\"], [\"0.Back\", \"3.Back\"], \
                  [\"0.Left\", \"1.Back\"], [\"1.Left\", \"3.Front\"], [\"2.Down\", \"5.Front\"], \
                  [\"3.Down\", \"4.Back\"]]";
    let reset = "attach = [\"4.Left\", \"5.Left\"]\n[[event]]\nat = 9.217\nreset = 9";
    for (robot, at, event, seed) in [
        (cross, 4.357, "attach = [\"10.Back\", \"8.Front\"]", 7193),
        (cross, 5.398, reset, 12),
        (joined, 4.794, "swap = [0, 4]", 6834),
    ] {
        let file = format!("{robot}\n[[event]]\nat = {at}\n{event}\n");
        let Scenario { wiring, timeline, .. } = Scenario::from_toml(&file).expect("the file is right");
        let mut run = Run::new(Native::new(wiring, seed, 40 * MILLISECOND), timeline, SECOND);
        let [until, end] = [26, 40].map(|seconds| {
            while run.step(seconds * SECOND).expect("the events can happen") {}
            run.observer.gait.violations()
        });
        assert_eq!(until, end, "{file}");
    }
}
