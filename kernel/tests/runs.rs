//! Consecutive runs of the kernel on the host: what a run leaves behind.

use std::panic::{self, AssertUnwindSafe};
use std::process::Command;
use std::sync::atomic::{AtomicU16, Ordering::Relaxed};
use std::time::Duration;
use std::{env, thread};

use kernel::{
    Boot, Interrupt, Job, JobContext, Message, Mutex, Never, Priority, Semaphore, Stack, Task, TaskState,
    Timer, host,
};

/// Runs `body` as the only task, for `ticks` ticks.
fn run_task(stack: &'static Stack<0>, ticks: u32, body: impl FnOnce(&mut Task) -> Never + Send + 'static) {
    host::run_for(ticks, |boot| stack.start(boot, Priority::P3, body).expect("the stack is free"), |_, _| {});
}

fn wait_for_ever(task: &mut Task) -> Never {
    static NEVER: Semaphore = Semaphore::new(0);
    loop {
        NEVER.wait(task);
    }
}

#[test]
fn a_timer_that_is_armed_as_a_run_ends_is_armed_no_more() {
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static TIMER: Timer = Timer::new();
    static DUE: Semaphore = Semaphore::new(0);
    static CAME: AtomicU16 = AtomicU16::new(0);
    for stack in &STACKS {
        run_task(stack, 5, |task| {
            assert!(!TIMER.is_running(task));
            TIMER.start(task, 2, &DUE);
            DUE.wait(task);
            CAME.fetch_add(1, Relaxed);
            TIMER.start(task, 100, &DUE);
            wait_for_ever(task)
        });
    }
    assert_eq!(CAME.load(Relaxed), 2);
}

#[test]
fn a_task_that_waits_as_a_run_ends_takes_no_signal_of_the_next() {
    static WAITERS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(0);
    let start = |boot: &mut Boot| {
        for stack in &WAITERS {
            stack.start(boot, Priority::P1, |task| SIGNAL.wait(task)).expect("the stack is free");
        }
    };
    host::run_for(1, start, |_, _| {});
    run_task(&STACK, 1, |task| {
        assert!(WAITERS.iter().all(|stack| stack.task().state(task) == TaskState::NotStarted));
        SIGNAL.post(task);
        assert!(SIGNAL.try_wait(task));
        wait_for_ever(task)
    });
}

#[test]
fn jobs_run_again_in_the_next_run() {
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static SIGNAL: Semaphore = Semaphore::new(0);
    static JOB: Job = Job::new(&SIGNAL, count);
    static COUNT: AtomicU16 = AtomicU16::new(0);
    fn count(_: &mut JobContext) {
        COUNT.fetch_add(1, Relaxed);
    }
    for stack in &STACKS {
        host::run_for(
            3,
            |boot| {
                stack
                    .start(boot, Priority::P3, |task| {
                        let _ = task.run_jobs(&[&JOB]);
                        panic!("the job is free");
                    })
                    .expect("the stack is free");
            },
            |interrupt, _| SIGNAL.post(interrupt),
        );
    }
    // The third signal of each run is given at its end.
    assert_eq!(COUNT.load(Relaxed), 6);
}

/// More tasks than a process can have stacks at once.
#[test]
fn a_body_that_returns_gives_its_coroutine_back() {
    static STACK: Stack<0> = Stack::new();
    static HELPER: Stack<0> = Stack::new();
    static HELPED: AtomicU16 = AtomicU16::new(0);
    run_task(&STACK, 0, |task| {
        for _ in 0..40_000 {
            HELPER.start(task, Priority::P0, |_| HELPED.fetch_add(1, Relaxed)).expect("the stack is free");
        }
        wait_for_ever(task)
    });
    assert_eq!(HELPED.load(Relaxed), 40_000);
}

/// Makes kernel calls when its task is dropped.
struct Parting<'a>(&'a mut Task, fn(&mut Task));

impl Drop for Parting<'_> {
    fn drop(&mut self) {
        (self.1)(self.0);
    }
}

#[test]
fn a_task_that_is_dropped_may_make_calls_that_do_not_block() {
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(0);
    static SHARED: Mutex<u16> = Mutex::new(Priority::P1, 0);
    fn part(task: &mut Task) {
        *SHARED.lock(task) += 1;
        SIGNAL.post(task);
        task.yield_now();
    }
    for _ in 0..2 {
        host::run_for(
            1,
            |boot| {
                for stack in &STACKS {
                    let body = |task: &mut Task| {
                        let parting = Parting(task, part);
                        wait_for_ever(parting.0)
                    };
                    stack.start(boot, Priority::P5, body).expect("the stack is free");
                }
            },
            |_, _| {},
        );
    }
    run_task(&STACK, 1, |task| {
        assert_eq!(SHARED.with(task, |shared| *shared), 4);
        assert_eq!((0..9).filter(|_| SIGNAL.try_wait(task)).count(), 4);
        wait_for_ever(task)
    });
}

