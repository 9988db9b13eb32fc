//! Scheduling: priorities, order among equals, and wake-ups from interrupts.

mod log;

use kernel::{Boot, Interrupt, Mutex, Priority, Semaphore, Stack, host};
use log::Log;

#[test]
fn the_higher_task_runs_first_and_a_post_wakes_it_at_once() {
    static LOG: Log = Log::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    host::run_for(
        1,
        |boot| {
            LOW.start(boot, Priority::P5, |task| {
                LOG.note("low runs");
                WAKE.post(task);
                LOG.note("low runs on");
                forever(task)
            })
            .unwrap();
            HIGH.start(boot, Priority::P2, |task| {
                LOG.note("high runs");
                WAKE.wait(task);
                LOG.note("high is woken");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["high runs", "low runs", "high is woken", "low runs on"]);
}

#[test]
fn a_task_of_each_priority_gives_way_to_each_higher_one() {
    use Priority::*;
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static GO: Semaphore = Semaphore::new(0);
    let priorities = [P0, P1, P2, P3, P4, P5, P6, P7];
    for (low, high) in (1..8).flat_map(|low| (0..low).map(move |high| (low, high))) {
        let log: &Log = Box::leak(Box::new(Log::new()));
        host::run_for(
            0,
            |boot| {
                HIGH.start(boot, priorities[high], move |task| {
                    GO.wait(task); // the other task is found
                    log.note("high");
                })
                .unwrap();
                LOW.start(boot, priorities[low], move |task| {
                    GO.post(task);
                    log.note("low");
                })
                .unwrap();
            },
            |_, _| {},
        );
        log.expect(&["high", "low"]);
    }
}

#[test]
fn a_post_in_a_loop_wakes_and_counts_as_any_does() {
    static LOG: Log = Log::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    host::run_for(
        1,
        |boot| {
            LOW.start(boot, Priority::P5, |task| {
                WAKE.post_in_loop(task);
                LOG.note("low runs on");
                WAKE.post_in_loop(task);
                assert!(WAKE.try_wait(task), "nobody waited, and the signal was lost");
                forever(task)
            })
            .unwrap();
            HIGH.start(boot, Priority::P2, |task| {
                WAKE.wait(task);
                LOG.note("high is woken");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["high is woken", "low runs on"]);
}

#[test]
fn a_post_to_a_lower_task_does_not_switch() {
    static LOG: Log = Log::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static WAKE: Semaphore = Semaphore::new(0);
    host::run_for(
        5,
        |boot| {
            LOW.start(boot, Priority::P7, |task| {
                WAKE.wait(task);
                LOG.note("low is woken");
                forever(task)
            })
            .unwrap();
            HIGH.start(boot, Priority::P0, |task| {
                task.delay(1);
                WAKE.post(task);
                LOG.note("high runs on");
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["high runs on", "low is woken"]);
}

#[test]
fn equals_take_turns_in_the_order_in_which_they_became_ready() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    host::run_for(
        1,
        |boot| {
            for (stack, name) in STACKS.iter().zip(["a", "b", "c"]) {
                stack
                    .start(boot, Priority::P3, move |task| {
                        for _ in 0..2 {
                            LOG.note(name);
                            task.yield_now();
                        }
                        forever(task)
                    })
                    .unwrap();
            }
        },
        |_, _| {},
    );
    LOG.expect(&["a", "b", "c", "a", "b", "c"]);
}

#[test]
fn a_preempted_task_keeps_its_place_before_its_equals() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static WAKE: Semaphore = Semaphore::new(0);
    host::run_for(
        1,
        |boot| {
            let [high, first, second] = &STACKS;
            high.start(boot, Priority::P0, |task| {
                WAKE.wait(task);
                LOG.note("high");
                forever(task)
            })
            .unwrap();
            first
                .start(boot, Priority::P4, |task| {
                    WAKE.post(task);
                    LOG.note("first");
                    forever(task)
                })
                .unwrap();
            second
                .start(boot, Priority::P4, |task| {
                    LOG.note("second");
                    forever(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["high", "first", "second"]);
}

#[test]
fn waiting_tasks_are_woken_by_priority_and_then_by_arrival() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 5] = [const { Stack::new() }; 5];
    static GATE: Semaphore = Semaphore::new(0);
    host::run_for(
        20,
        |boot| {
            let tasks = [
                ("P6 early", Priority::P6, 1),
                ("P2 early", Priority::P2, 2),
                ("P6 late", Priority::P6, 3),
                ("P1", Priority::P1, 4),
                ("P2 late", Priority::P2, 5),
            ];
            for (stack, (name, priority, ticks)) in STACKS.iter().zip(tasks) {
                stack
                    .start(boot, priority, move |task| {
                        task.delay(ticks);
                        GATE.wait(task);
                        LOG.note(name);
                        forever(task)
                    })
                    .unwrap();
            }
        },
        |interrupt, tick| {
            if tick >= 10 {
                GATE.post(interrupt);
            }
        },
    );
    LOG.expect(&["P1", "P2 early", "P2 late", "P6 early", "P6 late"]);
}

#[test]
fn two_tasks_woken_by_one_interrupt_run_by_priority_whatever_the_order_of_the_posts() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static GATES: [Semaphore; 3] = [const { Semaphore::new(0) }; 3];
    host::run_for(
        3,
        |boot| {
            let tasks = [("P1", Priority::P1), ("P3", Priority::P3), ("P5", Priority::P5)];
            for ((stack, gate), (name, priority)) in STACKS.iter().zip(&GATES).zip(tasks) {
                stack
                    .start(boot, priority, move |task| {
                        loop {
                            gate.wait(task);
                            LOG.note(name);
                        }
                    })
                    .unwrap();
            }
        },
        |interrupt, tick| {
            let order = [[1, 0, 2], [2, 1, 0], [0, 2, 1]][tick as usize - 1];
            order.iter().for_each(|&index| GATES[index].post(interrupt));
        },
    );
    LOG.expect(&["P1", "P3", "P5", "P1", "P3", "P5", "P1", "P3", "P5"]);
}

#[test]
fn a_semaphore_counts_to_255_and_no_further() {
    static TAKEN: Stack<0> = Stack::new();
    static SIGNALS: Semaphore = Semaphore::new(250);
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            TAKEN
                .start(boot, Priority::P0, |task| {
                    (0..10).for_each(|_| SIGNALS.post(task));
                    let mut taken = 0;
                    while SIGNALS.try_wait(task) {
                        taken += 1;
                    }
                    assert_eq!(taken, 255);
                    LOG.note("counted");
                    forever(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["counted"]);
}

#[test]
fn work_on_a_mutex_is_not_preempted_and_what_it_held_up_runs_after_it() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static WAKE: Semaphore = Semaphore::new(0);
    static VALUE: Mutex<Vec<&str>> = Mutex::new(Priority::P0, Vec::new());
    host::run_for(
        3,
        |boot| {
            let [high, low] = &STACKS;
            high.start(boot, Priority::P0, |task| {
                loop {
                    WAKE.wait(task);
                    LOG.note("high");
                    VALUE.with(task, |value| value.push("high"));
                }
            })
            .unwrap();
            low.start(boot, Priority::P4, |task| {
                VALUE.with(task, |value| {
                    host::interrupt(|interrupt| WAKE.post(interrupt));
                    LOG.note("low works on");
                    value.push("low");
                });
                LOG.note("low is done");
                let order = VALUE.with(task, |value| value.join(", "));
                LOG.note(order);
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["low works on", "high", "low is done", "low, high"]);
}

#[test]
fn work_on_a_mutex_goes_on_before_an_equal_once_a_task_above_the_ceiling_has_run() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static WAKE: Semaphore = Semaphore::new(0);
    static VALUE: Mutex<()> = Mutex::new(Priority::P3, ());
    host::run_for(
        1,
        |boot| {
            let [above, works, equal] = &STACKS;
            above
                .start(boot, Priority::P1, |task| {
                    WAKE.wait(task);
                    LOG.note("above");
                })
                .unwrap();
            works
                .start(boot, Priority::P5, |task| {
                    VALUE.with(task, |()| {
                        host::interrupt(|interrupt| WAKE.post(interrupt));
                        LOG.note("works on");
                    });
                    LOG.note("is done");
                })
                .unwrap();
            equal.start(boot, Priority::P5, |_| LOG.note("equal")).unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["above", "works on", "is done", "equal"]);
}

#[test]
fn whoever_is_woken_while_a_ceiling_is_left_runs_in_its_turn() {
    // One for each critical section of the call.
    for section in 1..=3 {
        let log: &'static Log = Box::leak(Box::new(Log::new()));
        let stacks: &'static [Stack<0>; 3] = Box::leak(Box::new([const { Stack::new() }; 3]));
        let value: &'static Mutex<()> = Box::leak(Box::new(Mutex::new(Priority::P1, ())));
        let wakes: &'static [Semaphore; 2] = Box::leak(Box::new([const { Semaphore::new(0) }; 2]));
        let start = |boot: &mut Boot| {
            let [high, middle, low] = stacks;
            let [wake_high, wake_middle] = wakes;
            high.start(boot, Priority::P2, |task| {
                wake_high.wait(task);
                log.note("high");
                forever(task)
            })
            .unwrap();
            middle
                .start(boot, Priority::P3, |task| {
                    wake_middle.wait(task);
                    log.note("middle");
                    forever(task)
                })
                .unwrap();
            low.start(boot, Priority::P5, move |task| {
                let guard = value.lock(task);
                host::interrupt(|interrupt| wake_middle.post(interrupt));
                let interruption = |interrupt: &mut Interrupt| wake_high.post(interrupt);
                host::interrupted(section, interruption, || drop(guard));
                log.note("low");
                forever(task)
            })
            .unwrap();
        };
        host::run(start, |_| false);
        log.expect(&["high", "middle", "low"]);
    }
}

#[test]
fn a_ceiling_holds_up_those_below_it_only_and_a_task_above_it_waits_its_turn() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static WAKE: [Semaphore; 2] = [const { Semaphore::new(0) }; 2];
    static VALUE: Mutex<u8> = Mutex::new(Priority::P3, 0);
    host::run_for(
        3,
        |boot| {
            let [above, middle, low] = &STACKS;
            above
                .start(boot, Priority::P1, |task| {
                    loop {
                        WAKE[0].wait(task);
                        LOG.note("above runs");
                        *VALUE.lock(task) += 1; // outranks the ceiling: waits for the holder
                        LOG.note("above had it");
                    }
                })
                .unwrap();
            middle
                .start(boot, Priority::P4, |task| {
                    loop {
                        WAKE[1].wait(task);
                        LOG.note("middle runs");
                    }
                })
                .unwrap();
            low.start(boot, Priority::P5, |task| {
                let mut value = VALUE.lock(task);
                host::interrupt(|interrupt| WAKE[1].post(interrupt));
                LOG.note("low works on");
                host::interrupt(|interrupt| WAKE[0].post(interrupt));
                *value += 1;
                LOG.note("low gives it");
                drop(value);
                LOG.note("low is done");
                let total = *VALUE.lock(task);
                LOG.note(format!("{total}"));
                forever(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&[
        "low works on",
        "above runs",
        "low gives it",
        "above had it",
        "middle runs",
        "low is done",
        "2",
    ]);
}

#[test]
fn a_stack_holds_one_task() {
    static ONCE: Stack<0> = Stack::new();
    host::run_for(
        0,
        |boot| {
            assert!(ONCE.start(boot, Priority::P0, forever).is_ok());
            assert_eq!(ONCE.start(boot, Priority::P0, forever), Err(kernel::StartError::Started));
        },
        |_, _| {},
    );
}

fn forever(task: &mut kernel::Task) -> kernel::Never {
    static NEVER: Semaphore = Semaphore::new(0);
    loop {
        NEVER.wait(task);
    }
}
