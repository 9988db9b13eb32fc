//! The joints' task, on their plants: when it controls them, when it only looks, its counts and its news.

use std::sync::{Arc, Mutex, MutexGuard};

use kernel::{Priority, Semaphore, Stack, Task, Ticks, host};
use plants::joint::{Joint as Plant, PotentiometerFault, counts};
use tasks::device::JointMotors;
use tasks::motor::FULL_DRIVE;
use tasks::motor::joint::{Joint, Reading, State};
use tasks::motor::joints::{Joints, Order, WATCH};
use tasks::motor::task::{self as motor, Motors};
use tasks::superbot::JOINT;

/// Two joints, and the task's calls on their motors.
struct World {
    joints: [Plant; 2],
    /// What was measured last. A period measures while it goes on, so its measurement is there when it ends.
    readings: [Reading; 2],
    drives: [i16; 2],
    /// Posted each millisecond while the joints are controlled.
    period: Option<&'static Semaphore>,
    /// Whether a period goes on.
    is_measuring: bool,
    /// How often control began, and how often the joints were looked at without it.
    begun: u32,
    looked: u32,
    /// How long a look takes, and how many periods pass at once.
    look_ticks: Ticks,
    at_once: u32,
}

#[derive(Clone)]
struct Board(Arc<Mutex<World>>);

impl Board {
    fn world(&self) -> MutexGuard<'_, World> {
        self.0.lock().expect("no test panicked with it")
    }
}

impl World {
    fn measure(&mut self) {
        self.readings = [0, 1].map(|joint: usize| {
            let plant = &self.joints[joint];
            let [potentiometer, current] = [plant.potentiometer_volts(), plant.current_volts()].map(counts);
            Reading { potentiometer, current }
        });
    }
}

impl JointMotors for Board {
    fn begin(&mut self, _: &mut Task, period: &'static Semaphore) {
        let mut world = self.world();
        world.begun += 1;
        world.period = Some(period);
    }

    fn end(&mut self, _: &mut Task) {
        self.world().period = None;
    }

    fn look(&mut self, task: &mut Task) {
        let ticks = self.world().look_ticks;
        self.world().looked += 1;
        task.delay(ticks);
        self.world().measure();
    }

    fn reading(&self, _: &mut Task, joint: usize) -> Reading {
        self.world().readings[joint]
    }

    fn drive(&mut self, _: &mut Task, joint: usize, drive: i16) {
        self.world().drives[joint] = drive;
    }

    fn done(&mut self) {}
}

/// A client that gives orders to joints.
struct Client<'a> {
    task: &'a mut Task,
    motors: &'static Motors<2>,
    news: &'static Semaphore,
    board: Board,
}

impl Client<'_> {
    fn turn(&mut self, joint: usize, angle: i16) {
        self.motors.order(self.task, joint, Order::Turn { angle, speed: 90 });
    }

    /// How often there was news within so many ticks. Checks at each tick that the task is in time.
    fn news(&mut self, ticks: Ticks) -> u32 {
        let mut news = 0;
        for _ in 0..ticks {
            self.task.delay(1);
            while self.news.try_wait(self.task) {
                news += 1;
            }
            assert!(self.motors.is_in_time(self.task));
        }
        news
    }

    fn states(&mut self) -> [State; 2] {
        [0, 1].map(|joint| self.motors.state(self.task, joint).expect("it is here"))
    }

    /// Periods so far.
    fn periods(&mut self) -> u16 {
        self.motors.counters(self.task).periods
    }
}

