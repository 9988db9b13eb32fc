//! Robots with the images that they are flashed with, in a physical world.

use plants::battery::{CAPACITY, IDLE_AMPERES};
use plants::motor::STALL_CURRENT;
use simavr_harness::{Engine, Ground, Physics, RobotBuilder, Variation};
use simulation::{
    Change, Face, JointFault, JointOf, Motion, Native, Robot, Run, Scenario, Shape, Terrain, Trouble,
};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock;
use tasks::motor::Axis;

const SECOND: u64 = 1000 * MILLISECOND;

fn centipede(modules: usize, seed: u64, threads: usize) -> Engine {
    varied(modules, seed, threads, &[])
}

fn varied(modules: usize, seed: u64, threads: usize, variations: &[Variation]) -> Engine {
    let wiring = Shape::Centipede.wiring(modules).unwrap();
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(seed).power_up_within(40 * MILLISECOND);
    Engine::new(robot.on(Ground::default()).varied(variations).build().unwrap(), threads)
}

/// The angles of a module's joints, in degrees.
fn angles(engine: &Engine, module: usize) -> [f64; 3] {
    engine.robot().module(module).unwrap().body().angles()
}

#[test]
fn threads_change_nothing_and_the_seed_does() {
    let hash = |seed, threads| {
        let mut engine = centipede(6, seed, threads);
        // These stops are neither at the end of a millisecond nor of a window.
        for end in [SECOND / 3, 1_500 * MILLISECOND + 1] {
            engine.run_until(end);
        }
        engine.state_hash()
    };
    let one = hash(1, 1);
    assert_eq!(one, hash(1, 2));
    assert_eq!(one, hash(1, 3));
    assert_ne!(one, hash(2, 2));
}

#[test]
fn how_often_a_run_is_interrupted_changes_nothing() {
    let run = |step: u64| {
        let mut engine = centipede(2, 1, 1);
        while engine.cycle() < SECOND {
            engine.run_until((engine.cycle() + step).min(SECOND));
        }
        engine.state_hash()
    };
    assert_eq!(run(SECOND), run(7_777));
}

#[test]
fn legs_turn_to_where_they_are_told_against_the_ground() {
    let mut engine = centipede(6, 1, 2);
    engine.run_until(4 * SECOND);
    for (leg, side) in [(2, 1.0), (3, -1.0)] {
        let [_, roll, _] = angles(&engine, leg);
        assert!((65.0..115.0).contains(&(side * roll)), "leg {leg} has rolled to {roll}");
    }
    let [_, roll, _] = angles(&engine, 4);
    assert!(roll.abs() < 5.0, "the spine is at {roll}");
}

#[test]
fn who_is_turned_over_feels_it() {
    let mut engine = centipede(6, 1, 2);
    let up = |engine: &Engine| engine.robot().module(1).unwrap().body().acceleration[2];
    engine.run_until(SECOND);
    assert!(up(&engine) > 0.5, "{}", up(&engine));
    engine.change(&Change::Roll(180.0)).unwrap();
    engine.run_until(2 * SECOND);
    assert!(up(&engine) < -0.5, "{}", up(&engine));
}

#[test]
fn what_is_detached_stays_behind_and_can_be_joined_again() {
    let mut engine = centipede(10, 1, 2);
    engine.run_until(3 * SECOND);
    let [one, other] = [Face { module: 8, dock: Dock::Back }, Face { module: 9, dock: Dock::Front }];
    engine.change(&Change::Detach(one)).unwrap();
    engine.run_until(4 * SECOND);
    assert!(engine.trouble().is_none());
    let gap = |engine: &Engine| engine.robot().distance(one, other).unwrap();
    let before = gap(&engine);
    engine.change(&Change::Attach(one, other)).unwrap();
    // At 30 mm/s.
    engine.run_until(engine.cycle() + 4 * SECOND);
    assert!(engine.trouble().is_none());
    assert!(before > 5.0 && gap(&engine) < 1.0, "{before} mm, then {}", gap(&engine));
}

