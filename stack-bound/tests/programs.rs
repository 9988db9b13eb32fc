//! Hand-written programs whose bounds are known to the byte, and programs without a bound, which are named.

use std::path::{Path, PathBuf};
use std::process::Command;

use stack_bound::{AnnotationError, Annotations, Image, Stack, stacks};

/// Builds `fixtures/<source>` for an MCU with avr-gcc.
fn build(source: &str, mcu: &str) -> Image {
    Image::load(build_file(source, mcu)).expect("avr-gcc makes an AVR image")
}

fn build_file(source: &str, mcu: &str) -> PathBuf {
    build_with(source, mcu, &[])
}

fn build_with(source: &str, mcu: &str, options: &[&str]) -> PathBuf {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(source);
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{source}-{mcu}-{}.elf", thread_name()));
    let status = Command::new("avr-gcc")
        .args(["-Os", "-Wall", "-Werror", &format!("-mmcu={mcu}"), "-o"])
        .args([&elf, &fixture])
        .args(options)
        .status()
        .expect("avr-gcc runs (Debian: gcc-avr and avr-libc; ./x test installs them)");
    assert!(status.success(), "avr-gcc builds {}", fixture.display());
    elf
}

/// The name of the running test, so that no two tests write the same file.
fn thread_name() -> String {
    std::thread::current().name().unwrap_or_default().to_owned()
}

fn bounds(image: &Image, notes: &str) -> Vec<Stack> {
    let annotations = Annotations::parse(notes, image).expect("the notes fit the image");
    stacks(image, &annotations).expect("there is a bound")
}

fn problems(image: &Image) -> Vec<String> {
    let problems = stacks(image, &Annotations::default()).expect_err("there is no bound");
    problems.iter().map(ToString::to_string).collect()
}

fn steps(stack: &Stack) -> Vec<(&str, u32)> {
    stack.steps.iter().map(|step| (step.name.as_str(), step.bytes)).collect()
}

#[test]
fn frames() {
    let bounds = bounds(&build("frames.S", "atmega128"), "");
    let [kernel] = bounds.as_slice() else { panic!("{bounds:?}") };
    assert_eq!(steps(kernel)[1..], [("main", 16), ("deep", 302)]);
    assert_eq!((kernel.needs(), kernel.size), (320, 4096));
    assert!(!kernel.is_too_small());
}

#[test]
fn a_program_counter_of_three_bytes() {
    let bounds = bounds(&build("frames.S", "atmega2560"), "");
    assert_eq!(steps(&bounds[0])[1..], [("main", 17), ("deep", 302)]);
    assert_eq!(bounds[0].needs(), 322, "two return addresses");
}

#[test]
fn a_variable_ends_with_the_data_space_whatever_its_symbol_says() {
    let image = build("sizes.S", "atmega128");
    let places: Vec<_> = image.variable("LARGE").collect();
    assert_eq!(places, [&(0x100..u16::MAX)]);
}

#[test]
fn tasks() {
    let bounds = bounds(&build("tasks.S", "atmega128"), "");
    let [narrow, wide, kernel] = bounds.as_slice() else { panic!("{bounds:?}") };
    assert_eq!(steps(wide), [("captured", 4), ("wide", 7), ("a preempted context", 35)]);
    assert_eq!((wide.needs(), wide.size, wide.is_too_small()), (46, 45, true));
    assert_eq!(steps(narrow), [("its first context", 6), ("a preempted context", 35)]);
    assert_eq!((narrow.needs(), narrow.size, narrow.is_too_small()), (41, 41, false));
    assert_eq!(steps(kernel)[1..], [("an interrupt", 2), ("kernel_switch", 8), ("odd", 3)]);
}

/// A byte more for each return address, in the first context, and in the preempted one.
#[test]
fn tasks_with_a_program_counter_of_three_bytes() {
    let bounds = bounds(&build("tasks.S", "atmega2560"), "");
    let [narrow, wide, kernel] = bounds.as_slice() else { panic!("{bounds:?}") };
    assert_eq!(steps(wide), [("captured", 4), ("wide", 8), ("a preempted context", 36)]);
    assert_eq!(steps(narrow), [("its first context", 7), ("a preempted context", 36)]);
    assert_eq!(steps(kernel)[1..], [("an interrupt", 3), ("kernel_switch", 9), ("odd", 3)]);
}

