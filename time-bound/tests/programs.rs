//! A hand-written program whose bounds are known to the cycle; code without a bound is named.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use stack_bound::{Annotations, Image};
use time_bound::{Bounds, NoteError, Notes, limits};

const NOTES: &str = "\
__vector_1 = 10
__vector_2 = 4(5)
masks = 4
__vector_4 -> long = 1
# The task's own.
task = job
";

fn fixture() -> PathBuf {
    built("interrupts.S")
}

fn built(source: &str) -> PathBuf {
    built_for("atmega128", source)
}

fn built_for(mcu: &str, source: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(source);
    let name = std::thread::current().name().unwrap_or_default().to_owned();
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{mcu}.elf"));
    let status = Command::new("avr-gcc")
        .args(["-Wall", "-Werror", &format!("-mmcu={mcu}"), "-o"])
        .args([&elf, &source])
        .status()
        .expect("avr-gcc runs (Debian: gcc-avr and avr-libc; ./x test installs them)");
    assert!(status.success(), "avr-gcc builds {}", source.display());
    elf
}

fn image() -> Image {
    Image::load(fixture()).expect("avr-gcc makes an AVR image")
}

/// The bounds with these notes, or the messages about missing bounds.
fn bounds(notes: &str) -> Result<Bounds, Vec<String>> {
    let image = image();
    let notes = Notes::parse(notes, &image).expect("the notes fit the image");
    Bounds::new(&image, &Annotations::default(), &notes)
        .map_err(|problems| problems.iter().map(ToString::to_string).collect())
}

#[test]
fn each_bound_is_exact() {
    let bounds = bounds(NOTES).expect("there is a bound for each");
    let found: Vec<_> = bounds
        .interrupts
        .iter()
        .map(|interrupt| {
            let [cycles, masked] = [interrupt.cycles, interrupt.masked].map(|cycles| cycles - 11);
            (interrupt.vector, cycles, masked, interrupt.masked_again, interrupt.masked_last)
        })
        .collect();
    let masks = 1 + 1 + 11 + 1 + 4;
    let long = 3 + 3 + 2 + 4;
    assert_eq!(
        found,
        [
            (1, 44, 44, 0, 11 + 44),
            (2, 71, 71, 0, 11 + 71),
            (3, 2 + 1 + 4 + masks + 4, 2, 12, 4),
            (4, 1 + long + 2 + 4, 1 + long + 2 + 4, 0, 11 + 1 + long + 2 + 4),
            (5, 1 + 1 + 4, 2, 0, 0),
            (6, 4 + 1 + 4 + 4, 4 + 1 + 4, 0, 0)
        ]
    );
    let tasks: Vec<_> = bounds.tasks.iter().map(|task| (task.name.as_str(), task.masked)).collect();
    assert_eq!(tasks, [("task", 6)]);
    assert_eq!(bounds.masked_by_instructions(), 12);
    let jobs: Vec<_> = bounds.jobs.iter().map(|job| (job.function.as_str(), job.cycles)).collect();
    assert_eq!(jobs, [("task", 10)]);
}

/// A count begins where the loop is entered, at the function's begin, or at the job's.
#[test]
fn limits_name_the_instructions_that_count_and_where_a_count_begins() {
    let image = image();
    let notes = NOTES.replace("4(5)", "4(5!)");
    let notes = Notes::parse(&notes, &image).expect("the notes fit the image");
    let limits = limits(&image, &Annotations::default(), &notes).expect("the notes fit");
    let found: Vec<_> = limits
        .iter()
        .map(|limit| {
            let function =
                limit.name.split(' ').next().and_then(|name| image.function(name)).expect("it is there");
            let offsets =
                |at: &std::collections::BTreeSet<u32>| at.iter().map(|at| at - function).collect::<Vec<_>>();
            (limit.name.as_str(), offsets(&limit.counted), limit.most, offsets(&limit.begins))
        })
        .collect();
    assert_eq!(
        found,
        [
            ("__vector_1", vec![8], 10, vec![6]),
            ("__vector_2", vec![2], 4, vec![0]),
            ("__vector_2", vec![8], 5, vec![0]),
            ("masks", vec![4], 4, vec![2]),
            ("__vector_4 -> long", vec![2, 6], 1, vec![0]),
        ]
    );
}

