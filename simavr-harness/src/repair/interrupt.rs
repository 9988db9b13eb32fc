//! Interrupts as in the datasheet (chapters "Reset and Interrupt Handling", "External
//! Interrupts"). In simavr an interrupt's entry takes no time, a flag that was latched while its
//! interrupt was disabled does not fire, and writes do not clear the flags of EIFR.
//!
//! The rule here: an interrupt is pending exactly while its flag and its enable bit are set. It is applied
//! after every write to a register that holds either bit. For level-triggered flags (a USART's RXC, TWINT),
//! which acceptance does not clear, it is applied after each acceptance, too. So it also holds for a kernel
//! that leaves a handler in other ways than by RETI.

use crate::cpu::{Cpu, IO_START, RegisterBits, Vector};
use crate::device::{WrappedWrites, has_write_handler};

/// Wraps every register whose write may change which interrupts are pending. Wraps every other register with
/// a handler in simavr, too, so that none of them makes a run miss its deadline.
pub(crate) fn install(cpu: Cpu) -> WrappedWrites {
    let mut wrapped = WrappedWrites::default();
    for address in IO_START..cpu.ram_start() {
        let holds = |bits: RegisterBits| bits.mask != 0 && bits.address == address;
        let concerns = |vector: &Vector| holds(vector.flag_bit()) || holds(vector.enable_bit());
        let vectors: Vec<Vector> = cpu.vectors().filter(concerns).collect();
        match (has_write_handler(cpu, address), vectors.is_empty()) {
            (true, false) => wrapped.wrap(cpu, address, move |cpu, _, _, _| refresh_all(cpu, &vectors)),
            (true, true) => wrapped.wrap(cpu, address, |_, _, _, _| {}),
            (false, false) => wrapped.wrap(cpu, address, move |cpu, address, before, written| {
                clear_flags(cpu, &vectors, address, before, written);
                refresh_all(cpu, &vectors);
            }),
            (false, true) => {}
        }
    }
    wrapped
}

/// Makes `vector` pending or not, according to its flag and its enable bit.
pub(crate) fn refresh(cpu: Cpu, vector: Vector) {
    let (flag, enable) = (vector.flag_bit(), vector.enable_bit());
    if flag.mask == 0 || enable.mask == 0 {
        return;
    }
    let is_set = |bits: RegisterBits| cpu.data(bits.address) & bits.mask != 0;
    set_pending(cpu, vector, is_set(flag) && is_set(enable));
}

/// Makes `vector` pending, or not pending any more.
pub(crate) fn set_pending(cpu: Cpu, vector: Vector, wanted: bool) {
    if wanted && !vector.is_pending() {
        cpu.raise(vector);
    } else if !wanted && vector.is_pending() {
        cpu.withdraw(vector);
    }
}

fn refresh_all(cpu: Cpu, vectors: &[Vector]) {
    vectors.iter().for_each(|&vector| refresh(cpu, vector));
    cpu.forget_withdrawn();
}

/// Clears flags by the ones written to them, in a register that simavr treats as memory.
fn clear_flags(cpu: Cpu, vectors: &[Vector], address: u16, before: u8, written: u8) {
    let flags = vectors
        .iter()
        .map(|vector| vector.flag_bit())
        .filter(|flag| flag.address == address)
        .fold(0, |all, flag| all | flag.mask);
    cpu.set_data(address, written & !flags | before & flags & !written);
}
