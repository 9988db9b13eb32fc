//! The analog-to-digital converter: it measures what the motors and the power need, in rounds, one each
//! millisecond.
//!
//! A round is a chain of conversions, 200 us the first and 104 us the others, each begun by the interrupt
//! that ends the one before:
//!
//! 1. an input of the multiplexer, if one was [asked for](Analog::look);
//! 2. the current of one dock that is [watched](Analog::watch), in turn: each is measured at least every
//!    third millisecond, and a current out of bounds opens the dock's power switch at once;
//! 3. the potentiometers of the joints, while those are controlled or were asked for; in every second round
//!    their motors' currents too, each before its potentiometer.
//!
//! Timer2 begins the rounds, and with them the periods of the joints' control. It is a separate clock: its
//! interrupt has priority over the tick's and occurs half a tick away from it, so that neither kernel timers
//! nor tasks that wait for them delay it. While there is nothing to measure there are no rounds.
//!
//! Between its chains the converter is off. If it were on, it would begin a conversion whenever the MCU goes
//! to sleep (ATmega128 datasheet, "Idle Mode"). Nothing would need that conversion, and a round that found it
//! under way would measure nothing.

use avr_device::atmega128a::{ADC, TC2};
use kernel::{Context, Masked, MaskedCell, Semaphore};

use crate::deferred::{self, Serving, source};
use crate::gpio::Port;
use crate::input::Input;
use crate::interrupts::Serves;
use crate::period;
use crate::superbot::{self, CLOCK_HZ, DOCK_CURRENT_AT_REST, DOCK_CURRENT_LIMIT, PowerPort, ROUND_HZ};

/// ADMUX: full scale is AVCC.
const REFERENCE: u8 = 1 << 6; // REFS0

/// ADMUX: the pin of the multiplexer's output.
const MULTIPLEXER: u8 = 7;

/// ADCSRA: begins a conversion with its interrupt enabled, and clears the interrupt of an earlier one. The
/// converter's clock of 125 kHz lies within the 50 to 200 kHz that 10 bits need (ATmega128 datasheet,
/// "Prescaling and Conversion Timing").
const START: u8 = 1 << 7 | 1 << 6 | 1 << 4 | 1 << 3 | 0b111; // ADEN, ADSC, ADIF, ADIE, clock / 128
/// The converter is off.
const OFF: u8 = 0;

/// The prescaler of 64 is the smallest with which a round of 1 ms fits 8 bits.
const PRESCALER: u32 = 64;

/// TCCR2: the prescaler of 64. Timer0 has another table of prescalers.
const CLOCK_SELECT: u8 = 0b011; // CS22:0

/// Timer2's compare value.
const TOP: u8 = {
    assert!(CLOCK_HZ.is_multiple_of(PRESCALER * ROUND_HZ), "the round is not a whole number of timer clocks");
    let top = CLOCK_HZ / PRESCALER / ROUND_HZ - 1;
    assert!(top <= 255, "the round does not fit 8 bits");
    top as u8
};

/// The bits of the docks, by place, and of the joints among the direct inputs that were asked for.
const DOCKS: u8 = 0b111;
const JOINTS: u8 = 1 << 7;

/// The bit of an input of the multiplexer among those that were asked for.
fn multiplexed_bit(input: Input) -> Option<u8> {
    (input.0 >= Input::MULTIPLEXED).then(|| 1 << (input.0 & 7))
}

/// The bit of an input at a pin of its own among those asked for: a dock's current, or any of the joints.
fn direct_bit(input: Input) -> u8 {
    if input.0 >= Input::FIRST_DOCK { 1 << (input.0 & 3) } else { JOINTS }
}

