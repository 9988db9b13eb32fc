//! Tests what is measured of how a robot has moved.

use crate::common::{at, chain, run};
use plants::geometry::Dock;
use world::{Face, Ground, World};

#[test]
fn a_robot_is_as_long_as_it_lies() {
    for modules in [1, 2, 5] {
        let length = 168.0 * modules as f64 - 2.0;
        let found = 1e3 * chain(modules).motion().length;
        assert!((found - length).abs() < 1e-6, "{found} mm of {modules}");
    }
    let beside = World::new(&[at(0.0, 0.0, 0.0), at(-30.0, 400.0, 0.0)], &Ground::default()).unwrap();
    assert!((beside.length() - 0.196).abs() < 1e-9, "{} m", beside.length());
}

#[test]
fn what_slides_all_the_way_slips_by_all_of_it() {
    let slope = Ground { friction: 0.1, slope: 10.0, ..Ground::default() };
    let mut world = World::new(&[at(0.0, 0.0, 0.0), at(0.0, 300.0, 0.0)], &slope).unwrap();
    run(&mut world, [0.0; 3], 1000);
    let motion = world.motion();
    assert!(motion.distance < -0.3 && motion.sideways.abs() < 1e-3, "{motion:?}");
    assert!((motion.slip - 1.0).abs() < 0.02, "{motion:?}");
}

#[test]
fn a_robot_has_turned_by_the_mean_of_its_parts() {
    // The first lies still. The others are one body, and whoever pushes its ends turns it to the left.
    let placed = [at(0.0, 1000.0, 0.0), at(0.0, 0.0, 0.0), at(-168.0, 0.0, 0.0)];
    let mut world = World::new(&placed, &Ground::default()).unwrap();
    world.attach(Face { module: 1, dock: Dock::Back }, Face { module: 2, dock: Dock::Front });
    world.push(1, [0.0, 14.0, 0.0], 100);
    world.push(2, [0.0, -14.0, 0.0], 100);
    run(&mut world, [0.0; 3], 1000);
    let [still, turned, behind] = [0, 1, 2].map(|module| {
        let ahead = world.frame(module).matrix3.x_axis;
        ahead.y.atan2(ahead.x)
    });
    assert!(
        still.abs() < 1e-3 && (0.3..1.2).contains(&turned) && (turned - behind).abs() < 0.01,
        "{turned}, {behind}"
    );
    // A module has as many parts as another. Axes have no sign, so their angles are doubled.
    let mean = (2.0 * turned).sin().atan2(0.5 + (2.0 * turned).cos()) / 2.0;
    let heading = world.motion().heading;
    assert!((heading - mean.to_degrees()).abs() < 0.3, "{heading} where its parts turned by {turned} rad");
}