/// A joint of a leg, which turns with each step.
fn expect_that_it_jams(mut robot: impl Robot) {
    let joint = JointOf { module: 2, axis: Axis::Front };
    for (until, fault, turns) in [
        (4 * SECOND, JointFault::None, true),
        (7 * SECOND, JointFault::Jammed, false),
        (10 * SECOND, JointFault::None, true),
    ] {
        robot.change(&Change::Fault { joint, fault }).unwrap();
        let mut angles = Vec::new();
        while robot.now() < until {
            robot.run_until(robot.now() + 20 * MILLISECOND);
            angles.push(robot.angles(joint.module)[usize::from(joint.axis.index())]);
        }
        let [least, most] = [f64::min, f64::max].map(|one| angles.iter().copied().reduce(one).unwrap());
        assert_eq!(most - least > 5.0, turns, "{least} to {most} until {until}");
        assert!(turns || most - least < 1.0, "{least} to {most}");
    }
    assert!(robot.trouble().is_none());
}

#[test]
fn a_joint_that_jams_stays_where_it_is_until_it_is_mended_in_both_engines() {
    expect_that_it_jams(centipede(6, 1, 2));
    let wiring = Shape::Centipede.wiring(6).unwrap();
    let world = Physics::on_terrain(&wiring, &Terrain::default(), &[], 1).unwrap();
    expect_that_it_jams(Native::new(wiring, 1, 40 * MILLISECOND).within(Box::new(world)));
}

#[test]
fn modules_that_change_places_take_their_joints_with_them() {
    let mut engine = centipede(6, 1, 1);
    engine.run_until(3 * SECOND);
    let before = [2, 4].map(|module| angles(&engine, module));
    engine.change(&Change::Swap(2, 4)).unwrap();
    engine.run_until(engine.cycle() + 2 * MILLISECOND);
    let roll = usize::from(Axis::Roll.index());
    assert!((angles(&engine, 4)[roll] - before[0][roll]).abs() < 1.0);
    assert!((angles(&engine, 2)[roll] - before[1][roll]).abs() < 1.0);
    engine.run_until(engine.cycle() + SECOND);
    assert!(engine.trouble().is_none());
}

#[test]
fn who_changes_places_beside_a_module_without_power_leaves_that_where_it_is() {
    let mut engine = centipede(10, 1, 2);
    engine.run_until(2 * SECOND);
    engine.change(&Change::Kill(5)).unwrap();
    engine.change(&Change::Swap(4, 9)).unwrap();
    engine.run_until(3 * SECOND);
    assert_eq!(engine.trouble(), None);
    let robot = engine.robot();
    let gap = robot.distance(Face { module: 9, dock: Dock::Back }, Face { module: 5, dock: Dock::Front });
    assert!(gap.unwrap() < 1.0, "it holds what came in the place of the other: {gap:?}");
}

/// Its motors stop driving at any point of a swing, and brake.
#[test]
fn what_loses_its_power_turns_no_joint_further() {
    let mut engine = centipede(6, 1, 2);
    engine.run_until(5_200 * MILLISECOND);
    let mut angle = |after: u64| {
        engine.run_until(engine.cycle() + after);
        angles(&engine, 2)
    };
    let [before, swinging] = [0, 20 * MILLISECOND].map(&mut angle);
    let turned = |from: [f64; 3], to: [f64; 3]| {
        from.iter().zip(to).map(|(from, to)| (from - to).abs()).fold(0.0, f64::max)
    };
    assert!(turned(before, swinging) > 0.5, "it swings: {before:?}, {swinging:?}");
    engine.change(&Change::Kill(2)).unwrap();
    engine.run_until(engine.cycle() + SECOND);
    let dead = angles(&engine, 2);
    assert!(turned(swinging, dead) < 5.0, "{swinging:?}, {dead:?}");
}

#[test]
fn who_lets_go_of_a_module_without_power_comes_off_it() {
    let mut engine = centipede(10, 1, 2);
    engine.run_until(2 * SECOND);
    engine.change(&Change::Kill(5)).unwrap();
    let [alive, dead] = [Face { module: 4, dock: Dock::Back }, Face { module: 5, dock: Dock::Front }];
    let gap = |engine: &mut Engine| {
        engine.change(&Change::Push { module: 9, newtons: [-60.0, 0.0, 0.0] }).unwrap();
        engine.run_until(engine.cycle() + SECOND);
        engine.robot().distance(alive, dead).unwrap()
    };
    assert!(gap(&mut engine) < 1.0);
    engine.change(&Change::Detach(alive)).unwrap();
    assert!(gap(&mut engine) > 5.0);
    assert_eq!(engine.trouble(), None);
}

