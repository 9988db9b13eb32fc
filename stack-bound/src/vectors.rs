//! The names of the ATmega128's interrupts, by the numbers of their vectors, from 0 (datasheet, "Interrupt
//! Vectors in ATmega128").

const NAMES: [&str; 35] = [
    "RESET",
    "INT0",
    "INT1",
    "INT2",
    "INT3",
    "INT4",
    "INT5",
    "INT6",
    "INT7",
    "TIMER2 COMP",
    "TIMER2 OVF",
    "TIMER1 CAPT",
    "TIMER1 COMPA",
    "TIMER1 COMPB",
    "TIMER1 OVF",
    "TIMER0 COMP",
    "TIMER0 OVF",
    "SPI, STC",
    "USART0, RX",
    "USART0, UDRE",
    "USART0, TX",
    "ADC",
    "EE READY",
    "ANALOG COMP",
    "TIMER1 COMPC",
    "TIMER3 CAPT",
    "TIMER3 COMPA",
    "TIMER3 COMPB",
    "TIMER3 COMPC",
    "TIMER3 OVF",
    "USART1, RX",
    "USART1, UDRE",
    "USART1, TX",
    "TWI",
    "SPM READY",
];

/// The name of the interrupt with this vector; `None` if there is none.
pub fn name(vector: u8) -> Option<&'static str> {
    NAMES.get(usize::from(vector)).copied()
}
