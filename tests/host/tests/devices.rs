//! The devices' task on its plants: latches, a joint, infrared and a battery. Each request is carried out and
//! reported, or refused.

use std::sync::{Arc, Mutex, MutexGuard};

use kernel::{Interrupt, Priority, Semaphore, Stack, Task, TaskHandle, Ticks, host};
use plants::dock::{Latch, reflected};
use plants::joint::{Joint as Plant, PotentiometerFault, counts};
use tasks::device::{JointMotors, Peripherals, Quantity};
use tasks::devices::memory::{Cells, Memory, Record};
use tasks::devices::task::{self as devices, Desk};
use tasks::dock::Dock;
use tasks::docking::guidance::HELD;
use tasks::docking::latch::{End, EndSwitches, Failure, State as LatchState};
use tasks::mailbox::Mailbox;
use tasks::message::{Address, Message, TaskCode};
use tasks::motor::joint::{Joint, Reading, State};
use tasks::motor::joints::Joints;
use tasks::motor::task::{self as motor, Motors};
use tasks::motor::{Axis, FULL_DRIVE};
use tasks::post_office::{PostOffice, Undelivered};
use tasks::power::allowance::Allowance;
use tasks::power::battery::Level;
use tasks::power::charger;
use tasks::power::switch::Switch;
use tasks::request::{Report, Request};
use tasks::router::{Mcu, Router, Source};
use tasks::sensor::Sensor;
use tasks::superbot::{Half, JOINT, LATCH_CURRENT_LIMIT, MASTER, RESIDENCE, SLAVE};

const HORMONE: TaskCode = TaskCode::HORMONE;

/// The surroundings of one MCU's devices.
struct World {
    /// The quantities requested and not read yet, each with whether the light was there at the request.
    looked: Vec<(Quantity, bool)>,
    latches: [Latch; 3],
    driven: [Option<End>; 3],
    powered: [bool; 3],
    tripped: u8,
    emitters: bool,
    /// The milliseconds since the light was switched on.
    lit: u32,
    charger: bool,
    joint: Plant,
    drive: i16,
    /// Posted each millisecond while the joint is controlled.
    period: Option<&'static Semaphore>,
    /// The dock that has another one before it, the distance in mm, and the joint's angle, in degrees, at
    /// which they face each other.
    before: Option<(Dock, f64, f64)>,
    /// A current that replaces that of the latch's plant, in mA.
    latch_ma: Option<i16>,
    battery_mv: i16,
    battery_temperature: i16,
    /// The current out of each dock here, in mA.
    dock_ma: i16,
    /// The EEPROM, and the milliseconds until the byte under way is written.
    eeprom: [u8; 256],
    writes: u8,
    /// How often the task has reported that it is alive.
    alive: u32,
}

type Shared = Arc<Mutex<World>>;

impl World {
    fn new() -> Shared {
        Arc::new(Mutex::new(World {
            looked: Vec::new(),
            latches: [0; 3].map(|_| Latch::at(0.0)),
            driven: [None; 3],
            powered: [false; 3],
            tripped: 0,
            emitters: false,
            lit: 0,
            charger: false,
            joint: Plant::at(0.0),
            drive: 0,
            period: None,
            before: None,
            latch_ma: None,
            battery_mv: 7_400,
            battery_temperature: 250,
            dock_ma: 0,
            eeprom: [0xFF; 256],
            writes: 0,
            alive: 0,
        }))
    }

    /// A millisecond passes.
    fn step(&mut self, interrupt: &mut Interrupt) {
        for _ in 0..20 {
            self.joint.step(f64::from(self.drive) / f64::from(FULL_DRIVE), 0.000_05);
        }
        for (latch, driven) in self.latches.iter_mut().zip(self.driven) {
            latch.step(driven.map_or(0, |end| if end == End::Latched { 1 } else { -1 }), 0.001);
        }
        self.lit = if self.emitters { self.lit + 1 } else { 0 };
        self.writes = self.writes.saturating_sub(1);
        if let Some(period) = self.period {
            period.post(interrupt);
        }
    }

    fn value(&self, quantity: Quantity) -> i16 {
        match quantity {
            Quantity::Proximity(dock) => match self.before {
                Some((seen, millimetres, facing)) if seen == dock && self.emitters => {
                    reflected(millimetres, self.joint.degrees() - facing) as i16
                }
                _ => 0,
            },
            Quantity::LatchCurrent => {
                let running = self.latches.iter().zip(self.driven).filter(|(_, driven)| driven.is_some());
                let drawn = running.map(|(latch, _)| (1000.0 * latch.amperes()) as i16).max().unwrap_or(0);
                self.latch_ma.unwrap_or(drawn)
            }
            Quantity::Sensor(Sensor::BatteryVoltage) => self.battery_mv,
            Quantity::Sensor(Sensor::BatteryTemperature) => self.battery_temperature,
            Quantity::Sensor(Sensor::DockCurrent(_)) => self.dock_ma,
            Quantity::Sensor(sensor) => 1000 + i16::from(sensor.code()),
        }
    }
}

fn at(world: &Shared) -> MutexGuard<'_, World> {
    world.lock().expect("no test panicked with it")
}

/// The devices of the master, or with the battery those of the slave.
struct Board<const BATTERY: bool>(Shared);

impl<const BATTERY: bool> Board<BATTERY> {
    fn place(dock: Dock) -> usize {
        Self::HALF.docks().into_iter().position(|here| here == dock).expect("a dock of this MCU")
    }
}

impl<const BATTERY: bool> Peripherals for Board<BATTERY> {
    const HALF: Half = if BATTERY { SLAVE } else { MASTER };

    fn look(&mut self, _: &mut Task, quantity: Quantity) {
        let mut world = at(&self.0);
        world.looked.retain(|(looked, _)| *looked != quantity);
        // A converter's reading shows no light that came up just now.
        let is_lit = world.lit > 16;
        world.looked.push((quantity, is_lit));
    }

    fn seen(&mut self, _: &mut Task, quantity: Quantity) -> Option<i16> {
        let mut world = at(&self.0);
        let index = world.looked.iter().position(|(looked, _)| *looked == quantity)?;
        let (_, is_lit) = world.looked.remove(index);
        Some(if is_lit || !matches!(quantity, Quantity::Proximity(_)) { world.value(quantity) } else { 0 })
    }

    fn end_switches(&mut self, dock: Dock) -> EndSwitches {
        let latch = &at(&self.0).latches[Self::place(dock)];
        EndSwitches { is_released: latch.is_released(), is_latched: latch.is_latched() }
    }

    fn drive_latch(&mut self, dock: Dock, to: Option<End>) {
        at(&self.0).driven[Self::place(dock)] = to;
    }