#[test]
fn a_task_that_is_dropped_may_start_another() {
    static STACK: Stack<0> = Stack::new();
    static STARTED: Stack<0> = Stack::new();
    static OTHER: Stack<0> = Stack::new();
    static DROPPED: AtomicU16 = AtomicU16::new(0);
    struct Counts;
    impl Drop for Counts {
        fn drop(&mut self) {
            DROPPED.fetch_add(1, Relaxed);
        }
    }
    fn part(task: &mut Task) {
        let counts = Counts;
        let body = move |task: &mut Task| {
            let _counts = &counts;
            wait_for_ever(task)
        };
        STARTED.start(task, Priority::P7, body).expect("the stack is free");
        assert_eq!(STARTED.task().state(task), TaskState::Ready);
    }
    for round in 1..3 {
        run_task(&STACK, 1, |task| {
            OTHER.start(task, Priority::P3, wait_for_ever).expect("the stack is free");
            let parting = Parting(task, part);
            wait_for_ever(parting.0)
        });
        assert_eq!(DROPPED.load(Relaxed), round);
    }
}

#[test]
fn a_mutex_is_free_when_the_task_that_has_it_was_dropped() {
    static HOLDER: Stack<0> = Stack::new();
    static FAILING: Stack<0> = Stack::new();
    static STACK: Stack<0> = Stack::new();
    static FAIL: Semaphore = Semaphore::new(0);
    static SHARED: Mutex<u16> = Mutex::new(Priority::P2, 0);
    let failed = panic::catch_unwind(|| {
        host::run_for(
            1,
            |boot| {
                let fail = |task: &mut Task| {
                    FAIL.wait(task);
                    panic!("on purpose");
                };
                FAILING.start(boot, Priority::P0, fail).expect("the stack is free");
                let hold = |task: &mut Task| {
                    let mut guard = SHARED.lock(task);
                    *guard += 1;
                    host::interrupt(|interrupt| FAIL.post(interrupt));
                    *guard += 1;
                };
                HOLDER.start(boot, Priority::P4, hold).expect("the stack is free");
            },
            |_, _| {},
        );
    });
    assert!(failed.is_err());
    run_task(&STACK, 1, |task| {
        assert_eq!(SHARED.try_lock(task).as_deref(), Some(&1));
        wait_for_ever(task)
    });
}

/// If a panic of an interrupt ends a delay, no timer is left behind on the task's stack, which is gone.
#[test]
fn a_delay_that_fails_leaves_no_timer() {
    static FAILING: Stack<0> = Stack::new();
    static STACK: Stack<0> = Stack::new();
    for section in 1..6 {
        let failed = panic::catch_unwind(|| {
            run_task(&FAILING, 1, move |task| {
                host::interrupted(section, |_| panic!("on purpose"), || task.delay(9));
                wait_for_ever(task)
            });
        });
        // The last section ends when the task has blocked.
        assert!(failed.is_err(), "section {section}");
        run_task(&STACK, 20, |task| {
            task.delay(10);
            wait_for_ever(task)
        });
    }
}

/// Whether `body` panicked, for a task that continues then.
fn has_failed(body: impl FnOnce()) -> bool {
    panic::catch_unwind(AssertUnwindSafe(body)).is_err()
}

#[test]
fn a_task_that_catches_the_panic_of_a_job_waits_as_any_other() {
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static SIGNAL: Semaphore = Semaphore::new(1);
    static JOB: Job = Job::new(&SIGNAL, |_| panic!("a job fails"));
    let [runner, killer] = &STACKS;
    host::run_for(
        1,
        |boot| {
            let runs = |task: &mut Task| {
                assert!(has_failed(|| {
                    let _ = task.run_jobs(&[&JOB]);
                }));
                wait_for_ever(task)
            };
            runner.start(boot, Priority::P3, runs).expect("the stack is free");
            let kills = |task: &mut Task| {
                assert_eq!(runner.task().kill(task), Ok(()));
                wait_for_ever(task)
            };
            killer.start(boot, Priority::P5, kills).expect("the stack is free");
        },
        |_, _| {},
    );
}

#[test]
fn an_interrupt_that_fails_inside_of_a_call_ends_the_run_though_the_task_would_catch_it() {
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(0);
    for section in 1..3 {
        let panic = panic_of(|| {
            run_task(&STACK, 1, move |task| {
                let fails = move |_: &mut Interrupt| panic!("section {section}");
                let waits = || host::interrupted(section, fails, || SIGNAL.wait(task));
                match panic::catch_unwind(AssertUnwindSafe(waits)) {
                    Err(panic) if !panic.is::<String>() => panic::resume_unwind(panic), // the task is dropped
                    _ => wait_for_ever(task),
                }
            });
        });
        assert_eq!(panic, format!("section {section}"));
    }
}

#[test]
fn an_interrupt_inside_of_a_call_that_fails_does_not_come_later() {
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(0);
    static OTHER: Semaphore = Semaphore::new(0);
    run_task(&STACK, 1, |task| {
        let posts = |interrupt: &mut Interrupt| SIGNAL.post(interrupt);
        assert!(has_failed(|| host::interrupted(2, posts, || panic!("the call fails"))));
        assert!((0..9).all(|_| !OTHER.try_wait(task)));
        assert!(!SIGNAL.try_wait(task));
        wait_for_ever(task)
    });
}

