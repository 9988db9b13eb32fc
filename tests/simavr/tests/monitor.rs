//! The monitor, driven over a serial line.

use simavr_harness::{Character, Mcu, Place};
use superbot_tests_simavr::{MILLISECOND, image, mcu};

/// Types `line`, and returns the reply without its prompt.
fn ask(mcu: &mut Mcu, line: &str) -> String {
    ask_slowly(mcu, line, 0)
}

/// The same, with a pause of so many milliseconds after each character.
fn ask_slowly(mcu: &mut Mcu, line: &str, milliseconds: u64) -> String {
    let frame = mcu.usart_frame_cycles(0).expect("the transmitter is on");
    for value in line.bytes().chain([b'\r']) {
        let start = mcu.cycle();
        mcu.receive(0, Character { value, start, end: start + frame });
        mcu.run_until(start + frame + 100 + milliseconds * MILLISECOND);
    }
    let mut reply = String::new();
    let limit = mcu.cycle() + 1_000 * MILLISECOND;
    while !reply.ends_with("> ") {
        assert!(mcu.is_alive() && mcu.cycle() < limit, "{line}: {reply}");
        mcu.run_until(mcu.cycle() + frame);
        reply.extend(mcu.take_sent(0).iter().map(|character| char::from(character.value)));
    }
    reply.trim_end_matches("> ").to_owned()
}

/// The image's monitor, after its start.
fn monitor() -> Mcu {
    let mut mcu = mcu("board_monitor");
    mcu.run_until(100 * MILLISECOND);
    mcu
}

/// The program counter, with which the reply to `x` and `n` begins.
fn pc(reply: &str) -> u32 {
    let digits =
        reply.strip_prefix("pc ").and_then(|rest| rest.get(..6)).unwrap_or_else(|| panic!("{reply}"));
    u32::from_str_radix(digits, 16).expect("it is a number")
}

#[test]
fn tasks_are_listed_suspended_stepped_resumed_and_killed() {
    let mut mcu = monitor();
    let Place::Data(count) = image("board_monitor").symbol("COUNT").expect("there is one").place else {
        panic!("a variable in flash")
    };
    let word = |mcu: &Mcu| u16::from_le_bytes([count, count + 1].map(|at| mcu.read(at).expect("in SRAM")));

    let list = ask(&mut mcu, "l");
    let states: Vec<&str> =
        list.lines().map(|line| line.split(" sp ").next().expect("one at least")).collect();
    assert_eq!(
        states,
        ["00 MONITOR ready p2", "01 COUNTER ready p6", "02 WAITER waiting p4", "03 ABSENT not started"]
    );

    assert_eq!(ask(&mut mcu, &format!("w {count:x} 0 0")), "done\r\n");
    // While the task is suspended its stack is untouched, and its count stands still.
    assert_eq!(ask(&mut mcu, "s COUNTER"), "done\r\n");
    let stopped_at = word(&mcu);
    assert!((1_000..60_000).contains(&stopped_at), "it has run: {stopped_at}");
    let [low, high] = stopped_at.to_le_bytes();
    let shown = format!("{count:04x} {low:02x} {high:02x}\r\n");
    assert_eq!(ask(&mut mcu, &format!("r {count:x} 2")), shown);
    assert_eq!(ask(&mut mcu, " r  1AF  1 "), ask(&mut mcu, "r 1af 1"));
    assert!(ask(&mut mcu, "l").contains("01 COUNTER suspended p6"));

    // Instruction by instruction, through one round and the next.
    let first = pc(&ask(&mut mcu, "x COUNTER"));
    for round in 1..=2 {
        let mut steps = 0;
        loop {
            let reply = ask(&mut mcu, "n COUNTER");
            assert_eq!(reply, ask(&mut mcu, "x 1"), "it stays where it is");
            steps += 1;
            if pc(&reply) == first {
                break;
            }
            assert!(steps < 30, "it does not come round: {reply}");
        }
        assert!(steps > 1, "more than one instruction");
        assert_eq!(word(&mcu), stopped_at + round);
    }

    assert_eq!(ask(&mut mcu, &format!("w {count:x} 34 12")), "done\r\n");
    assert_eq!(word(&mcu), 0x1234);
    assert_eq!(ask(&mut mcu, "p COUNTER 5"), "done\r\n");
    assert_eq!(ask(&mut mcu, "g COUNTER"), "done\r\n");
    mcu.run_until(mcu.cycle() + MILLISECOND);
    assert!((0x1235..0x8000).contains(&word(&mcu)), "it counts on: {:x}", word(&mcu));
    assert!(ask(&mut mcu, "l").contains("01 COUNTER ready p5"));

    assert_eq!(ask(&mut mcu, "k 1"), "done\r\n");
    let killed_at = word(&mcu);
    mcu.run_until(mcu.cycle() + MILLISECOND);
    assert_eq!(word(&mcu), killed_at);
    assert!(ask(&mut mcu, "l").contains("01 COUNTER killed p"));
}

#[test]
fn a_line_may_be_typed_with_pauses() {
    let mut mcu = monitor();
    let reply = ask(&mut mcu, "x WAITER");
    assert!(!reply.contains("no such command"), "{reply}");
    for pause in [2, 20] {
        let slowly = ask_slowly(&mut mcu, "x WAITER", pause);
        assert!(slowly.ends_with(&reply), "{slowly}");
    }
}

#[test]
fn mistakes_are_explained() {
    let mut mcu = monitor();
    for (line, reason) in [
        ("z", "h shows all"),
        ("r 12345", "4 hexadecimal digits"),
        ("r 1G", "4 hexadecimal digits"),
        ("r 1_", "4 hexadecimal digits"),
        ("l COUNTER", "too many words"),
        ("k  ABSENT \t \x0c now ", "too many words"),
        ("w 100", "something is missing"),
        ("s NOBODY", "l shows all"),
        ("s MONITOR", "the monitor itself"),
        ("n WAITER", "not now"),
        ("g WAITER", "it is not suspended"),
        ("k ABSENT", "no task runs there"),
        ("x ABSENT", "no task runs there"),
        ("n ABSENT", "no task runs there"),
        (&"w 100 1 ".repeat(10), "too long"),
    ] {
        let reply = ask(&mut mcu, line);
        assert!(reply.starts_with("? ") && reply.contains(reason), "{line}: {reply}");
    }
    // A waiting task can't be stepped, and its registers are not saved.
    assert_eq!(ask(&mut mcu, "s WAITER"), "done\r\n");
    assert!(ask(&mut mcu, "n WAITER").starts_with("? not now"));
    assert!(ask(&mut mcu, "x WAITER").starts_with("? it gave way by itself"));
    assert!(ask(&mut mcu, "h").contains("w ADDRESS BYTE"));
    // The monitor still serves.
    assert_eq!(ask(&mut mcu, "r 5b").len(), "005b 00\r\n".len());
}
