//! Gears that have backlash.

use crate::common::{at, run};
use plants::motor::SUPPLY_VOLTS;
use world::{Block, Ground, Make, Placed, STEP_SECONDS, World};

/// Two modules whose gears have so much backlash, in degrees: one lies on the ground, and the other on a
/// block, which bears all of it but the half in front.
fn on_block(mass: f64, backlash: [f64; 2]) -> World {
    let block = Block { at: [-0.07, 1.0], size: [0.2, 0.2, 0.07], turn: 0.0 };
    let ground = Ground { blocks: vec![block], ..Ground::default() };
    let placed = [at(0.0, 0.0, 0.0), at(0.0, 1000.0, 70.0)];
    let modules: [Placed; 2] = std::array::from_fn(|module| Placed {
        make: Make { mass, backlash: backlash[module], ..Make::default() },
        ..placed[module]
    });
    World::new(&modules, &ground).unwrap()
}

/// At the start each motor is in the middle of its gear's backlash, and it does not turn.
#[test]
fn a_half_that_nothing_bears_sags_by_half_the_backlash() {
    for backlash in [0.5, 1.0, 2.0, 10.0] {
        for mass in [1.0, 4.0] {
            let mut world = on_block(mass, [0.0, backlash]);
            run(&mut world, [0.0; 3], 500);
            let [borne, hanging] = [0, 1].map(|module| world.angles(module)[0].to_degrees());
            assert!(borne.abs() < 0.01, "{borne}: one that has none, beside one that has");
            let beyond = hanging.abs() - backlash / 2.0;
            assert!((0.0..0.1).contains(&beyond), "{backlash}, {mass} kg: {hanging}");
        }
    }
}

/// A motor has turned by the sum of its speeds. In a larger backlash friction would carry the half along
/// before it comes to the side.
#[test]
fn a_half_lags_behind_its_motor_by_half_the_backlash_whichever_way_that_turns() {
    for backlash in [0.5, 1.0] {
        let make = Make { backlash, ..Make::default() };
        let placed = [at(0.0, 0.0, 0.0), Placed { make, ..at(0.0, 1000.0, 20_000.0) }];
        let mut world = World::new(&placed, &Ground::default()).unwrap();
        let mut turned = 0.0;
        for volts in [SUPPLY_VOLTS, -SUPPLY_VOLTS, SUPPLY_VOLTS] {
            let mut most = 0.0_f64;
            for _ in 0..150 {
                run(&mut world, [0.0, volts, 0.0], 1);
                turned += world.speeds(1)[1].to_degrees() * STEP_SECONDS;
                let behind = turned - world.angles(1)[1].to_degrees();
                assert!(behind.abs() < backlash / 2.0 + 0.2, "{behind} of {backlash}");
                most = most.max(behind * volts.signum());
            }
            assert!(most > backlash / 2.0 - 0.01, "{most} of {backlash}");
        }
    }
}
