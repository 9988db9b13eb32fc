//! Responses of a hand-written program, known to the cycle; wrong statements about the program are named.

use std::path::{Path, PathBuf};
use std::process::Command;

use stack_bound::{Annotations, Image};
use time_bound::{Bounds, Costs, Notes, ReleaseError, Releases, Response, Responses};

const NOTES: &str = "__vector_1 = 10\n__vector_2 = 4(5)\nmasks = 4\n__vector_4 -> long = 1\ntask = job\n";

/// An instruction of the interrupted program, which may read the EEPROM.
const BETWEEN: u64 = 6;
/// The longest critical section, and an instruction behind it.
const MASKED: u64 = 12 + BETWEEN;
/// The first interrupt in a core that is awake; and an instruction and a critical section behind its `reti`.
const FIRST: u64 = 44 + 7;
const INTERRUPT: u64 = FIRST + BETWEEN + MASKED;
/// The last interrupt, which returns by `ret`: behind it the program executes nothing.
const LAST: u64 = 4 + 1 + 4 + 4 + 7;
/// The task's job.
const JOB: u64 = 10;

const TASK: &str = r#"
[[task]]
name = "one"
body = "task"
priority = 1
answers = "its event"
deadline = 106
"#;

const OTHER: &str = r#"
[[task]]
name = "other"
body = "task"
priority = 2
unbounded = "nobody asks"
"#;

fn event(name: &str, rest: &str) -> String {
    format!("[[event]]\nname = \"{name}\"\nwhy = \"so\"\n{rest}\n")
}

fn own(every: u64) -> String {
    event("its event", &format!("every = {every}\nruns = [{{ by = \"one\", job = \"task\" }}]"))
}

