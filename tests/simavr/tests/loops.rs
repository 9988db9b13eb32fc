//! No loop of the firmware goes round more often, and no call is made more often, than the image's
//! `loops.txt` notes. So a note that belongs to another loop of its function, or counts one turn too few,
//! shows in a run.

use simavr_harness::{Controller, Engine, RobotBuilder};
use simulation::{Run, Scenario};
use superbot_tests_simavr::bounds::Noted;
use superbot_tests_simavr::times::Times;
use superbot_tests_simavr::{MILLISECOND, firmware};

use crate::time_bound::{FLOODED, flooded};

const SECOND: u64 = 1000 * MILLISECOND;

/// Robots with what happens to them, each with the time for which it runs, in s, and the modules in which
/// we count.
const ROBOTS: [(&str, u64, &[usize]); 2] = [
    (include_str!("../../../robots/ring.toml"), 26, &[0, 3]),
    (include_str!("../../../robots/changes.toml"), 18, &[0, 1, 2, 5]),
];

#[test]
fn nothing_runs_more_often_than_noted() {
    let mcus = [(Controller::Master, "firmware-master"), (Controller::Slave, "firmware-slave")];
    let mcus = mcus.map(|(mcu, name)| (mcu, Noted::load(name).limits()));
    let mut counts = mcus.each_ref().map(|_| Vec::new());
    let mut count = |engine: &mut Engine, module| {
        for ((mcu, limits), counts) in mcus.iter().zip(&mut counts) {
            let module = engine.robot_mut().module_mut(module).expect("it is there");
            counts.push(Times::count(module.mcu_mut(*mcu), limits));
        }
    };
    let mut engine = flooded();
    count(&mut engine, FLOODED);
    engine.run_until(SECOND);
    for (file, seconds, modules) in ROBOTS {
        let Scenario { wiring, timeline, .. } = Scenario::from_toml(file).expect("the file is right");
        let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).power_up_within(40 * MILLISECOND);
        let mut engine = Engine::new(robot.build().expect("it can be built"), 1);
        modules.iter().for_each(|&module| count(&mut engine, module));
        let mut run = Run::new(engine, timeline, SECOND);
        while run.step(seconds * SECOND).expect("the events can happen") {}
    }

    println!("MCU     times  noted  loop, or call");
    for ((mcu, limits), counts) in mcus.iter().zip(counts) {
        let counts: Vec<_> = counts.iter().map(Times::most).collect();
        let (mut beyond, mut taken, mut reached) = (Vec::new(), 0, 0);
        for (number, limit) in limits.iter().enumerate() {
            let times = counts.iter().map(|most| most[number]).max().unwrap_or(0);
            let first = limit.counted.first().expect("each counts an instruction");
            println!("{:7} {times:5} {:6}  {first:#x} {}", format!("{mcu:?}"), limit.most, limit.name);
            taken += usize::from(times > 0);
            reached += usize::from(times == limit.most);
            if times > limit.most {
                beyond.push((times, limit));
            }
        }
        let all = limits.len();
        println!("{mcu:?}: {taken} of {all} were executed, {reached} as often as noted");
        assert!(beyond.is_empty(), "{mcu:?}: more often than noted: {beyond:#x?}");
        assert!(taken > all / 2 && reached > all / 4, "{taken} and {reached} of {all} show little");
    }
}
