//! Docks, sensors and power of a module on their plants: a behaviour on the master sends requests, and
//! devices of both MCUs report.

use plants::dock::reflected;
use plants::joint::Joint;
use simavr_harness::{Controller, Engine, Images, RobotBuilder, State};
use simulation::Change;
use superbot_tests_simavr::{MILLISECOND, firmware, image};
use tasks::dock::Dock;
use tasks::docking::latch::{self, End};
use tasks::message::TaskCode;
use tasks::motor::Axis;
use tasks::motor::joint;
use tasks::power::battery::Level;
use tasks::power::charger;
use tasks::power::switch::Switch;
use tasks::request::Report;
use tasks::sensor::Sensor;

/// A module, and its devices' reports so far.
struct Rig {
    engine: Engine,
    marks: Vec<u8>,
    read: usize,
}

impl Rig {
    fn new() -> Self {
        let images = Images { master: image("devices"), slave: firmware().slave };
        let robot = RobotBuilder::new(images, 1).seed(1).build().expect("a module can be built");
        Rig { engine: Engine::new(robot, 1), marks: Vec::new(), read: 0 }
    }

    fn body(&mut self) -> &mut simavr_harness::Body {
        self.engine.robot_mut().module_mut(0).expect("there is one").body_mut()
    }

    fn run(&mut self, milliseconds: u64) {
        self.engine.run_until(self.engine.cycle() + milliseconds * MILLISECOND);
        let events = self.engine.take_events();
        let master = events.into_iter().filter(|event| event.controller == Controller::Master);
        self.marks.extend(master.map(|event| event.value));
    }

    /// The next report, with the milliseconds that it took. `each` is called before each millisecond.
    fn report(&mut self, mut each: impl FnMut(&mut simavr_harness::Body)) -> (Report, u64) {
        for milliseconds in 0..5_000 {
            let marked = self.marks[self.read..].first_chunk::<4>().copied();
            if let Some([kind, device, low, high]) = marked {
                self.read += 4;
                let report = Report::from_payload(&[kind, device, low, high, 0]);
                return (report.expect("it is a report"), milliseconds);
            }
            each(self.body());
            self.run(1);
        }
        panic!("no report after {:x?}", self.marks);
    }

    /// The value of the next report, which has to be about `sensor`.
    fn value(&mut self, sensor: Sensor) -> i16 {
        match self.report(|_| ()).0 {
            Report::Value(of, value) if of == sensor => value,
            other => panic!("{other:?} in place of {sensor:?}"),
        }
    }
}

