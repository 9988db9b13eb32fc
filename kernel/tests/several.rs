//! Waits for several semaphores, and jobs that share a stack.

mod log;

use kernel::{Job, JobContext, JobTaken, Priority, Refused, Semaphore, Stack, Timer, host};
use log::Log;

#[test]
fn a_wait_for_several_ends_with_the_first_signal() {
    static LOG: Log = Log::new();
    static WAITER: Stack<0> = Stack::new();
    static ANY: [Semaphore; 3] = [const { Semaphore::new(0) }; 3];
    host::run_for(
        4,
        |boot| {
            WAITER
                .start(boot, Priority::P3, |task| {
                    loop {
                        let index = task.wait_any([&ANY[0], &ANY[1], &ANY[2]]);
                        LOG.note(format!("{index}"));
                    }
                })
                .unwrap();
        },
        |interrupt, tick| match tick {
            1 => ANY[2].post(interrupt),
            2 => {
                for index in [1, 0, 1] {
                    ANY[index].post(interrupt);
                }
            }
            _ => {}
        },
    );
    // In the second tick 1 is the first. The signal that 0 has taken too is given back, and comes before 1.
    LOG.expect(&["2", "1", "0", "1"]);
}

#[test]
fn a_wait_for_several_stands_in_line_by_priority() {
    static LOG: Log = Log::new();
    static WAITERS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static ONE: Semaphore = Semaphore::new(0);
    static NEVER: Semaphore = Semaphore::new(0);
    host::run_for(
        4,
        |boot| {
            for ((stack, name), priority) in
                WAITERS.iter().zip(["low", "high"]).zip([Priority::P5, Priority::P2])
            {
                stack
                    .start(boot, priority, move |task| {
                        loop {
                            assert_eq!(task.wait_any([&NEVER, &ONE]), 1);
                            LOG.note(name);
                            task.delay(10);
                        }
                    })
                    .unwrap();
            }
            WAITERS[2]
                .start(boot, Priority::P4, |task| {
                    loop {
                        ONE.wait(task);
                        LOG.note("middle");
                        task.delay(10);
                    }
                })
                .unwrap();
        },
        |interrupt, _| ONE.post(interrupt),
    );
    LOG.expect(&["high", "middle", "low"]);
}

#[test]
fn a_timer_ends_a_wait_for_several_and_a_task_on_its_way_out_of_it_is_not_killed() {
    static LOG: Log = Log::new();
    static WAITER: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    static EVENT: Semaphore = Semaphore::new(0);
    static TIME_UP: Semaphore = Semaphore::new(0);
    static TIMER: Timer = Timer::new();
    host::run_for(
        9,
        |boot| {
            WAITER
                .start(boot, Priority::P3, |task| {
                    TIMER.start(task, 3, &TIME_UP);
                    assert_eq!(task.wait_any([&EVENT, &TIME_UP]), 1);
                    LOG.note(format!("{}", kernel::now(task)));
                    forever(task)
                })
                .unwrap();
            BOSS.start(boot, Priority::P5, |task| {
                let waiter = WAITER.task();
                assert_eq!(waiter.suspend(task), Ok(()));
                task.delay(5);
                assert_eq!(
                    waiter.kill(task),
                    Err(Refused::Busy),
                    "its proxy waiters are in their queues still"
                );
                waiter.resume(task);
                assert_eq!(waiter.kill(task), Ok(()));
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["5"]);
}

static JOBS_LOG: Log = Log::new();

#[test]
fn jobs_run_to_their_ends_in_the_order_of_their_signals() {
    static RUNNER: Stack<0> = Stack::new();
    static OTHER: Stack<0> = Stack::new();
    static BLINK: Job = Job::new(&TICKED, blink);
    static BEEP: Job = Job::new(&PRESSED, beep);
    static TICKED: Semaphore = Semaphore::new(0);
    static PRESSED: Semaphore = Semaphore::new(0);
    fn blink(job: &mut JobContext) {
        JOBS_LOG.note("blink begins");
        PRESSED.post(job);
        JOBS_LOG.note("blink ends");
    }
    fn beep(_: &mut JobContext) {
        JOBS_LOG.note("beep");
    }
    host::run_for(
        3,
        |boot| {
            RUNNER
                .start(boot, Priority::P3, |task| match task.run_jobs(&[&BLINK, &BEEP]) {
                    Ok(never) => never,
                    Err(JobTaken) => unreachable!(),
                })
                .unwrap();
            OTHER
                .start(boot, Priority::P5, |task| {
                    assert!(task.run_jobs(&[&BEEP]).is_err());
                    JOBS_LOG.note("taken");
                    forever(task)
                })
                .unwrap();
        },
        |interrupt, tick| {
            if tick == 1 {
                TICKED.post(interrupt);
                TICKED.post(interrupt);
            }
            if tick == 2 {
                PRESSED.post(interrupt);
            }
        },
    );
    let blink = ["blink begins", "blink ends"];
    JOBS_LOG.expect(&[&["taken"], &blink[..], &["beep"], &blink[..], &["beep", "beep"]].concat());
}

#[test]
fn who_is_about_to_run_jobs_and_has_taken_some_is_not_killed() {
    static LOG: Log = Log::new();
    static RUNNER: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    static CALL: Semaphore = Semaphore::new(0);
    static NEVER: Semaphore = Semaphore::new(0);
    static JOB: Job = Job::new(&NEVER, |_| {});
    host::run_for(
        0,
        |boot| {
            BOSS.start(boot, Priority::P2, |task| {
                CALL.wait(task);
                LOG.note(format!("{:?}", RUNNER.task().kill(task)));
                forever(task)
            })
            .unwrap();
            RUNNER
                .start(boot, Priority::P3, |task| {
                    let run = || task.run_jobs(&[&JOB]);
                    match host::interrupted(2, |interrupt| CALL.post(interrupt), run) {
                        Ok(never) => never,
                        Err(JobTaken) => unreachable!(),
                    }
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["Err(Busy)"]);
}

#[test]
fn whoever_waited_by_proxy_as_a_run_ended_leaves_no_trace_in_a_queue() {
    static WAITER: Stack<0> = Stack::new();
    static RUNNER: Stack<0> = Stack::new();
    static AWAITED: Semaphore = Semaphore::new(0);
    static JOB: Job = Job::new(&AWAITED, |_| {});
    host::run_for(
        1,
        |boot| {
            WAITER.start(boot, Priority::P3, |task| task.wait_any([&AWAITED, &AWAITED])).unwrap();
            RUNNER
                .start(boot, Priority::P3, |task| task.run_jobs(&[&JOB]).map(|never| match never {}))
                .unwrap();
        },
        |_, _| {},
    );
    host::run_for(
        1,
        |_| {},
        |interrupt, _| {
            AWAITED.post(interrupt);
            assert!(AWAITED.try_wait(interrupt), "nobody waits any more");
        },
    );
}

fn forever(task: &mut kernel::Task) -> kernel::Never {
    loop {
        task.delay(kernel::LONGEST);
    }
}