    fn set_power(&mut self, _: &mut Task, dock: Dock, is_on: bool) {
        at(&self.0).powered[Self::place(dock)] = is_on;
    }

    fn take_tripped(&mut self, _: &mut Task) -> u8 {
        std::mem::take(&mut at(&self.0).tripped)
    }

    fn set_emitters(&mut self, is_on: bool) {
        at(&self.0).emitters = is_on;
    }

    fn set_charger(&mut self, is_on: bool) {
        at(&self.0).charger = is_on;
    }

    fn is_memory_ready(&mut self, _: &mut Task) -> bool {
        at(&self.0).writes == 0
    }

    fn recall(&mut self, address: u16) -> u8 {
        at(&self.0).eeprom[usize::from(address)]
    }

    fn store(&mut self, _: &mut Task, address: u16, byte: u8) {
        let mut world = at(&self.0);
        world.eeprom[usize::from(address)] = byte;
        world.writes = 9;
    }
}

struct Motor(Shared);

impl JointMotors for Motor {
    fn begin(&mut self, _: &mut Task, period: &'static Semaphore) {
        at(&self.0).period = Some(period);
    }

    fn end(&mut self, _: &mut Task) {
        at(&self.0).period = None;
    }

    fn look(&mut self, _: &mut Task) {}

    fn reading(&self, _: &mut Task, _: usize) -> Reading {
        let world = at(&self.0);
        Reading {
            potentiometer: counts(world.joint.potentiometer_volts()),
            current: counts(world.joint.current_volts()),
        }
    }

    fn drive(&mut self, _: &mut Task, _: usize, drive: i16) {
        at(&self.0).drive = drive;
    }

    fn done(&mut self) {}
}

/// A client that asks the devices, and receives their reports.
struct Client<'a> {
    task: &'a mut Task,
    office: &'static PostOffice,
    devices: &'static Mailbox,
    /// The devices' task.
    server: TaskHandle,
    /// The mailbox that gets all reports: HORMONE's, or the bridge's.
    heard: &'static Mailbox,
    world: Shared,
}

impl Client<'_> {
    /// Asks a device on behalf of `client`, which is on the other MCU.
    fn ask_for(&mut self, client: TaskCode, request: Request) {
        let payload = request.to_payload();
        let message = Message::new(Address::here(request.task()), Address::here(client), &payload);
        let sent = self.office.deliver(self.task, message.expect("it is short"), Source::Bridge);
        assert_eq!(sent, Ok(()), "{request:?}");
    }

    fn ask(&mut self, request: Request) {
        self.ask_for(HORMONE, request);
    }

    /// Asks all this before the devices take the first of it.
    fn ask_at_once(&mut self, requests: [Request; 3]) {
        self.server.suspend(self.task).expect("it waits");
        requests.into_iter().for_each(|request| self.ask(request));
        assert!(self.server.resume(self.task));
    }

    /// The messages within so many ticks, each with its addressee.
    fn within(&mut self, ticks: Ticks) -> Vec<(TaskCode, Told)> {
        let mut told = Vec::new();
        for _ in 0..ticks {
            self.task.delay(1);
            while let Some(letter) = self.heard.take(self.task) {
                let what = Report::from_payload(letter.payload()).map(Told::Report);
                let what = what.or(Request::from_payload(letter.payload()).map(Told::Request));
                let what = what.expect("a report or a request");
                assert_eq!(letter.from(), Address::here(what.device()), "{what:?}");
                told.push((letter.to().task(), what));
            }
        }
        told
    }

    /// The reports to HORMONE among the messages [`within`](Self::within) so many ticks.
    fn reports(&mut self, ticks: Ticks) -> Vec<Report> {
        let told = self.within(ticks).into_iter();
        told.filter_map(|(to, told)| match told {
            Told::Report(report) if to == HORMONE => Some(report),
            _ => None,
        })
        .collect()
    }

    /// Uses up all buffers, until the next call that takes the messages.
    fn fill(&mut self) {
        let payload = Report::Charger(charger::State::Off).to_payload();
        let message = || Message::new(Address::here(HORMONE), Address::here(TaskCode::POWER), &payload);
        while self.office.deliver(self.task, message().expect("it is short"), Source::Task).is_ok() {}
    }

    fn world(&self) -> MutexGuard<'_, World> {
        at(&self.world)
    }

    /// Sets the battery's voltage, and waits until the task believes it.
    fn drain(&mut self, millivolts: i16) -> Vec<(TaskCode, Told)> {
        self.world().battery_mv = millivolts;
        self.within(1_400)
    }

    /// Searches for a dock that is too far away. Returns the messages about it.
    fn loses_a_dock(&mut self) -> Vec<Told> {
        self.within(10);
        self.turn(0);
        self.world().before = Some((Dock::Back, 14.0, 8.0));
        self.ask(Request::Approach(Dock::Back));
        let told: Vec<_> = (0..10).flat_map(|_| self.within(1_000)).map(|(_, told)| told).collect();
        assert_eq!(told.last(), Some(&Told::Report(Report::Lost(Dock::Back))));
        told
    }

    /// Turns the joint, so that its position is known.
    fn turn(&mut self, angle: i16) {
        self.ask(Request::Turn { axis: Axis::Back, angle, speed: 90 });
        let told = self.reports(3_000);
        assert!(told.contains(&Report::Joint(Axis::Back, State::Arrived)), "{told:?}");
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    Report(Report),
    Request(Request),
}

impl Told {
    /// The device that tells it.
    fn device(self) -> TaskCode {
        match self {
            Told::Report(Report::Value(sensor, _)) => sensor.task(),
            Told::Report(Report::Joint(axis, _)) => TaskCode::joint(axis),
            Told::Report(
                Report::Latch(dock, _) | Report::Lost(dock) | Report::Held(dock) | Report::Switch(dock, _),
            ) => TaskCode::dock(dock),
            Told::Report(Report::Battery(_) | Report::Charger(_)) => TaskCode::POWER,
            Told::Report(Report::Refused(device)) => device,
            Told::Report(Report::Kept(_)) => TaskCode::MEMORY,
            // The dock of a search.
            Told::Request(Request::TurnBy { .. }) => TaskCode::dock(Dock::Back),
            Told::Request(_) => TaskCode::POWER,
        }
    }
}

const fn mcu<const BATTERY: bool>() -> Mcu {
    if BATTERY { Mcu::Slave } else { Mcu::Master }
}

/// The clock begins anew within that time.
const TICKS: u32 = 70_000;

