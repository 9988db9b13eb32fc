//! Control flow: branches, matches, calls through tables and pointers, recursion.

use core::hint::black_box;
use core::num::NonZero;

use crate::Checks;
use crate::random::Random;

pub fn run(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    branches(checks);
    calls(checks);
    values(checks);
}

fn branches(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    checks.check("match, dense", |random| dense(random.byte() & 15));
    checks.check("match, dense in 16 bits", |random| dense_words(random.word() % 12 + 1000));
    checks.check("match, sparse", |random| sparse(random.word() & 0x8181));
    checks.check("match, ranges", |random| ranges(random.word() as i16));
    checks.check("match, guards and tuples", |random| guards(random.byte(), random.byte() as i8));
    checks.check("test single bits", |random| bits(random.byte(), random.word()));
    checks.check("loops with breaks", |random| collatz(random.byte()));
    checks.check("short circuits", |random| {
        let [a, b, c] = random.bytes();
        (a > 1 && b > 1 || c > 1, a == 0 || b == 0 && c == 0, (a & b != 0) ^ (c & 0x80 != 0))
    });
}

#[inline(never)]
fn dense(value: u8) -> u16 {
    match value {
        0 => 7,
        1 => 0x1234,
        2 => dense_words(1003),
        3 => 99,
        4 => black_box(17),
        5 => 0xffff,
        6 => 6 * dense_words(1006),
        7 => 0x8000,
        8 => 0,
        9 => 512,
        10 => black_box(300) / 7,
        _ => 1,
    }
}

#[inline(never)]
fn dense_words(value: u16) -> u16 {
    match value {
        1000 => black_box(1),
        1001 => 4,
        1002 => black_box(9) + 1,
        1003 => 16,
        1004 => black_box(25) - 1,
        1005 => 36,
        1006 => black_box(49) * 3,
        1007 => 64,
        1008 => black_box(81) % 5,
        _ => value,
    }
}

#[inline(never)]
fn sparse(value: u16) -> u8 {
    match value {
        0 => 1,
        0x0001 => 2,
        0x0080 => 3,
        0x0081 => 4,
        0x0100 => 5,
        0x8000 => 6,
        0x8081 => 7,
        0x8180 => 8,
        0x8181 => 9,
        _ => 0,
    }
}

#[inline(never)]
fn ranges(value: i16) -> u8 {
    match value {
        i16::MIN..=-1000 => 1,
        -999..=-129 => 2,
        -128..=-1 => 3,
        0 => 4,
        1..=127 => 5,
        128..=255 => 6,
        256..=0x7eff => 7,
        _ => 8,
    }
}

#[inline(never)]
fn guards(a: u8, b: i8) -> i16 {
    match (a, b) {
        (0, 0) => 0,
        (0, b) if b < 0 => i16::from(b),
        (a @ 1..=127, _) if a & 1 == 1 => i16::from(a),
        (_, 1..) => 1000,
        (a, b) => i16::from(a) - i16::from(b),
    }
}

#[inline(never)]
fn bits(byte: u8, word: u16) -> u8 {
    let mut count = 0;
    if byte & 0x01 != 0 {
        count += 1;
    }
    if byte & 0x80 == 0 {
        count += 2;
    }
    if word & 0x0100 != 0 {
        count += 4;
    }
    if word & 0x8000 == 0 {
        count += 8;
    }
    if word & 0x0018 == 0x0018 {
        count += 16;
    }
    count
}

/// The number of steps of Collatz's sequence from `start` to 1.
#[inline(never)]
fn collatz(start: u8) -> u16 {
    let mut value = u32::from(start);
    for step in 0..200 {
        match value {
            0 | 1 => return step,
            even if even % 2 == 0 => value = even / 2,
            odd => value = odd * 3 + 1,
        }
    }
    u16::MAX
}

fn calls(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    checks.check("function pointers", |random| {
        let operation = black_box(OPERATIONS).get(usize::from(random.byte() & 3)).copied().unwrap_or(add);
        operation(random.word(), random.word())
    });
    checks.check("dynamic dispatch", |random| {
        let shapes: [&dyn Shape; 3] =
            [&Square(random.byte()), &Rectangle(random.byte(), random.word()), &Square(3)];
        let [a, b, c] = black_box(shapes);
        (a.area(), b.area(), c.area(), b.name(), a.twice())
    });
    checks.check("closures that hold values", |random| {
        let (a, b, mut sum) = (random.word(), random.byte(), 0u32);
        apply(&mut |value| sum = sum.wrapping_add(u32::from(value) * u32::from(a) + u32::from(b)));
        sum
    });
    checks.check("recursion", |random| (ackermann(2, random.byte() & 3), fibonacci(random.byte() & 7)));
    checks.check("many arguments", |random| {
        many(random.byte(), random.word(), 3, random.word().into(), random.byte(), 5, random.word(), 7, 8, 9)
    });
}

