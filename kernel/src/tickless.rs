//! Tickless idle: while all tasks wait, the tick's timer interrupts only when the first deadline is due.
//!
//! The timer runs freely, and its compare unit interrupts at each tick. Before the idle task sleeps it moves
//! the compare value past all ticks at which nothing is due. The interrupt that ends the sleep, whichever it
//! is, counts the ticks that have passed before its handler runs. So tasks and handlers see the same time as
//! with an interrupt per tick, and nothing else in the kernel knows of this.

use crate::context::{Context, Interrupt};
use crate::critical::{Masked, MaskedCell};
use crate::timer::{self, NEXT_DEADLINE, TICKS, Ticks};

/// A free-running 16-bit timer with a compare interrupt. Its functions are called with interrupts masked.
pub trait TickTimer {
    /// Counts in a tick: 2 to 250.
    const COUNTS: u16;

    fn counter() -> u16;

    /// Makes the timer interrupt when the counter next reaches `at`.
    fn set_compare(at: u16);

    /// Clears a match whose interrupt has not occurred yet.
    fn forget_match();
}

/// The most ticks to the next interrupt. Together they are shorter than a turn of the timer.
const MOST: Ticks = 250;

/// Ticks from the last counted tick to the next interrupt.
static AHEAD: MaskedCell<Ticks> = MaskedCell::new(1);

/// The counter's value at the last counted tick.
static COUNTED: MaskedCell<u16> = MaskedCell::new(0);

/// Moves the compare value ahead, before the CPU sleeps.
///
/// # Safety
/// Only for the idle task, with interrupts masked.
#[doc(hidden)]
#[inline(always)]
pub unsafe fn before_sleep<T: TickTimer>() {
    // SAFETY: the caller guarantees that interrupts are masked.
    let masked = &unsafe { Masked::assume() };
    // If no timer is armed the deadline is up to a whole turn of the ticks ahead: 0 stands for 65,536.
    let behind_next_tick = NEXT_DEADLINE.get(masked).wrapping_sub(TICKS.get(masked)).wrapping_sub(1);
    let ahead = behind_next_tick.min(MOST - 1) + 1;
    let counted = COUNTED.get(masked);
    // Not if the next tick is about to come, or pending.
    let is_near = T::counter().wrapping_sub(counted) >= T::COUNTS - 1;
    if ahead <= 1 || AHEAD.get(masked) != 1 || is_near {
        return;
    }
    T::set_compare(counted.wrapping_add(ahead.wrapping_mul(T::COUNTS)));
    if T::counter().wrapping_sub(counted) >= T::COUNTS {
        // The tick came meanwhile: either its interrupt is pending, or the compare value was moved before the
        // match.
        T::forget_match();
        count::<T>(masked, 1);
        AHEAD.set(masked, ahead - 1);
        return;
    }
    AHEAD.set(masked, ahead);
}

/// Counts the ticks that have passed in the sleep, except for the one that interrupts. It must be called
/// before the handler of any interrupt runs, and does nothing if they are counted already. So an interrupt
/// that does not enter the kernel may call it before it reads the ticks.
///
/// # Safety
/// Only with interrupts masked, and with the timer that drives the tick.
#[doc(hidden)]
#[inline(always)]
pub unsafe fn after_sleep<T: TickTimer>() {
    // SAFETY: the caller guarantees that interrupts are masked.
    let masked = &unsafe { Masked::assume() };
    let ahead = AHEAD.get(masked);
    if ahead == 1 {
        return;
    }
    let counted = COUNTED.get(masked);
    let mut passed = whole_ticks::<T>(T::counter().wrapping_sub(counted), ahead - 1);
    let last = counted.wrapping_add(passed.wrapping_mul(T::COUNTS));
    if passed != ahead - 1 {
        T::set_compare(last.wrapping_add(T::COUNTS));
        if T::counter().wrapping_sub(last) >= T::COUNTS {
            // The next tick came just now: either its interrupt is pending, or it came before the compare
            // value was set. A match shows only when the counter goes on from there, so the match is cleared
            // after the compare value has moved.
            T::set_compare(last.wrapping_add(2 * T::COUNTS));
            T::forget_match();
            passed += 1;
        }
    }
    count::<T>(masked, passed);
}

/// The handler of the timer's interrupt.
///
/// # Safety
/// Only for that interrupt: it lets other interrupts nest.
#[doc(hidden)]
pub unsafe fn tick<T: TickTimer>(interrupt: &mut Interrupt) {
    const { assert!(2 <= T::COUNTS && T::COUNTS <= 250, "a tick has 2 to 250 counts") };
    interrupt.mask(|masked| {
        count::<T>(masked, AHEAD.get(masked));
        T::set_compare(COUNTED.get(masked).wrapping_add(T::COUNTS));
    });
    loop {
        let is_due = interrupt.mask(|masked| TICKS.get(masked) == NEXT_DEADLINE.get(masked));
        if is_due {
            // SAFETY: this is the tick's interrupt.
            unsafe { timer::expire() };
        }
        let is_late = interrupt.mask(|masked| {
            // The next tick has come meanwhile: either its interrupt is pending, or it came before the
            // compare value was set.
            let is_late = T::counter().wrapping_sub(COUNTED.get(masked)) >= T::COUNTS;
            if is_late {
                count::<T>(masked, 1);
                T::set_compare(COUNTED.get(masked).wrapping_add(T::COUNTS));
                T::forget_match(); // only now: see `after_sleep`
            }
            is_late
        });
        if !is_late {
            return;
        }
    }
}

