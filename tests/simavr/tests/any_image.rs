//! No image breaks the simulator: the robot's images with random bits flipped run or are refused. Some of
//! them are also run by simavr's own interpreter, with the same result, and others with a trace.

use std::sync::Arc;

use simavr_harness::{Controller, Engine, Face, Holder, Image, Images, Mcu, Place, Robot, RobotBuilder};
use simulation::{Random, Robot as _};
use superbot_tests_simavr::{MILLISECOND, images, setting};
use tasks::dock::Dock;

/// How many images are tried, unless `SUPERBOT_FLIPPED` says otherwise, and for how long each runs.
const IMAGES: u64 = 400;
const RUNS: u64 = 60 * MILLISECOND;

/// The bytes of the headers at the start of an ELF file; flips there are tried more often.
const HEADERS: usize = 0x100;

/// One in so many is run by simavr's interpreter, too, and another one is traced.
const BY_BOTH: u64 = 4;

/// The image with one bit to eight flipped; `None` if it is refused.
fn flipped(file: &[u8], random: &mut Random) -> Option<Image> {
    let mut file = file.to_vec();
    let end = if random.chance(0.1) { HEADERS } else { file.len() };
    for _ in 0..1 << (random.next_u64() % 4) {
        let at = random.next_u64() as usize % end;
        file[at] ^= 1 << (random.next_u64() % 8);
    }
    Image::parse(&file).ok()
}

/// Two modules, so that docks have a neighbour.
fn robot(images: Images, seed: u64) -> Option<Robot> {
    let [one, other] = [(0, Dock::Back), (1, Dock::Front)].map(|(module, dock)| Face { module, dock });
    RobotBuilder::new(images, 2).attach(one, other).seed(seed).build().ok()
}

/// Runs the robot. Returns a hash of its final state, unless it can't be built.
fn run(images: Images, seed: u64) -> Option<u64> {
    let mut engine = Engine::new(robot(images, seed)?, 1);
    engine.run_until(RUNS);
    Some(engine.state_hash())
}

/// As [`run`], with the first module traced, if its images can be traced. The times of the trace must be
/// those of the CPU.
fn run_traced(images: Images, seed: u64) -> Option<u64> {
    let mut robot = robot(images, seed)?;
    let is_traced = Controller::ALL.map(|controller| mcu(&mut robot, controller).trace().is_ok());
    let mut engine = Engine::new(robot, 1);
    engine.run_until(RUNS);
    for (controller, is_traced) in Controller::ALL.into_iter().zip(is_traced) {
        let mcu = mcu(engine.robot_mut(), controller);
        let trace = mcu.take_trace();
        assert_eq!(trace.is_some(), is_traced);
        let Some(trace) = trace else { continue };
        let is_awake = |holder| !matches!(holder, Holder::Sleep | Holder::Reset);
        let awake = trace.cpu.iter().filter(|slice| is_awake(slice.what)).map(|slice| slice.cycles());
        assert_eq!(awake.sum::<u64>(), mcu.awake_cycles(), "seed {seed}");
    }
    Some(engine.state_hash())
}

fn mcu(robot: &mut Robot, controller: Controller) -> &mut Mcu {
    robot.module_mut(0).expect("there are two").mcu_mut(controller)
}

#[test]
fn no_flipped_bit_breaks_the_simulator() {
    let number = setting("SUPERBOT_FLIPPED");
    let read = |name: &str| std::fs::read(images().join(name)).expect("./x build leaves it");
    let [master, slave] = ["firmware-master.elf", "firmware-slave.elf"].map(read);
    let [whole_master, whole_slave] =
        [&master, &slave].map(|file| Arc::new(Image::parse(file).expect("it is an image")));
    let mut refused = 0;
    for seed in 0..number.unwrap_or(IMAGES) {
        let mut random = Random::new(seed);
        let is_master = seed % 2 == 0;
        let Some(image) = flipped(if is_master { &master } else { &slave }, &mut random) else {
            refused += 1;
            continue;
        };
        if std::env::var_os("SUPERBOT_FLIPPED").is_some() {
            eprintln!("seed {seed}");
        }
        let beside = |image: Image| {
            let image = Arc::new(image);
            if is_master {
                Images { master: image, slave: whole_slave.clone() }
            } else {
                Images { master: whole_master.clone(), slave: image }
            }
        };
        let state = run(beside(image.clone()), seed);
        if seed.is_multiple_of(BY_BOTH) {
            assert_eq!(state, run(beside(image.undecoded()), seed), "seed {seed}");
        } else if seed % BY_BOTH == seed / BY_BOTH % (BY_BOTH - 1) + 1 {
            // This traces images of the master as well as of the slave.
            assert_eq!(state, run_traced(beside(image), seed), "seed {seed}");
        }
    }
    assert!(refused < number.unwrap_or(IMAGES) / 4, "{refused} images were refused");
}

/// A flipped bit once moved a label onto the SLEEP of the idle loop, and the trace showed the CPU awake for
/// ever.
#[test]
fn an_image_whose_label_lies_on_its_sleep_can_not_be_traced() {
    const LABEL: &str = "kernel_run_head";
    let file = std::fs::read(images().join("firmware-master.elf")).expect("./x build leaves it");
    let slave = Arc::new(Image::load(images().join("firmware-slave.elf")).expect("it is an image"));
    let place = |image: &Image, name: &str| match image.symbol(name)?.place {
        Place::Flash(address) => Some(address),
        _ => None,
    };
    let whole = Image::parse(&file).expect("it is an image");
    let sleep = place(&whole, "idle").expect("there is one") + 2; // after SEI
    let label = place(&whole, LABEL).expect("there is one").to_le_bytes();
    let moved = file.windows(4).enumerate().filter(|(_, bytes)| *bytes == label).find_map(|(at, _)| {
        let mut file = file.clone();
        file[at..at + 4].copy_from_slice(&sleep.to_le_bytes());
        Image::parse(&file).ok().filter(|image| place(image, LABEL) == Some(sleep))
    });
    let images = Images { master: Arc::new(moved.expect("a symbol says where it lies")), slave };
    let mut robot = robot(images, 1).expect("it can be built");
    assert!(mcu(&mut robot, Controller::Slave).trace().is_ok());
    assert!(mcu(&mut robot, Controller::Master).trace().is_err());
}