/// Runs `script` beside the tasks of one MCU's devices and joint. Returns the world at the end.
fn run<const BATTERY: bool>(script: fn(&mut Client)) -> Shared {
    fn forever<T>(value: T) -> &'static T {
        Box::leak(Box::new(value))
    }
    let world = World::new();
    let [devices, heard, nobody] = [6, 64, 0].map(|length| forever(Mailbox::new(length)));
    let motors: &'static Motors<1> = forever(Motors::new());
    let office = forever(PostOffice {
        router: Router::new(mcu::<BATTERY>(), RESIDENCE),
        tasks: if BATTERY { &[] } else { forever([(HORMONE, heard)]) },
        devices,
        links: &[],
        bridge: if BATTERY { heard } else { nobody },
    });
    let desk: &'static Desk<1> = forever(Desk::new(motors, office));
    let axis = if BATTERY { Axis::Back } else { Axis::Front };
    let done = Arc::new(Mutex::new(false));
    let is_done = Arc::clone(&done);
    let in_tick = Arc::clone(&world);
    let of_task = Arc::clone(&world);
    host::run_for(
        TICKS,
        move |boot| {
            let [board, motor, alive, of_script] = [0; 4].map(|_| Arc::clone(&of_task));
            let stacks: [&'static Stack<4000>; 3] = [0; 3].map(|_| forever(Stack::new()));
            let [joints, devices_stack, client] = stacks;
            let run_joints = move |task: &mut Task| {
                motor::run(task, motors, Joints::new([Joint::new(JOINT)]), Motor(motor), devices.semaphore())
            };
            joints.start(boot, Priority::P0, run_joints).expect("the stack is free");
            let serve = move |task: &mut Task| {
                devices::run(task, devices, Board::<BATTERY>(board), [axis], desk, move |_| {
                    at(&alive).alive += 1;
                })
            };
            devices_stack.start(boot, Priority::P3, serve).expect("the stack is free");
            let play = move |task: &mut Task| {
                let server = devices_stack.task();
                let mut client = Client { task, office, devices, server, heard, world: of_script };
                script(&mut client);
                *is_done.lock().expect("no test panicked with it") = true;
                // All tests share one pool of letters, so none may stay in a mailbox.
                loop {
                    client.within(1_000);
                }
            };
            client.start(boot, Priority::P4, play).expect("the stack is free");
        },
        move |interrupt, _| at(&in_tick).step(interrupt),
    );
    assert!(*done.lock().expect("no test panicked with it"), "the script takes too long");
    world
}

#[test]
fn a_joint_tells_at_first_that_it_is_off_and_then_of_what_it_comes_to() {
    let world = run::<true>(|client| {
        assert_eq!(client.reports(10), [Report::Joint(Axis::Back, State::Off)]);
        client.ask(Request::Turn { axis: Axis::Back, angle: 200, speed: 90 });
        assert_eq!(client.reports(3_000), [Report::Joint(Axis::Back, State::Arrived)]);
        assert!((client.world().joint.degrees() - 20.0).abs() < 1.0);

        // The client that asked last gets the report.
        client.ask_for(TaskCode::AC_RECEIVE, Request::Turn { axis: Axis::Back, angle: 0, speed: 90 });
        let told = client.within(3_000);
        let arrived = Told::Report(Report::Joint(Axis::Back, State::Arrived));
        assert_eq!(told, [(TaskCode::AC_RECEIVE, arrived)]);

        client.ask_for(TaskCode::AC_RECEIVE, Request::Turn { axis: Axis::Back, angle: 0, speed: 90 });
        assert_eq!(client.within(500), [(TaskCode::AC_RECEIVE, arrived)], "it is there already");

        client.ask(Request::Relax(Axis::Back));
        let off = Told::Report(Report::Joint(Axis::Back, State::Off));
        assert_eq!(client.within(50), [(TaskCode::AC_RECEIVE, off)], "whose turn it was");
        assert_eq!(client.world().drive, 0);
    });
    // At least every 50 ms.
    assert!(at(&world).alive >= TICKS / 50);
}

#[test]
fn a_joint_that_is_not_here_is_refused() {
    run::<true>(|client| {
        client.within(10);
        // No router would send this request here.
        let request = Request::Turn { axis: Axis::Front, angle: 200, speed: 90 };
        let payload = request.to_payload();
        let (to, from) = (Address::here(TaskCode::joint(Axis::Front)), Address::here(HORMONE));
        let message = Message::new(to, from, &payload).expect("it is short");
        let letter = tasks::message::Letter::of(message);
        let letter = kernel::Message::new(client.task, letter).expect("there is a buffer");
        client.devices.put(client.task, letter).ok().expect("there is room");
        assert_eq!(client.reports(10), [Report::Refused(TaskCode::joint(Axis::Front))]);
        assert_eq!(client.world().drive, 0);
        let absent = Address::here(TaskCode::CONSOLE);
        let to_nobody = Message::new(absent, from, &[]).expect("it is short");
        assert_eq!(client.office.deliver(client.task, to_nobody, Source::Task), Err(Undelivered::Ignored));
    });
}

#[test]
fn sensors_are_read_four_at_a_time() {
    run::<true>(|client| {
        client.within(10);
        let sensors = [
            Sensor::BatteryVoltage,
            Sensor::BatteryTemperature,
            Sensor::DockCurrent(Dock::Up),
            Sensor::SlaveTemperature,
        ];
        client.world().dock_ma = 77;
        for (round, client_code) in [HORMONE, TaskCode::AC_RECEIVE].into_iter().enumerate() {
            for sensor in sensors {
                client.ask_for(client_code, Request::Read(sensor));
            }
            client.ask_for(client_code, Request::Read(Sensor::DockCurrent(Dock::Down)));
            let mut told = client.within(20);
            let refused = Report::Refused(TaskCode::dock(Dock::Down));
            assert_eq!(told.remove(0), (client_code, Told::Report(refused)), "{round}");
            let values = [7_400, 250, 77, 1018];
            let expected = sensors.into_iter().zip(values);
            let expected: Vec<_> = expected
                .map(|(sensor, value)| (client_code, Told::Report(Report::Value(sensor, value))))
                .collect();
            assert_eq!(told, expected);
        }
    });
}

/// Else a sensor of the other MCU, which nothing here measures, would take a place for good.
#[test]
fn a_request_to_another_device_than_it_is_for_is_malformed() {
    run::<true>(|client| {
        client.within(10);
        let payload = Request::Read(Sensor::AccelerationX).to_payload();
        let message = Message::new(Address::here(TaskCode::POWER), Address::here(HORMONE), &payload);
        let sent = client.office.deliver(client.task, message.expect("it is short"), Source::Bridge);
        assert_eq!(sent, Ok(()));
        assert_eq!(client.within(20), []);
    });
}