/// Runs `script` beside the joints' task.
fn run(script: fn(&mut Client)) {
    fn forever<T>(value: T) -> &'static T {
        Box::leak(Box::new(value))
    }
    let board = Board(Arc::new(Mutex::new(World {
        joints: [0.0, 10.0].map(Plant::at),
        readings: [Reading { potentiometer: 0, current: 0 }; 2],
        is_measuring: false,
        drives: [0; 2],
        period: None,
        begun: 0,
        looked: 0,
        look_ticks: 2,
        at_once: 1,
    })));
    let (motors, news) = (forever(Motors::new()), forever(Semaphore::new(0)));
    let [joints, client] = [0; 2].map(|_| forever(Stack::<4000>::new()));
    let done = Arc::new(Mutex::new(false));
    let (is_done, in_tick, of_task) = (Arc::clone(&done), board.clone(), board.clone());
    host::run_for(
        20_000,
        move |boot| {
            let control = move |task: &mut Task| {
                motor::run(task, motors, Joints::new([0; 2].map(|_| Joint::new(JOINT))), of_task, news)
            };
            joints.start(boot, Priority::P0, control).expect("the stack is free");
            let play = move |task: &mut Task| {
                script(&mut Client { task, motors, news, board });
                *is_done.lock().expect("no test panicked with it") = true;
                loop {
                    task.delay(1_000);
                }
            };
            client.start(boot, Priority::P4, play).expect("the stack is free");
        },
        move |interrupt, _| {
            let mut world = in_tick.world();
            for _ in 0..20 {
                for joint in 0..2 {
                    let duty = f64::from(world.drives[joint]) / f64::from(FULL_DRIVE);
                    world.joints[joint].step(duty, 0.000_05);
                }
            }
            if world.is_measuring {
                world.measure();
            }
            world.is_measuring = world.period.is_some();
            if let Some(period) = world.period {
                for _ in 0..world.at_once {
                    period.post(interrupt);
                }
            }
        },
    );
    assert!(*done.lock().expect("no test panicked with it"), "the script takes too long");
}

#[test]
fn joints_that_are_off_are_left_alone() {
    run(|client| {
        assert_eq!(client.news(500), 0);
        let world = client.board.world();
        assert_eq!((world.begun, world.looked), (0, 0));
    });
}

#[test]
fn a_joint_is_controlled_in_each_period_until_all_are_at_rest_and_its_arrival_is_news_once() {
    run(|client| {
        client.turn(0, 300);
        assert_eq!(client.news(100), 0);
        assert_eq!(client.states(), [State::Moving, State::Off]);
        let before = client.periods();
        client.news(100);
        assert_eq!(client.periods() - before, 100);
        assert_eq!(client.news(3_000), 1);
        assert_eq!(client.states(), [State::Arrived, State::Off]);
        assert!((client.motors.angle(client.task, 0).expect("it is known") - 300).abs() <= 3);
        // It was begun once, and has ended.
        assert_eq!(client.board.world().begun, 1);
        let before = client.periods();
        client.news(100);
        assert_eq!((client.periods(), client.motors.counters(client.task).missed), (before, 0));

        // One joint rests while the other moves.
        client.turn(1, 500);
        client.news(300);
        assert_eq!(client.states(), [State::Arrived, State::Moving]);
        assert_eq!(client.board.world().begun, 2);
        client.news(3_000);
        assert_eq!(client.states(), [State::Arrived; 2]);
    });
}

#[test]
fn an_order_is_begun_with_whenever_it_comes() {
    run(|client| {
        // The first order comes before the first period, or in one of the next; the other joint gets its own.
        for ticks in 0..4 {
            client.turn(0, 300);
            client.news(ticks);
            client.turn(1, 500);
            client.news(5);
            assert_eq!(client.states(), [State::Moving; 2]);
            let driven = client.board.world().drives;
            assert!(driven.iter().all(|&drive| drive > 0), "{ticks} ticks later: {driven:?}");
            for joint in 0..2 {
                client.motors.order(client.task, joint, Order::Relax);
            }
            client.news(5);
            assert_eq!((client.states(), client.board.world().drives), ([State::Off; 2], [0; 2]));
        }
        assert_eq!(client.motors.counters(client.task).missed, 0);
    });
}

#[test]
fn two_joints_that_arrive_in_the_same_period_are_news() {
    run(|client| {
        client.board.world().joints = [0.0; 2].map(Plant::at);
        client.turn(0, 300);
        client.turn(1, 300);
        assert_eq!(client.news(3_000), 1);
        assert_eq!(client.states(), [State::Arrived; 2]);
    });
}

