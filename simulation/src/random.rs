//! The one source of chance: the same seed gives the same run.

/// SplitMix64 (Steele, Lea, Flood: "Fast Splittable Pseudorandom Number Generators", 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A generator of its own for the part numbered `part` of what `seed` stands for.
    pub fn of_part(seed: u64, part: u64) -> Self {
        let mut parts = Self(seed);
        Self(parts.next_u64() ^ Self(part).next_u64())
    }

    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// True with this probability; never at 0, always at 1.
    pub fn chance(&mut self, probability: f64) -> bool {
        const STEPS: u64 = 1 << 53;
        ((self.next_u64() >> 11) as f64) < probability * STEPS as f64
    }

    /// A number from `least` up to `most`, evenly spread.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number below `bound`, which is not 0.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.next_u64() % bound as u64) as usize
    }

    pub fn fill(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.next_u64().to_le_bytes()[..chunk.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const DRAWS: usize = 10_000;

    /// Vigna's own program prints these for this seed.
    #[test]
    fn numbers_are_those_of_splitmix64() {
        let mut random = Random::new(1_234_567);
        let numbers = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([(); 3].map(|()| random.next_u64()), numbers);
        let mut bytes = [0; 19];
        Random::new(1_234_567).fill(&mut bytes);
        let expected: Vec<u8> = numbers.into_iter().flat_map(u64::to_le_bytes).take(19).collect();
        assert_eq!(bytes[..], expected);
    }

    #[test]
    fn parts_of_a_seed_have_their_own_numbers_and_so_has_a_part_by_each_seed() {
        for fixed in [0, 1, 77, u64::MAX] {
            let of_seed = |part| Random::of_part(fixed, part).next_u64();
            let of_part = |seed| Random::of_part(seed, fixed).next_u64();
            let firsts: [BTreeSet<u64>; 2] =
                [(0..1_000).map(of_seed).collect(), (0..1_000).map(of_part).collect()];
            assert_eq!(firsts.map(|firsts| firsts.len()), [1_000; 2], "{fixed}");
        }
    }

    #[test]
    fn chances_and_numbers_are_evenly_spread_within_their_bounds() {
        let mut random = Random::new(1);
        for (probability, least, most) in
            [(0.0, 0, 0), (1.0, DRAWS, DRAWS), (0.5, 4_800, 5_200), (0.02, 150, 250), (1e-9, 0, 1)]
        {
            let hits = (0..DRAWS).filter(|_| random.chance(probability)).count();
            assert!((least..=most).contains(&hits), "{hits} at {probability}");
        }
        let mut draws_0 = Random::new(0_u64.wrapping_sub(0x9e37_79b9_7f4a_7c15));
        assert_eq!(draws_0.clone().next_u64(), 0);
        assert!(!draws_0.chance(0.0), "never");
        for (least, most) in [(-1.0, 1.0), (3.0, 8.0), (-7.0, -7.0), (-9.0, -4.0)] {
            let draws: Vec<f64> = (0..DRAWS).map(|_| random.between(least, most)).collect();
            assert!(draws.iter().all(|draw| (least..=most).contains(draw)), "{least} to {most}");
            for quarter in 0..4 {
                let part = (most - least) / 4.0;
                let from = least + part * f64::from(quarter);
                let within = draws.iter().filter(|draw| (from..from + part).contains(*draw)).count();
                assert!(part == 0.0 || (2_300..2_700).contains(&within), "{within} from {from}");
            }
        }
        for bound in [1, 2, 7] {
            let mut counts = vec![0_usize; bound];
            (0..DRAWS).for_each(|_| counts[random.below(bound)] += 1);
            let even = DRAWS / bound;
            assert!(counts.iter().all(|count| count.abs_diff(even) <= even / 10), "{counts:?}");
        }
    }
}
