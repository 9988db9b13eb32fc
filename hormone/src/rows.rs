//! Rows of the tables in flash: rules, and the postures of motions.

/// A table's rows as an array, for a `static`.
///
/// # Panics
/// When compiled, if there are not `N` of them.
pub const fn array<T: Copy, const N: usize>(rows: &[T]) -> [T; N] {
    let Some(array) = rows.first_chunk() else { panic!("fewer rows than said") };
    assert!(rows.len() == N, "more rows than said");
    *array
}
