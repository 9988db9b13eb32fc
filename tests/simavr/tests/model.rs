//! Compares the kernel on the MCU with the reference of the host tests, in part: `./x model` plays more. Also
//! checks that planted faults are found.

use kernel::LONGEST;
use kernel::Priority::{self, P3, P4, P5};
use model::call::Call;
use model::setup::Setup;
use model::shorten::Replay;
use model::step::{Handler, Interruption, Step};
use superbot_tests_simavr::image;
use superbot_tests_simavr::model::{Campaign, Player, Subject, Total, play_seed};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS, Target};

fn run(subject: &Subject, first_seed: u64, sequences: u64) -> Total {
    let total = Campaign { first_seed, sequences }.run(subject);
    println!("{}: {total}", subject.target().part.name);
    total
}

#[test]
fn the_kernel_does_what_the_reference_does_on_every_mcu() {
    for subject in TARGETS.into_iter().flat_map(Subject::all) {
        let total = run(&subject, 0, 6_000);
        assert!(total.failures.is_empty(), "{:?}", total.failures);
        assert!(total.counts.inside > 6_000, "few interrupts come inside of calls: {total}");
    }
}

/// Plays scripts of these steps and one more call, with an interrupt inside of it that makes a call, at every
/// cycle.
fn interrupt_everywhere(setup: &Setup, before: &[Call], call: Call, of_interrupt: Call) {
    let subject = Subject::new(ATMEGA128, image("model"));
    let mut player = Player::new(&subject);
    for after in 0..500 {
        let handler = Handler::Calls(vec![of_interrupt]);
        let last = Step::Call(call, Some(Interruption { after, handler, then: None }));
        let steps = before.iter().map(|&call| Step::Call(call, None)).chain([last]).collect();
        if let Err(disagreement) = player.play(setup, setup, Replay::new(steps), None).1 {
            panic!("{after} cycles into {call:?}:\n{disagreement}");
        }
    }
}

/// A setup in which all tasks are started, and then these calls are made.
fn tasks(priorities: &[Priority], boot: &[Call]) -> Setup {
    Setup {
        priorities: priorities.to_vec(),
        started: priorities.len(),
        semaphores: vec![0],
        ceilings: vec![P3],
        rooms: vec![1],
        timers: 1,
        jobs: vec![0],
        without: None,
        boot: boot.to_vec(),
    }
}

#[test]
fn an_isr_starts_a_task_that_ends_itself_and_runs_on_its_stack_still() {
    interrupt_everywhere(&tasks(&[P3, P4], &[]), &[], Call::Exit, Call::Start { task: 0 });
}

#[test]
fn an_isr_asks_the_priority_of_a_stack_that_is_free_and_nobodys_yet() {
    let setup = tasks(&[P4, P3], &[]);
    interrupt_everywhere(&setup, &[Call::Exit], Call::Start { task: 1 }, Call::Priority { task: 1 });
}

#[test]
fn an_isr_starts_a_task_that_is_killed_for_the_second_time() {
    let setup = tasks(&[P3, P4], &[Call::Kill { task: 1 }]);
    interrupt_everywhere(&setup, &[], Call::Kill { task: 1 }, Call::Start { task: 1 });
}

/// Seeds whose scripts once disagreed with the reference.
#[test]
fn a_message_comes_for_a_task_whose_time_is_up_and_that_has_not_left_its_line() {
    for (mcu, seed) in [("atmega128", 27_131), ("atmega328p", 2_423)] {
        for subject in Subject::all(Target::named(mcu).expect("it is one of them")) {
            let total = Campaign { first_seed: seed, sequences: 1 }.run(&subject);
            assert!(total.failures.is_empty(), "{:?}", total.failures);
        }
    }
}

#[test]
fn behind_the_greatest_seed_comes_the_first_one() {
    let subject = Subject::new(ATMEGA128, image("model"));
    let played = |sequences| Campaign { first_seed: u64::MAX, sequences }.run(&subject).seeds;
    assert_eq!((played(1), played(2)), (1, 16));
}