#[test]
fn one_latch_moves_at_a_time_and_tells_when_it_is_there() {
    run::<true>(|client| {
        client.within(10);
        client.ask(Request::Latch(Dock::Up, End::Latched));
        assert_eq!(client.reports(100), []);
        assert_eq!(client.world().driven, [None, Some(End::Latched), None]);
        client.ask(Request::Latch(Dock::Down, End::Latched));
        client.ask(Request::Approach(Dock::Back));
        let refused = [Dock::Down, Dock::Back].map(|dock| Report::Refused(TaskCode::dock(dock)));
        assert_eq!(client.reports(10), refused);
        // The same dock may change its mind.
        client.ask(Request::Latch(Dock::Up, End::Released));
        assert_eq!(client.reports(2_500), [Report::Latch(Dock::Up, LatchState::At(End::Released))]);
        assert_eq!(client.world().driven, [None; 3]);

        client.ask(Request::Latch(Dock::Down, End::Latched));
        assert_eq!(client.reports(2_500), [Report::Latch(Dock::Down, LatchState::At(End::Latched))]);
        assert!(client.world().latches[2].is_latched() && client.world().latches[1].is_released());

        client.world().latches[0].blocked_at = Some(0.5);
        client.ask(Request::Latch(Dock::Back, End::Latched));
        let jammed = LatchState::Failed(Failure::Jammed);
        assert_eq!(client.reports(2_500), [Report::Latch(Dock::Back, jammed)]);
        assert_eq!(client.world().driven, [None; 3]);

        client.world().latch_ma = Some(0);
        client.ask_for(TaskCode::AC_RECEIVE, Request::Latch(Dock::Back, End::Latched));
        client.ask(Request::Power { dock: Dock::Back, is_on: true });
        assert_eq!(client.within(1_990), []);
        let failed = Told::Report(Report::Latch(Dock::Back, LatchState::Failed(Failure::TimedOut)));
        assert_eq!(client.within(30), [(TaskCode::AC_RECEIVE, failed)], "which asked for the latch last");
    });
}

#[test]
fn a_docking_motor_may_take_its_limit_and_no_more() {
    run::<true>(|client| {
        client.within(10);
        for (drawn, end) in [
            (LATCH_CURRENT_LIMIT, LatchState::At(End::Latched)),
            (LATCH_CURRENT_LIMIT + 1, LatchState::Failed(Failure::Jammed)),
        ] {
            client.world().latches[1] = Latch::at(0.0);
            client.world().latch_ma = Some(drawn);
            client.ask(Request::Latch(Dock::Up, End::Latched));
            assert_eq!(client.reports(2_500), [Report::Latch(Dock::Up, end)]);
        }
    });
}

#[test]
fn a_dock_is_found_with_the_joint_and_latched() {
    run::<true>(|client| {
        client.within(10);
        client.ask(Request::Approach(Dock::Back));
        assert_eq!(client.reports(10), [Report::Refused(TaskCode::dock(Dock::Back))], "where is the joint?");
        client.turn(0);
        client.world().before = Some((Dock::Back, 3.0, 8.0));
        client.ask(Request::Approach(Dock::Back));
        assert_eq!(client.reports(20), []);
        assert!(client.world().emitters);
        // Meanwhile no other dock's motor may run, and the joint's turns are not reported.
        client.ask(Request::Latch(Dock::Up, End::Latched));
        assert_eq!(client.reports(10), [Report::Refused(TaskCode::dock(Dock::Up))]);
        let latched = Report::Latch(Dock::Back, LatchState::At(End::Latched));
        let told: Vec<Report> = (0..20).flat_map(|_| client.reports(1_000)).collect();
        assert_eq!(told, [latched]);
        let world = client.world();
        assert!(!world.emitters && world.latches[0].is_latched());
        assert!((world.joint.degrees() - 8.0).abs() < 2.0, "{}", world.joint.degrees());
    });
}

/// First the joint here turns, then both joints of the module: the one on the other MCU turns as far the
/// other way.
#[test]
fn a_dock_too_far_away_is_come_near_to_with_both_joints_and_lost() {
    run::<true>(|client| {
        let told = client.loses_a_dock();
        let opposite = told.iter().map(|told| match told {
            Told::Request(Request::TurnBy { axis: Axis::Front, by, speed: 30 }) => *by,
            Told::Report(Report::Lost(Dock::Back)) => 0,
            _ => panic!("{told:?}"),
        });
        let opposite: Vec<i16> = opposite.collect();
        assert_eq!(opposite[0], -120, "{opposite:?}");
        assert!(opposite.iter().sum::<i16>().abs() <= 40, "here this is of no use: {opposite:?}");
        let world = client.world();
        assert!(!world.emitters && world.driven == [None; 3]);
        assert!((world.joint.degrees() - 8.0).abs() < 2.0, "it stays: {}", world.joint.degrees());
    });
}

#[test]
fn a_joint_turns_by_as_much_as_a_search_on_the_other_mcu_asks() {
    run::<true>(|client| {
        client.within(10);
        client.turn(100);
        let axis = Axis::Back;
        client.ask_for(TaskCode::dock(Dock::Front), Request::TurnBy { axis, by: -150, speed: 30 });
        let told = client.within(2_000);
        let arrived = Told::Report(Report::Joint(axis, State::Arrived));
        assert_eq!(told, [(HORMONE, arrived)], "who asked for its turn");
        assert!((client.world().joint.degrees() + 5.0).abs() < 1.0);
    });
}

/// A joint at 10 degrees is switched off, and turned to 50 degrees by a hand, or by the other module.
fn turn_by_hand(client: &mut Client) {
    client.within(10);
    client.turn(100);
    client.ask(Request::Relax(Axis::Back));
    client.within(100);
    client.world().joint = Plant::at(50.0);
}

#[test]
fn a_joint_that_is_off_turns_from_where_it_is_and_not_from_where_it_was() {
    run::<true>(|client| {
        turn_by_hand(client);
        let turn = Request::TurnBy { axis: Axis::Back, by: -150, speed: 30 };
        client.ask_for(TaskCode::dock(Dock::Front), turn);
        client.within(2_000);
        assert!((client.world().joint.degrees() - 35.0).abs() < 1.0, "{}", client.world().joint.degrees());
    });
}

#[test]
fn a_search_begins_where_a_joint_that_was_off_is() {
    run::<true>(|client| {
        turn_by_hand(client);
        client.world().before = Some((Dock::Back, 3.0, 53.0));
        client.ask(Request::Approach(Dock::Back));
        let told: Vec<Report> = (0..20).flat_map(|_| client.reports(1_000)).collect();
        assert_eq!(told, [Report::Latch(Dock::Back, LatchState::At(End::Latched))]);
        assert!((client.world().joint.degrees() - 53.0).abs() < 2.0, "{}", client.world().joint.degrees());
    });
}

