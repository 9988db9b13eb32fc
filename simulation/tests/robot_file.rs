//! Robot files: what they say, and that their errors point at the line.

use simulation::{
    Block, Change, Event, Face, JointFault, JointOf, Links, Load, MILLISECOND, Mcus, OtherImages, Scenario,
    Shape, Stair, Terrain, Wall, Wiring,
};
use tasks::dock::Dock::{self, Back, Down, Front, Left, Right, Up};
use tasks::motor::Axis;

const SECOND: u64 = 1000 * MILLISECOND;

fn face(module: usize, dock: Dock) -> Face {
    Face { module, dock }
}

#[test]
fn a_file_says_how_docks_are_joined_and_what_happens() {
    let scenario = Scenario::from_toml(
        r#"
        modules = 4
        docks = [["0.Back", "1.Front"], ["1.left", "2.back"]]

        [[event]]
        at = 9
        kill = 0

        [[event]]
        at = 1.5
        attach = ["3.Back", "1.Right"]

        [[event]]
        at = 2
        detach = "1.Left"

        [[event]]
        at = 3
        swap = [0, 1]

        [[event]]
        at = 4
        reset = 2
        mcu = "slave"

        [[event]]
        at = 5
        loss = 0.75

        [[event]]
        at = 6
        noise = 0.01
        from = "3.Back"

        [[event]]
        at = 7
        obstacle = "2.Up"

        [[event]]
        at = 7.5
        clear = "2.Up"

        [[event]]
        at = 8
        command = [1, 0]
        to = "0.Left"

        [[event]]
        at = 7.75
        shared_light = true

        [[event]]
        at = 8.5
        roll = -180

        [[event]]
        at = 8.75
        console = "1.Down"

        [[event]]
        at = 8.29
        push = 1
        newtons = [0, -12.5, 3]

        [[event]]
        at = 8.3
        slip = 2
        degrees = [1.5, 0, -2]

        [[event]]
        at = 8.31
        joint = "2.Motor1"
        fault = "stuck"
        "#,
    )
    .unwrap();
    let mut wiring = Wiring::new(4);
    wiring.attach(face(0, Back), face(1, Front)).unwrap();
    wiring.attach(face(1, Left), face(2, Back)).unwrap();
    assert_eq!(scenario.wiring, wiring);
    let expected = [
        (1.5, Change::Attach(face(3, Back), face(1, Right))),
        (2.0, Change::Detach(face(1, Left))),
        (3.0, Change::Swap(0, 1)),
        (4.0, Change::Reset { module: 2, mcus: Mcus::Slave }),
        (5.0, Change::Loss { links: Links::All, probability: 0.75 }),
        (6.0, Change::Noise { links: Links::From(face(3, Back)), probability: 0.01 }),
        (7.0, Change::Obstacle { at: face(2, Up), is_there: true }),
        (7.5, Change::Obstacle { at: face(2, Up), is_there: false }),
        (7.75, Change::SharedLight(true)),
        (8.0, Change::Command { at: face(0, Left), payload: vec![1, 0] }),
        (8.29, Change::Push { module: 1, newtons: [0.0, -12.5, 3.0] }),
        (8.3, Change::Slip { module: 2, degrees: [1.5, 0.0, -2.0] }),
        (8.31, Change::Fault { joint: JointOf { module: 2, axis: Axis::Roll }, fault: JointFault::Stuck }),
        (8.5, Change::Roll(-180.0)),
        (8.75, Change::Console(face(1, Down))),
        (9.0, Change::Kill(0)),
    ];
    let cycle = |at: f64| (at * 100.0).round() as u64 * SECOND / 100;
    let expected = expected.map(|(at, change)| Event { at: cycle(at), change });
    assert_eq!(scenario.timeline, expected);

    // Written and read again, events are the same to the cycle.
    let docks = "modules = 4\ndocks = [[\"0.Back\", \"1.Front\"], [\"1.Left\", \"2.Back\"]]\n";
    let odd = scenario.timeline.into_iter().map(|event| Event { at: event.at + 12_345, ..event });
    let odd: Vec<Event> = odd.collect();
    let written = odd.iter().fold(docks.to_owned(), |text, event| text + &event.to_toml());
    assert_eq!(Scenario::from_toml(&written).unwrap().timeline, odd, "{written}");
}

