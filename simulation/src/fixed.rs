//! Arrays of a fixed length in files.

use serde::{Deserialize, Deserializer, de};

/// Exactly `N` elements: for a plain array serde takes the first elements of a longer one, and leaves the
/// others.
pub struct Fixed<T, const N: usize>(pub [T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Fixed<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let all = Vec::deserialize(deserializer)?;
        let number = all.len();
        let fixed = all.try_into().map_err(|_| format!("this list has length {number}: give {N} values"));
        fixed.map(Fixed).map_err(de::Error::custom)
    }
}
