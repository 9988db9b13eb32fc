//! Messages: pools, queues, and what happens when they are full.

mod log;

use kernel::{
    Boot, Exhausted, Full, Interrupt, LONGEST, Message, Pipe, Priority, Queue, Semaphore, Stack, Task, host,
};
use log::Log;

/// Runs `body` as the only task, and checks that it comes to its end.
fn run_to_its_end(stack: &'static Stack<0>, log: &'static Log, body: fn(&mut Task)) {
    host::run_for(
        1,
        |boot: &mut Boot| {
            stack
                .start(boot, Priority::P1, move |task| {
                    body(task);
                    log.note("done");
                    loop {
                        task.delay(LONGEST);
                    }
                })
                .unwrap();
        },
        |_, _| {},
    );
    log.expect(&["done"]);
}

#[test]
fn messages_arrive_in_order_and_wake_the_receiver() {
    struct Reading(u8);
    kernel::pool!(Reading, 4);
    static LOG: Log = Log::new();
    static READINGS: Queue<Reading> = Queue::new(4);
    static RECEIVER: Stack<0> = Stack::new();
    static SENDER: Stack<0> = Stack::new();
    host::run_for(
        1,
        |boot: &mut Boot| {
            RECEIVER
                .start(boot, Priority::P1, |task| {
                    loop {
                        LOG.note(format!("received {}", READINGS.receive(task).0));
                    }
                })
                .unwrap();
            SENDER
                .start(boot, Priority::P2, |task| {
                    for value in 0..3 {
                        let message = Message::new(task, Reading(value))
                            .unwrap_or_else(|_| panic!("the pool has room"));
                        assert!(READINGS.send(task, message).is_ok());
                        LOG.note(format!("sent {value}"));
                    }
                    loop {
                        task.delay(LONGEST);
                    }
                })
                .unwrap();
        },
        |_, _| {},
    );
    LOG.expect(&["received 0", "sent 0", "received 1", "sent 1", "received 2", "sent 2"]);
}

#[test]
fn a_full_queue_and_an_empty_pool_give_the_value_back_and_count() {
    struct Parcel(u8);
    kernel::pool!(Parcel, 3);
    static QUEUE: Queue<Parcel> = Queue::new(2);
    static LOG: Log = Log::new();
    static TASK: Stack<0> = Stack::new();
    run_to_its_end(&TASK, &LOG, |task| {
        let make = |task: &mut Task, value| Message::new(task, Parcel(value)).ok().unwrap();
        for value in 0..2 {
            let parcel = make(task, value);
            assert!(QUEUE.send(task, parcel).is_ok());
        }
        let third = make(task, 2);
        let Err(Full(third)) = QUEUE.send(task, third) else { panic!("there is room for two") };
        assert_eq!(third.0, 2);
        assert_eq!(QUEUE.refused(task), 1);
        let Err(Exhausted(fourth)) = Message::new(task, Parcel(3)) else { panic!("the pool has three") };
        assert_eq!(fourth.0, 3);

        drop(third);
        let parcel = make(task, 4);
        assert_eq!(QUEUE.try_receive(task).map(|parcel| parcel.0), Some(0));
        assert!(QUEUE.send(task, parcel).is_ok());
        assert_eq!(QUEUE.receive(task).0, 1);
        assert_eq!(QUEUE.receive(task).0, 4);
        assert!(QUEUE.try_receive(task).is_none());
        use kernel::Pooled;
        assert_eq!(Parcel::pool().exhausted(task), 1);
        assert_eq!(Parcel::pool().most_used(task), 3);
    });
}

#[test]
fn what_leaves_places_finds_room_only_beside_them() {
    struct Parcel;
    kernel::pool!(Parcel, 3);
    static QUEUE: Queue<Parcel> = Queue::new(3);
    static LOG: Log = Log::new();
    static TASK: Stack<0> = Stack::new();
    run_to_its_end(&TASK, &LOG, |task| {
        let mut send = |places| {
            let parcel = Message::new(task, Parcel).ok().expect("the pool has three");
            QUEUE.send_leaving(places, task, parcel).is_ok()
        };
        assert_eq!([4, 3, 2, 2, 1, 1, 0].map(&mut send), [false, false, true, false, true, false, true]);
        assert_eq!(QUEUE.refused(task), 4);
    });
}

#[test]
fn an_interrupt_sends_and_a_dropped_message_drops_its_value() {
    use std::sync::Arc;
    struct Shared(Arc<()>);
    kernel::pool!(Shared, 2);
    static QUEUE: Queue<Shared> = Queue::new(2);
    static LOG: Log = Log::new();
    static TASK: Stack<0> = Stack::new();
    let value = Arc::new(());
    host::run_for(
        4,
        |boot: &mut Boot| {
            TASK.start(boot, Priority::P1, |task| {
                loop {
                    let message = QUEUE.receive(task);
                    LOG.note(format!("{}", Arc::strong_count(&message.0)));
                }
            })
            .unwrap();
        },
        |interrupt, _| {
            let message = Message::new(interrupt, Shared(value.clone())).ok().unwrap();
            assert!(QUEUE.send(interrupt, message).is_ok());
        },
    );
    LOG.expect(&["2", "2", "2", "2"]);
    assert_eq!(Arc::strong_count(&value), 1);
}