#[test]
fn a_file_says_what_the_robot_moves_on() {
    let scenario = Scenario::from_toml(
        r#"
        modules = 4
        [world]
        friction = 0.3
        slope_degrees = -10
        module_kg = 1.3
        steps = { from_m = 0.5, height_mm = 20, length_mm = 400, number = 3 }
        boxes = [{ at_m = [1, -0.5], size_mm = [100, 200, 30], turned_degrees = 45 }]
        walls = [{ from_m = [0, 1], to_m = [2, 1], height_mm = 300 }]
        loads = [{ module = 3, kg = 0.5 }]
        "#,
    )
    .unwrap();
    let expected = Terrain {
        friction: Some(0.3),
        slope_degrees: -10.0,
        module_kg: Some(1.3),
        steps: Some(Stair { from_m: 0.5, height_mm: 20.0, length_mm: 400.0, number: 3 }),
        boxes: vec![Block { at_m: [1.0, -0.5], size_mm: [100.0, 200.0, 30.0], turned_degrees: 45.0 }],
        walls: vec![Wall { from_m: [0.0, 1.0], to_m: [2.0, 1.0], height_mm: 300.0 }],
        loads: vec![Load { module: 3, kg: 0.5 }],
    };
    assert_eq!(scenario.terrain, Some(expected));
    assert_eq!(Scenario::from_toml("modules = 4").unwrap().terrain, None);
    assert_eq!(Scenario::from_toml("modules = 4\n[world]").unwrap().terrain, Some(Terrain::default()));
}

#[test]
fn what_a_world_cannot_be_is_refused() {
    for (line, advice) in [
        ("friction = -0.1", "from 0 to 2"),
        ("friction = nan", "from 0 to 2"),
        ("friction = 2.1", "from 0 to 2"),
        ("slope_degrees = 46", "from -45 to 45 degrees"),
        ("slope_degrees = -46", "from -45 to 45 degrees"),
        ("module_kg = 0", "from 0.1 to 10 kg"),
        ("steps = { from_m = 1, height_mm = 0, length_mm = 100, number = 1 }", "from 1 to 100000 mm"),
        ("steps = { from_m = 1, height_mm = 20, length_mm = 100, number = 0 }", "from 1 to 1000"),
        ("steps = { from_m = 1, height_mm = 20, length_mm = 100, number = 1001 }", "from 1 to 1000"),
        ("steps = { from_m = 2000, height_mm = 20, length_mm = 100, number = 1 }", "from -1000 to 1000 m"),
        ("steps = { from_m = 1, height_mm = 20, length_mm = 100 }", "missing field `number`"),
        ("boxes = [{ at_m = [0, 0], size_mm = [100, 0.5, 30] }]", "from 1 to 100000 mm"),
        ("boxes = [{ at_m = [0, 0], size_mm = [1, 1, 1], turned_degrees = 181 }]", "from -180 to 180"),
        ("boxes = [{ at_m = [0, 0], size_mm = [1, 1, 1], turned_degrees = -181 }]", "from -180 to 180"),
        ("walls = [{ from_m = [0, inf], to_m = [1, 0], height_mm = 30 }]", "from -1000 to 1000 m"),
        ("boxes = [{ at_m = [0, 0, 0], size_mm = [1, 1, 1] }]", "this list has length 3: give 2 values"),
        ("boxes = [{ at_m = [0, 0], size_mm = [1, 1, 1, 1] }]", "this list has length 4: give 3 values"),
        (
            "walls = [{ from_m = [0, 1], to_m = [1, 0, 2], height_mm = 30 }]",
            "this list has length 3: give 2 values",
        ),
        ("loads = [{ module = 0, kg = -1 }]", "from 0 to 1000 kg"),
        ("gravity = 1.62", "expected one of `friction`, `slope_degrees`"),
    ] {
        let error = error(&format!("modules = 2\n[world]\n{line}\n"), 3, line);
        assert!(error.contains(advice), "{advice:?} is not in: {error}");
    }
    let text = "modules = 2\n[world]\nloads = [{ module = 2, kg = 1 }]\n";
    assert!(error(text, 2, "[world]").contains("there is no module 2 to load"));
}

#[test]
fn each_shape_has_a_name() {
    for shape in Shape::ALL {
        let (name, modules) = (shape.name(), shape.usual_modules());
        let scenario = Scenario::from_toml(&format!("shape = \"{name}\"\nmodules = {modules}")).unwrap();
        assert_eq!(scenario.wiring, shape.wiring(modules).unwrap(), "{name}");
    }
}

#[test]
fn a_shape_may_be_added_to() {
    let text = "shape = \"six-legs\"\nmodules = 12\ndocks = [[\"0.Up\", \"11.Up\"]]\n";
    let scenario = Scenario::from_toml(text).unwrap();
    let mut wiring = Shape::SixLegs.wiring(12).unwrap();
    wiring.attach(face(0, Up), face(11, Up)).unwrap();
    assert_eq!(scenario.wiring, wiring);
}

