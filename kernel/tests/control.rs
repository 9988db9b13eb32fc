//! Task control: suspend, resume, change of priority, kill.

mod log;

use kernel::{
    Boot, EventFlags, Interrupt, Mutex, Priority, Refused, Semaphore, Stack, StartError, Task, TaskState,
    Timer, host,
};
use log::Log;
use std::sync::atomic::{AtomicBool, Ordering};

#[test]
fn a_suspended_task_does_not_run_until_it_is_resumed() {
    static LOG: Log = Log::new();
    static WORKER: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    static GO: Semaphore = Semaphore::new(0);
    host::run_for(
        2,
        |boot| {
            WORKER
                .start(boot, Priority::P3, |task| {
                    loop {
                        GO.wait(task);
                        LOG.note("worker");
                    }
                })
                .unwrap();
            BOSS.start(boot, Priority::P5, |task| {
                let worker = WORKER.task();
                assert_eq!(worker.state(task), TaskState::Waiting);
                worker.suspend(task).unwrap();
                GO.post(task);
                GO.post(task);
                assert_eq!(worker.state(task), TaskState::Suspended);
                LOG.note("boss");
                assert!(worker.resume(task));
                LOG.note("boss again");
                assert!(!worker.resume(task), "it is not suspended");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["boss", "worker", "worker", "boss again"]);
}

#[test]
fn a_task_is_suspended_wherever_it_is() {
    static LOG: Log = Log::new();
    static ARRIVED: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static PREEMPTED: Stack<0> = Stack::new();
    static HIGH: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    const NAMES: [&str; 3] = ["first", "second", "third"];
    host::run_for(
        1,
        |boot| {
            PREEMPTED
                .start(boot, Priority::P6, |task| {
                    LOG.note("low");
                    WAKE.post(task);
                    LOG.note("low again");
                    forever(task)
                })
                .unwrap();
            HIGH.start(boot, Priority::P1, |task| {
                WAKE.wait(task);
                for (stack, name) in ARRIVED.iter().zip(NAMES) {
                    stack
                        .start(task, Priority::P4, move |task| {
                            LOG.note(name);
                            forever(task)
                        })
                        .unwrap();
                }
                let all = ARRIVED.iter().chain([&PREEMPTED]).map(Stack::task);
                // Not in the order of the ring: the middle one, the last, the first.
                for index in [1, 2, 0] {
                    assert_eq!(ARRIVED[index].task().state(task), TaskState::Ready);
                    ARRIVED[index].task().suspend(task).unwrap();
                }
                PREEMPTED.task().suspend(task).unwrap();
                assert!(all.clone().all(|one| one.state(task) == TaskState::Suspended));
                task.delay(1);
                LOG.note("all are still");
                all.rev().for_each(|one| assert!(one.resume(task)));
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["low", "all are still", "third", "second", "first", "low again"]);
}

#[test]
fn who_is_left_when_the_highest_is_suspended_before_the_kernel_runs_runs_at_once() {
    static LOG: Log = Log::new();
    static TASKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    host::run_for(
        0,
        |boot| {
            let start = [("high", Priority::P1), ("low", Priority::P5), ("middle", Priority::P3)];
            for (stack, (name, priority)) in TASKS.iter().zip(start) {
                stack
                    .start(boot, priority, move |task| {
                        LOG.note(name);
                        forever(task)
                    })
                    .unwrap();
            }
            TASKS[0].task().suspend(boot).unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["middle", "low"]);
}

#[test]
fn a_task_suspends_itself_and_an_interrupt_resumes_it() {
    static LOG: Log = Log::new();
    static SELF: Stack<0> = Stack::new();
    host::run_for(
        3,
        |boot| {
            SELF.start(boot, Priority::P3, |task| {
                loop {
                    LOG.note("once");
                    SELF.task().suspend(task).unwrap();
                }
            })
            .unwrap();
        },
        |interrupt, tick| {
            if tick == 2 {
                SELF.task().resume(interrupt);
            }
        },
    );
    LOG.expect(&["once", "once"]);
}

#[test]
fn a_change_of_priority_takes_effect_at_once() {
    static LOG: Log = Log::new();
    static ONE: Stack<0> = Stack::new();
    static OTHER: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot| {
            OTHER
                .start(boot, Priority::P5, |task| {
                    LOG.note("other");
                    forever(task)
                })
                .unwrap();
            ONE.start(boot, Priority::P3, |task| {
                ONE.task().set_priority(task, Priority::P4).unwrap();
                LOG.note("still the higher");
                OTHER.task().set_priority(task, Priority::P2).unwrap();
                LOG.note("one again");
                assert_eq!(ONE.task().priority(task), Priority::P4);
                assert_eq!(OTHER.task().state(task), TaskState::Waiting);
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["still the higher", "other", "one again"]);
}

#[test]
fn who_lowers_itself_lets_the_others_run() {
    static LOG: Log = Log::new();
    static ONE: Stack<0> = Stack::new();
    static OTHERS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    host::run_for(
        1,
        |boot| {
            ONE.start(boot, Priority::P1, |task| {
                for (stack, name) in OTHERS.iter().zip(["second", "third"]) {
                    stack
                        .start(task, Priority::P3, move |task| {
                            LOG.note(name);
                            forever(task)
                        })
                        .unwrap();
                }
                LOG.note("first");
                ONE.task().set_priority(task, Priority::P3).unwrap();
                LOG.note("last");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["first", "second", "third", "last"]);
}

#[test]
fn a_killed_task_leaves_every_list_and_its_stack_is_free() {
    static LOG: Log = Log::new();
    static VICTIM: Stack<0> = Stack::new();
    static OTHER: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    static SHARED: Semaphore = Semaphore::new(0);
    static QUIET: Semaphore = Semaphore::new(0);
    host::run_for(
        20,
        |boot| {
            VICTIM
                .start(boot, Priority::P3, |task| {
                    task.wait_any_timeout([&SHARED, &QUIET], 5).unwrap();
                    unreachable!("it was killed")
                })
                .unwrap();
            OTHER
                .start(boot, Priority::P4, |task| {
                    SHARED.wait(task);
                    LOG.note("other");
                    forever(task)
                })
                .unwrap();
            BOSS.start(boot, Priority::P5, |task| {
                let victim = VICTIM.task();
                assert_eq!(victim.kill(task), Ok(()));
                assert_eq!(victim.state(task), TaskState::Killed);
                assert_eq!(victim.kill(task), Err(Refused::NotStarted));
                SHARED.post(task);
                task.delay(10);
                let body = |_: &mut kernel::Task| {};
                assert_eq!(VICTIM.start(task, Priority::P3, body), Err(StartError::Started));
                // SAFETY: nothing on the stack was pinned or lent.
                assert!(unsafe { victim.reuse(task) });
                VICTIM
                    .start(task, Priority::P3, |task| {
                        LOG.note("anew");
                        forever(task)
                    })
                    .unwrap();
                LOG.note("boss");
                QUIET.post(task);
                assert!(QUIET.try_wait(task), "nothing of the killed task takes the signal");
                LOG.note("a signal is kept");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["other", "anew", "boss", "a signal is kept"]);
}

#[test]
fn a_delayed_and_a_ready_task_are_killed() {
    static DELAYED: Stack<0> = Stack::new();
    static READY: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    host::run_for(
        20,
        |boot| {
            DELAYED
                .start(boot, Priority::P1, |task| {
                    task.delay(5);
                    unreachable!("it was killed")
                })
                .unwrap();
            BOSS.start(boot, Priority::P3, |task| {
                READY.start(task, Priority::P5, |_| unreachable!("it was killed")).unwrap();
                READY.task().kill(task).unwrap();
                DELAYED.task().kill(task).unwrap();
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
}

#[test]
fn the_delay_of_a_killed_task_ends_no_other_on_its_stack() {
    static STACK: Stack<0> = Stack::new();
    static TICKS: Semaphore = Semaphore::new(0);
    let start = |boot: &mut Boot| {
        STACK.start(boot, Priority::P1, |task| task.delay(5)).unwrap();
        let boss = |task: &mut Task| {
            STACK.task().kill(task).unwrap();
            // SAFETY: the kill is complete, and the task had nothing on its stack but its delay.
            assert!(unsafe { STACK.task().reuse(task) });
            STACK
                .start(task, Priority::P1, |task| {
                    let begin = kernel::now(task);
                    task.delay(10);
                    (0..kernel::now(task).wrapping_sub(begin)).for_each(|_| TICKS.post(task));
                })
                .unwrap();
            forever(task)
        };
        leak(Stack::<0>::new()).start(boot, Priority::P3, boss).unwrap();
    };
    host::run_for(20, start, |_, _| {});
    host::run_for(
        1,
        |boot| {
            let count = |task: &mut Task| assert_eq!((0..20).filter(|_| TICKS.try_wait(task)).count(), 10);
            leak(Stack::<0>::new()).start(boot, Priority::P3, count).unwrap();
        },
        |_, _| {},
    );
}

/// A task that is killed while it waits leaves the queue. Those before and behind it stay, even if an ISR
/// wakes some of them meanwhile.
#[test]
fn a_kill_finds_its_task_though_interrupts_wake_others_meanwhile() {
    const WAITING: usize = 5;
    // Above the task that kills, so that they run at once; and below it, so that they stay ready.
    for priority in [Priority::P4, Priority::P6] {
        for (section, posts) in (1..16).flat_map(|section| (1..=WAITING).map(move |posts| (section, posts))) {
            for victim in 0..WAITING {
                let shared = leak(Semaphore::new(0));
                let stacks = leak([const { Stack::<0>::new() }; WAITING]);
                let woken: &[AtomicBool; WAITING] = leak([const { AtomicBool::new(false) }; WAITING]);
                let start = |boot: &mut Boot| {
                    for (stack, woken) in stacks.iter().zip(woken) {
                        let body = move |task: &mut Task| {
                            shared.wait(task);
                            woken.store(true, Ordering::Relaxed);
                            forever(task)
                        };
                        stack.start(boot, priority, body).unwrap();
                    }
                    let kill = move |task: &mut Task| {
                        task.delay(1); // until all wait
                        let post =
                            move |interrupt: &mut Interrupt| (0..posts).for_each(|_| shared.post(interrupt));
                        let kill = || stacks[victim].task().kill(task);
                        host::interrupted(section, post, kill).unwrap();
                        (0..WAITING).for_each(|_| shared.post(task));
                        forever(task)
                    };
                    leak(Stack::<0>::new()).start(boot, Priority::P5, kill).unwrap();
                };
                host::run_for(3, start, |_, _| {});
                let mut left = (0..WAITING).filter(|&number| number != victim);
                let is_woken = |number: usize| woken[number].load(Ordering::Relaxed);
                let place = format!("task {victim} killed, {posts} posts at section {section}");
                assert!(left.all(is_woken), "{place}: {woken:?}");
            }
        }
    }
}

#[test]
fn a_task_whose_body_returns_can_be_started_again() {
    static LOG: Log = Log::new();
    static SHORT: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot| {
            BOSS.start(boot, Priority::P5, |task| {
                for name in ["once", "twice"] {
                    let body = move |task: &mut Task| {
                        LOG.note(name);
                        task.yield_now();
                    };
                    assert_eq!(SHORT.start(task, Priority::P3, body), Ok(()));
                    assert_eq!(SHORT.task().priority(task), Priority::P0, "none is started");
                }
                let low = |_: &mut kernel::Task| {};
                assert_eq!(SHORT.start(task, Priority::P6, low), Ok(()));
                assert_eq!(SHORT.start(task, Priority::P6, low), Err(StartError::Started));
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["once", "twice"]);
}

#[test]
fn who_has_a_mutex_is_left_alone() {
    static HOLDER: Stack<0> = Stack::new();
    static HIGH: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    static VALUE: Mutex<u8> = Mutex::new(Priority::P4, 0);
    static TRIED: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            HIGH.start(boot, Priority::P1, |task| {
                for expected in [Err(Refused::Busy), Ok(())] {
                    WAKE.wait(task);
                    assert_eq!(HOLDER.task().suspend(task), expected);
                    TRIED.note("tried");
                }
                forever(task)
            })
            .unwrap();
            HOLDER
                .start(boot, Priority::P6, |task| {
                    VALUE.with(task, |_| {
                        host::interrupt(|interrupt| WAKE.post(interrupt));
                    });
                    WAKE.post(task);
                    unreachable!("it is suspended")
                })
                .unwrap();
        },
        |_, _| {},
    );
    TRIED.expect(&["tried", "tried"]);
}

#[test]
fn who_waits_for_a_mutex_is_left_alone_until_it_has_had_it() {
    static HOLDER: Stack<0> = Stack::new();
    static WAITER: Stack<0> = Stack::new();
    static HIGH: Stack<0> = Stack::new();
    static WAKE: [Semaphore; 2] = [const { Semaphore::new(0) }; 2];
    static VALUE: Mutex<u8> = Mutex::new(Priority::P4, 0);
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            HIGH.start(boot, Priority::P1, |task| {
                for expected in [Err(Refused::Busy), Err(Refused::Busy), Ok(())] {
                    WAKE[1].wait(task);
                    assert_eq!(WAITER.task().suspend(task), expected);
                    assert_eq!(WAITER.task().set_priority(task, Priority::P5), expected);
                    assert_eq!(WAITER.task().kill(task), expected);
                    LOG.note("tried");
                }
                forever(task)
            })
            .unwrap();
            // It is above the ceiling, so it has to wait.
            WAITER
                .start(boot, Priority::P2, |task| {
                    WAKE[0].wait(task);
                    LOG.note("waits");
                    VALUE.with(task, |_| {
                        LOG.note("has it");
                        host::interrupt(|interrupt| WAKE[1].post(interrupt));
                    });
                    WAKE[1].post(task);
                    unreachable!("it is killed")
                })
                .unwrap();
            HOLDER
                .start(boot, Priority::P6, |task| {
                    VALUE.with(task, |_| {
                        host::interrupt(|interrupt| WAKE[0].post(interrupt));
                        host::interrupt(|interrupt| WAKE[1].post(interrupt));
                    });
                    forever(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["waits", "tried", "has it", "tried", "tried"]);
}

#[test]
fn a_guard_that_is_forgotten_keeps_its_mutex_and_does_no_other_harm() {
    static FORGETFUL: Stack<0> = Stack::new();
    static OTHER: Stack<0> = Stack::new();
    static HIGH: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    static WAKE_HIGH: Semaphore = Semaphore::new(0);
    static KEPT: Mutex<u8> = Mutex::new(Priority::P1, 0);
    static ANOTHER: Mutex<u8> = Mutex::new(Priority::P2, 0);
    static LOG: Log = Log::new();
    host::run_for(
        9,
        |boot| {
            HIGH.start(boot, Priority::P0, |task| {
                WAKE_HIGH.wait(task);
                assert_eq!(FORGETFUL.task().kill(task), Err(Refused::Busy));
                LOG.note("it has another");
                forever(task)
            })
            .unwrap();
            OTHER
                .start(boot, Priority::P3, |task| {
                    WAKE.wait(task);
                    LOG.note("other runs");
                    assert!(KEPT.try_lock(task).is_none() && KEPT.lock_timeout(task, 2).is_err());
                    assert_eq!(FORGETFUL.task().kill(task), Err(Refused::Busy));
                    WAKE.wait(task);
                    LOG.note("other runs again");
                    assert_eq!(FORGETFUL.task().kill(task), Ok(()));
                    assert!(KEPT.lock_timeout(task, 2).is_err());
                    LOG.note("it is kept");
                    forever(task)
                })
                .unwrap();
            FORGETFUL
                .start(boot, Priority::P5, |task| {
                    std::mem::forget(KEPT.lock(task));
                    assert_eq!(FORGETFUL.task().suspend(task), Err(Refused::Busy));
                    assert_eq!(FORGETFUL.task().kill(task), Err(Refused::Busy));
                    WAKE.post(task);
                    LOG.note("at the ceiling");
                    task.delay(1);
                    LOG.note("at the ceiling again");
                    task.delay(4);
                    ANOTHER.with(task, |_| host::interrupt(|interrupt| WAKE_HIGH.post(interrupt)));
                    WAKE.post(task);
                    unreachable!("it is at its own priority again, and killed")
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&[
        "at the ceiling",
        "other runs",
        "at the ceiling again",
        "it has another",
        "other runs again",
        "it is kept",
    ]);
}

fn forever(task: &mut Task) -> kernel::Never {
    loop {
        task.delay(kernel::LONGEST);
    }
}

fn leak<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

/// Starts a task that calls `what` once `wake` is posted, in a run in which no other task does.
fn start_when_woken(
    boot: &mut Boot,
    wake: &'static Semaphore,
    what: impl FnOnce(&mut Task) + Send + 'static,
) {
    let body = move |task: &mut Task| {
        wake.wait(task);
        what(task);
        forever(task)
    };
    leak(Stack::<0>::new()).start(boot, Priority::P1, body).unwrap();
}

/// Makes a task's call, and at the end of its `section`-th critical section an ISR posts `wake`.
fn disturbed<R>(section: usize, wake: &'static Semaphore, call: impl FnOnce() -> R) -> R {
    host::interrupted(section, move |interrupt| wake.post(interrupt), call)
}

#[test]
fn a_search_is_right_though_another_task_suspends_one_meanwhile() {
    const MOST: usize = 4;
    let cases = (1..8).flat_map(|section| (1..=MOST).map(move |ready| (section, ready)));
    for (section, ready) in cases {
        for (suspended, sought) in (0..ready).flat_map(|one| (0..ready).map(move |other| (one, other))) {
            let wake = leak(Semaphore::new(0));
            let stacks = &leak([const { Stack::<0>::new() }; MOST])[..ready];
            let start = |boot: &mut Boot| {
                for stack in stacks {
                    stack.start(boot, Priority::P5, forever).unwrap();
                }
                start_when_woken(boot, wake, move |task| stacks[suspended].task().suspend(task).unwrap());
                let search = move |task: &mut Task| {
                    let state = disturbed(section, wake, || stacks[sought].task().state(task));
                    let is_right =
                        state == TaskState::Ready || suspended == sought && state == TaskState::Suspended;
                    assert!(is_right, "{state:?}: task {suspended} suspended at section {section}");
                    forever(task)
                };
                leak(Stack::<0>::new()).start(boot, Priority::P3, search).unwrap();
            };
            host::run_for(1, start, |_, _| {});
        }
    }
}

#[test]
fn a_task_that_is_being_started_is_none_yet_to_others() {
    for section in 1..8 {
        let wake = leak(Semaphore::new(0));
        let [started, starter] = [(); 2].map(|()| leak(Stack::<0>::new()));
        let [killed, first, second] = [(); 3].map(|()| leak(AtomicBool::new(false)));
        let body = |runs: &'static AtomicBool| {
            move |task: &mut Task| {
                runs.store(true, Ordering::Relaxed);
                forever(task)
            }
        };
        let start = |boot: &mut Boot| {
            start_when_woken(boot, wake, move |task| {
                if started.task().kill(task).is_ok() {
                    killed.store(true, Ordering::Relaxed);
                    // SAFETY: the kill is complete, and the task has not run.
                    assert!(unsafe { started.task().reuse(task) });
                    started.start(task, Priority::P6, body(second)).unwrap();
                }
            });
            let start = move |task: &mut Task| {
                disturbed(section, wake, || started.start(task, Priority::P6, body(first))).unwrap();
                forever(task)
            };
            starter.start(boot, Priority::P5, start).unwrap();
        };
        host::run_for(3, start, |_, _| {});
        let [killed, first, second] = [killed, first, second].map(|flag| flag.load(Ordering::Relaxed));
        assert_eq!([first, second], [!killed, killed], "at section {section} of the start");
    }
}

#[test]
fn a_stack_that_an_interrupt_takes_while_a_task_is_started_on_it_holds_one() {
    for section in 1..6 {
        let [shared, starter] = [(); 2].map(|()| leak(Stack::<0>::new()));
        let log = leak(Log::new());
        let note = move |what: &'static str| {
            move |task: &mut Task| {
                log.note(what);
                forever(task)
            }
        };
        let start = move |task: &mut Task| {
            let of_interrupt = move |interrupt: &mut Interrupt| {
                if shared.start(interrupt, Priority::P6, note("runs")).is_ok() {
                    log.note("by the interrupt");
                }
            };
            if host::interrupted(section, of_interrupt, || shared.start(task, Priority::P6, note("runs")))
                .is_ok()
            {
                log.note("by the task");
            }
            forever(task)
        };
        host::run_for(1, |boot| starter.start(boot, Priority::P5, start).unwrap(), |_, _| {});
        // The second section of the start takes the stack.
        let by = if section == 1 { "by the interrupt" } else { "by the task" };
        log.expect(&[by, "runs"]);
    }
}

#[test]
fn who_kills_another_task_is_not_killed_before_that_is_done() {
    static REFUSED: AtomicBool = AtomicBool::new(false);
    for sections in 1..20 {
        let [victim, killer, boss] = [(); 3].map(|()| leak(Stack::<0>::new()));
        let [shared, wake] = [(); 2].map(|()| leak(Semaphore::new(0)));
        host::run_for(
            5,
            |boot| {
                victim
                    .start(boot, Priority::P6, |task| {
                        loop {
                            shared.wait(task)
                        }
                    })
                    .unwrap();
                killer
                    .start(boot, Priority::P5, move |task| {
                        task.delay(1);
                        let kill = || victim.task().kill(task);
                        let _ = disturbed(sections, wake, kill);
                        forever(task)
                    })
                    .unwrap();
                boss.start(boot, Priority::P1, move |task| {
                    wake.wait(task);
                    if killer.task().kill(task).is_err() {
                        REFUSED.store(true, Ordering::Relaxed);
                    } else if victim.task().state(task) == TaskState::Killed {
                        shared.post(task);
                        assert!(shared.try_wait(task), "{sections}: what was killed waits still");
                    }
                    forever(task)
                })
                .unwrap();
            },
            |_, _| {},
        );
    }
    assert!(REFUSED.load(Ordering::Relaxed), "a task that kills another was never refused");
}

/// The timer behind which the task was to put its own is in no list any more, and another task's traversal
/// began last.
#[test]
fn who_goes_on_in_the_midst_of_a_traversal_begins_that_anew() {
    for is_stepped in [false, true] {
        let [wake, due, other] = [(); 3].map(|()| leak(Semaphore::new(0)));
        let [gone, first, behind, own] = [(); 4].map(|()| leak(Timer::new()));
        let [high, middle, low] = [(); 3].map(|()| leak(Stack::<0>::new()));
        let has_expired = leak(AtomicBool::new(false));
        let start = |boot: &mut Boot| {
            let act = move |task: &mut Task| {
                gone.start(task, 5, other);
                wake.wait(task);
                middle.task().suspend(task).unwrap();
                gone.cancel(task);
                wake.wait(task);
                middle.task().step(task, |_| {}).unwrap();
                forever(task)
            };
            high.start(boot, Priority::P1, act).unwrap();
            let arm = move |task: &mut Task| {
                disturbed(2, wake, || own.start(task, 10, due));
                due.wait(task);
                has_expired.store(true, Ordering::Relaxed);
                forever(task)
            };
            middle.start(boot, Priority::P3, arm).unwrap();
            let disturb = move |task: &mut Task| {
                first.start(task, 3, other);
                let go_on = move |interrupt: &mut Interrupt| {
                    if is_stepped {
                        wake.post(interrupt);
                    } else {
                        assert!(middle.task().resume(interrupt));
                    }
                };
                host::interrupted(2, go_on, || behind.start(task, 20, other));
                forever(task)
            };
            low.start(boot, Priority::P5, disturb).unwrap();
        };
        host::run_for(30, start, |_, _| {});
        assert!(has_expired.load(Ordering::Relaxed), "stepped: {is_stepped}");
    }
}

/// Stands for the trap at the end of each critical section, as the host has none.
fn trap(interrupt: &mut Interrupt) {
    // SAFETY: it stands for the trap, and interrupts the task that is stepped.
    unsafe { kernel::stepped(interrupt) };
    host::arrive_later(1, trap);
}

#[test]
fn single_steps_take_a_task_to_its_place_in_a_list() {
    let waits: [fn(&mut Task, &Semaphore); 3] = [
        |task, shared| shared.wait(task),
        |task, _| task.delay(10),
        |task, shared| assert!(shared.wait_timeout(task, 10).is_ok()),
    ];
    for (number, wait) in waits.into_iter().enumerate() {
        let [stepped, other, boss] = [(); 3].map(|()| leak(Stack::<0>::new()));
        let (shared, earlier) = (leak(Semaphore::new(0)), leak(Timer::new()));
        let is_over = leak(AtomicBool::new(false));
        let start = |boot: &mut Boot| {
            let body = move |task: &mut Task| {
                stepped.task().suspend(task).unwrap();
                host::interrupted(1, trap, || wait(task, shared));
                is_over.store(true, Ordering::Relaxed);
                forever(task)
            };
            stepped.start(boot, Priority::P3, body).unwrap();
            let wait = |task: &mut Task| loop {
                shared.wait(task);
            };
            other.start(boot, Priority::P3, wait).unwrap();
            let step = move |task: &mut Task| {
                earlier.start(task, 5, shared);
                let steps = (0..100).take_while(|_| stepped.task().step(task, |_| {}).is_ok()).count();
                assert!(steps < 100, "wait {number} has no end");
                assert!(stepped.task().resume(task));
                forever(task)
            };
            boss.start(boot, Priority::P5, step).unwrap();
        };
        host::run_for(20, start, |_, _| {});
        assert!(is_over.load(Ordering::Relaxed), "wait {number} is not over");
    }
}

#[test]
fn a_handle_tells_the_size_of_its_stack() {
    static NONE: Stack<0> = Stack::new();
    static SOME: Stack<200> = Stack::new();
    assert_eq!([NONE.task(), SOME.task()].map(kernel::TaskHandle::stack_size), [0, 200]);
}

#[test]
fn who_suspends_itself_in_a_single_step_keeps_its_priority() {
    static STEPPED: Stack<0> = Stack::new();
    static BOSS: Stack<0> = Stack::new();
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            let body = |task: &mut Task| {
                STEPPED.task().suspend(task).unwrap();
                host::interrupted(1, trap, || {
                    STEPPED.task().suspend(task).unwrap();
                    forever(task)
                });
            };
            STEPPED.start(boot, Priority::P3, body).unwrap();
            let body = |task: &mut Task| {
                while STEPPED.task().step(task, |_| {}).is_ok() {}
                LOG.note(format!("{:?}", STEPPED.task().priority(task)));
                forever(task)
            };
            BOSS.start(boot, Priority::P5, body).unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["P3"]);
}

#[test]
fn single_steps_get_past_the_setting_of_flags_though_another_task_waits_for_others() {
    static FLAGS: EventFlags = EventFlags::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static IS_PAST: AtomicBool = AtomicBool::new(false);
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            let [waits, stepped, boss] = &STACKS;
            waits.start(boot, Priority::P2, |task| FLAGS.wait_any(task, 2)).unwrap();
            let body = |task: &mut Task| {
                stepped.task().suspend(task).unwrap();
                host::interrupted(1, trap, || {
                    FLAGS.set(task, 1);
                    IS_PAST.store(true, Ordering::Relaxed);
                    forever(task)
                });
            };
            stepped.start(boot, Priority::P3, body).unwrap();
            let body = |task: &mut Task| {
                let is_past = || IS_PAST.load(Ordering::Relaxed);
                let mut ends_there = false;
                let steps = (0..100).take_while(|_| {
                    let is_made = !is_past() && stepped.task().step(task, |_| {}).is_ok();
                    ends_there |= FLAGS.take(task, 1) != 0 && !is_past();
                    is_made
                });
                let is_few = steps.count() < 10;
                LOG.note(format!("past it: {}, in few steps: {is_few}", is_past()));
                LOG.note(format!("a step ends there: {ends_there}"));
                forever(task)
            };
            boss.start(boot, Priority::P4, body).unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["past it: true, in few steps: true", "a step ends there: true"]);
}