/// A robot from a file, at power-up.
fn start(file: &str) -> Run<Engine> {
    let Scenario { wiring, terrain, timeline, .. } = Scenario::from_toml(file).unwrap();
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).power_up_within(40 * MILLISECOND);
    let robot = robot.on_terrain(&terrain.unwrap_or_default()).build().unwrap();
    Run::new(Engine::new(robot, 2), timeline, SECOND)
}

/// Runs a robot through a file's events. Returns how it has moved after each of the times.
fn motions(file: &str, looks: &[u64]) -> Vec<Motion> {
    let mut run = start(file);
    let look = |&at: &u64| {
        while run.step(at).unwrap() {}
        assert_eq!(run.robot.trouble(), None);
        run.robot.motion().unwrap()
    };
    looks.iter().map(look).collect()
}

#[test]
fn a_centipede_walks_ahead() {
    let mut engine = centipede(10, 1, 2);
    engine.run_until(8 * SECOND);
    let Motion { distance, sideways, slip, .. } = engine.motion().unwrap();
    assert!(distance > 0.4, "{distance} m");
    assert!(sideways.abs() < 0.1 * distance, "{sideways} m sideways of {distance}");
    assert!(slip < 1.5, "it drags itself: {slip}");
    // The charge is more than the electronics alone take, and less than a stalled motor takes at full
    // voltage.
    let coulombs = engine.charge_used().unwrap() * CAPACITY;
    assert!(coulombs > 8.0 * 1.2 * IDLE_AMPERES && coulombs < 8.0 * STALL_CURRENT, "{coulombs} C");
}

/// Joints that followed readings which are off by up to four counts would shake the feet off their places,
/// and gears that are worn let them give way by a degree.
#[test]
fn with_converters_that_are_noisy_or_gears_that_are_worn_it_walks_nearly_as_far() {
    let [exact, noisy, worn] = ["converter=0%", "converter=0.4%", "backlash=0.3%"].map(|variation| {
        let mut engine = varied(10, 1, 2, &[variation.parse().unwrap()]);
        engine.run_until(10 * SECOND);
        engine.motion().unwrap().distance
    });
    for distance in [noisy, worn] {
        assert!(distance < exact && distance > 0.91 * exact, "{noisy} m and {worn} m in place of {exact}");
    }
}

/// A centipede, or a module alone that is told to crawl.
const CENTIPEDE: &str = "modules = 10\nshape = 'centipede'\nevent = [";
const ALONE: &str = "modules = 1\nevent = [{ at = 0.5, command = [0xda, 1, 255], to = '0.Front' }, ";

/// Orders to this robot: to the left from 1 s on, and to the right from 6 s on.
fn left_then_right(robot: &str) -> String {
    let course = |number: u32| if number < 4 { 0xe1 } else { 0xe2 };
    let order = |number: u32| {
        let [at, serial] = [1.0 + 1.25 * f64::from(number), f64::from(number + 2)];
        format!("{{ at = {at}, command = [{}, {serial}, 255], to = '0.Front' }}", course(number))
    };
    let orders: Vec<String> = (0..8).map(order).collect();
    format!("{robot}{}]\n", orders.join(", "))
}

#[test]
fn who_is_ordered_to_a_side_turns_to_it() {
    for (robot, least) in [(CENTIPEDE, 15.0), (ALONE, 8.0)] {
        let looks = motions(&left_then_right(robot), &[1, 6, 11].map(|at| at * SECOND));
        let turns = [looks[1].heading - looks[0].heading, looks[1].heading - looks[2].heading];
        assert!(turns.iter().all(|&turn| turn > least), "{turns:?} degrees to the left and to the right");
    }
}

#[test]
fn on_its_back_it_walks_on_at_half_its_speed_at_least() {
    let file = "modules = 10\nshape = 'centipede'\n[[event]]\nat = 6\nroll = 180\n";
    let ways: Vec<f64> = motions(file, &[3, 6, 8, 11].map(|at| at * SECOND))
        .into_iter()
        .map(|motion| motion.distance)
        .collect();
    let [upright, over] = [ways[1] - ways[0], ways[3] - ways[2]];
    assert!(upright > 0.15 && over > upright / 2.0, "{upright} m, then {over} m on its back");
}

