//! Tests obstacles on the ground, and properties that differ from module to module.

use crate::common::{at, run};
use glam::{DAffine3, DMat3, DVec3, EulerRot};
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
fn a_module_falls_onto_what_is_below_it() {
    let steps = Some(Steps { from: 1.0, height: 0.05, length: 0.5, number: 3 });
    let block = Block { at: [-2.0, 1.0], size: [1.0, 0.4, 0.07], turn: 60.0 };
    let ground = Ground { steps, blocks: vec![block], ..Ground::default() };
    // Ahead and to the left, in mm; what is there rises to this, in mm. A module reaches 83 mm to each side.
    let places = [
        ((0.0, 0.0), 0.0),
        ((910.0, 0.0), 0.0),
        ((1090.0, 49_900.0), 50.0),
        ((1410.0, -49_900.0), 50.0),
        ((1590.0, 0.0), 100.0),
        ((2090.0, 0.0), 150.0),
        ((2410.0, 0.0), 150.0),
        ((2590.0, 0.0), 0.0),
        ((-2000.0, 1000.0), 70.0),
        ((-1800.0, 1346.0), 70.0),
        ((-2200.0, 654.0), 70.0),
        ((-2200.0, 1346.0), 0.0),
        ((-1800.0, 654.0), 0.0),
    ];
    // The first lies on the plane.
    let placed: Vec<_> =
        places.iter().map(|&((x, y), _)| at(x, y, if x == 0.0 { 0.0 } else { 200.0 })).collect();
    let mut world = World::new(&placed, &ground).unwrap();
    run(&mut world, [0.0; 3], 600);
    for (module, (place, expected)) in places.into_iter().enumerate() {
        let rise = world.front(module).translation.z - world.front(0).translation.z;
        assert!((rise - expected).abs() < 1.0, "{rise} mm at {place:?}");
    }
}

#[test]
fn a_module_is_laid_down_on_its_lowest_corner() {
    for degrees in [[0.0; 3], [30.0, 0.0, 0.0], [0.0, 40.0, 0.0], [20.0, -70.0, 110.0], [-160.0, 25.0, 5.0]] {
        let [x, y, z] = degrees.map(f64::to_radians);
        let turn = DMat3::from_euler(EulerRot::XYZ, x, y, z);
        let high = DAffine3::from_mat3_translation(turn, DVec3::Z * 500.0);
        let world = World::new(&[Placed { frame: high, ..at(0.0, 0.0, 0.0) }], &Ground::default()).unwrap();
        let height = turn.transpose().z_axis.abs().dot(DVec3::new(0.083, 0.041, 0.041));
        assert!((world.place(0).z - height).abs() < 1e-9, "{degrees:?}: {} m", world.place(0));
    }
}

#[test]
fn a_robot_in_something_is_refused_and_one_that_touches_it_is_not() {
    let deep = |modules: &[Placed], block| {
        let ground = Ground { blocks: vec![block], ..Ground::default() };
        match World::new(modules, &ground) {
            Err(error @ WorldError::Occupied { .. }) => error.to_string(),
            made => panic!("it was made: {}", made.is_ok()),
        }
    };
    let two = [at(0.0, 2000.0, 0.0), at(0.0, 0.0, 0.0)];
    let turned = Block { at: [0.1, 0.0], size: [0.1, 0.1, 0.02], turn: 30.0 };
    assert!(deep(&two, turned).contains("module 1 lies"));
    // The module's end is at 83 mm, the wall's face so many mm behind that.
    let wall = |deep: f64| Block { at: [0.133 - deep * 1e-3, 0.0], size: [0.1, 1.0, 0.2], turn: 0.0 };
    for millimetres in [-1.0, 0.5, 0.9] {
        let ground = Ground { blocks: vec![wall(millimetres)], ..Ground::default() };
        assert!(World::new(&two, &ground).is_ok(), "{millimetres} mm");
    }
    for millimetres in [2.0, 17.0] {
        let error = deep(&two, wall(millimetres));
        assert!(
            error.contains(&format!("module 1 lies where a step, a box or a wall is, {millimetres} mm deep")),
            "{error}"
        );
    }
    // The one that is the deepest is named, whichever of its halves it is.
    for side in [1.0, -1.0] {
        let three = [(-3.0, 300.0), (-5.0, -300.0), (0.0, 0.0)].map(|(behind, y)| at(side * behind, y, 0.0));
        let wall = Block { at: [side * 0.124, 0.0], ..wall(0.0) };
        let error = deep(&three, wall);
        assert!(error.contains("module 2 lies where a step, a box or a wall is, 9 mm deep"), "{error}");
    }
}

#[test]
fn who_is_turned_over_on_a_step_is_laid_onto_it() {
    // The front half of the second module lies on the step, the other half hangs over the edge.
    let steps = Some(Steps { from: 1.0, height: 0.05, length: 1.0, number: 1 });
    let ground = Ground { steps, ..Ground::default() };
    let mut world = World::new(&[at(0.0, 0.0, 0.0), at(1030.0, 0.0, 60.0)], &ground).unwrap();
    run(&mut world, [0.0; 3], 1000);
    let other = world.place(0);
    world.turn_over(180.0);
    assert!((world.place(0) - other).length() < 1e-3, "what lies elsewhere is not raised with it");
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
        let up = world.up(module);
        assert!(up.y < -0.99, "its Up side looks to the right: {up}");
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
