//! The interrupts of the ATmega128 by their vectors' numbers (datasheet, table "Reset and Interrupt Vectors",
//! counted from 0).

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
    "TIMER2_COMP",
    "TIMER2_OVF",
    "TIMER1_CAPT",
    "TIMER1_COMPA",
    "TIMER1_COMPB",
    "TIMER1_OVF",
    "TIMER0_COMP",
    "TIMER0_OVF",
    "SPI_STC",
    "USART0_RX",
    "USART0_UDRE",
    "USART0_TX",
    "ADC",
    "EE_READY",
    "ANALOG_COMP",
    "TIMER1_COMPC",
    "TIMER3_CAPT",
    "TIMER3_COMPA",
    "TIMER3_COMPB",
    "TIMER3_COMPC",
    "TIMER3_OVF",
    "USART1_RX",
    "USART1_UDRE",
    "USART1_TX",
    "TWI",
    "SPM_READY",
];

/// The name of the interrupt with this vector; `None` if there is no such.
pub fn vector_name(vector: u8) -> Option<&'static str> {
    NAMES.get(usize::from(vector)).copied()
}