fn file() -> PathBuf {
    let name = std::thread::current().name().unwrap_or_default().to_owned();
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn image() -> Image {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/interrupts.S");
    let elf = file().with_extension("responses.elf");
    let gcc = Command::new("avr-gcc").args(["-mmcu=atmega128", "-o"]).args([&elf, &source]).status();
    assert!(gcc.expect("avr-gcc runs (Debian: gcc-avr and avr-libc)").success());
    Image::load(elf).expect("avr-gcc makes an AVR image")
}

fn releases(text: &str) -> Result<Releases, ReleaseError> {
    let path = file().with_extension("releases.toml");
    std::fs::write(&path, text).expect("the file can be written");
    Releases::load(&[path])
}

fn responses(text: &str) -> Result<Responses, String> {
    let image = image();
    let notes = Notes::parse(NOTES, &image).expect("the notes fit");
    let bounds = Bounds::new(&image, &Annotations::default(), &notes).expect("there are bounds");
    let costs = Costs::new(&image, &Annotations::default(), &notes).expect("the notes fit");
    let releases = releases(text).map_err(|error| error.to_string())?;
    Responses::new(&releases, &costs, &bounds)
        .map_err(|problems| problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// The response of the task under test.
fn response(text: &str) -> Response {
    let responses = responses(text).unwrap_or_else(|problems| panic!("{problems}"));
    responses.tasks.into_iter().find(|task| task.task == "one").expect("it is listed")
}

#[test]
fn interrupts_and_what_is_masked_come_before_the_job() {
    let interrupt = |every: u64| event("a", &format!("every = {every}\nruns = [{{ vector = 1 }}]"));
    let found = response(&[TASK, &own(1_000), &interrupt(110)].concat());
    assert_eq!((found.cycles, found.blocking), (Some(JOB), MASKED));
    assert_eq!((found.response, found.slack()), (Some(MASKED + JOB + INTERRUPT), Some(3)));
    let found = response(&[TASK, &own(1_000), &interrupt(85)].concat());
    assert_eq!(found.response, Some(MASKED + JOB + 3 * INTERRUPT), "three come within 253 cycles");
    assert_eq!(found.slack(), Some(106 - 253));
    let found = response(&[TASK, &own(1_000), &interrupt(85).replace("vector = 1", "vector = 6")].concat());
    assert_eq!(found.response, Some(MASKED + JOB + LAST), "behind it the program executes nothing");
}

#[test]
fn a_job_waits_for_those_before_it() {
    let interrupt = event("a", "every = 40\nat_once = 2\nruns = [{ vector = 6 }]");
    let found = response(&[TASK, &own(30), &interrupt].concat());
    // At 0 two interrupts, then one every 40 cycles.
    assert_eq!(found.response, Some(MASKED + JOB + 4 * LAST), "the first job takes longest");
}

#[test]
fn of_a_task_without_an_event_the_longest_job_is_told() {
    let other = |jobs: &str| [TASK, OTHER, jobs, &own(1_000)].concat();
    let found = responses(&other("jobs = \"task\"\n")).unwrap_or_else(|problems| panic!("{problems}"));
    let told = found.tasks.iter().find(|task| task.task == "other").expect("it is listed");
    assert_eq!((told.cycles, told.response), (Some(JOB), None));
    let found = responses(&other("jobs = \"ta*\"\n")).unwrap_or_else(|problems| panic!("{problems}"));
    assert!(found.tasks.contains(told), "{found:?}");
    let problem = responses(&other("jobs = \"long\"\n")).expect_err("it has no job");
    assert_eq!(problem, "the task other has its jobs in long, which has no loop that is noted as a job");
}

#[test]
fn a_cpu_without_time_has_no_bound() {
    let busy = event("a", "every = 51\nruns = [{ vector = 1 }]");
    let found = response(&[TASK, &own(1_000), &busy].concat());
    assert_eq!(found.response, None);
    assert_eq!(found.unbounded.as_deref(), Some("the CPU may be busy for ever"));
    assert!(found.percent > 100.0, "{found:?}");
}

#[test]
fn what_needs_a_lower_task_comes_no_more_often_than_that_lets_it() {
    let needy = |task: &str| {
        event("a", &format!("every = 20\nneeds = \"{task}\"\nmost = 2\nruns = [{{ vector = 1 }}]"))
    };
    let found = response(&[TASK, OTHER, &own(1_000), &needy("other")].concat());
    assert_eq!(found.response, Some(MASKED + JOB + 2 * INTERRUPT));
    let found = response(&[TASK, OTHER, &own(1_000), &needy("one")].concat());
    assert_eq!(found.response, None, "it runs itself");
}

#[test]
fn a_run_passes_by_what_it_is_said_to() {
    let loads = |runs: &str| {
        let text = [TASK, &own(1_000), &event("a", &format!("every = 100\nruns = [{runs}]"))].concat();
        let loads = responses(&text).unwrap_or_else(|problems| panic!("{problems}")).loads;
        loads.iter().find(|load| load.event == "a").map(|load| load.interrupts)
    };
    let (with, without) = (1 + 12 + 2 + 4 + 7, 2 + 2 + 4 + 7);
    assert_eq!(loads("{ vector = 4 }"), Some(with));
    assert_eq!(loads("{ vector = 4, without = [\"long\"] }"), Some(without));
    assert_eq!(loads("{ vector = 4, beyond = [\"long\"] }"), Some(with - without));
    assert_eq!(loads("{ vector = 4, times = 3, beyond = [\"long\"] }"), Some(3 * (with - without)));
    assert_eq!(loads("{ vector = 1, notes = \"__vector_1 = 2\" }"), Some(44 - 8 * 3 + 7));
    assert_eq!(loads("{ function = \"long\" }"), Some(9));
}

#[test]
fn what_an_event_may_run_instead_counts_where_it_takes_longer() {
    let a = event("a", "every = 500\nruns = [{ function = \"long\" }]\nor = [{ vector = 1 }]");
    assert_eq!(response(&[TASK, &own(1_000), &a].concat()).response, Some(MASKED + JOB + INTERRUPT));
}

#[test]
fn of_several_sources_each_comes_so_often() {
    let a = event("a", "every = 500\nsources = 3\nruns = [{ vector = 1 }]");
    assert_eq!(response(&[TASK, &own(1_000), &a].concat()).response, Some(MASKED + JOB + 3 * INTERRUPT));
}

#[test]
fn what_does_not_fit_is_named() {
    let refused = |text: &str, problem: &str| {
        let problems = responses(text).expect_err("it is refused");
        assert!(problems.contains(problem), "{problems}");
    };
    refused(&own(9), "\"its event\" belongs to a task one that is not listed");
    refused("", "the task task is not listed: list it");
    refused(TASK, "the task one answers \"its event\", which is not listed");
    let no_body = [TASK, &own(9), &OTHER.replace("\"task\"", "\"tusk\"")].concat();
    refused(&no_body, "the image has no task tusk: take it out");
    refused(
        &OTHER.replace("unbounded = \"nobody asks\"", ""),
        "neither an event that it answers nor a reason",
    );
    let run = |run: &str| [TASK, &own(9), &event("a", &format!("every = 1\nruns = [{{ {run} }}]"))].concat();
    refused(&run("vector = 9"), "the image serves no interrupt 9");
    refused(&run("function = \"lang\""), "the image has no function lang");
    refused(&run("vector = 1, without = [\"lang\"]"), "neither a function nor a variable lang");
    refused(&run("vector = 1, without = [\"@lang\"]"), "neither a function nor a variable @lang");
    refused(
        &run("function = \"long\", without = [\"long\"]"),
        "long has no path to its end without [\"long\"]",
    );
    refused(&run("times = 2"), "a run has either a vector, a job or a function");
    refused(&run("vector = 1, notes = \"__vector_1 = 2 2\""), "the note of __vector_1 does not fit");
    refused(&event("a", "every = 0\nruns = []"), "every, at_once and sources must be at least 1");
    refused("[[event]]\nname = 7", "releases.toml: TOML parse error");
    assert!(matches!(Releases::load(&["/nowhere"]), Err(ReleaseError::Unreadable { .. })));
}

#[test]
fn an_interrupt_waits_for_the_longest_handler_and_for_those_before_it() {
    let latency = |every: u64, vector: u8| {
        let a = event("a", &format!("every = {every}\nruns = [{{ vector = 1 }}]"));
        let interrupts = responses(&[TASK, &own(1_000), &a].concat()).expect("they fit").interrupts;
        let found = interrupts.iter().find(|interrupt| interrupt.vector == vector).expect("it is served");
        (found.blocking, found.latency)
    };
    // The second vector's handler, for which no frequency is listed, an instruction, and the stretch that it
    // masks.
    let blocking = 71 + 11 + BETWEEN + MASKED;
    assert_eq!(latency(200, 1), (blocking, Some(blocking)), "nothing goes before it");
    assert_eq!(latency(200, 2), (blocking, Some(blocking + INTERRUPT)));
    assert_eq!(latency(110, 2), (blocking, Some(blocking + 4 * INTERRUPT)));
    assert_eq!(latency(50, 2), (blocking, None), "there is always another");
    // The fifth handler enables interrupts before it returns, and the sixth returns to a `ret`.
    let blocking = 4 + 1 + 4 + 11 + BETWEEN;
    assert_eq!(latency(200, 5), (blocking, Some(blocking + INTERRUPT)));
}

#[test]
fn an_interrupt_with_a_deadline_has_what_is_left_of_it_once_it_has_waited_and_run() {
    let a = event("a", "every = 200\nruns = [{ vector = 1 }]");
    let deadline = |vector: u8, until: &str| {
        let deadline = format!("[[deadline]]\nvector = {vector}\nwithin = 200\nwhy = \"so\"\n");
        responses(&[TASK, &own(1_000), &a, &deadline, &format!("until = {{ {until} }}")].concat())
    };
    let found = deadline(1, "vector = 1").expect("it fits").interrupts;
    let [first, second] = [1, 2].map(|vector| found.iter().find(|one| one.vector == vector).expect("served"));
    let waits = 71 + 11 + BETWEEN + MASKED;
    assert_eq!((first.latency, first.takes), (Some(waits), Some(FIRST)));
    assert_eq!(first.slack(), Some(200 - (waits + FIRST).cast_signed()));
    assert_eq!((second.takes, second.slack()), (None, None));
    let problem = deadline(9, "function = \"long\"").expect_err("it is refused");
    assert_eq!(problem, "interrupt 9 has a deadline, but the image does not serve it");
    let problem = deadline(1, "vector = 9").expect_err("it is refused");
    assert!(problem.contains("the image serves no interrupt 9"), "{problem}");
}