#[test]
fn who_became_ready_in_work_that_fails_on_a_mutex_runs_though_its_task_catches_the_panic() {
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static VALUE: Mutex<u16> = Mutex::new(Priority::P3, 0);
    static WAKE: Semaphore = Semaphore::new(0);
    let [woken, fails] = &STACKS;
    host::run_for(
        1,
        |boot| {
            let adds = |task: &mut Task| {
                WAKE.wait(task);
                VALUE.with(task, |value| *value += 1);
                wait_for_ever(task)
            };
            woken.start(boot, Priority::P3, adds).expect("the stack is free");
            let catches = |task: &mut Task| {
                let fails = |_: &mut u16| {
                    host::interrupt(|interrupt| WAKE.post(interrupt));
                    panic!("work fails");
                };
                assert!(has_failed(|| VALUE.with(task, fails)));
                assert_eq!(*VALUE.lock(task), 1);
                wait_for_ever(task)
            };
            fails.start(boot, Priority::P5, catches).expect("the stack is free");
        },
        |_, _| {},
    );
}

#[test]
fn a_task_that_blocks_where_it_is_dropped_ends_the_program() {
    static STACK: Stack<0> = Stack::new();
    blocks_where_it_is_dropped("a_task_that_blocks_where_it_is_dropped_ends_the_program", || {
        run_task(&STACK, 1, |task| {
            let parting = Parting(task, |task| task.delay(1));
            wait_for_ever(parting.0)
        });
    });
}

#[test]
fn a_task_that_catches_its_end_and_blocks_again_ends_the_program() {
    static STACK: Stack<0> = Stack::new();
    blocks_where_it_is_dropped("a_task_that_catches_its_end_and_blocks_again_ends_the_program", || {
        run_task(&STACK, 1, |task| {
            loop {
                has_failed(|| task.delay(5));
            }
        });
    });
}

/// Checks that `runs`, in the test `name`, ends the program with the message about a task that is dropped.
fn blocks_where_it_is_dropped(name: &str, runs: impl FnOnce()) {
    const CHILD: &str = "SUPERBOT_TEST_BLOCKS_IN_DROP";
    if env::var_os(CHILD).is_some() {
        return runs();
    }
    let mut child = Command::new(env::current_exe().expect("this program"));
    let output = child.args(["--exact", name, "--nocapture"]).env(CHILD, "").output().expect("it runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && errors.contains("a task that is dropped blocks"), "{errors}");
}

/// The message with which `body` panics.
fn panic_of(body: impl FnOnce()) -> String {
    let panic = panic::catch_unwind(AssertUnwindSafe(body)).expect_err("it panics");
    match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(panic) => panic.downcast::<&str>().map_or_else(|_| String::new(), |message| message.to_string()),
    }
}

#[test]
fn what_is_no_task_is_interrupted_by_nothing() {
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(0);
    let outside = panic_of(|| host::interrupt(|interrupt| SIGNAL.post(interrupt)));
    assert!(outside.contains("no kernel runs on this thread"), "{outside}");
    let in_thread = panic_of(|| {
        run_task(&STACK, 1, |task| {
            let thread = thread::spawn(|| panic_of(|| host::interrupt(|interrupt| SIGNAL.post(interrupt))));
            let message = thread.join().expect("it panics no more");
            assert!(!SIGNAL.try_wait(task));
            panic!("{message}");
        });
    });
    assert!(in_thread.contains("no kernel runs on this thread"), "{in_thread}");
    let idle = panic_of(|| {
        let wait = |boot: &mut Boot| {
            STACK.start(boot, Priority::P3, |task| SIGNAL.wait(task)).expect("the stack is free");
        };
        host::run(wait, |_| {
            host::interrupt(|interrupt| SIGNAL.post(interrupt));
            false
        });
    });
    assert!(idle.contains("outside"), "{idle}");
}

#[test]
fn a_thread_runs_one_kernel_at_a_time() {
    let nested = panic_of(|| host::run_for(1, |_| host::run_for(1, |_| {}, |_, _| {}), |_, _| {}));
    assert!(nested.contains("this thread runs a kernel already"), "{nested}");
    for _ in 0..2 {
        // SAFETY: on the host it replaces no stack.
        let no_mcu = panic_of(|| unsafe { kernel::run(|_| {}) });
        assert!(no_mcu.contains("`host::run` runs the kernel"), "{no_mcu}");
    }
}

/// A message is dropped without a context, so that may happen while another thread runs the kernel.
#[test]
fn a_message_goes_back_while_no_other_thread_runs_the_kernel() {
    struct Parcel(#[expect(dead_code, reason = "only its place counts")] u16);
    kernel::pool!(Parcel, 1);
    thread::scope(|scope| {
        let start = |boot: &mut Boot| {
            let message = Message::new(boot, Parcel(1)).ok().expect("the one buffer is free");
            let thread = scope.spawn(|| drop(message));
            thread::sleep(Duration::from_millis(100));
            assert!(!thread.is_finished());
        };
        host::run_for(1, start, |_, _| {});
    });
}