/// Vectors have other numbers on other MCUs.
#[test]
fn an_interrupt_has_the_name_that_it_has_on_its_mcu() {
    for (mcu, name) in [("atmega128", "INT0"), ("atmega328p", "?")] {
        let image = Image::load(built_for(mcu, "interrupts.S")).expect("avr-gcc makes an AVR image");
        let notes = Notes::parse(NOTES, &image).expect("the notes fit the image");
        let bounds = Bounds::new(&image, &Annotations::default(), &notes).expect("there are bounds");
        assert_eq!((bounds.interrupts[0].vector, bounds.interrupts[0].name), (1, name), "{mcu}");
    }
}

#[test]
fn sections_without_an_instruction_between_them_are_one_stretch() {
    let image = Image::load(built("sections.S")).expect("avr-gcc makes an AVR image");
    let bounds = Bounds::new(&image, &Annotations::default(), &Notes::default()).expect("there are bounds");
    let tasks: Vec<_> = bounds.tasks.iter().map(|task| (task.name.as_str(), task.masked)).collect();
    assert_eq!(tasks, [("task", 9)]);
}

#[test]
fn a_section_may_begin_and_end_with_a_value_for_sreg_that_the_program_makes() {
    let image = Image::load(built("status.S")).expect("avr-gcc makes an AVR image");
    let bounds = Bounds::new(&image, &Annotations::default(), &Notes::default()).expect("there are bounds");
    assert_eq!(bounds.tasks[0].masked, 4);
}

#[test]
fn a_section_behind_the_reti_of_a_call_is_part_of_the_stretch() {
    let image = Image::load(built("behind.S")).expect("avr-gcc makes an AVR image");
    let bounds = Bounds::new(&image, &Annotations::default(), &Notes::default()).expect("there are bounds");
    assert_eq!(bounds.tasks[0].masked, 7);
}

#[test]
fn what_a_task_masks_behind_a_sleep_counts() {
    let image = Image::load(built("sleep.S")).expect("avr-gcc makes an AVR image");
    let bounds = Bounds::new(&image, &Annotations::default(), &Notes::default()).expect("there are bounds");
    assert_eq!(bounds.tasks[0].masked, 4);
}

#[test]
fn the_core_waits_for_the_eeprom() {
    for mcu in ["atmega128", "atmega328p", "atmega1284p", "atmega2560"] {
        let image = Image::load(built_for(mcu, "eeprom.S")).expect("avr-gcc makes an AVR image");
        assert_eq!(image.mcu(), Some(mcu));
        let notes = Notes::parse("task = job", &image).expect("the note fits the image");
        let bounds = Bounds::new(&image, &Annotations::default(), &notes).expect("there are bounds");
        assert_eq!((bounds.jobs[0].cycles, bounds.tasks[0].masked), (17, 7), "{mcu}");
    }
}

#[test]
fn a_job_that_begins_in_a_call_goes_on_behind_it() {
    let image = Image::load(built("jobs.S")).expect("avr-gcc makes an AVR image");
    for notes in ["task = job\nretry = job", "tas* = job\nretr* = job"] {
        let notes = Notes::parse(notes, &image).expect("the notes fit the image");
        let bounds = Bounds::new(&image, &Annotations::default(), &notes).expect("there are bounds");
        let jobs: Vec<_> = bounds.jobs.iter().map(|job| (job.function.as_str(), job.cycles)).collect();
        assert_eq!(jobs, [("task", 4), ("retry", 9)]);
    }
}

#[test]
fn a_job_may_begin_with_a_call() {
    let image = Image::load(built("call.S")).expect("avr-gcc makes an AVR image");
    let bounds = |notes: &str| {
        let notes = Notes::parse(notes, &image).expect("the notes fit the image");
        Bounds::new(&image, &Annotations::default(), &notes)
    };
    let jobs = bounds("task = job\nwork = 3").expect("there are bounds").jobs;
    assert_eq!(jobs.iter().map(|job| job.cycles).collect::<Vec<_>>(), [17]);
    let problems = bounds("task = job\nwork = job").expect_err("which of the two is it?");
    assert!(problems[0].to_string().contains("a function that has jobs, too"), "{problems:?}");
}

#[test]
fn without_a_note_both_calls_count() {
    let bounds = bounds(&NOTES.replace("__vector_4 -> long = 1", "")).expect("there is a bound");
    assert_eq!(bounds.interrupts[3].cycles - 11, 2 * (1 + 3 + 3 + 2 + 4) + 4);
}

#[test]
fn a_loop_without_a_note_is_named() {
    let problems = bounds(&NOTES.replace("__vector_2 = 4(5)", "")).expect_err("there is no bound");
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.starts_with("__vector_2 has loops without a bound, at 0x"), "{problem}");
    assert!(problem.ends_with("note \"__vector_2 = turns\", in this shape: ?(?)"), "{problem}");
}

