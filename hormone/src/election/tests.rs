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
                // If a module sends both at once, the older one is lost, which does not matter here.
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
    let last = 2 + u16::from(PATIENCE);
    for round in 3..=last {
        assert!(leader.round(round * ROUND).unwrap().rank & LEADER != 0);
    }
    assert!(leader.round((last + 1) * ROUND).unwrap().rank & LEADER == 0);
    assert_eq!(leader.ring(), None);
}

/// Tokens on their way round the ring when the first of them comes back to their leader.
#[test]
fn a_token_that_takes_longer_than_a_round_is_the_leaders_own() {
    for seed in 1..=50 {
        let mut leader = Election::new(seed, 0);
        let token = leader.round(2 * ROUND).unwrap();
        assert_eq!(leader.hear(token, 2 * ROUND + 6), None);
        let sent = [3, 4, 5].map(|round| leader.round(round * ROUND).unwrap());
        for (token, round) in sent.into_iter().zip(5..) {
            assert_eq!(leader.hear(token, round * ROUND + 500), None);
            assert_eq!(leader.ring(), Some(1), "seed {seed}");
            assert!(leader.round((round + 1) * ROUND).unwrap().rank & LEADER != 0, "seed {seed}");
        }
    }
}

#[test]
fn a_candidate_that_has_led_knows_its_late_token_and_one_that_has_followed_gives_way_to_another() {
    let mut led = Election::new(9, 0);
    let token = led.round(2 * ROUND).unwrap();
    assert_eq!(led.hear(token, 2 * ROUND + 6), None);
    let last = 2 + u16::from(PATIENCE);
    let late = (3..=last).map(|round| led.round(round * ROUND).unwrap()).last().unwrap();
    let own = led.round((last + 1) * ROUND).unwrap();
    assert_eq!(led.hear(late, (last + 1) * ROUND + 6), None);
    assert_eq!(led.hear(own, (last + 1) * ROUND + 9), None);
    assert_eq!(led.ring(), Some(1), "it has not given way to the late one");

    let highest = Token { rank: !LEADER, hops: 3 };
    let mut followed = Election::new(9, 0);
    let passed_on = Some(Token { hops: 4, ..highest });
    assert_eq!(followed.hear(highest, ROUND), passed_on);
    assert!(followed.round(3 * ROUND).unwrap().rank < highest.rank);
    assert_eq!(followed.hear(highest, 3 * ROUND + 6), passed_on);
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
    let mut round = |round| {
        let token = one.round(round * ROUND).unwrap();
        assert_eq!(one.hear(token, round * ROUND + 6), None);
        token.rank & !LEADER
    };
    let ranks = [4, 5, 6].map(&mut round);
    assert!(ranks[0] != ranks[1] && ranks[1] != ranks[2] && !ranks.contains(&first), "{ranks:?}");
}

#[test]
fn a_candidate_that_hears_its_own_beat_leads_when_its_token_comes_back() {
    let mut ring = Ring::new(&[3, 5, 7, 11, 13, 17]);
    ring.modules[2].stand(1);
    ring.run(3);
    for module in &mut ring.modules {
        module.follow(3); // the beat of when it was the head, which goes round as the token does
    }
    ring.run(6);
    assert_eq!(ring.leaders(), [6]);
    ring.run(20 * ROUND);
    assert_eq!(ring.leaders(), [6], "and it stays");
}

#[test]
fn a_candidate_follows_whoever_leads() {
    let mut candidate = Election::new(9, 0);
    let own = candidate.round(2 * ROUND).unwrap();
    candidate.follow(2 * ROUND + 10);
    assert_eq!(candidate.round(4 * ROUND + 9), None);
    let leaders = Token { rank: LEADER | 7, hops: 3 };
    assert_eq!(candidate.hear(leaders, 2 * ROUND + 20), Some(Token { hops: 4, ..leaders }));
    assert_eq!(candidate.hear(Token { hops: 6, ..own }, 2 * ROUND + 30), Some(Token { hops: 7, ..own }));
    assert_eq!(candidate.ring(), None);
}

