//! Tests docks that hold each other.

use crate::common::{at, chain, run};
use plants::geometry::Dock;
use plants::motor::SUPPLY_VOLTS;
use world::{Face, Ground, World};

#[test]
fn docks_hold_while_joints_pull() {
    let mut world = chain(12);
    let mut most = 0.0_f64;
    for volts in [0.5 * SUPPLY_VOLTS, -0.5 * SUPPLY_VOLTS] {
        run(&mut world, [volts, 0.0, volts], 1000);
        most = world.angles(0)[0].abs().max(most);
        let (mm, degrees) = world.dock_error();
        assert!(mm < 0.5 && degrees < 0.5, "{mm} mm and {degrees} degrees");
        for module in 1..12 {
            let [back, front] = [(module - 1, Dock::Back), (module, Dock::Front)]
                .map(|(module, dock)| world.dock(Face { module, dock }).translation);
            assert!((back - front).length() < 0.5, "{module} is held: {back} and {front}");
        }
    }
    assert!(most > 0.5, "joints turn");
}

#[test]
fn docks_that_catch_pull_their_modules_together() {
    let near = at(-178.0, 3.0, 0.0);
    let mut world = World::new(&[at(0.0, 0.0, 0.0), near], &Ground::default()).unwrap();
    let [back, front] = [Face { module: 0, dock: Dock::Back }, Face { module: 1, dock: Dock::Front }];
    let gap = |world: &World| (world.dock(back).translation - world.dock(front).translation).length();
    assert!((gap(&world) - 10.44).abs() < 0.01, "{}", gap(&world));
    world.attach(back, front);
    run(&mut world, [0.0; 3], 100);
    assert!((6.0..9.0).contains(&gap(&world)), "pulled, not thrown: {}", gap(&world));
    run(&mut world, [0.0; 3], 900);
    assert!(gap(&world) < 0.1, "{}", gap(&world));
}

#[test]
fn what_lets_go_falls_apart() {
    let high = [at(0.0, 0.0, 3000.0), at(-168.0, 0.0, 3000.0), at(0.0, 2000.0, 0.0)];
    let mut world = World::new(&high, &Ground::default()).unwrap();
    let [back, front] = [Face { module: 0, dock: Dock::Back }, Face { module: 1, dock: Dock::Front }];
    world.attach(back, front);
    run(&mut world, [3.0, 0.0, 3.0], 200);
    assert!(world.dock_error().0 < 0.1);
    world.detach(front);
    assert_eq!(world.dock_error(), (0.0, 0.0), "nothing is held");
    run(&mut world, [-7.0, 0.0, -7.0], 400);
    let apart = (world.dock(back).translation - world.dock(front).translation).length();
    assert!(apart > 1.0, "{apart} mm");
}

#[test]
fn who_changes_places_is_held_there_by_what_held_the_other() {
    for (one, other) in [(0, 3), (1, 3), (1, 2)] {
        let mut world = chain(4);
        run(&mut world, [3.0, -1.0, 2.0], 200);
        let how = |world: &World| {
            [one, other].map(|module| (world.angles(module), world.speeds(module), world.frame(module)))
        };
        let [before, before_other] = how(&world);
        world.swap(one, other);
        for (now, before) in how(&world).into_iter().zip([before_other, before]) {
            assert_eq!((now.0, now.1), (before.0, before.1), "{one} and {other}");
            // The frames before are those of a millisecond ago.
            assert!(now.2.abs_diff_eq(before.2, 0.1), "{one} and {other}: {} and {}", now.2, before.2);
        }
        let mut order = [0, 1, 2, 3];
        order.swap(one, other);
        run(&mut world, [3.0, 0.0, 3.0], 200);
        assert!(world.dock_error().0 < 0.5, "{:?}", world.dock_error());
        for place in 1..4 {
            let [back, front] = [(place - 1, Dock::Back), (place, Dock::Front)]
                .map(|(place, dock)| world.dock(Face { module: order[place], dock }).translation);
            let gap = (back - front).length();
            assert!(gap < 0.5, "{one} and {other}: {gap} mm at {place}");
        }
    }
}

#[test]
fn a_dock_that_takes_hold_of_another_lets_go_of_what_it_held() {
    let modules = [at(0.0, 0.0, 0.0), at(-178.0, 3.0, 0.0), at(-90.0, 500.0, 0.0)];
    let mut world = World::new(&modules, &Ground::default()).unwrap();
    let [first, third] = [0, 2].map(|module| Face { module, dock: Dock::Back });
    let front = Face { module: 1, dock: Dock::Front };
    world.attach(first, front);
    assert!(world.dock_error().0 > 5.0);
    world.attach(front, third);
    world.detach(third);
    assert_eq!(world.dock_error(), (0.0, 0.0), "nothing is held");
}

#[test]
fn all_docks_of_a_robot_may_hold_others() {
    let mut world = chain(2);
    for dock in Dock::ALL {
        world.attach(Face { module: 0, dock }, Face { module: 1, dock });
    }
    for dock in &Dock::ALL[..5] {
        assert!(world.dock_error().0 > 100.0, "others hold");
        world.detach(Face { module: 0, dock: *dock });
    }
    assert!(world.dock_error().0 > 100.0, "the last one holds");
}

#[test]
fn a_leg_is_attached_by_a_quarter_turn_and_stands_upright_when_rolled() {
    use glam::{DAffine3, DVec3};
    use plants::geometry::attached;
    use world::Placed;
    let body = at(0.0, 0.0, 0.0);
    let dock = Dock::Left.in_module([0.0; 3]) * attached(Dock::Left, Dock::Back);
    let angles = [0.0, 90.0, 0.0];
    let leg: DAffine3 = dock * Dock::Back.in_module(angles).inverse();
    let mut world = World::new(&[body, Placed { frame: leg, angles, ..body }], &Ground::default()).unwrap();
    let [left, back] = [Face { module: 0, dock: Dock::Left }, Face { module: 1, dock: Dock::Back }];
    world.attach(left, back);
    assert!(world.dock_error().0 < 1e-9);
    run(&mut world, [0.0; 3], 100);
    let up = world.front(1).matrix3 * DVec3::Z;
    assert!(up.z > 0.99, "{up}");
}