#[test]
fn notes_that_fit_no_loop_and_no_call_are_named() {
    let named = |from: &str, to: &str, problem: &str| {
        let problems = bounds(&NOTES.replace(from, to)).expect_err("there is no bound").join("\n");
        assert!(problems.contains(problem), "{problems}");
    };
    named("4(5)", "4 5", "the note of __vector_2 does not fit its loops");
    named("4(5)", "4", "they have this shape: ?(?)");
    named("__vector_4 -> long", "__vector_4 -> masks", "__vector_4 does not call masks: take the note out");
    named("masks = 4", "masks = 4\nlong = 4", "long has a note, but no loop: take the note out");
    named("masks = 4", "masks = job", "masks has loops without a bound");
}

#[test]
fn a_function_that_was_not_followed_has_no_bound() {
    let image = image();
    let notes = Notes::parse("__vector_1 = 10\n__vector_2 = 4(5)\nmasks = 4", &image).expect("they fit");
    let annotations = Annotations::parse("long = 2", &image).expect("it fits");
    let problems = Bounds::new(&image, &annotations, &notes).expect_err("nobody knows what it takes");
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.to_string().starts_with("the instructions of long were not followed"), "{problem}");
}

#[test]
fn notes_that_are_none_are_refused() {
    let image = image();
    let refused = |notes| Notes::parse(notes, &image).expect_err("it is refused");
    for notes in ["masks", "\nmasks = many", "\nmasks = 0", "\nmasks =", "\n__vector_4 -> long = often"] {
        let line = if notes.starts_with('\n') { 2 } else { 1 };
        assert!(matches!(refused(notes), NoteError::Malformed { line: at } if at == line), "{notes}");
    }
    let is_unknown =
        |notes, unknown| matches!(refused(notes), NoteError::NoFunction { line: 1, name } if name == unknown);
    assert!(is_unknown("mask = 4", "mask"));
    assert!(is_unknown("__vector_4 -> lang = 1", "lang"));
    assert!(is_unknown("__vector_* = 4", "__vector_*"), "there are several");
    assert!(matches!(refused("masks = 4\nmasks = 5"), NoteError::Twice { line: 2, .. }));
}

#[test]
fn notes_may_begin_with_a_byte_order_mark_and_have_the_line_ends_of_windows() {
    let as_they_are = bounds(NOTES).expect("there is a bound for each");
    let notes = format!("\u{feff}{}", NOTES.replace('\n', "\r\n"));
    let read = bounds(&notes).expect("there is a bound for each");
    let cycles =
        |bounds: &Bounds| bounds.interrupts.iter().map(|interrupt| interrupt.cycles).collect::<Vec<_>>();
    assert_eq!(cycles(&read), cycles(&as_they_are));
}

fn run(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_superbot-time-bound"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

#[test]
fn the_program_prints_a_table_or_json_and_fails_without_a_bound() {
    let elf = fixture();
    let file = |name: &str, text: &str| {
        let path = elf.with_extension(name);
        std::fs::write(&path, text).expect("the file can be written");
        path
    };
    let (none, notes) = (file("none", ""), file("notes", NOTES));
    let table = run(&[&elf, &none, &notes]);
    let text = String::from_utf8(table.stdout).expect("text");
    assert!(table.status.success() && text.contains("    55      55      0    55  1 INT0\n"), "{text}");
    let json = run(&[&elf, &none, &notes, Path::new("--json")]);
    let text = String::from_utf8(json.stdout).expect("text");
    assert!(
        text.contains(r#"{"vector":1,"cycles":55,"masked":55,"masked_again":0,"masked_last":55}"#),
        "{text}"
    );

    let without = run(&[&elf, &none, &none]);
    let errors = String::from_utf8(without.stderr).expect("text");
    assert_eq!((without.status.code(), without.stdout.len()), (Some(1), 0), "{errors}");
    assert!(errors.contains("masks has loops without a bound"), "{errors}");
    let missing = run(&[&elf, &none, Path::new("/nowhere")]);
    let errors = String::from_utf8(missing.stderr).expect("text");
    assert!(missing.status.code() == Some(1) && errors.contains("cannot read /nowhere"), "{errors}");
    let asked = run(&[Path::new("--help")]);
    assert!(asked.status.success());
    for usage in [asked.stdout, run(&[]).stderr] {
        assert!(String::from_utf8_lossy(&usage).contains("usage: superbot-time-bound IMAGE NOTES LOOPS"));
    }
}
