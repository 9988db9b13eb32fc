//! Reads campaigns from TOML files: options of `./x sim`, each with a list of values.

use std::path::Path;

use serde::Deserialize;
use toml::Value;

/// The most runs of a campaign. More are taken for a mistake.
const MOST_RUNS: usize = 100_000;

/// The fields of a campaign file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    robot: Option<Value>,
    engine: Option<Value>,
    world: Option<Value>,
    seconds: Option<Value>,
    loss: Option<Value>,
    vary: Option<Value>,
    seed: Option<Value>,
}

/// A shape, with a list of numbers of modules.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sized {
    shape: String,
    modules: Value,
}

/// All seeds from one to another, both included.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: u64,
    to: u64,
}

/// The arguments of one run of `superbot-sim sim`, or a part of them.
pub type Line = Vec<String>;

/// The arguments of all runs: all combinations of the values that `text` lists, with the seed changing
/// fastest. Paths of robot files are relative to `directory`.
///
/// # Errors
/// The text is not TOML, has unknown fields, or has something other than values and lists of values.
pub fn lines(text: &str, directory: &Path) -> Result<Vec<Line>, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
    let mut options = Vec::new();
    if let Some(robot) = file.robot {
        options.push(("robot", each("robot", robot, |value| robots(value, directory))?));
    }
    let plain =
        [("engine", file.engine), ("world", file.world), ("seconds", file.seconds), ("loss", file.loss)];
    for (name, value) in plain {
        if let Some(value) = value {
            options.push((name, each(name, value, |value| Ok(vec![option(name, &value)?]))?));
        }
    }
    if let Some(vary) = file.vary {
        options.push(("vary", each("vary", vary, |value| Ok(vec![variations(value)?]))?));
    }
    if let Some(seed) = file.seed {
        options.push(("seed", each("seed", seed, seeds)?));
    }
    let runs = options.iter().try_fold(1, |runs: usize, (_, values)| runs.checked_mul(values.len()));
    if runs.is_none_or(|runs| runs > MOST_RUNS) {
        return Err(format!("the lists make more than {MOST_RUNS} runs: split them into several campaigns"));
    }
    if let Some((name, _)) = options.iter().find(|(_, values)| values.is_empty()) {
        return Err(format!("`{name}` is an empty list: give it a value, or leave it out"));
    }
    Ok(product(options.into_iter().map(|(_, values)| values)))
}

/// All combinations of one value of each of `options`, with the last option changing fastest.
fn product(options: impl Iterator<Item = Vec<Line>>) -> Vec<Line> {
    options.fold(vec![Line::new()], |lines, values| {
        let with = |line: Line| values.iter().map(move |value| [line.as_slice(), value.as_slice()].concat());
        lines.into_iter().flat_map(with).collect()
    })
}

/// The arguments for each value of a list. A single value is a list of one.
fn each(
    name: &str,
    value: Value,
    arguments: impl Fn(Value) -> Result<Vec<Line>, String>,
) -> Result<Vec<Line>, String> {
    let lists: Result<Vec<_>, String> = many(value).into_iter().map(arguments).collect();
    Ok(lists.map_err(|error| format!("`{name}`: {error}"))?.concat())
}

fn many(value: Value) -> Vec<Value> {
    match value {
        Value::Array(values) => values,
        value => vec![value],
    }
}

fn text(value: &Value) -> Result<String, String> {
    match value {
        Value::String(text) => no_option(text),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(number.to_string()),
        _ => Err(format!("{value} is neither a number nor a text")),
    }
}

/// Refuses a text that the simulator would take for one of its options.
fn no_option(text: &str) -> Result<String, String> {
    if text.starts_with('-') {
        return Err(format!("{text} would be an option: give a value that does not begin with -"));
    }
    Ok(text.into())
}

fn option(name: &str, value: &Value) -> Result<Line, String> {
    Ok(vec![format!("--{name}"), text(value)?])
}