#[test]
fn a_joint_at_rest_is_looked_at_and_held_where_somebody_moves_it() {
    run(|client| {
        client.turn(0, 0);
        client.news(1_000);
        let before = client.board.world().looked;
        // A look takes two ticks, and the task is in time as long as a look takes no longer than that.
        client.news(10 * (WATCH + 2));
        assert_eq!(client.board.world().looked - before, 10);
        client.board.world().look_ticks = WATCH - 4;
        client.news(10 * WATCH);
        client.board.world().look_ticks = 2;

        client.board.world().joints[0] = Plant::at(5.0);
        let periods = client.periods();
        client.news(1_500);
        assert!(client.periods() - periods > 50);
        assert!(client.board.world().joints[0].degrees().abs() < 0.5);
    });
}

#[test]
fn periods_that_passed_meanwhile_are_counted_as_missed() {
    run(|client| {
        client.turn(0, 600);
        client.news(50);
        let before = client.motors.counters(client.task);
        client.board.world().at_once = 3;
        client.news(10);
        client.board.world().at_once = 1;
        client.news(1);
        let after = client.motors.counters(client.task);
        assert_eq!((after.missed - before.missed, after.periods - before.periods), (20, 11));
    });
}

#[test]
fn a_task_whose_periods_do_not_come_is_not_in_time() {
    run(|client| {
        client.turn(0, 600);
        client.news(50);
        client.board.world().at_once = 0;
        client.task.delay(50);
        assert!(!client.motors.is_in_time(client.task));
        client.board.world().at_once = 1;
        client.task.delay(2);
        client.news(50);
    });
}

#[test]
fn a_signal_left_over_from_before_rest_stands_for_no_measurement() {
    run(|client| {
        client.news(10);
        client.motors.period().post(client.task);
        let before = client.periods();
        client.turn(0, 300);
        client.task.delay(1);
        assert_eq!(client.periods(), before, "computed before anything was measured");
        client.news(50);
    });
}

/// A joint at rest is looked at each 32 ms, and a push turns it further than its motor could.
#[test]
fn a_joint_that_was_pushed_since_the_last_look_is_not_broken_when_an_order_comes() {
    run(|client| {
        client.turn(0, 300);
        client.news(4_000);
        for joint in [1, 0] {
            assert_eq!(client.states()[0], State::Arrived);
            client.board.world().joints[0] = Plant::at(40.0);
            client.turn(joint, 300);
            client.news(4_000);
            assert_eq!(client.states(), [State::Arrived; 2], "an order to joint {joint}");
        }
    });
}

/// The last measurement may be of long ago, and at first there is none.
#[test]
fn a_joint_that_is_off_and_is_to_stay_stays_where_it_is() {
    run(|client| {
        for degrees in [10.0, -30.0] {
            client.board.world().joints[1] = Plant::at(degrees);
            client.motors.order(client.task, 1, Order::TurnBy { by: 0, speed: 60 });
            client.news(500);
            let now = client.board.world().joints[1].degrees();
            assert!((now - degrees).abs() < 0.3, "{now} in place of {degrees}");
            client.motors.order(client.task, 1, Order::Relax);
            client.news(100);
        }
    });
}

/// Else it would turn to where nobody wants it.
#[test]
fn a_joint_that_is_to_stay_where_it_is_and_can_not_be_measured_turns_nowhere() {
    run(|client| {
        for (ticks, degrees) in (0..6).zip([40.0, -30.0].into_iter().cycle()) {
            let mut joint = Plant::at(degrees);
            joint.set_fault(Some(PotentiometerFault::Open));
            client.board.world().joints[1] = joint;
            client.motors.order(client.task, 1, Order::TurnBy { by: 0, speed: 60 });
            client.news(ticks);
            client.board.world().joints[1].set_fault(None);
            client.news(500);
            let now = client.board.world().joints[1].degrees();
            assert!((now - degrees).abs() < 0.3, "{ticks} ticks later: {now} in place of {degrees}");
            let state = if ticks < 2 { State::Arrived } else { State::BrokenPotentiometer };
            assert_eq!(client.states()[1], state, "{ticks} ticks later");
            client.motors.order(client.task, 1, Order::Relax);
            client.news(100);
        }
    });
}