#[test]
fn a_token_whose_candidate_is_gone_ends_and_another_leads() {
    for at in 0..6 {
        let mut ring = Ring::new(&[3, 5, 7, 11, 13, 17]);
        ring.modules[at].stand(1);
        ring.run(4);
        ring.modules[at] = Election::new(19, ring.now); // it was reset
        ring.run(2 * ROUND + 20);
        assert_eq!(ring.leaders(), [6], "{at}");
    }
}

#[test]
fn a_token_that_is_sent_again_is_passed_on_again_and_one_that_comes_round_again_is_not() {
    let mut follower = Election::new(1, 0);
    let token = Token { rank: 5, hops: 3 };
    let on = Some(Token { hops: 4, ..token });
    assert_eq!([10, 20].map(|now| follower.hear(token, now)), [on; 2]);
    assert_eq!(follower.hear(Token { hops: 9, ..token }, 30), None);
    assert_eq!(follower.next_due(30), 2 * ROUND - 10, "and nobody waits for it");
    // It passes on all that comes of another candidate.
    assert!(follower.hear(Token { rank: 6, hops: 9 }, 40).is_some());
    // In another ring the same rank is another token.
    follower.leave(50);
    assert!(follower.hear(Token { rank: 6, hops: 12 }, 60).is_some());
}

/// The ring is cut, takes up modules elsewhere meanwhile, and is closed again. All modules behind those have
/// seen the leader's last token when it had passed fewer modules.
#[test]
fn a_ring_that_grew_while_it_was_cut_elsewhere_has_its_leaders_token_come_round() {
    for (rounds_cut, behind, more) in [(1, 2, 1), (2, 2, 1), (3, 2, 1), (1, 1, 4), (1, 4, 4)] {
        let mut ring = Ring::new(&[3, 5, 7, 11, 13, 17, 19]);
        ring.run(6 * ROUND);
        let leader = ring.modules.iter().position(|module| module.ring().is_some()).unwrap();
        ring.modules.rotate_left(leader);
        ring.under_way.rotate_left(leader);
        let beat = |ring: &mut Ring| {
            let now = ring.now;
            ring.modules.iter_mut().filter(|module| module.ring().is_none()).for_each(|it| it.follow(now));
        };
        for _ in 0..rounds_cut * ROUND {
            ring.run(1);
            ring.under_way[6] = None;
            beat(&mut ring);
        }
        ring.modules[behind].leave(ring.now); // no module was in front of it for a moment
        for module in 0..more {
            ring.modules.insert(behind, Election::new(23 + module, ring.now));
            ring.under_way.insert(behind, None);
        }
        for _ in 0..5 * ROUND {
            ring.run(1);
            beat(&mut ring);
        }
        assert_eq!(ring.leaders(), [7 + more], "cut for {rounds_cut} rounds, {more} more behind {behind}");
    }
}

/// A part of a ring is closed to a ring of its own while the leader's token is in it.
#[test]
fn a_token_that_a_smaller_ring_has_caught_ends_soon() {
    let mut ring = Ring::new(&(0..60).map(|module| module * 31 + 3).collect::<Vec<u16>>());
    ring.run(6 * ROUND);
    let leader = ring.modules.iter().position(|module| module.ring().is_some()).unwrap();
    ring.modules.rotate_left(leader);
    ring.under_way.rotate_left(leader);
    while ring.under_way[42].is_none() {
        ring.run(1);
    }
    ring.modules = ring.modules.drain(40..44).collect();
    ring.under_way = ring.under_way.drain(40..44).collect();
    ring.run(100);
    assert_eq!(ring.under_way, [None; 4]);
    ring.run(4 * ROUND);
    assert_eq!(ring.leaders(), [4]);
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