/// Two interrupts occur in `main` with a byte pushed: one enables interrupts 5 bytes deep, and the other is
/// the deepest.
#[test]
fn interrupts_that_nest() {
    let bounds = bounds(&build("nested.S", "atmega128"), "");
    let [task, kernel] = bounds.as_slice() else { panic!("{bounds:?}") };
    let opens = [("an interrupt", 2), ("enter", 6), ("opens", 4), ("callee", 1)];
    let deep = [("an interrupt", 2), ("enter", 6), ("deep", 7)];
    assert_eq!(steps(kernel)[1..], [&[("main", 1)][..], &opens, &deep].concat());
    assert_eq!(kernel.needs(), 2 + 1 + 13 + 15);
    assert_eq!(
        steps(task),
        [("its first context", 6), ("an interrupt", 2), ("__vector_3", 5)],
        "and no other"
    );
}

/// The first handler has pushed two bytes, the second one pushes three. They nest only if a write to SREG may
/// enable interrupts.
#[test]
fn interrupts_nest_where_a_write_to_sreg_enables_them() {
    for (option, bytes) in [
        ("-DNEITHER", 3),
        ("-DCLEARS", 3),
        ("-DFRAME", 2 + 8),
        ("-DSETS", 2 + 2 + 3),
        ("-DCONSTANT", 2 + 2 + 3),
        ("-DCALLER", 2 + 2 + (2 + 2)),
    ] {
        let image = Image::load(build_with("status.S", "atmega128", &[option])).expect("it is an image");
        let bounds = bounds(&image, "");
        assert_eq!(bounds[0].needs(), 2 + 2 + bytes, "{option}: {:?}", bounds[0].steps);
    }
}

/// Each handler of two may be preempted in the function that both call, by the other.
#[test]
fn interrupts_that_nest_in_one_function() {
    let bounds = bounds(&build("shared.S", "atmega128"), "");
    let first = [("an interrupt", 2), ("__vector_1", 2), ("opens", 1)];
    let second = [("an interrupt", 2), ("__vector_2", 3), ("opens", 1)];
    let deepest = [("an interrupt", 2), ("__vector_2", 3), ("opens", 2)];
    assert_eq!(steps(&bounds[1])[1..], [first, second, deepest].concat());
}

/// Behind the `reti` of the handler that it calls, a handler is preempted with its registers on the stack.
#[test]
fn an_interrupt_behind_a_call_that_returns_by_reti() {
    let bounds = bounds(&build("behind.S", "atmega128"), "");
    let window = [("an interrupt", 2), ("__vector_1", 2)];
    let deepest = [("an interrupt", 2), ("__vector_1", 3), ("__vector_2", 3)];
    assert_eq!(steps(&bounds[1])[1..], [&window[..], &deepest].concat());
}

/// The handler is preempted as the task is: a whole context lies on top of what it uses.
#[test]
fn an_interrupt_that_preempts_a_handler_on_a_tasks_stack() {
    let bounds = bounds(&build("window.S", "atmega128"), "");
    let [task, _kernel] = bounds.as_slice() else { panic!("{bounds:?}") };
    assert_eq!(
        steps(task),
        [("its first context", 6), ("an interrupt", 2), ("__vector_1", 2), ("a preempted context", 35)]
    );
}

#[test]
fn the_program_fails_when_a_stack_is_too_small() {
    let output = Command::new(env!("CARGO_BIN_EXE_superbot-stack-bound"))
        .arg(build_file("tasks.S", "atmega128"))
        .output()
        .expect("the program runs");
    assert_eq!(output.status.code(), Some(1));
    let [errors, table] = [output.stderr, output.stdout].map(|text| String::from_utf8(text).expect("text"));
    let wide = "wide: 45 bytes, needs 46, -1 to spare\n     4  captured\n     7  wide\n    35  a preempted context\n";
    assert!(
        errors.contains("tasks.S") && errors.ends_with(&format!("a stack is too small: {wide}")),
        "{errors}"
    );
    assert!(table.contains(wide) && table.contains("narrow: 41 bytes, needs 41, 0 to spare\n"), "{table}");
}

