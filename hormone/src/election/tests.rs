use super::*;

/// Modules in a ring, whose tokens take so many milliseconds a hop.
struct Ring {
    hop: u16,
    modules: Vec<Election>,
    /// The token on its way to each module.
    under_way: Vec<Option<Token>>,
    now: u16,
}

impl Ring {
    fn new(seeds: &[u16]) -> Self {
        let modules = seeds.iter().map(|&seed| Election::new(seed, 0)).collect();
        Ring { hop: 1, modules, under_way: vec![None; seeds.len()], now: 0 }
    }

    fn run(&mut self, milliseconds: u16) {
        for _ in 0..milliseconds / self.hop {
            self.now = self.now.wrapping_add(self.hop);
            let arriving = std::mem::replace(&mut self.under_way, vec![None; self.modules.len()]);
            for (index, token) in arriving.into_iter().enumerate() {
                let module = &mut self.modules[index];
                let on = token.and_then(|token| module.hear(token, self.now));
                let begun = module.round(self.now);
                let next = (index + 1) % self.modules.len();
                // Both at once is no matter for a test: the older one is lost.
                self.under_way[next] = begun.or(on);
            }
        }
    }

    fn leaders(&self) -> Vec<u16> {
        self.modules.iter().filter_map(Election::ring).collect()
    }
}

#[test]
fn a_ring_elects_one_leader_that_knows_its_size() {
    for (size, seeds) in [(1, 3), (2, 20), (3, 20), (6, 20), (200, 2)] {
        for seed in 1..=seeds {
            let seeds: Vec<u16> =
                (0..size).map(|module| (seed * 3_001_u16).wrapping_add(module * 31)).collect();
            let mut ring = Ring::new(&seeds);
            ring.run(6 * ROUND);
            assert_eq!(ring.leaders(), [size], "seed {seed}");
            ring.run(20 * ROUND);
            assert_eq!(ring.leaders(), [size], "and it stays, seed {seed}");
        }
    }
}

#[test]
fn a_ring_round_which_a_token_takes_longer_than_a_round_elects_one_leader_too() {
    for (size, hop, seeds) in [(256, 4, 9), (300, 4, 9), (1_000, 4, 4), (100, 40, 9), (LARGEST, 4, 1)] {
        for seed in 1..=seeds {
            let seeds: Vec<u16> =
                (0..size).map(|module: u16| module.wrapping_mul(31).wrapping_add(seed * 3_001)).collect();
            let mut ring = Ring { hop, ..Ring::new(&seeds) };
            ring.run(2 * ROUND + hop);
            for _ in 0..size / 10 {
                ring.run(10 * hop);
            }
            ring.run(10 * hop);
            assert_eq!(ring.leaders(), [size], "{size} modules, seed {seed}");
        }
    }
}

#[test]
fn two_leaders_find_out() {
    let mut ring = Ring::new(&[3, 5, 7, 11, 13, 17]);
    for leader in [1, 4] {
        ring.modules[leader].role = Role::Leader { ring: 3, silent: 0 };
    }
    ring.run(4 * ROUND);
    assert_eq!(ring.leaders(), [6]);
}

#[test]
fn a_leader_whose_ring_broke_stands_down() {
    let mut leader = Election::new(9, 0);
    let token = leader.round(2 * ROUND).unwrap();
    assert_eq!(leader.hear(token, 2 * ROUND + 6), None);
    assert_eq!(leader.ring(), Some(1));
    let ranks: Vec<u16> = (3..8).map(|round| leader.round(round * ROUND).unwrap().rank).collect();
    let led = ranks.iter().map(|rank| rank & LEADER != 0).collect::<Vec<_>>();
    assert_eq!(led, [true, true, true, false, false]);
    assert_eq!(leader.ring(), None);
}

#[test]
fn who_hears_a_beat_never_stands() {
    let mut follower = Election::new(9, 0);
    for beat in 0..100_u16 {
        follower.follow(beat.wrapping_mul(400));
        assert_eq!(follower.round(beat.wrapping_mul(400).wrapping_add(399)), None);
    }
}

#[test]
fn ranks_are_drawn_anew_also_from_one_seed_at_other_moments() {
    let (mut one, mut other) = (Election::new(0, 0), Election::new(0, 1));
    let (first, second) = (one.round(2 * ROUND).unwrap().rank, other.round(2 * ROUND + 1).unwrap().rank);
    assert_ne!(first, second);
    let own = Token { rank: first, hops: 6 };
    assert_eq!(one.round(3 * ROUND), Some(Token { hops: 1, ..own }), "it may be on its way still");
    assert_eq!(one.hear(own, 3 * ROUND + 6), None);
    let ranks: Vec<u16> = (4..7).map(|round| one.round(round * ROUND).unwrap().rank & !LEADER).collect();
    assert!(ranks[0] != ranks[1] && ranks[1] != ranks[2] && !ranks.contains(&first), "{ranks:?}");
}

#[test]
fn a_token_does_not_go_round_for_ever() {
    let mut follower = Election::new(1, 0);
    assert_eq!(follower.hear(Token { rank: 5, hops: LARGEST }, 0), None);
    let largest = Token { rank: 5, hops: LARGEST };
    assert_eq!(follower.hear(Token { hops: LARGEST - 1, ..largest }, 0), Some(largest));
}

#[test]
fn a_leader_is_above_all_candidates() {
    let mut leader = Election::new(9, 0);
    let own = leader.round(2 * ROUND).unwrap();
    let _ = leader.hear(own, 2 * ROUND + 6);
    leader.round(3 * ROUND).unwrap();
    assert_eq!(leader.hear(Token { rank: !LEADER, hops: 1 }, 3 * ROUND + 1), None);
    assert_eq!(leader.ring(), Some(1));

    let mut candidate = Election::new(5, 0);
    candidate.round(2 * ROUND).unwrap();
    let on = candidate.hear(Token { rank: LEADER, hops: 4 }, 2 * ROUND + 1);
    assert_eq!(on, Some(Token { rank: LEADER, hops: 5 }));
    assert_eq!(candidate.round(3 * ROUND + 1), None, "it follows");
}