/// The error of a file, which has to begin with its line and show what stands there.
fn error(text: &str, line: usize, shown: &str) -> String {
    let error = Scenario::from_toml(text).expect_err("there is an error").to_string();
    let found = error.contains(&format!("line {line}")) && error.contains(shown) && error.contains('^');
    assert!(found, "not line {line} with {shown:?}: {error}");
    error
}

#[test]
fn a_file_says_which_modules_have_other_images() {
    let scenario = Scenario::from_toml(
        r#"
        modules = 5
        [[image]]
        modules = [3, 4]
        master = "other/master.elf"
        [[image]]
        modules = [0]
        master = "/images/master.elf"
        slave = "slave.elf"
        "#,
    )
    .unwrap();
    let other = |modules: &[usize], master: &str, slave: Option<&str>| OtherImages {
        modules: modules.into(),
        master: Some(master.into()),
        slave: slave.map(Into::into),
    };
    let expected =
        [other(&[3, 4], "other/master.elf", None), other(&[0], "/images/master.elf", Some("slave.elf"))];
    assert_eq!(scenario.images, expected);
    assert_eq!(Scenario::from_toml("modules = 5").unwrap().images, []);
}

#[test]
fn errors_point_at_the_line_and_say_what_to_do() {
    let chain = "shape = \"chain\"\nmodules = 5\n";
    let event = |fields: &str| format!("{chain}\n[[event]]\n{fields}\n");
    let image = |fields: &str| format!("{chain}\n[[image]]\n{fields}\n");
    for (text, line, shown, advice) in [
        ("modules = 0", 1, "modules = 0", "give a number of modules from 1"),
        ("modules = 1000001", 1, "modules = 1000001", "give a number of modules from 1 to 1000000"),
        ("shape = \"six-legs\"\nmodules = 10", 2, "modules = 10", "at least 11 modules"),
        ("shape = \"square\"\nmodules = 5", 1, "\"square\"", "expected one of `centipede`"),
        ("modles = 5", 1, "modles", "expected one of `modules`"),
        (
            "modules = 2\ndocks = [\n  [\"0.Back\", \"2.Front\"],\n]",
            3,
            "2.Front",
            "the robot has 2, counted from 0",
        ),
        (
            "modules = 2\ndocks = [[\"0.Top\", \"1.Front\"]]",
            2,
            "0.Top",
            "Front, Back, Left, Right, Up or Down",
        ),
        ("modules = 2\ndocks = [[\"0.Back\", \"0.Back\"]]", 2, "0.Back", "attached to itself"),
        ("modules = 2\ndocks = [[\"0.Back\", \"0.Front\"]]", 2, "0.Back", "attached to itself"),
        ("modules = 3\ndocks = [[\"0.Back\"]]", 2, "0.Back", "this list has length 1: give 2 values"),
        (
            "modules = 3\ndocks = [[\"0.Back\", \"1.Front\", \"2.Front\"]]",
            2,
            "0.Back",
            "this list has length 3: give 2 values",
        ),
        (&event("at = 1\nswap = [2, 3, 4]"), 6, "swap", "this list has length 3: give 2 values"),
        (&event("at = 1\nattach = [\"0.Back\", \"4.Back\"]"), 4, "[[event]]", "detach it or use another"),
        (&event("at = 1\ndetach = \"0.Front\""), 4, "[[event]]", "attach something first"),
        (&event("at = 1\nswap = [0, 5]"), 4, "[[event]]", "there is no module 5"),
        (&event("at = 1\nswap = [2, 2]"), 4, "[[event]]", "can't change places with itself"),
        (&event("at = -1\nkill = 0"), 4, "[[event]]", "from 0 to 86400"),
        (&event("at = 86400.5\nkill = 0"), 4, "[[event]]", "from 0 to 86400"),
        (&event("kill = 0"), 4, "[[event]]", "missing field `at`"),
        (&event("at = 1\nloss = 2"), 4, "[[event]]", "give a probability from 0 to 1"),
        (&event("at = 1\nloss = 1\nfrom = \"0.Front\""), 4, "[[event]]", "attach something first"),
        (&event("at = 1\nnoise = 1.1"), 4, "[[event]]", "give a probability from 0 to 1"),
        (&event("at = 1\nroll = 181"), 4, "[[event]]", "give `roll` in degrees from -180 to 180"),
        (&event("at = 1\nroll = -181"), 4, "[[event]]", "give `roll` in degrees from -180 to 180"),
        (&event("at = 1\nroll = nan"), 4, "[[event]]", "give `roll` in degrees from -180 to 180"),
        (&event("at = 1\npush = 1"), 4, "[[event]]", "give both `push`"),
        (&event("at = 1\npush = 5\nnewtons = [0, 1, 2]"), 4, "[[event]]", "there is no module 5"),
        (&event("at = 1\npush = 1\nnewtons = [0, nan, 2]"), 4, "[[event]]", "from -100 to 100"),
        (&event("at = 1\npush = 1\nnewtons = [0, 101, 2]"), 4, "[[event]]", "from -100 to 100"),
        (&event("at = 1\npush = 1\nnewtons = [0, -101, 2]"), 4, "[[event]]", "from -100 to 100"),
        (&event("at = 1"), 4, "[[event]]", "give one of attach, detach"),
        (&event("at = 1\nkill = 0\nloss = 0.5"), 4, "[[event]]", "give one of attach, detach"),
        (&event("at = 1\nkill = 0\nmcu = \"slave\""), 4, "[[event]]", "`mcu` belongs to `reset`"),
        (
            &event("at = 1\nkill = 0\nfrom = \"0.Back\""),
            4,
            "[[event]]",
            "`from` belongs to `loss` or `noise`",
        ),
        (&event("at = 1\ncommand = [1]"), 4, "[[event]]", "give both `command`"),
        (
            &event(&format!("at = 1\ncommand = {:?}\nto = \"0.Up\"", [1; 17])),
            4,
            "[[event]]",
            "give a command of at most 16 bytes",
        ),
        (
            &event("at = 1\ncommand = [0xd1, 1, 3]\nto = \"0.Up\""),
            4,
            "[[event]]",
            "5 to 80 times 50 ms, or 255",
        ),
        (
            &event("at = 1\ncommand = [0xd1, 1]\nto = \"0.Up\""),
            4,
            "[[event]]",
            "give an order as 0xd0 + gait",
        ),
        (&event("at = 1\ncommand = [0xe3, 1, 9]\nto = \"0.Up\""), 4, "[[event]]", "give a course as 0xe0"),
        (&event("at = 1\ncommand = [256]\nto = \"0.Up\""), 6, "256", "give a whole number from 0 to 255"),
        (&event("at = \"1\"\nkill = 0"), 5, "\"1\"", "give a number"),
        (&event("at = 1\nkill = 0.5"), 6, "0.5", "give a whole number from 0"),
        (&event("at = 1\ndetach = 3"), 6, "3", "give a text in quotes"),
        ("modules = -3", 1, "-3", "give a whole number from 0"),
        ("modules = 3\nshape = 3", 2, "3", "give a text in quotes"),
        ("modules = 3\ndocks = [\"0.Back\", \"1.Front\"]", 2, "\"0.Back\"", "give a list, as in [1, 2]"),
        ("modules = 3\n[event]\nat = 1\nkill = 0", 2, "[event]", "give a list of tables, in [[ ]]"),
        ("modules = 3\nevent = [3]", 2, "3", "give a table, as docs/simulator.md has it"),
        ("modules = 3\nworld = 3", 2, "3", "give a table, as docs"),
        (&event("at = 1\ncommand = [1, 2]\nto = \"1.Front\""), 4, "[[event]]", "detach it or use another"),
        (
            &event("at = 1\npush = 1\nnewtons = [0, 1, 2, 3]"),
            7,
            "newtons",
            "this list has length 4: give 3 values",
        ),
        (&event("at = 1\nslip = 1\ndegrees = [0, 1]"), 7, "degrees", "this list has length 2: give 3 values"),
        (&event("at = 1\nslip = 1"), 4, "[[event]]", "give both `slip`"),
        (&event("at = 1\nslip = 5\ndegrees = [0, 1, 2]"), 4, "[[event]]", "there is no module 5"),
        (&event("at = 1\nslip = 1\ndegrees = [0, 16, 2]"), 4, "[[event]]", "from -15 to 15"),
        (&event("at = 1\nslip = 1\ndegrees = [0, -16, 2]"), 4, "[[event]]", "from -15 to 15"),
        (&event("at = 1\njoint = \"1.Motor1\""), 4, "[[event]]", "give both `joint`"),
        (&event("at = 1\njoint = \"5.Motor1\"\nfault = \"open\""), 4, "[[event]]", "there is no module 5"),
        (
            &event("at = 1\njoint = \"1.Motor3\"\nfault = \"open\""),
            6,
            "\"1.Motor3\"",
            "is not a joint: write",
        ),
        (
            &event("at = 1\njoint = \"1.Motor1\"\nfault = \"bent\""),
            7,
            "\"bent\"",
            "`stuck`, `jammed`, `none`",
        ),
        (&event("at = 1\nconsole = \"1.Front\""), 4, "[[event]]", "detach it or use another"),
        (&event("at = 1\nobstacle = \"1.Front\""), 4, "[[event]]", "detach it or use another"),
        (
            &event("at = 1\nobstacle = \"1.Up\"\n[[event]]\nat = 2\nattach = [\"0.Up\", \"1.Up\"]"),
            7,
            "[[event]]",
            "an obstacle is before the Up dock of module 1; clear it first or use another",
        ),
        (&event("at = 1\nconsole = \"0.Front\"\nkill = 1"), 4, "[[event]]", "joint, command and console"),
        (&event("at = 1\nreset = 0\nmcu = \"both\"\ncolour = 1"), 8, "colour", "unknown field `colour`"),
        (&image("modules = []\nmaster = \"a.elf\""), 4, "[[image]]", "give `modules`"),
        (&image("modules = [1]"), 4, "[[image]]", "give `master`, `slave` or both"),
        (&image("modules = [4, 5]\nslave = \"a.elf\""), 4, "[[image]]", "there is no module 5"),
        (&image("modules = [1, 1]\nslave = \"a.elf\""), 4, "[[image]]", "module 1 has other images already"),
        (
            &image("modules = [1]\nslave = \"a.elf\"\n[[image]]\nmodules = [2, 1]\nmaster = \"b.elf\""),
            7,
            "[[image]]",
            "module 1 has other images already",
        ),
        (&image("module = 1"), 5, "module", "unknown field `module`"),
    ] {
        let error = error(text, line, shown);
        assert!(error.contains(advice), "{advice:?} is not in: {error}");
    }
}

