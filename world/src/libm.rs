//! The mathematical functions that MuJoCo calls, so that a run gives the same bits on every machine.
//!
//! The C library selects implementations by the features of the CPU, and these differ in the last bit. A
//! program's own symbols take precedence over those of libraries, so MuJoCo calls these. Functions that are
//! correctly rounded everywhere (sqrt, floor) stay the C library's.

/// Defines C functions of one or two numbers by those of the crate `libm`, and a list of their addresses.
macro_rules! bind {
    ($($name:ident($($argument:ident),*): $number:ty;)*) => {
        $(
            // SAFETY: it does what C's function of this name does.
            #[unsafe(no_mangle)]
            extern "C" fn $name($($argument: $number),*) -> $number {
                ::libm::$name($($argument),*)
            }
        )*

        /// The addresses of all functions. Using them keeps the linker from dropping any.
        pub fn bound() -> impl Iterator<Item = usize> {
            [$($name as *const () as usize),*].into_iter()
        }
    };
}

bind! {
    acos(x): f64;
    asin(x): f64;
    atan2(y, x): f64;
    cbrt(x): f64;
    cos(x): f64;
    exp(x): f64;
    log(x): f64;
    pow(x, y): f64;
    sin(x): f64;
    tan(x): f64;
}
