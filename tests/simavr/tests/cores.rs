//! The harness's interpreter and simavr's own do the same: every test image, and the robot, end in the same
//! state with both.

use std::fs;
use std::sync::Arc;

use simavr_harness::{Engine, Face, Image, Images, Mcu, Part, RobotBuilder};
use simulation::Robot as _;
use superbot_tests_simavr::{MILLISECOND, images, test_images};
use tasks::dock::Dock;

/// How long each image of the tests runs.
const RUNS: u64 = 60 * MILLISECOND;

fn decoded_and_not(load: impl Fn() -> Image) -> [Arc<Image>; 2] {
    [Arc::new(load()), Arc::new(load().undecoded())]
}

#[test]
fn every_test_image_ends_in_the_same_state() {
    let folder = fs::read_dir(test_images()).expect("`./x test` builds them");
    let paths = folder.map(|entry| entry.expect("the folder can be read").path());
    let mut number = 0;
    for path in paths.filter(|path| path.extension().is_some_and(|extension| extension == "elf")) {
        let load = || Image::load(&path).expect("it is an image");
        let ends = decoded_and_not(load).map(|image| {
            let mut mcu = Mcu::new(Part::ATMEGA128, image, 1).expect("the image fits");
            mcu.run_until(RUNS);
            (mcu.state(), mcu.cycle(), mcu.resets(), mcu.take_markers(), mcu.state_hash())
        });
        assert_eq!(ends[0], ends[1], "{}", path.display());
        number += 1;
    }
    assert!(number > 40, "{number} images");
}

#[test]
fn the_robot_ends_in_the_same_state() {
    let load =
        |name: &str| decoded_and_not(|| Image::load(images().join(name)).expect("./x build leaves it"));
    let [[master, left_master], [slave, left_slave]] =
        ["firmware-master.elf", "firmware-slave.elf"].map(load);
    let both = [Images { master, slave }, Images { master: left_master, slave: left_slave }];
    let [one, other] = [(0, Dock::Back), (1, Dock::Front)].map(|(module, dock)| Face { module, dock });
    let hashes = both.map(|images| {
        let robot = RobotBuilder::new(images, 2).attach(one, other).build().expect("the images fit");
        let mut engine = Engine::new(robot, 2);
        engine.run_until(5_000 * MILLISECOND);
        engine.state_hash()
    });
    assert_eq!(hashes[0], hashes[1]);
}