const OPERATIONS: [fn(u16, u16) -> u16; 4] = [add, subtract, multiply, divide];

fn add(a: u16, b: u16) -> u16 {
    a.wrapping_add(b)
}

fn subtract(a: u16, b: u16) -> u16 {
    a.wrapping_sub(b)
}

fn multiply(a: u16, b: u16) -> u16 {
    a.wrapping_mul(b)
}

fn divide(a: u16, b: u16) -> u16 {
    a.checked_div(b).unwrap_or(a)
}

trait Shape {
    fn area(&self) -> u32;

    fn name(&self) -> u8 {
        0x20
    }

    fn twice(&self) -> u32 {
        self.area() * 2
    }
}

struct Square(u8);
struct Rectangle(u8, u16);

impl Shape for Square {
    fn area(&self) -> u32 {
        u32::from(self.0) * u32::from(self.0)
    }
}

impl Shape for Rectangle {
    fn area(&self) -> u32 {
        u32::from(self.0) * u32::from(self.1)
    }

    fn name(&self) -> u8 {
        0x21
    }
}

#[inline(never)]
fn apply(function: &mut dyn FnMut(u16)) {
    for value in [0, 1, 255, 256, u16::MAX] {
        function(value);
    }
}

#[inline(never)]
fn ackermann(m: u8, n: u8) -> u8 {
    match (m, n) {
        (0, n) => n.wrapping_add(1),
        (m, 0) => ackermann(m - 1, 1),
        (m, n) => ackermann(m - 1, ackermann(m, n - 1)),
    }
}

#[inline(never)]
fn fibonacci(n: u8) -> u64 {
    if n < 2 { n.into() } else { fibonacci(n - 1) + fibonacci(n - 2) }
}

/// A function with more arguments than registers for them.
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "that is what it checks")]
fn many(a: u8, b: u16, c: u8, d: u64, e: u8, f: u32, g: u16, h: u8, i: u64, j: u8) -> u64 {
    let bytes = [a, c, e, h, j].into_iter().fold(0u64, |sum, byte| sum * 3 + u64::from(byte));
    (bytes + u64::from(b)).wrapping_mul(d ^ i).wrapping_sub(u64::from(f) << (g & 31))
}

fn values(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    checks.check("enums with values", |random| weigh(&event(random)));
    checks.check("options", |random| {
        let (a, b) = (NonZero::new(random.byte()), random.byte().checked_sub(2));
        (a, b, a.map(NonZero::get).zip(b), a.and_then(|a| b?.checked_add(a.get())), b.is_some_and(|b| b > 9))
    });
    checks.check("results", |random| total(&[random.byte(), random.byte(), random.byte()]));
    checks.check("structs returned in memory", |random| {
        let state = state(random.word(), random.byte());
        (state.sum, state.bytes, state.flag)
    });
    checks.check("arrays by value", |random| reversed(random.bytes::<13>()));
    checks.check("booleans kept and combined", |random| {
        let flags = random.bytes::<4>().map(|byte| byte > 0x40);
        (flags, flags.iter().all(|flag| *flag), flags.iter().filter(|flag| **flag).count())
    });
}

#[derive(Clone, Copy)]
enum Event {
    Idle,
    Byte(u8),
    Pair { low: u8, high: u16 },
    Time(u32),
    Long(i64),
}

#[inline(never)]
fn event(random: &mut Random) -> Event {
    match random.byte() % 5 {
        0 => Event::Idle,
        1 => Event::Byte(random.byte()),
        2 => Event::Pair { low: random.byte(), high: random.word() },
        3 => Event::Time(u32::from_le_bytes(random.bytes())),
        _ => Event::Long(i64::from_le_bytes(random.bytes())),
    }
}

#[inline(never)]
fn weigh(event: &Event) -> i64 {
    match *event {
        Event::Idle => -1,
        Event::Byte(byte) => byte.into(),
        Event::Pair { low, high } => i64::from(high) - i64::from(low),
        Event::Time(time) => i64::from(time) << 8,
        Event::Long(long) => long.wrapping_neg(),
    }
}

#[inline(never)]
fn total(bytes: &[u8]) -> Result<u8, u16> {
    let mut total = 0u8;
    for (index, byte) in (0u16..).zip(bytes) {
        total = total.checked_add(*byte).ok_or(index)?;
    }
    Ok(total)
}

struct State {
    sum: u64,
    bytes: [u8; 5],
    flag: bool,
}

#[inline(never)]
fn state(word: u16, byte: u8) -> State {
    let [low, high] = word.to_be_bytes();
    State { sum: u64::from(word) * 0x1_0001, bytes: [byte, low, byte, high, !byte], flag: low > high }
}

#[inline(never)]
fn reversed<const N: usize>(mut bytes: [u8; N]) -> [u8; N] {
    bytes.reverse();
    bytes
}