#[test]
fn nothing_happens_to_a_module_whose_power_has_failed() {
    for fields in [
        "attach = [\"1.Back\", \"2.Front\"]",
        "swap = [3, 1]",
        "reset = 1",
        "kill = 1",
        "obstacle = \"1.Up\"",
        "command = [1, 0]\nto = \"1.Up\"",
    ] {
        let text = format!(
            "modules = 4\nshape = \"chain\"\n[[event]]\nat = 1\nkill = 1\n[[event]]\nat = 2\n{fields}"
        );
        assert!(error(&text, 6, "[[event]]").contains("the power of module 1 has failed"), "{fields}");
    }
}

#[test]
fn events_are_tried_in_the_order_of_time() {
    let text = "modules = 2\n[[event]]\nat = 2\ndetach = \"0.Back\"\n[[event]]\nat = 1\nattach = [\"0.Back\", \"1.Front\"]";
    assert!(Scenario::from_toml(text).is_ok());
    let text = text.replace("at = 2", "at = 0.5");
    assert!(error(&text, 2, "[[event]]").contains("attach something first"));
}

#[test]
fn once_a_robot_docks_itself_only_what_can_never_be_is_refused() {
    let event = |at: u32, fields: &str| format!("[[event]]\nat = {at}\n{fields}\n");
    let chain = "modules = 6\nshape = \"chain\"\n";
    let close = event(4, "command = [0xd8, 1, 255]\nto = \"0.Front\"");
    for fields in [
        "detach = \"0.Front\"",
        "attach = [\"0.Back\", \"5.Back\"]",
        "command = [0xd9, 1, 255]\nto = \"1.Front\"",
    ] {
        let later = event(9, fields);
        assert!(Scenario::from_toml(&format!("{chain}{close}{later}")).is_ok(), "{fields}");
        let walks = close.replace("0xd8", "0xd2");
        for text in [format!("{chain}{walks}{later}"), format!("{chain}{close}{}", later.replace('9', "3"))] {
            assert!(Scenario::from_toml(&text).is_err(), "{text}");
        }
    }
    for (fields, advice) in [
        ("detach = \"6.Front\"", "there is no module 6"),
        ("attach = [\"0.Back\", \"6.Back\"]", "there is no module 6"),
        ("attach = [\"0.Back\", \"0.Back\"]", "attached to itself"),
        ("swap = [1, 1]", "can't change places with itself"),
    ] {
        let text = format!("{chain}{close}{}", event(9, fields));
        assert!(error(&text, 7, "[[event]]").contains(advice), "{fields}");
    }
}