#[test]
fn a_ring_rolls_and_a_chain_a_human_and_a_module_alone_crawl_half_a_body_length_at_least() {
    for file in [
        include_str!("../../../../robots/gaits/rolling-track.toml"),
        include_str!("../../../../robots/gaits/caterpillar.toml"),
        include_str!("../../../../robots/gaits/single.toml"),
        include_str!("../../../../robots/gaits/human.toml"),
    ] {
        let Motion { distance, length, .. } = motions(file, &[9 * SECOND])[0];
        assert!(distance > length / 2.0, "{distance} m of {length}");
    }
}

#[test]
fn on_other_ground_it_walks_too_and_does_not_fall() {
    // On level ground it comes 0.33 m in that time.
    for (world, least) in [("friction = 0.3", 0.12), ("slope_degrees = -10", 0.2)] {
        let mut run = start(&format!("modules = 10\nshape = 'centipede'\n[world]\n{world}\n"));
        while run.step(5 * SECOND).unwrap() {}
        let distance = run.robot.motion().unwrap().distance;
        assert!(distance > least, "{world}: {distance} m");
        let tilt = Robot::tilt(&run.robot).unwrap();
        assert!((0.5..20.0).contains(&tilt), "{world}: it leans by {tilt} degrees");
    }
}

#[test]
fn both_parts_of_a_body_that_is_cut_walk_on() {
    let event = "[[event]]\nat = 4\ndetach = '8.Back'\n";
    let mut run = start(&format!("modules = 18\nshape = 'centipede'\n{event}"));
    let places = |run: &Run<Engine>, part: &[usize]| {
        part.iter().map(|&module| run.robot.robot().place(module).unwrap()[0]).sum::<f64>()
            / part.len() as f64
    };
    while run.step(5_500 * MILLISECOND).unwrap() {}
    let parts = [0, 9].map(|module| Robot::wiring(&run.robot).body(module));
    assert_eq!(parts.clone().map(|part| part.len()), [9, 9]);
    let before = parts.clone().map(|part| places(&run, &part));
    while run.step(8_500 * MILLISECOND).unwrap() {}
    for (part, before) in parts.iter().zip(before) {
        let way = places(&run, part) - before;
        assert!(way > 0.1, "the part of module {} comes {way} m", part[0]);
    }
}

#[test]
fn who_falls_leans() {
    let mut run = start("modules = 10\nshape = 'centipede'\n");
    while run.step(SECOND).unwrap() {}
    assert!(Robot::tilt(&run.robot).unwrap() < 2.0);
    // Laid on its side it falls back onto its belly, or onto its back.
    run.robot.robot_mut().change(&Change::Roll(60.0)).unwrap();
    while run.step(3 * SECOND).unwrap() {}
    assert!(Robot::tilt(&run.robot).unwrap() > 45.0, "{:?}", Robot::tilt(&run.robot));
}

#[test]
fn a_robot_that_a_tonne_throws_at_a_wall_breaks_the_world_and_its_last_100_ms_are_told() {
    let file = "modules = 10\nshape = 'centipede'\n[world]\nslope_degrees = 45\nfriction = 0\n\
                loads = [{ module = 0, kg = 1000 }]\n\
                walls = [{ from_m = [-4, -2], to_m = [-4, 2], height_mm = 500 }]\n";
    let Scenario { wiring, terrain, .. } = Scenario::from_toml(file).unwrap();
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).on_terrain(&terrain.unwrap());
    let mut engine = Engine::new(robot.build().unwrap(), 2);
    engine.run_until(3 * SECOND);
    let Trouble { seconds, place, last, .. } = Robot::trouble(&engine).expect("it breaks").clone();
    assert!((0.5..3.0).contains(&seconds) && place.starts_with("module "), "{place} after {seconds} s");
    assert!((last[0].seconds - (seconds - 0.1)).abs() < 1e-6, "{last:?}");
    assert!(last.last().unwrap().degrees_per_second.abs() > 1600.0, "{last:?}");
    assert!(engine.cycle() < ((seconds + 0.002) * SECOND as f64) as u64, "the run ends there");
}
