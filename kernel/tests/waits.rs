//! Waits with timeouts, and waits for any or all of several events.

mod log;

use std::sync::Mutex;

use kernel::{
    Boot, Elapsed, EventFlags, Interrupt, LONGEST, Message, Priority, Queue, Semaphore, Stack, Task, host,
    now,
};
use log::Log;

fn idle(task: &mut Task) -> kernel::Never {
    loop {
        task.delay(LONGEST);
    }
}

#[test]
fn a_wait_ends_by_its_signal_or_by_its_timeout_and_takes_a_signal_only_then() {
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    static SIGNAL: Semaphore = Semaphore::new(1);
    host::run_for(
        100,
        |boot| {
            STACK
                .start(boot, Priority::P3, |task| {
                    for _ in 0..4 {
                        let result = SIGNAL.wait_timeout(task, 10);
                        LOG.note(format!("{result:?} at {}", now(task)));
                    }
                    idle(task)
                })
                .unwrap();
        },
        |interrupt, tick| {
            // The last post comes at the very tick of the timeout, after it.
            if tick == 15 || tick == 25 {
                SIGNAL.post(interrupt);
            }
        },
    );
    LOG.expect(&["Ok(()) at 0", "Err(Elapsed) at 10", "Ok(()) at 15", "Err(Elapsed) at 25"]);
    static AFTER: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot| {
            AFTER
                .start(boot, Priority::P3, |task| {
                    assert!(SIGNAL.try_wait(task), "the late signal is in store");
                    assert!(!SIGNAL.try_wait(task));
                    idle(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
}

#[test]
fn a_timeout_takes_its_own_task_from_the_list_wherever_it_stands() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 4] = [const { Stack::new() }; 4];
    static SIGNAL: Semaphore = Semaphore::new(0);
    host::run_for(
        50,
        |boot| {
            let tasks = [
                ("P1", Priority::P1, 40),
                ("P2", Priority::P2, 5),
                ("P3", Priority::P3, 40),
                ("P4", Priority::P4, 6),
            ];
            for (stack, (name, priority, ticks)) in STACKS.iter().zip(tasks) {
                stack
                    .start(boot, priority, move |task| {
                        let result = SIGNAL.wait_timeout(task, ticks);
                        LOG.note(format!("{name} {result:?}"));
                        idle(task)
                    })
                    .unwrap();
            }
        },
        |interrupt, tick| {
            if tick == 10 || tick == 11 {
                SIGNAL.post(interrupt);
            }
        },
    );
    LOG.expect(&["P2 Err(Elapsed)", "P4 Err(Elapsed)", "P1 Ok(())", "P3 Ok(())"]);
}

#[test]
fn a_timeout_finds_its_task_though_interrupts_wake_others_meanwhile() {
    const WAITING: usize = 5;
    for (section, posts) in (1..8).flat_map(|section| (1..WAITING).map(move |posts| (section, posts))) {
        let signal: &'static Semaphore = Box::leak(Box::new(Semaphore::new(0)));
        let stacks: &'static [Stack<0>; WAITING] = Box::leak(Box::new([const { Stack::new() }; WAITING]));
        let results: &'static Mutex<Vec<_>> = Box::leak(Box::default());
        let start = |boot: &mut Boot| {
            for (number, stack) in stacks.iter().enumerate() {
                // The timeout of the last in the list is up first.
                let ticks = if number == WAITING - 1 { 2 } else { LONGEST };
                let body = move |task: &mut Task| {
                    let result = signal.wait_timeout(task, ticks);
                    results.lock().unwrap().push((number, result));
                    idle(task)
                };
                stack.start(boot, Priority::P3, body).unwrap();
            }
        };
        let mut passed = 0;
        host::run(start, |interrupt| {
            passed += 1;
            match passed {
                2 => {
                    let interruption = move |interrupt: &mut Interrupt| {
                        (0..posts).for_each(|_| signal.post(interrupt));
                    };
                    host::interrupted(section, interruption, || host::tick(interrupt));
                }
                // For the tasks that still wait.
                3 => (0..WAITING).for_each(|_| signal.post(interrupt)),
                _ => host::tick(interrupt),
            }
            passed < 4
        });
        let mut results = results.lock().unwrap();
        results.sort_by_key(|&(number, _)| number);
        let expected = [(0, Ok(())), (1, Ok(())), (2, Ok(())), (3, Ok(())), (4, Err(Elapsed))];
        assert_eq!(*results, expected, "{posts} posts at the end of section {section}");
    }
}

#[test]
fn a_receive_times_out_and_the_next_message_is_not_lost() {
    struct Reading(u8);
    kernel::pool!(Reading, 2);
    static LOG: Log = Log::new();
    static STACK: Stack<0> = Stack::new();
    static READINGS: Queue<Reading> = Queue::new(2);
    host::run_for(
        50,
        |boot: &mut Boot| {
            STACK
                .start(boot, Priority::P3, |task| {
                    for _ in 0..3 {
                        match READINGS.receive_timeout(task, 10) {
                            Ok(reading) => LOG.note(format!("{} at {}", reading.0, now(task))),
                            Err(Elapsed) => LOG.note(format!("nothing at {}", now(task))),
                        }
                    }
                    idle(task)
                })
                .unwrap();
        },
        |interrupt, tick| {
            if tick == 12 || tick == 30 {
                let message = Message::new(interrupt, Reading(tick as u8)).ok().unwrap();
                assert!(READINGS.send(interrupt, message).is_ok());
            }
        },
    );
    LOG.expect(&["nothing at 10", "12 at 12", "nothing at 22"]);
}

#[test]
fn events_wake_who_waits_for_any_or_for_all() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static FLAGS: EventFlags = EventFlags::new();
    host::run_for(
        10,
        |boot| {
            let [any, all] = &STACKS;
            any.start(boot, Priority::P3, |task| {
                loop {
                    let taken = FLAGS.wait_any(task, 0b0011);
                    LOG.note(format!("any {taken:04b} at {}", now(task)));
                }
            })
            .unwrap();
            all.start(boot, Priority::P2, |task| {
                loop {
                    FLAGS.wait_all(task, 0b1100);
                    LOG.note(format!("all at {}", now(task)));
                }
            })
            .unwrap();
        },
        |interrupt, tick| match tick {
            1 => FLAGS.set(interrupt, 0b0100),
            2 => FLAGS.set(interrupt, 0b0001),
            3 => FLAGS.set(interrupt, 0b1010),
            4 => FLAGS.set(interrupt, 0b1111),
            _ => {}
        },
    );
    LOG.expect(&["any 0001 at 2", "all at 3", "any 0010 at 3", "all at 4", "any 0011 at 4"]);
}

#[test]
fn who_sets_flags_lets_a_higher_task_that_waits_for_them_run_at_once() {
    static LOG: Log = Log::new();
    static FLAGS: EventFlags = EventFlags::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    host::run_for(
        0,
        |boot| {
            HIGH.start(boot, Priority::P1, |task| {
                FLAGS.wait_all(task, 1);
                LOG.note("high");
            })
            .unwrap();
            LOW.start(boot, Priority::P2, |task| {
                FLAGS.set(task, 1);
                LOG.note("low");
            })
            .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["high", "low"]);
}

#[test]
fn flags_that_are_set_as_a_wait_begins_end_it_though_another_task_waits_for_others() {
    static FLAGS: EventFlags = EventFlags::new();
    let waits: [fn(&mut Task) -> u8; 4] = [
        |task| FLAGS.wait_any(task, 1),
        |task| {
            FLAGS.wait_all(task, 1);
            1
        },
        |task| FLAGS.wait_any_timeout(task, 1, 9).unwrap(),
        |task| FLAGS.wait_all_timeout(task, 1, 9).map(|()| 1).unwrap(),
    ];
    for (number, wait) in waits.into_iter().enumerate() {
        // After it has found no flag, and before it is in the queue.
        for section in [1, 2] {
            let log: &Log = Box::leak(Box::new(Log::new()));
            let [other, waiter]: [&Stack<0>; 2] = [(); 2].map(|()| &*Box::leak(Box::new(Stack::new())));
            host::run_for(
                1,
                |boot| {
                    other.start(boot, Priority::P1, |task| FLAGS.wait_any(task, 2)).unwrap();
                    let body = move |task: &mut Task| {
                        let sets = |interrupt: &mut Interrupt| FLAGS.set(interrupt, 1);
                        let taken = host::interrupted(section, sets, || wait(task));
                        log.note(format!("wait {number} took {taken}"));
                    };
                    waiter.start(boot, Priority::P3, body).unwrap();
                },
                |_, _| {},
            );
            log.expect(&[&format!("wait {number} took 1")]);
        }
    }
}

#[test]
fn changes_of_other_flags_do_not_shorten_a_timeout() {
    static LOG: Log = Log::new();
    static STACKS: [Stack<0>; 2] = [const { Stack::new() }; 2];
    static FLAGS: EventFlags = EventFlags::new();
    host::run_for(
        100,
        |boot| {
            let any = |task: &mut Task| {
                for _ in 0..3 {
                    let result = FLAGS.wait_any_timeout(task, 1 | 4, 20);
                    LOG.note(format!("any: {result:?} at {}", now(task)));
                }
                idle(task)
            };
            STACKS[0].start(boot, Priority::P2, any).unwrap();
            let all = |task: &mut Task| {
                for _ in 0..2 {
                    let result = FLAGS.wait_all_timeout(task, 8 | 16, 30);
                    LOG.note(format!("all: {result:?} at {}", now(task)));
                }
                idle(task)
            };
            STACKS[1].start(boot, Priority::P3, all).unwrap();
        },
        |interrupt, tick| match tick {
            5 | 28 | 32 => FLAGS.set(interrupt, 2),
            10 => FLAGS.set(interrupt, 8),
            15 => FLAGS.set(interrupt, 4 | 2),
            45 => FLAGS.set(interrupt, 16 | 1),
            _ => {}
        },
    );
    LOG.expect(&[
        "any: Ok(4) at 15",
        "all: Err(Elapsed) at 30",
        "any: Err(Elapsed) at 35",
        "any: Ok(1) at 45",
        "all: Ok(()) at 45",
    ]);
}

/// Runs a task above the ceiling P3, and one below it.
fn run_two(
    [above, below]: [&'static Stack<0>; 2],
    high: fn(&mut Task) -> kernel::Never,
    low: fn(&mut Task) -> kernel::Never,
) {
    host::run_for(
        1,
        |boot| {
            above.start(boot, Priority::P2, high).unwrap();
            below.start(boot, Priority::P4, low).unwrap();
        },
        |_, _| {},
    );
}

/// A task above the ceiling locks while a lower one has the value.
#[test]
fn a_mutex_that_does_not_come_in_time_is_not_had() {
    static LOG: Log = Log::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static GO: Semaphore = Semaphore::new(0);
    static TOTAL: kernel::Mutex<u8> = kernel::Mutex::new(Priority::P3, 0);
    fn high(task: &mut Task) -> kernel::Never {
        loop {
            GO.wait(task);
            let result = TOTAL.lock_timeout(task, 10).map(|mut total| *total += 1);
            LOG.note(format!("{result:?} at {}", now(task)));
            // This would be refused if the task had a mutex.
            LOG.note(format!("{:?}", HIGH.task().suspend(task)));
        }
    }
    fn low(task: &mut Task) -> kernel::Never {
        let total = TOTAL.lock(task);
        host::interrupt(|interrupt| GO.post(interrupt));
        (0..15).for_each(|_| host::interrupt(host::tick));
        drop(total);
        HIGH.task().resume(task);
        let total = TOTAL.lock(task);
        host::interrupt(|interrupt| GO.post(interrupt));
        (0..5).for_each(|_| host::interrupt(host::tick));
        drop(total);
        HIGH.task().resume(task);
        LOG.note(format!("{}", *TOTAL.lock(task)));
        idle(task)
    }
    run_two([&HIGH, &LOW], high, low);
    LOG.expect(&["Err(Elapsed) at 10", "Ok(())", "Ok(()) at 20", "Ok(())", "1"]);
}

/// A task above the ceiling tries the mutex while a lower one has the value.
#[test]
fn a_mutex_that_another_task_has_stays_with_that_when_it_is_tried() {
    static LOG: Log = Log::new();
    static HIGH: Stack<0> = Stack::new();
    static LOW: Stack<0> = Stack::new();
    static GO: Semaphore = Semaphore::new(0);
    static TOTAL: kernel::Mutex<u8> = kernel::Mutex::new(Priority::P3, 0);
    fn high(task: &mut Task) -> kernel::Never {
        loop {
            GO.wait(task);
            for _ in 0..2 {
                let has_come = TOTAL.try_lock(task).map(|mut total| *total += 1).is_some();
                LOG.note(format!("{has_come}"));
            }
        }
    }
    fn low(task: &mut Task) -> kernel::Never {
        let total = TOTAL.lock(task);
        host::interrupt(|interrupt| GO.post(interrupt));
        drop(total);
        host::interrupt(|interrupt| GO.post(interrupt));
        LOG.note(format!("{}", *TOTAL.lock(task)));
        idle(task)
    }
    run_two([&HIGH, &LOW], high, low);
    LOG.expect(&["false", "false", "true", "true", "2"]);
}