/// Plays these steps.
fn play(setup: &Setup, steps: &[Step]) {
    let subject = Subject::new(ATMEGA128, image("model"));
    let played = Player::new(&subject).play(setup, setup, Replay::new(steps.to_vec()), None).1;
    let played = played.unwrap_or_else(|disagreement| panic!("{disagreement}"));
    assert_eq!(played.steps().take(steps.len()).collect::<Vec<_>>(), steps.iter().collect::<Vec<_>>());
}

fn call(call: Call) -> Step {
    Step::Call(call, None)
}

fn interrupt(call: Call) -> Step {
    Step::Interrupt(Handler::Calls(vec![call]))
}

#[test]
fn two_tasks_above_the_ceiling_wait_for_one_mutex() {
    // The first two wait until the third has the mutex, and then wait for the mutex.
    let setup = Setup { ceilings: vec![P4], ..tasks(&[P3, P3, P5], &[]) };
    let go = Call::Wait { semaphore: 0 };
    let lock = Call::Lock { mutex: 0 };
    let in_time = Call::LockTimeout { mutex: 0, ticks: 2 };
    let post = interrupt(Call::Post { semaphore: 0 });
    for (first, second) in [(lock, lock), (lock, in_time), (in_time, lock), (in_time, in_time)] {
        let begin = [go, go, lock].map(call);
        let meet = [post.clone(), call(first), post.clone(), call(second)];
        // Each unlocks, and waits again so that the next one runs.
        let unlock = [Call::Unlock, Call::Unlock, go, Call::Unlock].map(call);
        play(&setup, &[&begin[..], &meet, &unlock].concat());
        // Some give up in the second tick.
        let ticks = vec![Step::Interrupt(Handler::Tick(None)); 2];
        let timed = [first, second].into_iter().filter(|&call| call == in_time).count();
        let go_on = vec![call(go); timed];
        let unlock = &unlock[..[4, 2, 1][timed]];
        play(&setup, &[&begin[..], &meet, &ticks, &go_on, unlock].concat());
    }
}

#[test]
fn a_time_beyond_the_longest_counts_as_that() {
    let setup = tasks(&[P3], &[]);
    let wait = Call::WaitForSeveralTimeout { semaphores: [0; 3], ticks: LONGEST + 1 };
    play(&setup, &[call(wait), Step::Silence(LONGEST - 1), Step::Silence(1), call(Call::Now)]);
}

/// Plays until a planted fault of the kernel is found. The first seed lies shortly before one that finds it.
fn find_fault(fault: &str, first_seed: u64) {
    let subject = Subject::new(ATMEGA128, image(&format!("fault-{fault}/model")));
    let total = run(&subject, first_seed, 200_000);
    assert!(!total.failures.is_empty(), "{fault} is not found: {total}");
    total.failures.iter().for_each(|failure| println!("{failure}"));
}

#[test]
fn a_critical_section_taken_out_is_found() {
    find_fault("unmasked-post", 2_300);
}

#[test]
fn a_stale_head_is_found() {
    find_fault("stale-head", 0);
}

#[test]
fn a_kernel_that_differs_is_found_in_a_few_steps() {
    let subject = Subject::new(ATMEGA128, image("model"));
    let find = |alter: fn(&mut Setup)| {
        let mut player = Player::new(&subject);
        let found = (0..100).filter_map(|seed| play_seed(&mut player, seed, alter).err()).take(3);
        let shortest = found.min_by_key(|found| found.steps().count()).expect("it differs");
        assert!(shortest.steps().count() < 10, "{shortest}");
    };
    find(|real| real.semaphores.iter_mut().for_each(|signals| *signals += 1));
    find(|real| real.rooms.iter_mut().for_each(|room| *room += 1));
    find(|real| real.priorities.reverse());
    find(|real| real.jobs.reverse());
}