/// The rounds.
struct Rounds {
    /// The input that is being converted.
    input: MaskedCell<u8>,
    /// The docks that are watched: a bit for each place.
    watched: MaskedCell<u8>,
    /// The docks that were asked for, likewise, and the bit [`JOINTS`].
    wanted_direct: MaskedCell<u8>,
    /// The place whose turn was last.
    dock: MaskedCell<u8>,
    /// The highest input of the joints while they are measured.
    joints: MaskedCell<Option<u8>>,
    /// Whether their currents, at odd inputs, are left out of this round.
    without_currents: MaskedCell<bool>,
    /// The inputs of the multiplexer that were asked for, a bit each.
    wanted: MaskedCell<u8>,
    readings: [MaskedCell<u16>; 16],
    /// The semaphore to post at the start of a round while the joints are driven.
    period: MaskedCell<Option<&'static Semaphore>>,
    /// The docks whose switches were opened, a bit each, and the semaphore to post then.
    tripped: MaskedCell<u8>,
    trip: MaskedCell<Option<&'static Semaphore>>,
}

static ROUNDS: Rounds = Rounds {
    input: MaskedCell::new(0),
    watched: MaskedCell::new(0),
    wanted_direct: MaskedCell::new(0),
    dock: MaskedCell::new(0),
    joints: MaskedCell::new(None),
    without_currents: MaskedCell::new(false),
    wanted: MaskedCell::new(0),
    readings: [const { MaskedCell::new(0) }; 16],
    period: MaskedCell::new(None),
    tripped: MaskedCell::new(0),
    trip: MaskedCell::new(None),
};

#[inline(always)]
fn timer() -> TC2 {
    // SAFETY: other timers share TIMSK, which is changed with interrupts masked only.
    unsafe { TC2::steal() }
}

/// Lets rounds begin as long as there is anything to measure.
fn go_on(_: &Masked) {
    let timer = timer();
    if timer.timsk().read().ocie2().bit_is_clear() {
        timer.tifr().write(|w| w.ocf2().set_bit()); // a round that nothing needed
        timer.timsk().modify(|_, w| w.ocie2().set_bit());
    }
}

#[inline(always)]
fn registers() -> ADC {
    // SAFETY: the registers are used with interrupts masked only.
    unsafe { ADC::steal() }
}

/// The converter, the multiplexer before it, and Timer2.
pub struct Adc(());

impl Adc {
    pub(crate) const fn new() -> Self {
        Adc(())
    }

    /// Starts the clock of the rounds. `trip` is posted when the switch of a dock was opened for its current.
    pub fn start(
        self,
        _: impl Serves<Adc>,
        context: &mut impl Context,
        trip: &'static Semaphore,
    ) -> (Rhythm, Analog) {
        context.mask(|masked| ROUNDS.trip.set(masked, Some(trip)));
        superbot::start_multiplexer();
        // The first conversion with a reference may be off (datasheet, "ADC Voltage Reference"). It is a
        // chain of its own, of the last input, before anything is asked for.
        context.mask(|masked| convert(masked, 0));
        let timer = timer();
        timer.ocr2().write(|w| w.set(TOP));
        // WGM21 alone: clear timer on compare match.
        timer.tccr2().write(|w| w.wgm21().set_bit().cs2().set(CLOCK_SELECT));
        timer.tcnt2().write(|w| w.set(TOP / 2)); // half a tick away from the tick, if that was just started
        (Rhythm(()), Analog(()))
    }
}

/// The rounds as the periods of the joints' control.
pub struct Rhythm(());

impl Rhythm {
    /// From the next round on, each round puts the joints' drives into effect, measures the inputs up to
    /// `highest`, and posts `period`.
    pub fn begin(&mut self, context: &mut impl Context, period: &'static Semaphore, highest: Input) {
        context.mask(|masked| {
            ROUNDS.period.set(masked, Some(period));
            ROUNDS.joints.set(masked, Some(highest.0));
            go_on(masked);
            period::control(masked, true);
        });
    }

    /// Ends what [`begin`](Self::begin) began, once the last drives are in effect.
    pub fn end(&mut self, context: &mut impl Context) {
        context.mask(|masked| {
            period::control(masked, false);
            ROUNDS.period.set(masked, None);
            ROUNDS.joints.set(masked, None);
        });
    }

    /// Measures the potentiometers among the inputs up to `highest` in the next round.
    pub fn look(&mut self, context: &mut impl Context, highest: Input) {
        context.mask(|masked| {
            ROUNDS.joints.set(masked, Some(highest.0));
            ROUNDS.without_currents.set(masked, false); // this round's turn is to leave them out
            go_on(masked);
        });
    }
}

