//! The centipede's table, what is changed in it to try the verdict, and a robot that needs each of its rules:
//! for the native engine's tests and for those that write the changes into an image.

use hormone::action::Action::{Holding, HoldingOver, Straight, Swing, SwingOver};
use hormone::data::Data::{A, B};
use hormone::gait::GaitName;
use hormone::rule::{BACK, LEFT_RIGHT_BACK, Rule};

/// How many rules the table has.
pub const RULES: usize = 14;

/// How long the robot has to walk until each of its rules has counted, in s.
pub const WALK: u64 = 9;

/// The table of the centipede's gait, as the paper has it, and for legs that lie on their backs.
pub fn table() -> [Rule; RULES] {
    let rules = GaitName::Centipede.gait().rules;
    let table: Vec<Rule> = rules.iter().collect();
    table.try_into().expect("the test knows each rule")
}

/// A centipede with legs at its head too; turned over in the middle of the run.
pub fn walks() -> String {
    let docks = centipede_docks(14);
    format!(
        "modules = 16\ndocks = [{docks}[\"0.Left\", \"14.Back\"], [\"0.Right\", \"15.Back\"]]\n\
         [[event]]\nat = 5.1\nroll = 180"
    )
}

/// The docks that a centipede of so many modules joins, as a robot file lists them.
pub fn centipede_docks(modules: usize) -> String {
    let wiring = simulation::Shape::Centipede.wiring(modules).expect("it is long enough");
    wiring.attachments().map(|(one, other)| format!("[\"{one}\", \"{other}\"],")).collect()
}

/// The rules that may stand in the place of a rule: one does something else, sends something else, or sends
/// it elsewhere. The last one is another rule of the table, which then stands there twice while the place's
/// own rule is missing.
pub fn mutants(place: usize) -> Vec<Rule> {
    let rule = table()[place];
    let mut mutants: Vec<Rule> = [Straight, Swing, Holding, SwingOver, HoldingOver]
        .into_iter()
        .filter(|&action| action != rule.action())
        .map(|action| rule.perform(action))
        .collect();
    for data in [A, B] {
        if let Some(send) = rule.sends(data, 2).filter(|_| rule.covers(data, 2)) {
            let other = if send.data == A { B } else { A };
            let docks = if send.docks == BACK { LEFT_RIGHT_BACK } else { BACK };
            mutants.push(rule.send(other, send.docks));
            // No module hears what a spine sends to its sides, too.
            mutants.extend((send.docks != BACK).then(|| rule.send(send.data, docks)));
        }
    }
    mutants.push(table()[(place + 1) % RULES]);
    mutants
}
