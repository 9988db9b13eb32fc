//! A part of the interrupt sweep: `./x sweep` runs the whole. Also checks that planted faults are found.

use superbot_tests_simavr::image;
use superbot_tests_simavr::sweep::{
    Extent, Findings, Order, PROGRAMS, Share, Subject, sweep_all, sweep_path,
};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS};

#[test]
fn no_interrupt_breaks_the_kernel() {
    let total = sweep_all(ATMEGA128, PROGRAMS, Extent::Sample(7), |line| println!("{line}"));
    assert_eq!(total.single.failed, 0, "{:#?}", total.single.failures);
    assert!(total.single.boundaries > 10_000, "{total:?}");
}

/// The other MCUs run the same code, except that the largest has a program counter of 3 bytes, so a smaller
/// part of the boundaries is enough.
#[test]
fn no_interrupt_breaks_the_kernel_on_other_mcus() {
    for target in TARGETS.into_iter().skip(1) {
        let total = sweep_all(target, PROGRAMS, Extent::Sample(61), |line| println!("{line}"));
        assert_eq!(total.single.failed, 0, "{}: {:#?}", target.part.name, total.single.failures);
        assert!(total.single.boundaries > 1_000, "{}: {total:?}", target.part.name);
    }
}

#[test]
fn every_path_is_swept() {
    for program in PROGRAMS {
        assert_eq!(
            Subject::new(ATMEGA128, ATMEGA128.image(program.image)).paths(),
            program.paths.len(),
            "{}",
            program.image
        );
    }
}

/// Sweeps a path, by its name, at every boundary whose number is a multiple of `step`.
fn sweep(subject: &Subject, program: &str, path: &str, order: Order, step: usize) -> Findings {
    let program = PROGRAMS.iter().find(|one| one.image == program).expect("there is such a program");
    let path = program.paths.iter().position(|&name| name == path).expect("there is such a path");
    sweep_path(subject, path as u8, order, Share { number: 0, of: step })
}

#[test]
fn a_critical_section_taken_out_is_found() {
    let subject = Subject::new(ATMEGA128, image("fault-unmasked-post/sweep_semaphore"));
    // The signal that an interrupt stores is lost; the lists of ready tasks break.
    for path in
        ["post to nobody", "post to a higher task, which then blocks", "post to a lower task, then block"]
    {
        let findings = sweep(&subject, "sweep_semaphore", path, Order::Single, 1);
        assert!(findings.failed > 0, "{path}: {findings:?}");
    }
}

#[test]
fn contexts_that_pile_up_are_found() {
    let subject = Subject::new(ATMEGA128, image("fault-early-enable/sweep_switch"));
    let findings = sweep(&subject, "sweep_switch", "preemption with all registers in use", Order::Single, 7);
    assert!(findings.failures.iter().any(|told| told.contains("more than one context")), "{findings:?}");
}

#[test]
fn a_stale_head_is_found() {
    let subject = Subject::new(ATMEGA128, image("fault-stale-head/sweep_switch"));
    // A tick wakes a task. As the context of the one that it preempts is saved, an external interrupt makes a
    // higher one ready.
    let findings = sweep(&subject, "sweep_switch", "yield to nobody", Order::Pair, 97);
    assert!(findings.failures.iter().any(|told| told.contains("where HIGH should be")), "{findings:?}");
    let subject = Subject::new(ATMEGA128, image("sweep_switch"));
    let findings = sweep(&subject, "sweep_switch", "yield to nobody", Order::Pair, 97);
    assert_eq!(findings.failed, 0, "{findings:?}");
}

#[test]
fn a_stack_that_is_too_small_is_found() {
    const PATH: &str = "preemption with all registers in use";
    let mut subject = Subject::new(ATMEGA128, image("sweep_switch"));
    let used = sweep(&subject, "sweep_switch", PATH, Order::Single, 7).depths;
    let stacks = subject.stacks().map(|(name, _)| name.to_owned());
    let place = stacks.into_iter().position(|name| name == "HIGH").expect("there is such a task");
    subject.shrink_stack(place, used[place]);
    assert_eq!(sweep(&subject, "sweep_switch", PATH, Order::Single, 7).failed, 0, "what is in use is enough");
    subject.shrink_stack(place, used[place] - 1);
    let findings = sweep(&subject, "sweep_switch", PATH, Order::Single, 7);
    let is_it = |told: &String| told.contains("no stack") || told.contains("HIGH's context");
    assert!(findings.failures.iter().any(is_it), "{findings:?}");
}