#[test]
fn a_joint_that_is_off_stays_where_it_is_when_the_search_is_broken_off() {
    run::<true>(|client| {
        turn_by_hand(client);
        client.ask(Request::Approach(Dock::Back));
        client.ask(Request::Latch(Dock::Back, End::Latched));
        client.within(3_000);
        assert!((client.world().joint.degrees() - 50.0).abs() < 1.0, "{}", client.world().joint.degrees());
        // As the search holds it, it gives way to the other dock and tells nobody.
        client.world().joint.surroundings.load_torque = 12.0;
        assert_eq!(client.within(3_000), []);
        assert!((client.world().joint.degrees() - 50.0).abs() > 2.0, "it was pushed off");
    });
}

/// HORMONE makes the joint turn again only when it gets that report.
#[test]
fn a_joint_that_stalls_while_there_is_no_room_is_told_of_once_there_is() {
    run::<true>(|client| {
        client.within(10);
        client.turn(100);
        client.ask(Request::Turn { axis: Axis::Back, angle: 0, speed: 30 });
        client.world().joint.surroundings.is_blocked = true;
        client.fill();
        client.task.delay(2_000);
        let told = client.reports(100);
        assert_eq!(told.last(), Some(&Report::Joint(Axis::Back, State::Stalled)));
        assert_eq!(client.reports(1_000), [], "once");
    });
}

/// With a report, the task that asked for the last turn would turn the joint back.
#[test]
fn a_joint_that_a_search_has_push_against_the_other_dock_tells_nobody() {
    run::<true>(|client| {
        client.within(10);
        client.turn(100);
        client.world().joint.surroundings.is_blocked = true;
        let push = Request::TurnBy { axis: Axis::Back, by: -150, speed: 30 };
        client.ask_for(TaskCode::dock(Dock::Front), push);
        assert_eq!(client.within(2_000), []);
        // A turn that a task asks for is reported.
        client.ask(Request::Turn { axis: Axis::Back, angle: 0, speed: 30 });
        assert_eq!(client.reports(2_000), [Report::Joint(Axis::Back, State::Stalled)]);
    });
}

/// HORMONE has a joint stay where it is in this way, and tells one that has failed again.
#[test]
fn a_joint_that_a_behaviour_turns_by_an_angle_is_reported_to_it() {
    run::<true>(|client| {
        let turn = Request::TurnBy { axis: Axis::Back, by: -150, speed: 30 };
        client.within(10);
        client.turn(100);
        client.world().joint.surroundings.is_blocked = true;
        for _ in 0..2 {
            client.ask(turn);
            assert_eq!(client.reports(2_000), [Report::Joint(Axis::Back, State::Stalled)]);
        }
        client.world().joint.set_fault(Some(PotentiometerFault::Open));
        for _ in 0..2 {
            client.ask(turn);
            assert_eq!(client.reports(500), [Report::Joint(Axis::Back, State::BrokenPotentiometer)]);
        }
    });
}

/// Nor is a joint reported that a search of this MCU has turned, when the other dock then pushes it off.
#[test]
fn a_joint_that_a_search_has_left_somewhere_gives_way_and_tells_nobody() {
    run::<true>(|client| {
        client.loses_a_dock();
        client.world().joint.surroundings.load_torque = 12.0;
        assert_eq!(client.within(3_000), []);
        assert!((client.world().joint.degrees() - 8.0).abs() > 2.0, "it was pushed off");
        client.ask(Request::Turn { axis: Axis::Back, angle: 0, speed: 30 });
        assert_eq!(client.reports(3_000), [Report::Joint(Axis::Back, State::Stalled)]);
    });
}

/// The search has held the joint, and that was not noted yet when the turn comes.
#[test]
fn a_turn_that_comes_at_once_with_the_end_of_a_search_is_reported() {
    run::<true>(|client| {
        turn_by_hand(client);
        client.world().joint.surroundings.is_blocked = true;
        let turn = Request::Turn { axis: Axis::Back, angle: 0, speed: 30 };
        client.ask_at_once([Request::Approach(Dock::Back), Request::Leave(Dock::Back), turn]);
        assert_eq!(client.reports(2_000), [Report::Joint(Axis::Back, State::Stalled)]);
    });
}

/// A client that has got no answer asks again, and a search takes longer than a client may wait.
#[test]
fn a_search_that_is_asked_for_again_goes_on() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.world().before = Some((Dock::Back, 14.0, 8.0));
        let told: Vec<Report> = (0..20)
            .flat_map(|_| {
                client.ask(Request::Approach(Dock::Back));
                client.reports(500)
            })
            .collect();
        assert!(told.contains(&Report::Lost(Dock::Back)), "{told:?}");
    });
}

/// Hooks that hold each other move together, and docks that have met reflect most.
#[test]
fn a_search_ends_once_the_other_dock_has_latched() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.world().before = Some((Dock::Back, 14.0, 8.0));
        client.ask(Request::Approach(Dock::Back));
        assert_eq!(client.reports(500), []);
        client.world().before = Some((Dock::Back, 0.0, 0.0));
        client.world().latches[0] = Latch::at(1.0);
        let told: Vec<Report> = (0..10).flat_map(|_| client.reports(1_000)).collect();
        assert_eq!(told[0], Report::Held(Dock::Back));
        assert_eq!(told[1..], [Report::Joint(Axis::Back, State::Arrived)], "it stays where it is");
        let world = client.world();
        assert!(!world.emitters && world.latches[0].is_latched());
    });
}

#[test]
fn a_latch_that_has_closed_on_nothing_opens_before_it_closes_again_and_stays_so() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.world().latches[0] = Latch::at(1.0);
        let [released, latched] =
            [End::Released, End::Latched].map(|end| Report::Latch(Dock::Back, LatchState::At(end)));
        for (millimetres, report) in [(9.0, released), (9.0, latched), (0.0, Report::Held(Dock::Back))] {
            client.world().before = Some((Dock::Back, millimetres, 0.0));
            client.ask(Request::Approach(Dock::Back));
            let told: Vec<Report> = (0..4).flat_map(|_| client.reports(1_000)).collect();
            assert_eq!(told, [report]);
        }
    });
}

/// A latch that is closed has hold of a dock if that reflects as much as one that touches.
#[test]
fn a_dock_that_reflects_too_little_is_not_held() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        let released = Report::Latch(Dock::Back, LatchState::At(End::Released));
        for (counts, report) in [(HELD, Report::Held(Dock::Back)), (HELD - 1, released)] {
            let distances = (0..).map(|step| f64::from(step) * 0.001);
            let millimetres = { distances }.find(|distance| reflected(*distance, 0.0) == counts);
            let facing = client.world().joint.degrees();
            client.world().latches[0] = Latch::at(1.0);
            client.world().before = Some((Dock::Back, millimetres.expect("there is one"), facing));
            client.ask(Request::Approach(Dock::Back));
            assert_eq!(client.reports(3_000), [report], "{counts}");
        }
    });
}

