//! Delays, timers and periods, in virtual ticks.

mod log;

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use kernel::{
    EventFlags, Interrupt, LONGEST, Never, Period, Priority, Semaphore, Stack, Task, Ticks, Timer, host,
    is_reached, now,
};
use log::Log;

fn start(boot: &mut kernel::Boot, stack: &'static Stack<0>, body: fn(&mut Task) -> Never) {
    stack.start(boot, Priority::P3, body).unwrap();
}

#[test]
fn delays_end_at_their_tick_in_order() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 4] = [const { Stack::new() }; 4];
    host::run_for(
        100,
        |boot| {
            for (stack, ticks) in STACKS.iter().zip([30, 10, 20, 10]) {
                stack
                    .start(boot, Priority::P3, move |task| {
                        task.delay(ticks);
                        LOG.note(format!("{ticks} at {}", now(task)));
                        loop {
                            task.delay(LONGEST);
                        }
                    })
                    .unwrap();
            }
        },
        |_, _| {},
    );
    LOG.expect(&["10 at 10", "10 at 10", "20 at 20", "30 at 30"]);
}

#[test]
fn a_timer_posts_once_can_be_set_anew_and_cancelled() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    static TIMERS: [Timer; 3] = [const { Timer::new() }; 3];
    static DUE: Semaphore = Semaphore::new(0);
    host::run_for(
        200,
        |boot| {
            start(boot, &STACK, |task| {
                let [first, second, third] = &TIMERS;
                first.start(task, 50, &DUE);
                second.start(task, 20, &DUE);
                third.start(task, 10, &DUE);
                first.start(task, 30, &DUE); // restarted: not twice in the list
                assert!(third.cancel(task));
                assert!(!third.cancel(task));
                for _ in 0..2 {
                    DUE.wait(task);
                    LOG.note(format!("due at {}", now(task)));
                }
                assert!(!first.cancel(task), "it has posted");
                task.delay(100);
                assert!(!DUE.try_wait(task), "nothing came after");
                LOG.note("quiet");
                loop {
                    DUE.wait(task);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["due at 20", "due at 30", "quiet"]);
}

#[test]
fn ticks_wrap_around() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    host::run_for(
        100_000,
        |boot| {
            start(boot, &STACK, |task| {
                for _ in 0..3 {
                    task.delay(30_000);
                }
                LOG.note(format!("{}", now(task)));
                loop {
                    task.delay(LONGEST);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["24464"]); // 90,000 modulo 65,536
}

/// Waits for the deadlines of a period, notes when each wait is over, and works for the ticks in `works`
/// after it. Checks that `missed` deadlines were missed then.
fn note_waits(task: &mut Task, log: &Log, mut period: Period, works: [u16; 6], missed: u16) -> Never {
    for work in works {
        period.wait(task);
        log.note(format!("{}", now(task)));
        if work > 0 {
            task.delay(work);
        }
    }
    assert_eq!(period.missed(), missed);
    loop {
        task.delay(LONGEST);
    }
}

#[test]
fn a_deadline_counts_as_reached_for_the_longest_time_there_is() {
    for deadline in [0, 1, LONGEST, LONGEST + 1, Ticks::MAX] {
        let is_reached_after = |ticks| is_reached(deadline, deadline.wrapping_add(ticks));
        assert!(is_reached_after(0) && is_reached_after(1) && is_reached_after(LONGEST), "{deadline}");
        assert!(!is_reached_after(LONGEST + 1) && !is_reached_after(Ticks::MAX), "{deadline}");
    }
}

#[test]
fn a_period_does_not_drift_and_counts_what_it_missed() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    host::run_for(
        100,
        |boot| {
            start(boot, &STACK, |task| {
                let period = Period::new(task, 10);
                note_waits(task, &LOG, period, [3, 9, 25, 0, 0, 0], 2)
            });
        },
        |_, _| {},
    );
    // The third piece of work takes 25 ticks, to 55: the deadlines 40 and 50 are missed, 60 is met.
    LOG.expect(&["10", "20", "30", "55", "55", "60"]);
}

#[test]
fn a_deadline_that_is_late_by_more_than_the_longest_wait_is_missed() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    host::run_for(
        70_000,
        |boot| {
            start(boot, &STACK, |task| {
                let period = Period::new(task, 10_000);
                task.delay(50_001);
                note_waits(task, &LOG, period, [0; 6], 5)
            });
        },
        |_, _| {},
    );
    LOG.expect(&["50001", "50001", "50001", "50001", "50001", "60000"]);
}

#[test]
fn a_delay_takes_any_number_of_ticks_and_0_does_not_block() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    host::run_for(
        70_000,
        |boot| {
            let [delays, equal] = &STACKS;
            start(boot, delays, |task| {
                task.delay(0);
                LOG.note(format!("0 ticks, to {}", now(task)));
                task.delay(60_000);
                LOG.note(format!("60000 ticks, to {}", now(task)));
                loop {
                    task.delay(LONGEST);
                }
            });
            start(boot, equal, |task| {
                LOG.note("an equal");
                loop {
                    task.delay(LONGEST);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["0 ticks, to 0", "an equal", "60000 ticks, to 60000"]);
}

#[test]
fn a_delay_of_any_number_of_ticks_counts_from_its_begin() {
    static LOG: Log = Log::new();
    static DELAYS: Stack<0> = Stack::new();
    static SUSPENDS: Stack<0> = Stack::new();
    host::run_for(
        50_000,
        |boot| {
            start(boot, &DELAYS, |task| {
                task.delay(40_000);
                LOG.note(now(task).to_string());
                loop {
                    task.delay(LONGEST);
                }
            });
            start(boot, &SUSPENDS, |task| {
                task.delay(LONGEST - 10);
                DELAYS.task().suspend(task).unwrap();
                task.delay(100);
                DELAYS.task().resume(task);
                loop {
                    task.delay(LONGEST);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["40000"]);
}

#[test]
fn a_period_of_no_length_or_too_long_a_one_has_the_nearest() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    host::run_for(
        70_000,
        |boot| {
            start(boot, &STACK, |task| {
                for length in [0, LONGEST + 1, u16::MAX] {
                    let begun = now(task);
                    let mut period = Period::new(task, length);
                    period.wait(task);
                    LOG.note(format!("{}", now(task).wrapping_sub(begun)));
                }
                loop {
                    task.delay(LONGEST);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["1", "32767", "32767"]);
}

/// An ISR that sets flags again and again does not disturb the traversal of timers.
#[test]
fn arming_a_timer_ends_though_an_isr_sets_flags_all_the_time() {
    static FLAGS: EventFlags = EventFlags::new();
    static EXPIRED: Semaphore = Semaphore::new(0);
    static TIMERS: [Timer; 9] = [const { Timer::new() }; 9];
    static STACK: Stack<0> = Stack::new();
    static CAME: AtomicU32 = AtomicU32::new(0);
    static LOG: Log = Log::new();
    fn sets(interrupt: &mut Interrupt) {
        FLAGS.set(interrupt, 1);
        if CAME.fetch_add(1, Relaxed) < 1000 {
            host::arrive_later(8, sets);
        }
    }
    host::run_for(
        1,
        |boot| {
            start(boot, &STACK, |task| {
                let [armed @ .., last] = &TIMERS;
                for timer in armed {
                    timer.start(task, 100, &EXPIRED);
                }
                host::interrupted(3, sets, || last.start(task, 200, &EXPIRED));
                LOG.note(format!("few came: {}", CAME.load(Relaxed) < 10));
                loop {
                    task.delay(LONGEST);
                }
            });
        },
        |_, _| {},
    );
    LOG.expect(&["few came: true"]);
}