#[test]
fn the_program_says_how_it_is_used() {
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_superbot-stack-bound")).args(arguments).output().expect("it runs")
    };
    let (asked, wrong) = (run(&["--help"]), run(&[]));
    assert_eq!((asked.status.code(), wrong.status.code()), (Some(0), Some(1)));
    for text in [asked.stdout, wrong.stderr] {
        assert!(String::from_utf8_lossy(&text).contains("usage: superbot-stack-bound IMAGE [NOTES]"));
    }
}

#[test]
fn the_program_names_the_file_of_a_wrong_note() {
    let image = build_file("recursion.c", "atmega128");
    let notes = image.with_extension("notes");
    std::fs::write(&notes, "\u{feff}# even and odd\r\neven = 1000\r\nodder = 3\r\n").expect("it is written");
    let output = Command::new(env!("CARGO_BIN_EXE_superbot-stack-bound"))
        .args([&image, &notes])
        .output()
        .expect("it runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    let named = format!("{}: line 3: the image has no function odder", notes.display());
    assert!(errors.contains(&named), "{errors}");
}

#[test]
fn recursion_is_named_until_it_is_noted() {
    let image = build("recursion.c", "atmega128");
    let problems = problems(&image);
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert_eq!(
        problem,
        "recursion: even calls odd calls even; if you know how many bytes it uses in all, note \"even = bytes\""
    );
    let bounds = bounds(&image, "even = 1000");
    assert_eq!(steps(&bounds[0]).last(), Some(&("even (as noted)", 1000)));
}

/// The handler is preempted in the function, at the depth that is noted, and behind its return.
#[test]
fn interrupts_that_nest_in_a_noted_function() {
    let build =
        |options: &[&str]| Image::load(build_with("noted.S", "atmega128", options)).expect("an image");
    let deepest =
        |image: &Image| steps(&bounds(image, "counts = 40")[0])[1..].iter().map(|step| step.1).sum();
    let (masked, enabled): (u32, u32) = (deepest(&build(&[])), deepest(&build(&["-DSEI"])));
    assert_eq!(masked, 2 + 2 + 40, "the interrupt, its call, and what is noted");
    assert_eq!(enabled, 2 + masked + masked, "behind the return, in the function, and the deeper interrupt");
}

/// Without a limit each depth up to all of SRAM would be followed: gigabytes.
#[test]
fn a_stack_that_grows_in_a_long_loop_is_named() {
    let problems = problems(&build("endless.S", "atmega1284p"));
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.starts_with("main pushes without end"), "{problem}");
}

/// Functions of avr-libc and libgcc have them, too.
#[test]
fn a_prologue_of_libgcc() {
    let bounds = bounds(&build("prologues.S", "atmega128"), "");
    assert_eq!(steps(&bounds[0])[1..], [("main", 2), ("saves", 18 + 100 + 2)]);
}

#[test]
fn an_indirect_call_is_named_until_it_is_noted() {
    let image = build("indirect.c", "atmega128");
    let problems = problems(&image);
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.starts_with("dispatch jumps or calls indirectly at 0x"), "{problem}");
    assert!(problem.ends_with("note \"dispatch => callee\", a line for each callee"), "{problem}");

    let fill = bounds(&image, "dispatch => fill");
    let both = bounds(&image, "# both\n\ndispatch => skip\ndispatch => fill\n");
    assert_eq!(steps(&both[0]), steps(&fill[0]), "the deeper one counts");
    assert_eq!(steps(&fill[0])[2..], [("dispatch", 2), ("fill", 42)], "Y and 40 bytes");
    assert_eq!(bounds(&image, "dispatch => skip")[0].needs(), fill[0].needs() - 42);
    assert_eq!(steps(&bounds(&image, "dis* => fil*")[0]), steps(&fill[0]));
}

/// The places to which a table leads have no names that could be noted.
#[test]
fn a_table_of_jumps_is_named_with_what_helps() {
    let problems = problems(&build("switch.c", "atmega128"));
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.starts_with("__tablejump2__ jumps or calls indirectly at 0x"), "{problem}");
    assert!(problem.ends_with("if a switch jumps there, build with -fno-jump-tables"), "{problem}");
    let options = ["-fno-jump-tables"];
    let image = Image::load(build_with("switch.c", "atmega128", &options)).expect("it is an image");
    assert_eq!(bounds(&image, "")[0].needs(), 2, "the return address of `main`");
}