/// The rounds for callers that need a reading now and then.
pub struct Analog(());

impl Analog {
    /// Asks for a reading of `input`.
    pub fn look(&mut self, context: &mut impl Context, input: Input) {
        context.mask(|masked| {
            if let Some(bit) = multiplexed_bit(input) {
                ROUNDS.wanted.set(masked, ROUNDS.wanted.get(masked) | bit);
            } else {
                ROUNDS.wanted_direct.set(masked, ROUNDS.wanted_direct.get(masked) | direct_bit(input));
            }
            go_on(masked);
        });
    }

    /// The reading that was asked for, 0 to 1023, once it is there.
    #[inline(never)] // otherwise the compiler moves computations on the value into the critical section
    pub fn seen(&mut self, context: &mut impl Context, input: Input) -> Option<u16> {
        context.mask(|masked| {
            let is_awaited = if let Some(bit) = multiplexed_bit(input) {
                ROUNDS.wanted.get(masked) & bit != 0
            } else {
                ROUNDS.wanted_direct.get(masked) & direct_bit(input) != 0
            };
            (!is_awaited).then(|| reading(masked, input))
        })
    }

    /// Begins or ends to watch the current of the dock at `place`, 0 to 2.
    pub fn watch(&mut self, context: &mut impl Context, place: u8, is_on: bool) {
        let bit = 1 << (place & 3);
        context.mask(|masked| {
            let others = ROUNDS.watched.get(masked) & !bit;
            ROUNDS.watched.set(masked, if is_on { others | bit } else { others });
            go_on(masked);
        });
    }

    /// The docks whose switches have been opened because of their currents since the last call, a bit each.
    pub fn take_tripped(&mut self, context: &mut impl Context) -> u8 {
        context.mask(|masked| {
            let tripped = ROUNDS.tripped.get(masked);
            ROUNDS.tripped.set(masked, 0);
            tripped
        })
    }
}

/// The last reading of an input, 0 to 1023.
#[inline(always)]
pub(crate) fn reading(masked: &Masked, Input(input): Input) -> u16 {
    ROUNDS.readings.get(usize::from(input)).map_or(0, |reading| reading.get(masked))
}

#[inline(always)]
fn convert(masked: &Masked, input: u8) {
    ROUNDS.input.set(masked, input);
    let pin = if input >= Input::MULTIPLEXED { MULTIPLEXER } else { input };
    // SAFETY: the converter touches no memory, whatever its registers hold.
    registers().admux().write(|w| unsafe { w.bits(REFERENCE | pin) });
    // SAFETY: the converter touches no memory, whatever its registers hold.
    registers().adcsra().write(|w| unsafe { w.bits(START) });
}

/// Switches the converter off.
#[inline(always)]
fn switch_off() {
    // SAFETY: the converter touches no memory, whatever its registers hold.
    registers().adcsra().write(|w| unsafe { w.bits(OFF) });
}

/// Begins the conversion of the next dock's current, or else of the joints' inputs. Returns whether there was
/// any.
fn convert_rest(masked: &Masked) -> bool {
    let docks = (ROUNDS.watched.get(masked) | ROUNDS.wanted_direct.get(masked)) & DOCKS;
    if docks == 0 {
        return convert_joints(masked);
    }
    let mut place = ROUNDS.dock.get(masked);
    loop {
        place = if place >= 2 { 0 } else { place + 1 };
        if docks >> place & 1 != 0 || place == ROUNDS.dock.get(masked) {
            break;
        }
    }
    ROUNDS.dock.set(masked, place);
    convert(masked, Input::FIRST_DOCK + place);
    true
}

/// Begins the conversion of the joints' inputs, or else switches the converter off: the chain has ended.
/// Returns whether there were any.
#[inline(always)] // as a call it makes the software interrupt save more registers
fn convert_joints(masked: &Masked) -> bool {
    let are_wanted = ROUNDS.wanted_direct.get(masked) & JOINTS != 0;
    let highest = match ROUNDS.joints.get(masked) {
        Some(highest) => highest,
        None if are_wanted => Input::LAST_OF_JOINTS,
        None => {
            switch_off();
            return false;
        }
    };
    // Currents are measured in every second round, and on request.
    let leaves_out = !ROUNDS.without_currents.get(masked) && !are_wanted;
    ROUNDS.without_currents.set(masked, leaves_out);
    convert(masked, if leaves_out { highest & !1 } else { highest });
    true
}