fn robots(value: Value, directory: &Path) -> Result<Vec<Line>, String> {
    if let Some(file) = value.as_str().filter(|robot| robot.ends_with(".toml")) {
        let path = directory.join(file);
        let path = path.canonicalize().map_err(|error| format!("can't read {}: {error}", path.display()))?;
        return Ok(vec![vec![path.to_str().ok_or("its path is not UTF-8: give it another name")?.into()]]);
    }
    if !value.is_table() {
        return Ok(vec![vec![text(&value)?]]);
    }
    let Sized { shape, modules } =
        value.try_into().map_err(|_| "write { shape = \"chain\", modules = [5, 10] }".to_owned())?;
    let shape = no_option(&shape)?;
    let sized = |modules| Ok([vec![shape.clone()], option("modules", &modules)?].concat());
    many(modules).into_iter().map(sized).collect()
}

/// The options `--vary` of a run: none, one or several.
fn variations(value: Value) -> Result<Line, String> {
    let options: Result<Vec<_>, _> = many(value).iter().map(|value| option("vary", value)).collect();
    Ok(options?.concat())
}

fn seeds(value: Value) -> Result<Vec<Line>, String> {
    if !value.is_table() {
        return Ok(vec![option("seed", &value)?]);
    }
    let Range { from, to } =
        value.try_into().map_err(|_| "write { from = 1, to = 40 } for all from 1 to 40".to_owned())?;
    if from > to || to - from >= MOST_RUNS as u64 {
        return Err(format!(
            "from {from} to {to} gives no seeds, or more than {MOST_RUNS}: give another range"
        ));
    }
    Ok((from..=to).map(|seed| vec!["--seed".into(), seed.to_string()]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(text: &str) -> Vec<String> {
        let lines = lines(text, Path::new(".")).unwrap();
        lines.iter().map(|line| line.join(" ")).collect()
    }

    #[test]
    fn all_combinations_are_run_and_the_seed_changes_fastest() {
        assert_eq!(
            joined("robot = 'chain'\nseed = { from = 1, to = 2 }\nloss = [0, 0.5]"),
            [
                "chain --loss 0 --seed 1",
                "chain --loss 0 --seed 2",
                "chain --loss 0.5 --seed 1",
                "chain --loss 0.5 --seed 2"
            ]
        );
        assert_eq!(
            joined("robot = ['ring', { shape = 'chain', modules = [5, 7] }]"),
            ["ring", "chain --modules 5", "chain --modules 7"]
        );
        assert_eq!(
            joined("vary = [[], 'mass=20%', ['mass=20%', 'torque=10%']]"),
            ["", "--vary mass=20%", "--vary mass=20% --vary torque=10%"]
        );
        assert_eq!(joined(""), [""]);
        let many = joined("engine = ['host', 'simavr']\nseconds = [1, 2, 3]\nseed = { from = 7, to = 11 }");
        assert_eq!(many.len(), 2 * 3 * 5);
    }

    #[test]
    fn what_makes_no_runs_is_refused_with_advice() {
        for (text, advice) in [
            ("loss = []", "`loss` is an empty list"),
            ("losses = 0", "unknown field `losses`"),
            ("loss = ", "line 1"),
            ("loss = { from = 0, to = 1 }", "`loss`: "),
            ("loss = [[0.1]]", "neither a number nor a text"),
            ("seed = { from = 2, to = 1 }", "no seeds"),
            ("seed = { from = 1 }", "write { from = 1, to = 40 }"),
            ("seed = { from = -1, to = 4 }", "write { from = 1, to = 40 }"),
            ("seed = { from = 0, to = 18446744073709551615 }", ""),
            ("seed = { from = 0, to = 9223372036854775807 }", "more than 100000"),
            ("seed = { from = 1, to = 100000 }\nloss = [0, 1]", "more than 100000 runs"),
            ("robot = { shape = 'chain' }", "write { shape"),
            ("robot = 'nowhere.toml'", "can't read ./nowhere.toml"),
            ("robot = '--view.toml'", "can't read ./--view.toml"),
            ("robot = ['chain', '--view']", "`robot`: --view would be an option"),
            ("robot = { shape = '-h', modules = 5 }", "`robot`: -h would be an option"),
            ("robot = { shape = 'chain', modules = '--view' }", "`robot`: --view would be an option"),
            ("engine = '--view'", "`engine`: --view would be an option"),
            ("vary = [['mass=20%', '--view']]", "`vary`: --view would be an option"),
        ] {
            let error = lines(text, Path::new(".")).unwrap_err();
            assert!(error.contains(advice), "{text}: {error}");
        }
    }
}