#[test]
fn a_dock_whose_latch_moves_is_not_searched_for() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        for end in [End::Latched, End::Released] {
            client.ask(Request::Latch(Dock::Back, end));
            assert_eq!(client.reports(100), []);
            client.ask(Request::Approach(Dock::Back));
            assert_eq!(client.reports(50), []);
            assert!(!client.world().emitters);
            assert_eq!(client.reports(2_500), [Report::Latch(Dock::Back, LatchState::At(end))]);
        }
    });
}

#[test]
fn where_no_dock_is_the_joint_stays() {
    run::<true>(|client| {
        client.within(10);
        client.turn(100);
        client.ask(Request::Approach(Dock::Back));
        let told: Vec<Report> = (0..30).flat_map(|_| client.reports(1_000)).collect();
        assert_eq!(told[0], Report::Lost(Dock::Back));
        assert!(told[1..].iter().all(|told| matches!(told, Report::Joint(..))), "{told:?}");
        let world = client.world();
        assert!(!world.emitters && world.driven == [None; 3]);
        assert!((world.joint.degrees() - 10.0).abs() < 1.0, "{}", world.joint.degrees());
    });
}

#[test]
fn an_order_to_the_latch_ends_the_search_of_its_dock() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.world().before = Some((Dock::Back, 3.0, 8.0));
        client.ask(Request::Approach(Dock::Back));
        assert_eq!(client.reports(50), []);
        client.ask(Request::Latch(Dock::Back, End::Latched));
        assert!(!client.world().emitters);
        let told = client.reports(3_000);
        assert!(told.contains(&Report::Latch(Dock::Back, LatchState::At(End::Latched))), "{told:?}");
        assert!(!told.contains(&Report::Lost(Dock::Back)), "{told:?}");
        assert!(!client.world().emitters);
        // Another request is served after that.
        client.ask(Request::Latch(Dock::Up, End::Latched));
        let told = client.reports(3_000);
        assert!(told.contains(&Report::Latch(Dock::Up, LatchState::At(End::Latched))), "{told:?}");
    });
}

#[test]
fn a_joint_that_fails_in_a_search_ends_it() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.world().before = Some((Dock::Back, 3.0, 8.0));
        client.world().joint.surroundings.is_blocked = true;
        client.ask(Request::Approach(Dock::Back));
        let told: Vec<Report> = (0..10).flat_map(|_| client.reports(1_000)).collect();
        assert_eq!(told[0], Report::Lost(Dock::Back), "{told:?}");
        assert!(!client.world().emitters);
    });
}

#[test]
fn switches_close_open_trip_and_are_told_of() {
    run::<true>(|client| {
        client.within(10);
        client.ask(Request::Power { dock: Dock::Up, is_on: true });
        client.ask(Request::Power { dock: Dock::Down, is_on: true });
        assert_eq!(client.reports(10), []);
        assert_eq!(client.world().powered, [false, true, true]);
        client.ask(Request::Power { dock: Dock::Down, is_on: false });
        client.within(10);
        assert_eq!(client.world().powered, [false, true, false]);
        // The board has opened three switches, of which one was closed.
        client.world().tripped = 0b111;
        assert_eq!(client.reports(60), [Report::Switch(Dock::Up, Switch::Tripped)]);
        assert_eq!(client.world().powered, [false; 3]);
        client.ask_for(TaskCode::AC_RECEIVE, Request::Power { dock: Dock::Up, is_on: true });
        client.within(10);
        client.world().tripped = 0b101;
        assert_eq!(client.within(60), []);
        assert_eq!(client.world().powered, [false, true, false]);
        client.world().tripped = 0b010;
        let tripped = Told::Report(Report::Switch(Dock::Up, Switch::Tripped));
        assert_eq!(client.within(60), [(TaskCode::AC_RECEIVE, tripped)], "which asked for the switch last");
    });
}

/// The message to the other MCU at this level.
fn allow(level: Level, is_charging: bool) -> (TaskCode, Told) {
    (TaskCode::POWER_BEYOND, Told::Request(Request::Allow(Allowance { level, is_charging })))
}

#[test]
fn an_emptying_battery_sheds_one_load_after_the_other_and_takes_them_up_again() {
    run::<true>(|client| {
        client.within(10);
        assert_eq!(client.within(300), [allow(Level::Good, false)], "the other MCU may know another");
        client.turn(0);
        client.ask_for(TaskCode::AC_RECEIVE, Request::Power { dock: Dock::Up, is_on: true });
        assert_eq!(client.within(600), [], "a good battery is no news");

        let told = client.drain(6_900);
        let battery = |level| (HORMONE, Told::Report(Report::Battery(level)));
        let switch = |switch| (TaskCode::AC_RECEIVE, Told::Report(Report::Switch(Dock::Up, switch)));
        assert_eq!(told[..3], [allow(Level::Low, false), battery(Level::Low), switch(Switch::Shed)]);
        assert!(told[3..].iter().all(|told| *told == allow(Level::Low, false)), "{told:?}");
        assert!(!told[3..].is_empty(), "the other MCU may have been reset: it is told again");
        assert_eq!(client.world().powered, [false; 3]);
        // A switch that is closed now waits for power.
        client.ask(Request::Power { dock: Dock::Down, is_on: true });
        assert_eq!(client.reports(10), [Report::Switch(Dock::Down, Switch::Shed)]);
        assert_eq!(client.world().powered, [false; 3]);

        // A moving latch stops where it is.
        client.world().latches[1].blocked_at = None;
        client.world().battery_mv = 6_600;
        client.within(900);
        client.ask(Request::Latch(Dock::Up, End::Latched));
        let told = client.within(600);
        assert!(told.contains(&battery(Level::VeryLow)), "{told:?}");
        let stopped = (HORMONE, Told::Report(Report::Latch(Dock::Up, LatchState::Between)));
        assert!(told.contains(&stopped), "{told:?}");
        assert_eq!(client.world().driven, [None; 3]);
        for request in [Request::Latch(Dock::Down, End::Latched), Request::Approach(Dock::Back)] {
            client.ask(request);
            assert_eq!(client.reports(10), [Report::Refused(request.task())]);
        }

        client.turn(300);
        let told = client.drain(6_300);
        let off = (HORMONE, Told::Report(Report::Joint(Axis::Back, State::Off)));
        assert!(told.contains(&off), "{told:?}");
        assert_eq!(client.world().drive, 0);
        let axis = Axis::Back;
        for turn in [Request::Turn { axis, angle: 0, speed: 90 }, Request::TurnBy { axis, by: 90, speed: 90 }]
        {
            client.ask(turn);
            assert_eq!(client.reports(10), [Report::Refused(TaskCode::joint(axis))]);
        }

        let told: Vec<_> = (0..5).flat_map(|_| client.drain(7_400)).collect();
        for level in [Level::VeryLow, Level::Low, Level::Good] {
            assert!(told.contains(&battery(level)), "{level:?}: {told:?}");
        }
        assert!(told.contains(&switch(Switch::Closed)), "{told:?}");
        assert_eq!(
            told.iter().filter(|told| **told == off).count(),
            1,
            "as what was asked meanwhile was refused"
        );
        assert_eq!(client.world().powered, [false, true, true]);
        client.turn(0);
    });
}

