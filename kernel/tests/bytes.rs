//! Bytes: FIFOs, and pipes on which tasks wait.

mod log;

use kernel::{Context, Fifo, LONGEST, MaskedCell, Pipe, Priority, Stack, Task, host, now};
use log::Log;

fn idle(task: &mut Task) -> kernel::Never {
    loop {
        task.delay(LONGEST);
    }
}

#[test]
fn a_fifo_keeps_order_all_around_and_counts_what_finds_no_space() {
    static FIFO: Fifo<3> = Fifo::new();
    static TASK: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot| {
            TASK.start(boot, Priority::P3, |task| {
                for round in 0..5 {
                    assert_eq!((FIFO.length(task), FIFO.space(task), FIFO.peek(task)), (0, 3, None));
                    assert_eq!(FIFO.put(task, round), Some(2));
                    assert_eq!(FIFO.put(task, 10), Some(1));
                    assert_eq!((FIFO.length(task), FIFO.space(task), FIFO.peek(task)), (2, 1, Some(round)));
                    assert_eq!(
                        (FIFO.take(task), FIFO.take(task), FIFO.take(task)),
                        (Some(round), Some(10), None)
                    );
                }
                for byte in 0..5 {
                    FIFO.put(task, byte);
                }
                assert_eq!((FIFO.overruns(task), FIFO.take(task)), (2, Some(0)));
                FIFO.flush(task);
                assert_eq!((FIFO.length(task), FIFO.take(task)), (0, None));
                assert_eq!((FIFO.put(task, 7), FIFO.take(task)), (Some(2), Some(7)));
                idle(task)
            })
            .unwrap();
        },
        |_, _| {},
    );
}

#[test]
fn who_puts_into_a_full_pipe_waits_for_space_and_is_served_by_priority() {
    static LOG: Log = Log::new();
    static PIPE: Pipe<2> = Pipe::new();
    static PUTTERS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static TAKER: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot| {
            for (stack, (priority, bytes)) in
                PUTTERS.iter().zip([(Priority::P3, b"abc"), (Priority::P4, b"def"), (Priority::P2, b"ghi")])
            {
                stack
                    .start(boot, priority, move |task| {
                        for byte in bytes {
                            PIPE.put(task, *byte);
                            LOG.note(format!("put {}", char::from(*byte)));
                        }
                        idle(task)
                    })
                    .unwrap();
            }
            TAKER
                .start(boot, Priority::P7, |task| {
                    for _ in 0..9 {
                        let byte = PIPE.take(task);
                        LOG.note(format!("took {}", char::from(byte)));
                    }
                    assert_eq!((PIPE.space(task), PIPE.try_take(task), PIPE.overruns(task)), (2, None, 0));
                    LOG.note("empty");
                    idle(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&[
        "put g", "put h", "put i", "took g", "put a", "took h", "put b", "took i", "put c", "took a",
        "put d", "took b", "put e", "took c", "put f", "took d", "took e", "took f", "empty",
    ]);
}

#[test]
fn an_interrupt_wakes_who_takes_and_what_finds_no_space_is_counted() {
    static LOG: Log = Log::new();
    static PIPE: Pipe<2> = Pipe::new();
    static TAKER: Stack<0> = Stack::new();
    host::run_for(
        10,
        |boot| {
            TAKER
                .start(boot, Priority::P3, |task| {
                    for _ in 0..2 {
                        let byte = PIPE.take(task);
                        LOG.note(format!("took {byte} at {}", now(task)));
                    }
                    task.delay(5);
                    let rest = [PIPE.take(task), PIPE.take(task)];
                    LOG.note(format!("then {rest:?} at {}, {} lost", now(task), PIPE.overruns(task)));
                    idle(task)
                })
                .unwrap();
        },
        |interrupt, tick| {
            if tick <= 5 {
                assert_eq!(PIPE.try_put(interrupt, tick as u8), tick < 5);
            }
        },
    );
    LOG.expect(&["took 1 at 1", "took 2 at 2", "then [3, 4] at 7, 1 lost"]);
}

#[test]
fn waits_for_a_byte_and_for_space_end_by_themselves() {
    static LOG: Log = Log::new();
    static PIPE: Pipe<1> = Pipe::new();
    static TASK: Stack<0> = Stack::new();
    host::run_for(
        30,
        |boot| {
            TASK.start(boot, Priority::P3, |task| {
                let taken = PIPE.take_timeout(task, 5);
                LOG.note(format!("{taken:?} at {}", now(task)));
                let taken = PIPE.take_timeout(task, 10);
                LOG.note(format!("{taken:?} at {}", now(task)));
                let put = [PIPE.put_timeout(task, 1, 5), PIPE.put_timeout(task, 2, 5)];
                LOG.note(format!("{put:?} at {}", now(task)));
                assert_eq!((PIPE.peek(task), PIPE.length(task), PIPE.try_take(task)), (Some(1), 1, Some(1)));
                assert_eq!(PIPE.try_take(task), None);
                idle(task)
            })
            .unwrap();
        },
        |interrupt, tick| {
            if tick == 8 {
                assert!(PIPE.try_put(interrupt, 42));
            }
        },
    );
    LOG.expect(&["Err(Elapsed) at 5", "Ok(42) at 8", "[Ok(()), Err(Elapsed)] at 13"]);
}

#[test]
fn a_flush_drops_also_what_waits_to_be_put() {
    static PIPE: Pipe<2> = Pipe::new();
    static PUTTER: Stack<0> = Stack::new();
    static FLUSHER: Stack<0> = Stack::new();
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            PUTTER
                .start(boot, Priority::P3, |task| {
                    for byte in 0..5 {
                        PIPE.put(task, byte);
                    }
                    LOG.note("put");
                    idle(task)
                })
                .unwrap();
            FLUSHER
                .start(boot, Priority::P5, |task| {
                    PIPE.flush(task);
                    assert_eq!((PIPE.length(task), PIPE.space(task)), (0, 2));
                    LOG.note("flushed");
                    idle(task)
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["put", "flushed"]);
}

#[test]
fn a_count_stays_at_its_largest_value() {
    static COUNT: MaskedCell<u16> = MaskedCell::new(u16::MAX - 1);
    host::run_for(
        0,
        |boot| {
            let counts = [(); 3].map(|()| {
                boot.mask(|masked| {
                    COUNT.count(masked);
                    COUNT.get(masked)
                })
            });
            assert_eq!(counts, [u16::MAX; 3]);
        },
        |_, _| {},
    );
}
