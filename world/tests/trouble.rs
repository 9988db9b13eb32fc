//! A world that breaks says when and where.

mod common;

use common::at;
use world::{Ground, Trouble, World, WorldError};

fn two() -> World {
    World::new(&[at(0.0, 0.0, 0.0), at(0.0, 500.0, 0.0)], &Ground::default()).unwrap()
}

#[test]
fn a_joint_that_turns_as_none_can_is_named() {
    let mut world = two();
    let calm = [0.0; 3];
    let trouble = (0..1000).find_map(|_| world.step(&[calm, [0.0, 1e4, 0.0]]).err());
    let Some(Trouble::Wild { seconds, place, .. }) = trouble else { panic!("{trouble:?}") };
    assert!(seconds > 0.0 && place.starts_with("module 1, back of the roll"), "{place} after {seconds}");
}

#[test]
fn a_number_that_is_none_is_told_with_its_module() {
    let mut world = two();
    let trouble = world.step(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]).unwrap_err();
    assert!(trouble.to_string().contains("module 1"), "{trouble}");
    assert!(trouble.to_string().contains("no number"), "{trouble}");
}

#[test]
fn a_world_without_modules_is_refused() {
    assert!(matches!(World::new(&[], &Ground::default()), Err(WorldError::Empty)));
}