#[test]
fn what_a_lower_level_still_allows_goes_on() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        let low = Report::Battery(Level::Low);
        client.world().battery_mv = 6_900;
        client.within(900);
        client.ask(Request::Latch(Dock::Up, End::Latched));
        let told = client.reports(2_500);
        assert_eq!(told, [low, Report::Latch(Dock::Up, LatchState::At(End::Latched))]);

        let told: Vec<_> = (0..5).flat_map(|_| client.drain(7_400)).collect();
        assert!(told.contains(&(HORMONE, Told::Report(Report::Battery(Level::Good)))), "{told:?}");
        client.world().before = Some((Dock::Back, 3.0, 8.0));
        client.world().battery_mv = 6_900;
        client.within(800);
        client.ask(Request::Approach(Dock::Back));
        let told: Vec<Report> = (0..10).flat_map(|_| client.reports(1_000)).collect();
        let found = Report::Latch(Dock::Back, LatchState::At(End::Latched));
        assert_eq!(told.iter().find(|report| [low, found].contains(report)), Some(&low), "{told:?}");
        assert!(told.contains(&found), "{told:?}");
    });
}

#[test]
fn a_search_ends_when_the_battery_gets_low() {
    run::<true>(|client| {
        client.within(10);
        client.turn(0);
        client.drain(6_900);
        client.world().battery_mv = 6_600;
        client.within(600);
        // The dock is too far away, so the search takes some time.
        client.world().before = Some((Dock::Back, 14.0, 8.0));
        client.ask(Request::Approach(Dock::Back));
        client.within(50);
        assert!(client.world().emitters);
        assert!(client.within(400).contains(&(HORMONE, Told::Report(Report::Lost(Dock::Back)))));
        assert!(!client.world().emitters);
        // The joint is free again, and reports.
        client.ask(Request::Turn { axis: Axis::Back, angle: 100, speed: 90 });
        assert!(client.reports(3_000).contains(&Report::Joint(Axis::Back, State::Arrived)));
    });
}

#[test]
fn the_charger_counts_what_comes_in_at_the_docks_of_both_mcus() {
    run::<true>(|client| {
        client.within(10);
        client.ask(Request::Charge { is_on: true });
        let asked =
            |dock: Dock| (TaskCode::dock(dock), Told::Request(Request::Read(Sensor::DockCurrent(dock))));
        let mut told = client.within(10);
        told.sort_by_key(|(to, _)| to.code());
        let mut expected = MASTER.docks().map(asked).to_vec();
        expected.push(allow(Level::Good, true));
        expected.sort_by_key(|(to, _)| to.code());
        assert_eq!(told, expected);
        assert!(client.world().charger);

        // 80 mA in all are enough to count as charging: what comes in at a dock of the other MCU, and 10 at
        // each here.
        let others = |client: &mut Client, current: i16| {
            let mut told = Vec::new();
            for _ in 0..12 {
                let current = Report::Value(Sensor::DockCurrent(Dock::Front), current).to_payload();
                let power = Address::here(TaskCode::POWER);
                let message = Message::new(power, Address::here(TaskCode::dock(Dock::Front)), &current);
                let sent = client.office.deliver(client.task, message.expect("short"), Source::Bridge);
                assert_eq!(sent, Ok(()));
                told.extend(client.reports(250));
            }
            told
        };
        client.world().dock_ma = -10;
        assert_eq!(others(client, -50), []);
        // A current out of the docks is no charge.
        for (here, there) in [(-10, -49), (500, -79)] {
            client.world().dock_ma = here;
            assert_eq!(others(client, there), [Report::Charger(charger::State::Failed)], "{here}, {there}");
            assert!(!client.world().charger);
            client.ask(Request::Charge { is_on: true });
            client.within(10);
        }
        client.world().dock_ma = -200;
        assert_eq!(client.reports(3_000), []);
        client.world().battery_temperature = 500;
        assert_eq!(client.reports(600), [Report::Charger(charger::State::Paused)]);
        assert!(!client.world().charger);
        client.world().battery_temperature = 250;
        assert_eq!(client.reports(600), [Report::Charger(charger::State::Charging)]);
        assert!(client.world().charger);
        client.ask(Request::Charge { is_on: false });
        assert_eq!(client.within(10), [allow(Level::Good, false)]);
        assert!(!client.world().charger);

        client.world().battery_temperature = 500;
        client.ask_for(TaskCode::AC_RECEIVE, Request::Charge { is_on: true });
        let paused = (TaskCode::AC_RECEIVE, Told::Report(Report::Charger(charger::State::Paused)));
        let told = client.within(600);
        assert!(told.contains(&paused), "which asked for the charger last: {told:?}");
    });
}

#[test]
fn the_mcu_without_a_battery_does_what_the_other_allows() {
    let world = run::<false>(|client| {
        assert_eq!(client.reports(10), [Report::Joint(Axis::Front, State::Off)]);
        client.ask(Request::Power { dock: Dock::Left, is_on: true });
        client.ask(Request::Read(Sensor::AccelerationZ));
        assert_eq!(client.reports(20), [Report::Value(Sensor::AccelerationZ, 1016)]);
        assert_eq!(client.world().powered, [false, true, false]);
        client.ask(Request::Latch(Dock::Right, End::Latched));
        client.within(100);
        client.ask(Request::Allow(Allowance { level: Level::VeryLow, is_charging: false }));
        let told = client.reports(20);
        assert!(told.contains(&Report::Switch(Dock::Left, Switch::Shed)), "{told:?}");
        assert!(told.contains(&Report::Latch(Dock::Right, LatchState::Between)), "{told:?}");
        // Switches may be closed even with an empty battery, if it is charged.
        client.ask(Request::Allow(Allowance { level: Level::Empty, is_charging: true }));
        assert!(client.reports(20).contains(&Report::Switch(Dock::Left, Switch::Closed)));
        client.ask(Request::Turn { axis: Axis::Front, angle: 100, speed: 90 });
        assert_eq!(client.reports(20), [Report::Refused(TaskCode::joint(Axis::Front))]);
        client.ask(Request::Allow(Allowance::ALL));
        assert_eq!(
            client.reports(20),
            [Report::Joint(Axis::Front, State::Off)],
            "so it is told to turn again"
        );
        client.ask(Request::Turn { axis: Axis::Front, angle: 100, speed: 90 });
        assert_eq!(client.reports(3_000), [Report::Joint(Axis::Front, State::Arrived)]);
    });
    assert!(at(&world).alive >= TICKS / 50);
}

