//! The joints' control never takes longer than was computed, and no interrupt waits for longer, whatever
//! comes in at the docks.

use std::collections::BTreeMap;

use simavr_harness::{
    CLOCK_HZ, CONTROL_PROBE, Character, Controller, Edge, Engine, Face, RobotBuilder, Trace,
};
use simulation::{Change, Links, Random, Robot};
use superbot_tests_simavr::bounds::{Noted, notes, pull};
use superbot_tests_simavr::firmware;
use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::Turn;
use tasks::link::frame::{Frame, Label};
use tasks::link::signature::Signature;
use tasks::message::{MAX_PAYLOAD, TaskCode};
use time_bound::{Costs, Releases, Responses};

const SECOND: u64 = CLOCK_HZ as u64;

/// Cycles of a character, and of a period.
const CHARACTER: u64 = 4160;
const PERIOD: u64 = 16_000;

/// For how long something pulls at the joints one way, in cycles, and how often for each load.
const TURN: u64 = SECOND / 20;
const TURNS: u64 = 5;

/// The serial ports of an MCU: the third is the one in software.
const PORTS: usize = 3;

/// What comes in at all docks, without a pause.
#[derive(Clone, Copy, Debug)]
enum Load {
    /// Messages whose bits alternate, as many as a line carries.
    Frames,
    /// Bytes by chance, one in four a zero.
    Babble,
    /// Nothing but ends of frames.
    Zeros,
}

/// The bytes of a message that nobody has sent yet, and whose bits alternate.
fn message(number: u64) -> Vec<u8> {
    let turn = if number.is_multiple_of(2) { Turn::Even } else { Turn::Odd };
    let label = Label { signature: Signature { dock: Dock::Front, epoch: 0x55 }, turn };
    let mut wire = WireBuffer::new();
    let frame = Frame::Data { label, to: TaskCode::HORMONE, payload: &[0x55; MAX_PAYLOAD] };
    frame.encode(&mut wire).unwrap_or_else(|_| panic!("it can be said"));
    wire.bytes().to_vec()
}

/// A module that walks, and hears no more of the neighbour behind it.
fn walking() -> Engine {
    let [here, there] = [(0, Dock::Back), (1, Dock::Front)].map(|(module, dock)| Face { module, dock });
    let robot = RobotBuilder::new(firmware(), 2).attach(here, there).seed(1);
    let mut engine = Engine::new(robot.build().expect("the robot can be built"), 2);
    for controller in Controller::ALL {
        let module = engine.robot_mut().module_mut(0).expect("it is there");
        module.mcu_mut(controller).trace().expect("the image has the kernel");
    }
    engine.run_until(2 * SECOND);
    let change = Change::Loss { links: Links::From(there), probability: 1.0 };
    engine.change(&change).expect("there is such a link");
    engine
}

/// What came in where.
type Came = Vec<(Controller, usize, Character)>;

/// Has a turn's bytes come in at all docks of the module.
fn load(engine: &mut Engine, load: Load, random: &mut Random, came: &mut Came) {
    let now = engine.cycle();
    let module = engine.robot_mut().module_mut(0).expect("it is there");
    for (port, controller) in (0..PORTS).flat_map(|port| Controller::ALL.map(|mcu| (port, mcu))) {
        let mut start = now + (port as u64 + 1) * CHARACTER / 4;
        let mut bytes = Vec::new();
        for number in 0.. {
            if start + CHARACTER > now + TURN {
                break;
            }
            let value = match load {
                Load::Frames => {
                    if bytes.is_empty() {
                        bytes = message(number);
                    }
                    bytes.remove(0)
                }
                Load::Babble => random.below(256) as u8 * u8::from(!random.chance(0.25)),
                Load::Zeros => 0,
            };
            let character = Character { value, start, end: start + CHARACTER };
            module.mcu_mut(controller).receive(port, character);
            came.push((controller, port, character));
            start += CHARACTER;
        }
    }
}

/// The longest from when a period was due to when its drives were computed, and of how many. A period is due
/// at the same time of each, as early as any of them began.
fn longest(edges: &[Edge]) -> (u64, usize) {
    let begins = edges.iter().filter(|edge| edge.level);
    let due = begins.clone().map(|edge| edge.cycle % PERIOD).min().unwrap_or(0);
    let pairs = edges.windows(2).filter(|pair| pair[0].level && !pair[1].level);
    let spans = pairs.map(|pair| pair[1].cycle - (pair[0].cycle - (pair[0].cycle - due) % PERIOD));
    (spans.max().unwrap_or(0), begins.count())
}