#[test]
fn devices_do_and_tell() {
    let mut rig = Rig::new();
    for (axis, degrees) in Axis::ALL.into_iter().zip([10.0, -20.0, 30.0]) {
        *rig.body().joint_mut(axis) = Joint::at(degrees);
    }
    rig.body().celsius = [31.0, 32.0];
    rig.engine.robot_mut().change(&Change::Roll(30.0)).expect("any robot can be turned");
    rig.body().battery.celsius = 33.0;

    let near = |value: i16, expected: i16, error: i16| {
        assert!(value.abs_diff(expected) <= error.unsigned_abs(), "{value}, not {expected}");
    };
    // The order of the two MCUs does not matter.
    let mut off = Axis::ALL.map(|_| rig.report(|_| ()).0);
    off.sort_by_key(|report| format!("{report:?}"));
    let mut expected = Axis::ALL.map(|axis| Report::Joint(axis, joint::State::Off));
    expected.sort_by_key(|report| format!("{report:?}"));
    assert_eq!(off, expected);
    assert_eq!(rig.report(|_| ()).0, Report::Charger(charger::State::Failed));
    for (axis, expected) in Axis::ALL.into_iter().zip([100, -200, 300]) {
        near(rig.value(Sensor::Angle(axis)), expected, 3);
    }
    for axis in Axis::ALL {
        near(rig.value(Sensor::MotorCurrent(axis)), 0, 5);
    }
    for dock in Dock::ALL {
        near(rig.value(Sensor::DockCurrent(dock)), 0, 10);
    }
    let volts = rig.body().battery.volts();
    near(rig.value(Sensor::BatteryVoltage), (volts * 1000.0) as i16, 20);
    near(rig.value(Sensor::BatteryTemperature), 330, 6);
    // Up is 30 degrees to the Left, and the half with the Front is lifted by 10.
    for (sensor, expected) in
        [(Sensor::AccelerationX, 150), (Sensor::AccelerationY, 500), (Sensor::AccelerationZ, 853)]
    {
        near(rig.value(sensor), expected, 8);
    }
    near(rig.value(Sensor::MasterTemperature), 310, 6);
    near(rig.value(Sensor::SlaveTemperature), 320, 6);

    for dock in [Dock::Right, Dock::Back] {
        assert_eq!(rig.report(|_| ()).0, Report::Latch(dock, latch::State::At(End::Latched)));
        assert!(rig.body().latch(dock).is_latched());
    }
    for dock in [Dock::Left, Dock::Down] {
        rig.run(20);
        rig.body().dock_amperes[usize::from(dock.index())] = 3.0;
        // The board opens the switch within 3.2 ms. The report may have to cross the I2C bus.
        let (report, milliseconds) = rig.report(|_| ());
        assert_eq!(report, Report::Switch(dock, Switch::Tripped));
        assert!(milliseconds <= 6, "{milliseconds} ms");
        rig.body().dock_amperes[usize::from(dock.index())] = 0.0;
    }
    for axis in Axis::ALL {
        assert_eq!(rig.report(|_| ()).0, Report::Joint(axis, joint::State::Arrived));
        near((rig.body().joint(axis).degrees() * 10.0) as i16, 100, 6);
    }

    // At first there is no dock before Front; then there is one, which the joint faces at 18 degrees.
    assert_eq!(rig.report(|_| ()).0, Report::Lost(Dock::Front));
    let (report, _) = rig.report(|body| {
        let askew = body.joint(Axis::Front).degrees() - 18.0;
        body.proximity[usize::from(Dock::Front.index())] = reflected(3.0, askew);
    });
    assert_eq!(report, Report::Latch(Dock::Front, latch::State::At(End::Latched)));
    near((rig.body().joint(Axis::Front).degrees() * 10.0) as i16, 180, 30);

    for (charge, level) in [(0.3, Level::Low), (0.2, Level::VeryLow)] {
        rig.body().battery = plants::battery::Battery::with(charge);
        let (report, milliseconds) = rig.report(|_| ());
        assert_eq!(report, Report::Battery(level));
        assert!(milliseconds <= 1_600, "{milliseconds} ms");
    }
    let left = TaskCode::dock(Dock::Left);
    assert_eq!(rig.report(|_| ()).0, Report::Refused(left), "with this little power no latch is moved");

    // An empty module is charged, here through a dock of the MCU without the battery. Until then the switch
    // waits for power.
    for expected in [Switch::Shed, Switch::Closed] {
        assert_eq!(rig.report(|_| ()).0, Report::Switch(Dock::Left, expected));
    }
    rig.body().dock_amperes[usize::from(Dock::Left.index())] = -0.5;
    let before = rig.body().battery.charge();
    rig.run(5_000);
    let charged = (rig.body().battery.charge() - before) * 1.6 * 3600.0;
    near((charged * 1000.0) as i16, 5 * (500 - 100), 100); // in mA s; 100 mA are for the electronics
    rig.body().dock_amperes[usize::from(Dock::Left.index())] = 0.0;
    let (report, milliseconds) = rig.report(|_| ());
    assert_eq!(report, Report::Switch(Dock::Left, Switch::Shed));
    assert!((1_700..2_300).contains(&milliseconds), "{milliseconds} ms");
    assert_eq!(rig.report(|_| ()).0, Report::Charger(charger::State::Failed));
    rig.run(1);
    let master = rig.engine.robot().module(0).expect("there is one").mcu(Controller::Master);
    assert_eq!(master.state(), State::Done);
}