/// As two files may have functions of their own of one name. The one that uses less lies first.
#[test]
fn all_callees_of_a_noted_name_count() {
    let elf = build_file("indirect.c", "atmega128");
    let fill = bounds(&Image::load(&elf).expect("it is an image"), "dispatch => fill");
    let renamed = elf.with_extension("renamed");
    let objcopy =
        Command::new("avr-objcopy").args(["--redefine-sym", "skip=fill"]).args([&elf, &renamed]).status();
    assert!(objcopy.expect("avr-objcopy runs (Debian: binutils-avr; ./x test installs it)").success());
    let both = bounds(&Image::load(&renamed).expect("it is an image"), "dispatch => fill");
    assert_eq!(both[0].needs(), fill[0].needs());
}

#[test]
fn what_no_compiler_makes_is_named() {
    let problems = problems(&build("broken.S", "atmega128")).join("\n");
    for problem in [
        "pushes_in_a_loop pushes without end",
        "leaves_a_byte returns at ",
        "jumps_by_ret returns at ",
        "loads_a_stack_pointer loads a stack pointer at ",
        "writes_sph_alone loads a stack pointer at ",
        "runs_into_data runs into data at ",
    ] {
        assert!(problems.contains(problem), "{problems}");
    }
}

#[test]
fn critical_sections_that_end_early_are_named() {
    let problems = problems(&build("sections.S", "atmega128"));
    let named = |problem: &String| {
        let (function, rest) = problem.split_once(' ').expect("a function's name comes first");
        let (_, by) = rest.split_once(", ").expect("what enables interrupts comes after the address");
        (function.to_owned(), by.split(',').next().unwrap_or_default().to_owned())
    };
    let named: Vec<_> = problems.iter().map(named).collect();
    let expected = [
        ("ends_by_a_call", "by signal"),
        ("ends_by_sei", "by sei"),
        ("ends_by_sei_alone", "by sei"),
        ("ends_by_sei_on_one_path", "by sei"),
        ("ends_by_the_callee_of_a_callee", "by signals"),
        ("ends_each_turn", "by signal"),
        ("ends_in_the_outer_one", "by signal"),
        ("ends_on_one_path", "by signal"),
        ("ends_what_a_callee_began", "by signal"),
    ];
    assert_eq!(named, expected.map(|(function, by)| (function.to_owned(), by.to_owned())), "{problems:?}");
}

/// An argument on the stack lies above two bytes of return address, and inside of three.
#[test]
fn an_argument_that_is_the_return_address_is_named() {
    let is_named = |mcu| {
        let problems = problems(&build("broken.S", mcu)).join("\n");
        problems.contains("reads_its_return_address reads its return address at ")
    };
    assert!(is_named("atmega2560"));
    assert!(!is_named("atmega128"));
}

#[test]
fn notes_that_do_not_fit_are_refused() {
    let image = build("indirect.c", "atmega128");
    let refused = |notes| Annotations::parse(notes, &image).err().expect("it is refused");
    assert!(matches!(refused("dispatch"), AnnotationError::Malformed { line: 1 }));
    assert!(matches!(refused("\nfill = many"), AnnotationError::Malformed { line: 2 }));
    assert!(refused("fill = 65536").to_string().contains("65535 bytes at most"));
    assert!(
        matches!(refused("dispatch => file"), AnnotationError::NoFunction { line: 1, name } if name == "file")
    );
    assert!(
        matches!(refused("discard => fill"), AnnotationError::NoFunction { line: 1, name } if name == "discard")
    );
    for (notes, name) in [("* => fill", "*"), ("fill == 40", "fill ="), ("fill = 4 = 40", "fill = 4")] {
        assert!(matches!(refused(notes), AnnotationError::NoFunction { line: 1, name: it } if it == name));
    }
    let twice = refused("fill = 40\nfil* = 41").to_string();
    assert_eq!(twice, "line 2: the bytes of fil* are noted already: take one of the lines out");
}