/// What was computed of an image.
fn computed(name: &str) -> Responses {
    let noted = Noted::load(name);
    let releases = Releases::load(&["board", name].map(|folder| notes(folder, "releases.toml")));
    let releases = releases.unwrap_or_else(|error| panic!("{error}"));
    let costs = Costs::new(&noted.image, &noted.annotations, &noted.loops).expect("the notes fit");
    let responses = Responses::new(&releases, &costs, &noted.bounds());
    responses.unwrap_or_else(|problems| panic!("{name}: {problems:?}"))
}

/// The vectors whose latency is measured: of the timers that have a period, and of what both USARTs receive.
const ROUND: u8 = 9;
const TICK: u8 = 15;
const RECEIVED: [u8; 2] = [18, 30];

/// How long interrupts have waited at most, by vector: since `start`.
fn waited(trace: &Trace, came: &Came, controller: Controller, start: u64) -> BTreeMap<u8, u64> {
    let accepted = |vector| {
        let of_vector = trace.interrupts.iter().filter(move |slice| slice.what == vector);
        of_vector.map(|slice| slice.begin).filter(move |&begin| begin >= start)
    };
    let mut waited = BTreeMap::new();
    for vector in [ROUND, TICK] {
        // It is due at the same time of each period, as early as it was ever accepted.
        let due = accepted(vector).map(|begin| begin % PERIOD).min().unwrap_or(0);
        waited
            .insert(vector, accepted(vector).map(|begin| (begin + PERIOD - due) % PERIOD).max().unwrap_or(0));
    }
    let mut from = |vector, cycles: Vec<u64>| {
        let begins: Vec<_> = accepted(vector).collect();
        let next = |cycle: u64| {
            begins.get(begins.partition_point(|&begin| begin < cycle)).map(|begin| begin - cycle)
        };
        waited.insert(vector, cycles.into_iter().filter_map(next).max().unwrap_or(0));
    };
    for (port, vector) in RECEIVED.into_iter().enumerate() {
        let here = came.iter().filter(|one| (one.0, one.1) == (controller, port));
        from(vector, here.map(|(_, _, character)| character.end).collect());
    }
    waited
}

#[test]
fn neither_the_joints_control_nor_interrupts_take_longer_than_was_computed() {
    let mut engine = walking();
    let (mut random, mut came) = (Random::new(1), Came::new());
    pull(&mut engine, 0, false);
    engine.run_until(engine.cycle() + TURN);
    for controller in Controller::ALL {
        engine.robot_mut().module_mut(0).expect("it is there").mcu_mut(controller).add_probe(CONTROL_PROBE);
    }
    let start = engine.cycle();
    let mcus = [(Controller::Master, "firmware-master"), (Controller::Slave, "firmware-slave")];
    let mcus = mcus.map(|(controller, name)| (controller, computed(name)));
    println!("MCU     what                bound  longest  bound over longest");
    let hold = |controller: Controller, what: &str, bound: Option<u64>, longest: u64| {
        let bound = bound.unwrap_or_else(|| panic!("{controller:?}: no bound of {what}"));
        let over = bound as f64 / longest as f64;
        println!("{:7} {what:18} {bound:6} {longest:8} {over:19.2}", format!("{controller:?}"));
        assert!(longest <= bound, "{controller:?}, {what}: {longest} cycles, {bound} at most");
    };
    for kind in [Load::Frames, Load::Babble, Load::Zeros] {
        for turn in 0..TURNS {
            pull(&mut engine, 0, turn.is_multiple_of(2));
            load(&mut engine, kind, &mut random, &mut came);
            engine.run_until(engine.cycle() + TURN);
        }
        for (controller, responses) in &mcus {
            let mcu = engine.robot_mut().module_mut(0).expect("it is there").mcu_mut(*controller);
            let (longest, periods) = longest(&mcu.take_edges(0));
            assert!(periods > 100, "the joints were controlled in {periods} periods only");
            let joints = responses.tasks.iter().find(|task| task.task == "MOTORS").expect("it is listed");
            hold(*controller, &format!("control, {kind:?}"), joints.response, longest);
        }
    }
    for (controller, responses) in &mcus {
        let mcu = engine.robot_mut().module_mut(0).expect("it is there").mcu_mut(*controller);
        let trace = mcu.take_trace().expect("it was traced");
        for (vector, longest) in waited(&trace, &came, *controller, start) {
            let of_vector = responses.interrupts.iter().find(|interrupt| interrupt.vector == vector);
            hold(*controller, &format!("vector {vector}"), of_vector.and_then(|one| one.latency), longest);
        }
    }
}
