//! Tests obstacles on the ground, and properties that differ from module to module.

use crate::common::{at, run};
use plants::geometry::Dock;
use plants::motor::{Motor, SUPPLY_VOLTS};
use world::{Block, Face, Ground, Make, Placed, Steps, World, WorldError};

#[test]
fn what_slides_down_a_slope_is_held_by_a_wall() {
    let slope = Ground { friction: 0.1, slope: 20.0, ..Ground::default() };
    // From the module's end at 83 mm to the wall's face.
    let room = 0.46 - 0.083;
    let wall = Block { at: [-0.51, 0.0], size: [0.1, 1.0, 0.2], turn: 0.0 };
    let slide = |blocks| {
        let mut world = World::new(&[at(0.0, 0.0, 0.0)], &Ground { blocks, ..slope.clone() }).unwrap();
        run(&mut world, [0.0; 3], 1500);
        world.motion().distance
    };
    assert!(slide(vec![]) < -1.0, "{}", slide(vec![]));
    let held = slide(vec![wall]);
    assert!((held + room).abs() < 0.003, "{held}");
}

#[test]
fn a_module_falls_onto_the_step_that_is_below_it() {
    let steps = Some(Steps { from: 1.0, height: 0.05, length: 0.5, number: 3 });
    let ground = Ground { steps, ..Ground::default() };
    // One on the plane, one above the second step.
    let mut world = World::new(&[at(0.0, 0.0, 0.0), at(1750.0, 0.0, 300.0)], &ground).unwrap();
    run(&mut world, [0.0; 3], 600);
    let rise = world.front(1).translation.z - world.front(0).translation.z;
    assert!((rise - 100.0).abs() < 1.0, "{rise} mm");
}

#[test]
fn a_robot_in_something_is_refused() {
    let block = Block { at: [0.1, 0.0], size: [0.1, 0.1, 0.02], turn: 30.0 };
    let ground = Ground { blocks: vec![block], ..Ground::default() };
    let error = World::new(&[at(0.0, 2000.0, 0.0), at(0.0, 0.0, 0.0)], &ground).err();
    assert!(matches!(error, Some(WorldError::Occupied { module: 1, .. })), "{error:?}");
}

#[test]
fn who_is_turned_over_on_a_step_is_laid_onto_it() {
    // The front half of the second module lies on the step, the other half hangs over the edge.
    let steps = Some(Steps { from: 1.0, height: 0.05, length: 1.0, number: 1 });
    let ground = Ground { steps, ..Ground::default() };
    let mut world = World::new(&[at(0.0, 0.0, 0.0), at(1030.0, 0.0, 60.0)], &ground).unwrap();
    run(&mut world, [0.0; 3], 1000);
    world.turn_over(180.0);
    run(&mut world, [0.0; 3], 100);
    let speeds = world.speeds(1);
    assert!(speeds.iter().all(|speed| speed.abs() < 1.0), "nothing throws it: {speeds:?}");
    assert!(world.front(1).translation.z < 500.0, "{:?}", world.front(1).translation);
}

#[test]
fn each_body_is_turned_over_where_it_lies() {
    let places = [(0.0, 0.0), (-168.0, 0.0), (0.0, -2000.0), (-168.0, -2000.0)];
    let mut world = World::new(&places.map(|(x, y)| at(x, y, 0.0)), &Ground::default()).unwrap();
    for (module, behind) in [(0, 1), (2, 3)] {
        world.attach(Face { module, dock: Dock::Back }, Face { module: behind, dock: Dock::Front });
    }
    let before: [_; 4] = std::array::from_fn(|module| world.place(module));
    world.turn_over(90.0);
    for (module, before) in before.into_iter().enumerate() {
        let way = world.place(module) - before;
        assert!(way.length() < 0.001, "{module} comes to lie {way} from where it lay");
        let left = world.front(module).matrix3.y_axis;
        assert!(left.z > 0.99, "the left side of {module} is up: {left}");
    }
    run(&mut world, [0.0; 3], 200);
    for module in 0..4 {
        let [x, y, z] = world.acceleration(module);
        assert!(y > 0.9, "{module} feels that its left side is up: {x}, {y}, {z} g");
    }
}

fn with(make: Make) -> Placed {
    Placed { make, ..at(0.0, 0.0, 0.0) }
}

#[test]
fn a_module_slides_by_its_own_grip() {
    let slide = |grip| {
        let ground = Ground { friction: 0.5, slope: 20.0, ..Ground::default() };
        let mut world = World::new(&[with(Make { grip, ..Make::default() })], &ground).unwrap();
        run(&mut world, [0.0; 3], 500);
        world.motion().distance
    };
    assert!(slide(1.0) > -1e-3 && slide(0.5) < -0.05, "{} and {}", slide(1.0), slide(0.5));
}

#[test]
fn a_joint_turns_by_its_own_motor() {
    let turned = |motor| {
        let placed = [
            at(0.0, 1000.0, 0.0),
            Placed { frame: at(0.0, 0.0, 9e3).frame, ..with(Make { motor, ..Make::default() }) },
        ];
        let mut world = World::new(&placed, &Ground::default()).unwrap();
        run(&mut world, [0.0, SUPPLY_VOLTS, 0.0], 300);
        world.angles(1)[1]
    };
    let usual = Motor::default();
    // At a given current, a motor with more torque is slower without load.
    let strong = Motor { stall_torque: 1.25 * usual.stall_torque, ..usual };
    let rough = Motor { sliding_friction: 3.0 * usual.sliding_friction, ..usual };
    let angles = [usual, strong, rough].map(turned);
    assert!(angles[1] < 0.9 * angles[0] && angles[2] < 0.9 * angles[0], "{angles:?}");
}