#[test]
fn a_fifo_wraps_and_counts_what_it_lost() {
    static FIFO: kernel::Fifo<3> = kernel::Fifo::new();
    host::run_for(
        1,
        |_| {},
        |interrupt, _| {
            for round in 0..5u8 {
                assert_eq!(FIFO.put(interrupt, round), Some(2));
                assert_eq!(FIFO.put(interrupt, round + 1), Some(1));
                assert_eq!(FIFO.put(interrupt, round + 2), Some(0));
                assert_eq!(FIFO.put(interrupt, 99), None);
                for expected in [Some(round), Some(round + 1), Some(round + 2), None] {
                    assert_eq!(FIFO.take(interrupt), expected);
                }
            }
            assert_eq!(FIFO.overruns(interrupt), 5);
        },
    );
}

/// `MIDDLE`, which computes, preempts `LOW` in the middle of `send`; what an interrupt sends meanwhile must
/// not wait for `LOW`.
#[test]
fn what_an_interrupt_sends_does_not_wait_for_a_low_task_that_sends() {
    struct Parcel(&'static str);
    kernel::pool!(Parcel, 4);
    static QUEUE: Queue<Parcel> = Queue::new(4);
    static PIPE: Pipe<4> = Pipe::new();
    static GO: Semaphore = Semaphore::new(0);
    static STACKS: [Stack<0>; 4] = [const { Stack::new() }; 4];
    static LOG: Log = Log::new();
    host::run_for(
        1,
        |boot| {
            let [messages, bytes, middle, low] = &STACKS;
            let receive = |task: &mut Task| {
                loop {
                    let message = QUEUE.receive(task);
                    LOG.note(message.0);
                }
            };
            messages.start(boot, Priority::P1, receive).unwrap();
            let take = |task: &mut Task| {
                loop {
                    let byte = PIPE.take(task);
                    LOG.note(format!("byte {byte}"));
                }
            };
            bytes.start(boot, Priority::P1, take).unwrap();
            let compute = |task: &mut Task| {
                loop {
                    GO.wait(task);
                    host::interrupt(|interrupt| {
                        let message = Message::new(interrupt, Parcel("the interrupt's")).ok().unwrap();
                        assert!(QUEUE.send(interrupt, message).is_ok());
                        assert!(PIPE.try_put(interrupt, 2));
                    });
                    LOG.note("has computed");
                }
            };
            middle.start(boot, Priority::P3, compute).unwrap();
            let send = |task: &mut Task| {
                let message = Message::new(task, Parcel("the task's")).ok().unwrap();
                let wake = |interrupt: &mut Interrupt| GO.post(interrupt);
                assert!(host::interrupted(1, wake, || QUEUE.send(task, message)).is_ok());
                host::interrupted(2, wake, || PIPE.put(task, 1));
                loop {
                    task.delay(LONGEST);
                }
            };
            low.start(boot, Priority::P5, send).unwrap();
        },
        |_, _| {},
    );
    let both = ["the task's", "the interrupt's", "byte 2", "has computed"];
    let again = ["byte 1", "the interrupt's", "byte 2", "has computed"];
    LOG.expect(&[both, again].concat());
}

#[test]
fn what_is_in_a_queue_that_is_dropped_goes_back_to_its_pool() {
    #[expect(dead_code, reason = "a value that fills a place")]
    struct Parcel(u8);
    kernel::pool!(Parcel, 2);
    host::run_for(
        1,
        |boot| {
            for _ in 0..2 {
                let queue = Queue::new(2);
                for value in 0..2 {
                    let message = Message::new(boot, Parcel(value)).ok().expect("a free buffer");
                    assert!(queue.send(boot, message).is_ok());
                }
            }
        },
        |_, _| {},
    );
}

/// The signal that woke it is lost with it: docs/kernel.md, "Suspend, resume, end".
#[test]
fn what_has_woken_a_task_that_is_killed_stays_behind() {
    struct Reading(u8);
    kernel::pool!(Reading, 2);
    static READINGS: Queue<Reading> = Queue::new(2);
    static TYPED: Pipe<2> = Pipe::new();
    static SCREEN: Pipe<2> = Pipe::new();
    static TASKS: [Stack<0>; 3] = [const { Stack::new() }; 3];
    static BOSS: Stack<0> = Stack::new();
    static LOG: Log = Log::new();
    fn send(task: &mut Task, value: u8) {
        let message = Message::new(task, Reading(value)).unwrap_or_else(|_| panic!("the pool has room"));
        assert!(READINGS.send(task, message).is_ok());
    }
    let start = |boot: &mut Boot| {
        let [receiver, taker, putter] = &TASKS;
        receiver.start(boot, Priority::P5, |task| READINGS.receive(task).0).unwrap();
        taker.start(boot, Priority::P5, |task| TYPED.take(task)).unwrap();
        putter.start(boot, Priority::P5, |task| (0..3).for_each(|byte| SCREEN.put(task, byte))).unwrap();
        let boss = |task: &mut Task| {
            task.delay(1); // all three wait
            send(task, 1);
            assert!(TYPED.try_put(task, 1));
            assert_eq!(SCREEN.try_take(task), Some(0));
            for stack in &TASKS {
                stack.task().kill(task).unwrap();
            }
            assert!(READINGS.try_receive(task).is_none() && TYPED.try_take(task).is_none());
            send(task, 2);
            assert!(TYPED.try_put(task, 2));
            assert_eq!(READINGS.try_receive(task).map(|reading| reading.0), Some(1));
            assert_eq!(TYPED.try_take(task), Some(1));
            assert!(!SCREEN.try_put(task, 3) && SCREEN.space(task) == 1);
            LOG.note("done");
        };
        BOSS.start(boot, Priority::P3, boss).unwrap();
    };
    host::run_for(2, start, |_, _| {});
    LOG.expect(&["done"]);
}
