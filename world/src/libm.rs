//! The functions of mathematics that MuJoCo calls, so that equal runs are equal on every machine.
//!
//! The C library chooses among implementations by what the CPU can do, and they differ in the last bit. A
//! program's own symbols come before those of libraries, so MuJoCo calls these. What rounds correctly
//! everywhere (sqrt, floor) stays the C library's.

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

        /// The addresses of all, so that none is left out of a program.
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
