//! Tests that a world that breaks reports when and where.

use crate::common::{at, chain};
use plants::geometry::Dock;
use world::{Block, Face, Ground, Make, Moment, Placed, Trouble, World, WorldError};

/// Two modules, whose gears have so much backlash, in degrees.
fn two(backlash: f64) -> World {
    let make = Make { backlash, ..Make::default() };
    let modules = [0.0, 500.0].map(|y| Placed { make, ..at(0.0, y, 0.0) });
    World::new(&modules, &Ground::default()).unwrap()
}

#[test]
fn a_joint_that_turns_as_none_can_is_named() {
    for backlash in [0.0, 1.0] {
        let mut world = two(backlash);
        let calm = [0.0; 3];
        let trouble = (0..1000).find_map(|_| world.step(&[calm, [0.0, 1e4, 0.0]]).err());
        let Some(Trouble { seconds, place, last, .. }) = trouble else { panic!("the world holds") };
        assert!(seconds > 0.0 && place.starts_with("module 1, back of the roll"), "{place} after {seconds}");
        let &Moment { seconds: end, degrees, degrees_per_second, volts } =
            last.last().expect("the last moment");
        assert!((end, volts) == (seconds, 1e4) && degrees_per_second > 1500.0, "{last:?}");
        let [angle, speed] = [world.angles(1), world.speeds(1)].map(|joints| joints[1].to_degrees());
        assert_eq!((degrees, degrees_per_second), (angle, speed), "as the world has it");
    }
}

#[test]
fn a_load_that_nothing_bears_breaks_the_world_and_the_last_100_ms_are_told() {
    // A chain slides down a slope, with a tonne on its head, and its tail meets a wall.
    let wall = Block { at: [-9.0, 0.0], size: [0.1, 4.0, 0.5], turn: 0.0 };
    let ground = Ground { friction: 0.0, slope: 45.0, blocks: vec![wall], ..Ground::default() };
    let mut placed: Vec<Placed> = (0..5).map(|module| at(-168.0 * f64::from(module), 0.0, 0.0)).collect();
    placed[0].make.mass = 1000.0;
    let mut world = World::new(&placed, &ground).unwrap();
    for module in 1..5 {
        world.attach(Face { module: module - 1, dock: Dock::Back }, Face { module, dock: Dock::Front });
    }
    let trouble = (0..3000).find_map(|_| world.step(&[[0.0; 3]; 5]).err()).expect("it breaks");
    let before: Vec<f64> = trouble.last.iter().map(|it| 1e3 * (trouble.seconds - it.seconds)).collect();
    let expected: Vec<f64> =
        (1..=10).rev().map(|it| 10.0 * f64::from(it)).chain((0..10).rev().map(f64::from)).collect();
    assert!(before.iter().zip(&expected).all(|(one, other)| (one - other).abs() < 1e-6), "{before:?}");
    assert_eq!(before.len(), expected.len());
    // The angles follow from the speeds.
    for pair in trouble.last[11..].windows(2) {
        let turned = pair[1].degrees - pair[0].degrees;
        let (least, most) =
            (0.5 * pair[1].degrees_per_second * 1e-3, 1.5 * pair[1].degrees_per_second * 1e-3);
        assert!((least.min(most)..=least.max(most)).contains(&turned), "{pair:?}");
    }
}

#[test]
fn docks_that_can_not_meet_are_named() {
    let mut world = chain(2);
    world.attach(Face { module: 0, dock: Dock::Front }, Face { module: 1, dock: Dock::Back });
    let trouble = (0..2000).find_map(|_| world.step(&[[0.0; 3]; 2]).err()).expect("it breaks").to_string();
    assert!(trouble.contains("; 0.Front and 1.Back hold each other and are 3"), "{trouble}");
}

#[test]
fn a_number_that_is_none_is_told_with_its_module() {
    let parts = ["half with the Front dock", "back of the roll", "half with the Back dock"];
    for backlash in [0.0, 1.0] {
        for (joint, part) in parts.into_iter().enumerate() {
            let mut volts = [[0.0; 3]; 2];
            volts[1][joint] = f64::NAN;
            let trouble = two(backlash).step(&volts).unwrap_err().to_string();
            assert!(trouble.contains(&format!("module 1, {part}")), "{trouble}");
            assert!(trouble.contains("not a number"), "{trouble}");
        }
    }
}

#[test]
fn a_world_without_modules_is_refused() {
    assert!(matches!(World::new(&[], &Ground::default()), Err(WorldError::Empty)));
}

/// The solver computes connected joints at once: if one turns impossibly fast, all do.
#[test]
fn of_many_joints_that_turn_as_none_can_the_fastest_is_named() {
    for volts in [1e6, 1e12] {
        let mut world = chain(3);
        let wild = [[0.0; 3], [0.0; 3], [0.0, volts, 0.0]];
        let trouble = world.step(&wild).expect_err("it breaks").to_string();
        assert!(trouble.contains("at module 2, back of the roll"), "{volts}: {trouble}");
    }
}

/// The solver spreads one invalid number to all.
#[test]
fn where_no_number_is_left_the_joint_that_was_the_fastest_before_is_named() {
    let mut world = chain(3);
    for _ in 0..20 {
        world.step(&[[0.0; 3], [0.0; 3], [0.0, 10.0, 0.0]]).expect("it turns");
    }
    let trouble = world.step(&[[0.0; 3], [1e200, 0.0, 0.0], [0.0; 3]]).expect_err("it breaks");
    assert!(trouble.to_string().contains("an acceleration that is not a number"), "{trouble}");
    assert!(trouble.place.contains("module 2, back of the roll"), "{trouble}");
}

#[test]
fn the_strongest_push_of_a_robot_file_breaks_no_chain() {
    const STRONGEST: f64 = 100.0;
    let axis = [-STRONGEST, 0.0, STRONGEST];
    let forces: Vec<[f64; 3]> =
        axis.iter().flat_map(|&x| axis.iter().flat_map(move |&y| axis.map(|z| [x, y, z]))).collect();
    for modules in 1..=3 {
        for module in 0..modules {
            for &newtons in &forces {
                let mut world = chain(modules);
                world.push(module, newtons, 200);
                let volts = vec![[0.0; 3]; modules];
                let trouble = (0..500).find_map(|_| world.step(&volts).err());
                assert!(trouble.is_none(), "module {module} of {modules}, {newtons:?} N: {trouble:?}");
            }
        }
    }
}
