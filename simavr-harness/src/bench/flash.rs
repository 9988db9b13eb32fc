//! Measures the flash that a program with the kernel takes beyond one without a kernel, and the kernel's part
//! of it.
//!
//! The flash of other kernels is known for their own functions as linked, without the program that calls
//! them. Here many calls are compiled into their callers, and count to the program. A function that the
//! program's crate does not define counts to the kernel. That includes generic functions that are built for
//! the program, and what only the kernel needs of `board`, of the compiler's library and of the start-up
//! code. Of the interrupts only the one that the program declares counts to the program.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::ops::Range;

use rustc_demangle::demangle;

use super::{BenchError, TestImages, unmeasurable};
use crate::image::{Place, Symbol};

/// The flash that an image takes beyond the one without a kernel.
#[derive(Clone, Debug)]
pub struct Flash {
    pub image: String,
    /// Largest first.
    pub kernel: Vec<Function>,
    /// Including the calls that are compiled into it; largest first.
    pub program: Vec<Function>,
}

/// A function, or the initial value of a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    pub name: String,
    /// Beyond the function of the same name in the image without a kernel: negative if that one is larger.
    pub bytes: i64,
}

impl Flash {
    pub(super) fn of(images: &TestImages, image: &str) -> Result<Self, BenchError> {
        let mut sizes = sizes_of(images, image)?;
        for (symbol, bytes) in sizes_of(images, "bench_flash_empty")? {
            *sizes.entry(symbol).or_default() -= bytes;
        }
        let mut functions: Vec<_> = sizes
            .into_iter()
            .map(|(symbol, bytes)| Function { name: format!("{:#}", demangle(&symbol)), bytes })
            .filter(|function| function.bytes != 0)
            .collect();
        functions.sort_by_key(|function| Reverse(function.bytes));
        let (program, kernel) = functions.into_iter().partition(|function| is_of(image, &function.name));
        Ok(Flash { image: image.into(), kernel, program })
    }

    /// Bytes of the kernel's functions.
    pub fn of_kernel(&self) -> i64 {
        sum(&self.kernel)
    }

    /// Bytes of the program's functions.
    pub fn of_program(&self) -> i64 {
        sum(&self.program)
    }
}

fn sum(functions: &[Function]) -> i64 {
    functions.iter().map(|function| function.bytes).sum()
}

/// The interrupt handler that the measured programs declare themselves.
const INTERRUPT_OF_PROGRAM: &str = "__vector_5";

/// Whether the crate `program` defines the function of this name, not a macro of the kernel or of `board`.
fn is_of(program: &str, name: &str) -> bool {
    if let Some(vector) = name.split("::").find(|part| part.starts_with("__vector_")) {
        return vector == INTERRUPT_OF_PROGRAM;
    }
    crate_of(name) == Some(program) || name == "main"
}

/// The crate that defines the function of this name.
pub(super) fn crate_of(name: &str) -> Option<&str> {
    // `<` and `&` stand before the crate of a method's type.
    name.split("::").next()?.rsplit(['<', '&', ' ']).next()
}

/// The bytes of the image's flash by symbol, each up to the next one. Together they are all of it.
fn sizes_of(images: &TestImages, name: &str) -> Result<BTreeMap<String, i64>, BenchError> {
    let image = images.image(name)?;
    let data = |symbol| match image.symbol(symbol) {
        Some(Symbol { place: Place::Data(at), .. }) => Ok(at),
        _ => Err(unmeasurable(name, format!("it has no {symbol}"))),
    };
    Ok(sizes(image.flash().len(), data("__data_start")?..data("__data_end")?, image.symbols()))
}

/// The bytes by symbol of a flash of `end` bytes, the last of which are the initial values of the variables
/// in `data`.
fn sizes<'a>(
    end: usize,
    data: Range<u16>,
    symbols: impl Iterator<Item = (&'a str, Symbol)>,
) -> BTreeMap<String, i64> {
    let end = end as i64;
    let values = end - data.len() as i64;
    let mut begins: Vec<_> = symbols
        .filter(|(_, symbol)| !symbol.is_label)
        .filter_map(|(name, symbol)| match symbol.place {
            Place::Flash(at) => Some((i64::from(at), Reverse(symbol.size), name)),
            Place::Data(at) if data.contains(&at) => {
                Some((values + i64::from(at - data.start), Reverse(symbol.size), name))
            }
            _ => None,
        })
        .collect();
    // Of several symbols at one address the largest gives the name; the linker's own symbols have no size.
    begins.sort_unstable();
    begins.dedup_by_key(|&mut (at, ..)| at);
    let ends = begins.iter().skip(1).map(|&(at, ..)| at).chain([end]);
    begins.iter().zip(ends).map(|(&(at, _, name), end)| (name.to_owned(), end - at)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_programs_crate_defines_is_its_own() {
        for (name, is_of_program) in [
            ("main", true),
            ("bench_flash::body", true),
            ("bench_flash::main::{closure#0}", true),
            ("<bench_flash::body as core::ops::function::FnOnce<()>>::call_once", true),
            ("<&bench_flash::Reading as core::ops::drop::Drop>::drop", true),
            ("__vector_5", true),
            ("bench_flash::__vector_5::handler", true),
            ("__vector_15", false),
            ("bench_flash::__vector_22::handler", false),
            ("kernel_switch", false),
            ("__do_copy_data", false),
            ("board::eeprom::take", false),
            ("kernel::arch::avr::start::enter::<bench_flash::body, ()>", false),
            ("<kernel::pool::Message<bench_flash::Reading> as core::ops::drop::Drop>::drop", false),
            ("core::ptr::drop_in_place::<bench_flash::Reading>", false),
        ] {
            assert_eq!(is_of("bench_flash", name), is_of_program, "{name}");
        }
    }

    #[test]
    fn a_symbol_lasts_to_the_next_one() {
        let symbol = |place, size| Symbol { place, size, is_label: false, is_function: false };
        let label = |at| Symbol { is_label: true, ..symbol(Place::Flash(at), 0) };
        let symbols = [
            ("__vectors", symbol(Place::Flash(0), 0)),
            ("__first", symbol(Place::Flash(8), 0)),
            ("switch", symbol(Place::Flash(8), 40)),
            ("loop", label(12)),
            ("save", symbol(Place::Flash(20), 0)),
            ("__end", symbol(Place::Flash(50), 0)),
            ("VALUE", symbol(Place::Data(0x103), 2)),
            ("__data_start", symbol(Place::Data(0x103), 0)),
            ("BYTE", symbol(Place::Data(0x105), 1)),
            ("CLEARED", symbol(Place::Data(0x107), 2)),
            ("STORED", symbol(Place::Eeprom(0), 2)),
        ];
        let sizes = sizes(54, 0x103..0x107, symbols.into_iter());
        let expected = [("BYTE", 2), ("VALUE", 2), ("__vectors", 8), ("save", 30), ("switch", 12)];
        assert_eq!(sizes, expected.map(|(name, bytes)| (name.to_owned(), bytes)).into());
    }
}