#[test]
fn a_slave_that_starts_over_on_an_empty_battery_sheds_at_its_first_look() {
    run::<true>(|client| {
        client.world().battery_mv = 6_200;
        let told = client.within(300);
        assert_eq!(
            told[told.len() - 2..],
            [allow(Level::Empty, false), (HORMONE, Told::Report(Report::Battery(Level::Empty)))]
        );
        client.ask(Request::Turn { axis: Axis::Back, angle: 600, speed: 10 });
        for _ in 0..3_000 {
            client.within(1);
            assert_eq!(client.world().drive, 0);
        }
    });
}

#[test]
fn one_that_is_to_charge_before_its_first_look_sheds_at_that() {
    run::<true>(|client| {
        client.world().battery_mv = 6_200;
        client.ask(Request::Charge { is_on: true });
        let told = client.within(300);
        assert!(told.contains(&allow(Level::Empty, true)), "{told:?}");
        assert!(told.contains(&(HORMONE, Told::Report(Report::Battery(Level::Empty)))), "{told:?}");
        client.ask(Request::Turn { axis: Axis::Back, angle: 600, speed: 10 });
        assert_eq!(client.reports(20), [Report::Refused(TaskCode::joint(Axis::Back))]);
    });
}

/// It never was on at a look: what it allowed in between has to be shed again.
#[test]
fn a_charger_that_pauses_at_its_first_look_keeps_no_switch_closed() {
    run::<true>(|client| {
        client.ask(Request::Power { dock: Dock::Up, is_on: true });
        client.world().battery_mv = 6_900;
        client.world().battery_temperature = 500;
        client.within(1_500);
        assert_eq!(client.world().powered, [false; 3]);
        client.ask(Request::Charge { is_on: true });
        let told = client.reports(600);
        let switch = |switch| Report::Switch(Dock::Up, switch);
        assert_eq!(
            told,
            [switch(Switch::Closed), Report::Charger(charger::State::Paused), switch(Switch::Shed)]
        );
        assert_eq!(client.world().powered, [false; 3]);
    });
}

#[test]
fn that_all_is_allowed_is_told_again_now_and_then() {
    run::<true>(|client| {
        let off = Told::Report(Report::Joint(Axis::Back, State::Off));
        let reminder = allow(Level::Good, false);
        assert_eq!(client.within(300), [(HORMONE, off), reminder]);
        for _ in 0..4 {
            assert_eq!(client.within(15_900), []);
            assert_eq!(client.within(100), [reminder], "every 16 s");
        }
        // What is under way goes on when the clock begins anew.
        client.ask(Request::Latch(Dock::Up, End::Latched));
        assert_eq!(client.reports(2_500), [Report::Latch(Dock::Up, LatchState::At(End::Latched))]);
        assert!(client.drain(6_900).contains(&allow(Level::Low, false)));
    });
}

/// Starts a search of the dock `Back`, up to where it turns the opposite joint.
fn shifting(client: &mut Client) {
    client.within(10);
    client.turn(0);
    client.world().before = Some((Dock::Back, 14.0, 8.0));
    client.ask(Request::Approach(Dock::Back));
    let turns = |(_, told): &(TaskCode, Told)| matches!(told, Told::Request(Request::TurnBy { .. }));
    while !client.within(1).iter().any(turns) {}
}

/// Whether the opposite joint was told to stay where it is.
fn stays(told: &[(TaskCode, Told)]) -> bool {
    told.iter().any(|(_, told)| matches!(told, Told::Request(Request::TurnBy { by: 0, .. })))
}

#[test]
fn when_the_other_dock_latches_the_opposite_joint_stays_where_it_is() {
    run::<true>(|client| {
        shifting(client);
        client.world().latches[0] = Latch::at(1.0);
        assert!(stays(&client.within(100)));
        assert!(!client.world().emitters);
    });
}

#[test]
fn a_search_that_is_to_end_stops_both_joints() {
    run::<true>(|client| {
        shifting(client);
        client.ask(Request::Leave(Dock::Back));
        let told = client.within(100);
        assert!(stays(&told), "{told:?}");
        let degrees = client.world().joint.degrees();
        assert_eq!(client.within(1_000), [], "it has arrived, and there is no search any more");
        client.ask(Request::Leave(Dock::Back));
        assert_eq!(client.within(1_000), []);
        let world = client.world();
        assert!(!world.emitters && (world.joint.degrees() - degrees).abs() < 1.0);
    });
}

#[test]
fn a_search_that_the_battery_ends_is_told_of_and_stops_both_joints() {
    run::<true>(|client| {
        shifting(client);
        client.world().battery_mv = 6_600;
        let told = client.within(3_000);
        assert!(stays(&told), "{told:?}");
        assert!(told.contains(&(HORMONE, Told::Report(Report::Lost(Dock::Back)))), "{told:?}");
        assert!(!client.world().emitters);
    });
}

/// The bytes of an EEPROM.
struct Bytes([u8; 256]);

impl Cells for Bytes {
    fn is_ready(&mut self) -> bool {
        true
    }

    fn recall(&mut self, address: u16) -> u8 {
        self.0[usize::from(address)]
    }

    fn store(&mut self, address: u16, byte: u8) {
        self.0[usize::from(address)] = byte;
    }
}

/// Keeps a record before the devices' task reads the memory.
fn keep(client: &mut Client, record: Record) {
    let mut bytes = Bytes(client.world().eeprom);
    let mut memory = Memory::new();
    memory.recall(&mut bytes);
    memory.keep(record);
    while memory.step(&mut bytes) {}
    client.world().eeprom = bytes.0;
}

/// Without it the module would walk by the gait of its image.
#[test]
fn a_kept_record_that_finds_no_room_is_told_once_there_is() {
    run::<false>(|client| {
        keep(client, [1; 4]);
        client.fill();
        client.task.delay(100);
        let told = client.reports(100);
        let kept = told.iter().filter(|report| **report == Report::Kept([1; 4]));
        assert_eq!(kept.count(), 1, "{told:?}");
        client.ask(Request::Keep([2; 4]));
        client.within(500);
        assert_eq!(Memory::new().recall(&mut Bytes(client.world().eeprom)), Some([2; 4]));
    });
}

#[test]
fn what_is_to_be_kept_before_the_memory_was_read_is_kept() {
    let world = run::<false>(|client| {
        keep(client, [1; 4]);
        client.ask(Request::Keep([2; 4]));
        assert!(client.reports(500).contains(&Report::Kept([1; 4])));
    });
    assert_eq!(Memory::new().recall(&mut Bytes(at(&world).eeprom)), Some([2; 4]));
}