/// Counts `ticks`; the next tick is to interrupt.
#[inline(always)]
fn count<T: TickTimer>(masked: &Masked, ticks: Ticks) {
    TICKS.set(masked, TICKS.get(masked).wrapping_add(ticks));
    COUNTED.set(masked, COUNTED.get(masked).wrapping_add(ticks.wrapping_mul(T::COUNTS)));
    AHEAD.set(masked, 1);
}

/// The number of whole ticks in `counts`, at most `most`, which is below 256. The AVR has no division.
#[inline(always)]
fn whole_ticks<T: TickTimer>(mut counts: u16, most: Ticks) -> Ticks {
    let mut ticks: u8 = 0;
    // The length of as many ticks as the present bit stands for.
    let mut length = T::COUNTS << 7;
    while length >= T::COUNTS {
        ticks <<= 1;
        if counts >= length {
            counts -= length;
            ticks |= 1;
        }
        length >>= 1;
    }
    Ticks::from(ticks).min(most)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::sync::atomic::{AtomicBool, AtomicU16, Ordering::Relaxed};
    use std::vec::Vec;

    use super::{AHEAD, COUNTED, TickTimer, tick, whole_ticks};
    use crate::critical::Masked;
    use crate::timer::TICKS;
    use crate::{Context, Interrupt, Priority, Semaphore, Stack, host};

    /// The state after a reset.
    fn begin(masked: &Masked) {
        AHEAD.set(masked, 1);
        COUNTED.set(masked, 0);
    }

    const COUNTS: u16 = 250;
    static COUNTER: AtomicU16 = AtomicU16::new(0);
    static COMPARE: AtomicU16 = AtomicU16::new(COUNTS);
    static HAS_MATCHED: AtomicBool = AtomicBool::new(false);

    fn count() {
        let counter = COUNTER.fetch_add(1, Relaxed).wrapping_add(1);
        if counter == COMPARE.load(Relaxed) {
            HAS_MATCHED.store(true, Relaxed);
        }
    }

    struct Timer;

    impl TickTimer for Timer {
        const COUNTS: u16 = COUNTS;

        /// Counts on at each read.
        fn counter() -> u16 {
            count();
            COUNTER.load(Relaxed)
        }

        fn set_compare(at: u16) {
            COMPARE.store(at, Relaxed);
        }

        fn forget_match() {
            HAS_MATCHED.store(false, Relaxed);
        }
    }

    #[test]
    fn a_tick_that_is_served_late_counts_those_that_have_passed() {
        static STACK: Stack<0> = Stack::new();
        static WOKEN: Semaphore = Semaphore::new(0);
        let start = |boot: &mut crate::Boot| {
            boot.mask(begin);
            let body = |task: &mut crate::Task| {
                loop {
                    task.delay(2);
                    WOKEN.post(task);
                }
            };
            STACK.start(boot, Priority::P3, body).unwrap();
        };
        let mut late = 0..800;
        let (mut counted, mut woken) = (0_u32, Vec::new());
        host::run(start, |interrupt| {
            let Some(late) = late.next() else { return false };
            let before = COUNTER.load(Relaxed);
            while !HAS_MATCHED.load(Relaxed) {
                count();
            }
            (0..late).for_each(|_| count());
            HAS_MATCHED.store(false, Relaxed); // as the vector is entered
            // SAFETY: this stands for the timer's interrupt.
            unsafe { tick::<Timer>(interrupt) };
            counted += u32::from(COUNTER.load(Relaxed).wrapping_sub(before));
            let ticks = interrupt.mask(|masked| TICKS.get(masked));
            let pending = u16::from(HAS_MATCHED.load(Relaxed));
            assert_eq!(u32::from(ticks + pending), counted / u32::from(COUNTS), "{late} counts late");
            woken.push(WOKEN.try_wait(interrupt));
            true
        });
        // An interrupt that is so late counts two ticks or more, so the delay is over each time.
        assert!(woken[260..].iter().all(|&woken| woken), "{woken:?}");
    }

    #[test]
    fn whole_ticks_are_those_of_a_division() {
        for counts in 0..=u16::MAX {
            assert_eq!(whole_ticks::<Timer>(counts, 249), (counts / Timer::COUNTS).min(249), "{counts}");
            assert_eq!(whole_ticks::<SlowCpu>(counts, 200), (counts / SlowCpu::COUNTS).min(200), "{counts}");
        }
    }

    static SLOW_COUNTER: AtomicU16 = AtomicU16::new(0);
    static SLOW_COMPARE: AtomicU16 = AtomicU16::new(0);
    static SLOW_HAS_MATCHED: AtomicBool = AtomicBool::new(false);

    fn count_slowly(counts: u16) {
        for _ in 0..counts {
            let counter = SLOW_COUNTER.fetch_add(1, Relaxed).wrapping_add(1);
            if counter == SLOW_COMPARE.load(Relaxed) {
                SLOW_HAS_MATCHED.store(true, Relaxed);
            }
        }
    }

    /// A CPU of 1 MHz, for which a count is 8 cycles: four counts pass before the compare value is set.
    struct SlowCpu;

    impl TickTimer for SlowCpu {
        const COUNTS: u16 = 125;

        fn counter() -> u16 {
            SLOW_COUNTER.load(Relaxed)
        }

        fn set_compare(at: u16) {
            count_slowly(4);
            SLOW_COMPARE.store(at, Relaxed);
        }

        fn forget_match() {
            SLOW_HAS_MATCHED.store(false, Relaxed);
        }
    }

    /// Runs a kernel that calls `check` when it is first idle, and ends then.
    fn idle_once(check: impl Fn(&mut Interrupt)) {
        let mut has_slept = false;
        host::run(
            |_| {},
            |interrupt| {
                if core::mem::replace(&mut has_slept, true) {
                    return false;
                }
                interrupt.mask(begin);
                check(interrupt);
                true
            },
        );
    }

    #[test]
    fn a_tick_that_comes_as_the_cpu_goes_to_sleep_is_counted_once() {
        for at in 100..125 {
            idle_once(|interrupt| {
                SLOW_COUNTER.store(at, Relaxed);
                SLOW_COMPARE.store(SlowCpu::COUNTS, Relaxed);
                SLOW_HAS_MATCHED.store(false, Relaxed);
                // SAFETY: the host is idle.
                unsafe { crate::tickless::before_sleep::<SlowCpu>() };
                // It sleeps until the match or another interrupt.
                for _ in 0..10 {
                    count_slowly(u16::from(!SLOW_HAS_MATCHED.load(Relaxed)));
                }
                // SAFETY: an interrupt is entered.
                unsafe { crate::tickless::after_sleep::<SlowCpu>() };
                if SLOW_HAS_MATCHED.swap(false, Relaxed) {
                    // SAFETY: this stands for the timer's interrupt.
                    unsafe { tick::<SlowCpu>(interrupt) };
                }
                let counted = interrupt.mask(|masked| TICKS.get(masked));
                let passed = SLOW_COUNTER.load(Relaxed) / SlowCpu::COUNTS;
                let pending = u16::from(SLOW_HAS_MATCHED.load(Relaxed));
                assert_eq!(counted + pending, passed, "it slept at count {at}");
            });
        }
    }

    static LATE_COUNTER: AtomicU16 = AtomicU16::new(0);
    static LATE_COMPARE: AtomicU16 = AtomicU16::new(0);
    static LATE_HAS_MATCHED: AtomicBool = AtomicBool::new(false);

    /// The match shows when the counter goes on from there, as in hardware.
    fn count_late() {
        if LATE_COUNTER.load(Relaxed) == LATE_COMPARE.load(Relaxed) {
            LATE_HAS_MATCHED.store(true, Relaxed);
        }
        LATE_COUNTER.fetch_add(1, Relaxed);
    }

    /// A CPU that takes a count for each access to the timer.
    struct LateMatch;

    impl TickTimer for LateMatch {
        const COUNTS: u16 = 125;

        fn counter() -> u16 {
            count_late();
            LATE_COUNTER.load(Relaxed)
        }

        fn set_compare(at: u16) {
            LATE_COMPARE.store(at, Relaxed);
            count_late();
        }

        fn forget_match() {
            LATE_HAS_MATCHED.store(false, Relaxed);
            count_late();
        }
    }

    #[test]
    fn a_tick_that_comes_as_the_cpu_wakes_is_counted_once() {
        for woken_at in 100..400 {
            idle_once(|interrupt| {
                LATE_COUNTER.store(0, Relaxed);
                LATE_COMPARE.store(LateMatch::COUNTS, Relaxed);
                LATE_HAS_MATCHED.store(false, Relaxed);
                // SAFETY: the host is idle.
                unsafe { crate::tickless::before_sleep::<LateMatch>() };
                while LATE_COUNTER.load(Relaxed) < woken_at {
                    count_late();
                }
                // SAFETY: an interrupt is entered.
                unsafe { crate::tickless::after_sleep::<LateMatch>() };
                for _ in 0..200 {
                    if LATE_HAS_MATCHED.swap(false, Relaxed) {
                        // SAFETY: this stands for the timer's interrupt.
                        unsafe { tick::<LateMatch>(interrupt) };
                    }
                    let counted = interrupt.mask(|masked| TICKS.get(masked));
                    let passed = (LATE_COUNTER.load(Relaxed) - 1) / LateMatch::COUNTS;
                    assert_eq!(counted, passed, "it was woken at count {woken_at}");
                    count_late();
                }
            });
        }
    }
}
