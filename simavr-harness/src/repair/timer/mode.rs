//! The modes of a timer (tables "Waveform Generation Mode Bit Description").

/// What the counter counts up to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Top {
    Fixed(u16),
    CompareA,
    Capture,
}

/// How the counter counts, and when the compare registers take what was written to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Up; at once.
    Plain,
    /// Fast PWM: up; at the bottom.
    Fast,
    /// Phase correct PWM: up and down; at the top.
    PhaseCorrect,
    /// Phase and frequency correct PWM: up and down; at the bottom.
    FrequencyCorrect,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    pub top: Top,
    pub kind: Kind,
}

impl Mode {
    pub const fn normal(max: u16) -> Self {
        Self { top: Top::Fixed(max), kind: Kind::Plain }
    }

    /// A mode of Timer0 or Timer2.
    pub fn of_narrow(number: u8) -> Self {
        let (top, kind) = match number & 3 {
            0 => (Top::Fixed(0xff), Kind::Plain),
            1 => (Top::Fixed(0xff), Kind::PhaseCorrect),
            2 => (Top::CompareA, Kind::Plain),
            _ => (Top::Fixed(0xff), Kind::Fast),
        };
        Self { top, kind }
    }

    /// A mode of Timer1 or Timer3. The reserved one is taken for the normal one.
    pub fn of_wide(number: u8) -> Self {
        let (top, kind) = match number & 15 {
            1 => (Top::Fixed(0xff), Kind::PhaseCorrect),
            2 => (Top::Fixed(0x1ff), Kind::PhaseCorrect),
            3 => (Top::Fixed(0x3ff), Kind::PhaseCorrect),
            4 => (Top::CompareA, Kind::Plain),
            5 => (Top::Fixed(0xff), Kind::Fast),
            6 => (Top::Fixed(0x1ff), Kind::Fast),
            7 => (Top::Fixed(0x3ff), Kind::Fast),
            8 => (Top::Capture, Kind::FrequencyCorrect),
            9 => (Top::CompareA, Kind::FrequencyCorrect),
            10 => (Top::Capture, Kind::PhaseCorrect),
            11 => (Top::CompareA, Kind::PhaseCorrect),
            12 => (Top::Capture, Kind::Plain),
            14 => (Top::Capture, Kind::Fast),
            15 => (Top::CompareA, Kind::Fast),
            _ => return Self::normal(u16::MAX),
        };
        Self { top, kind }
    }

    pub fn is_pwm(self) -> bool {
        self.kind != Kind::Plain
    }

    pub fn counts_down(self) -> bool {
        matches!(self.kind, Kind::PhaseCorrect | Kind::FrequencyCorrect)
    }
}