/// Whether a conversion is under way, or its result has not been handled yet. Beginning another one would do
/// nothing then, or the result would be taken for the other's.
#[inline(always)]
fn is_converting(masked: &Masked) -> bool {
    registers().adcsra().read().adsc().bit_is_set() || deferred::waits(masked, source::CONVERSION)
}

/// The interrupt "Timer/Counter2 Compare Match": begins a round, with the joints first.
#[doc(hidden)]
#[inline(always)]
pub fn begin_round(masked: &Masked) {
    period::begin_period(masked);
    deferred::raise(masked, source::ROUND);
}

/// The rest of the work at the beginning of a round.
#[doc(hidden)]
#[inline(always)]
pub fn round(serving: &mut Serving) {
    serving.window();
    let period = serving.interrupt.mask(|masked| {
        period::await_next(masked);
        let period = ROUNDS.period.get(masked);
        if is_converting(masked) {
            return period; // interrupts were held up: this round measures nothing
        }
        let wanted = ROUNDS.wanted.get(masked);
        if wanted != 0 {
            let (mut number, mut rest) = (0, wanted);
            while rest & 1 == 0 && number < 7 {
                rest >>= 1;
                number += 1;
            }
            superbot::select(number);
            convert(masked, Input::MULTIPLEXED + number);
        } else if !convert_rest(masked) {
            timer().timsk().modify(|_, w| w.ocie2().clear_bit());
        }
        period
    });
    serving.window();
    if let Some(period) = period {
        period.post(serving.interrupt);
    }
}

/// The interrupt "ADC Conversion Complete", which does not enter the kernel: the joints' inputs follow each
/// other.
#[doc(hidden)]
#[inline(always)]
pub fn conversion_complete(masked: &Masked) {
    let input = ROUNDS.input.get(masked);
    if input >= Input::FIRST_DOCK {
        return deferred::raise(masked, source::CONVERSION);
    }
    keep_reading(masked, input);
    if let Some(next) = input.checked_sub(1) {
        convert(masked, if ROUNDS.without_currents.get(masked) { next & !1 } else { next });
    } else {
        switch_off();
        if !ROUNDS.without_currents.get(masked) {
            ROUNDS.wanted_direct.set(masked, ROUNDS.wanted_direct.get(masked) & !JOINTS);
        }
        if ROUNDS.period.get(masked).is_none() {
            ROUNDS.joints.set(masked, None);
        }
    }
}

#[inline(always)]
fn keep_reading(masked: &Masked, input: u8) -> u16 {
    let reading = registers().adc().read().bits();
    if let Some(last) = ROUNDS.readings.get(usize::from(input)) {
        last.set(masked, reading);
    }
    reading
}

/// A conversion of a dock's current or of an input of the multiplexer is complete.
#[doc(hidden)]
#[inline(always)]
pub fn other_conversion_complete(serving: &mut Serving) {
    serving.window();
    let trip = serving.interrupt.mask(|masked| {
        let input = ROUNDS.input.get(masked);
        let reading = keep_reading(masked, input);
        if input >= Input::MULTIPLEXED {
            ROUNDS.wanted.set(masked, ROUNDS.wanted.get(masked) & !(1 << (input & 7)));
            convert_rest(masked);
            return None;
        }
        convert_joints(masked);
        let place = input & 3;
        ROUNDS.wanted_direct.set(masked, ROUNDS.wanted_direct.get(masked) & !(1 << place));
        if reading.abs_diff(DOCK_CURRENT_AT_REST) < DOCK_CURRENT_LIMIT {
            return None;
        }
        PowerPort::set_output(superbot::power_switch(place), false);
        ROUNDS.tripped.set(masked, ROUNDS.tripped.get(masked) | 1 << place);
        ROUNDS.trip.get(masked)
    });
    serving.window();
    if let Some(trip) = trip {
        trip.post(serving.interrupt);
    }
}
