use super::*;
use crate::random::Random;
use Dock::{Back, Front};

/// Modules in a row, the Back of each at the Front of the next; in a ring the last one's at the first one's.
struct Row {
    modules: Vec<Ledger>,
    is_ring: bool,
    now: u16,
    random: Random,
    /// So many of a hundred messages are lost.
    lost: u32,
    messages: usize,
}

impl Row {
    fn new(modules: usize, is_ring: bool, seed: u32, lost: u32) -> Self {
        let modules: Vec<Ledger> = (0..modules).map(|_| Ledger::new(1)).collect();
        let mut row = Row { modules, is_ring, now: 65_000, random: Random::new(seed), lost, messages: 0 };
        (0..row.modules.len()).for_each(|module| row.appears(module));
        row
    }

    fn peer(&self, module: usize, dock: Dock) -> Option<usize> {
        let last = self.modules.len() - 1;
        match dock {
            Front if module > 0 => Some(module - 1),
            Front => self.is_ring.then_some(last),
            _ if module < last => Some(module + 1),
            _ => self.is_ring.then_some(0),
        }
    }

    fn docks(&self, module: usize) -> DockSet {
        let mut docks = DockSet::EMPTY;
        [Front, Back]
            .into_iter()
            .filter(|&dock| self.peer(module, dock).is_some())
            .for_each(|dock| docks.insert(dock));
        docks
    }

    fn appears(&mut self, module: usize) {
        let docks = self.docks(module);
        self.modules[module].tell(docks, self.now);
    }

    /// A module is reset, and its neighbours notice; or they do not.
    fn reset(&mut self, module: usize, is_noticed: bool) {
        self.modules[module] = Ledger::new(1);
        self.appears(module);
        for (dock, theirs) in [(Front, Back), (Back, Front)] {
            if let Some(peer) = self.peer(module, dock).filter(|_| is_noticed) {
                self.modules[peer].tell(DockSet::of(&[theirs]), self.now);
            }
        }
    }

    fn order(&mut self, module: usize, gait: u8) {
        let docks = self.docks(module);
        if let Some(next) = self.modules[module].standing().next(gait, Period::OWN) {
            self.modules[module].set(next, docks, self.now);
        }
    }

    fn hear(&mut self, module: usize, dock: Dock, theirs: Standing, knows: bool) {
        let docks = self.docks(module).without(DockSet::of(&[dock]));
        let (ledger, now) = (&mut self.modules[module], self.now);
        if ledger.hear(dock, theirs, knows, now) {
            ledger.set(theirs, docks, now);
            ledger.hear(dock, theirs, false, now);
        }
    }

    /// A message arrives in the millisecond in which it is sent.
    fn run(&mut self, milliseconds: u16) {
        for _ in 0..milliseconds {
            self.now = self.now.wrapping_add(1);
            for module in 0..self.modules.len() {
                let (docks, now) = (self.docks(module), self.now);
                let mut due = self.modules[module].next_due(now);
                while let Some((docks, knows)) = self.modules[module].due(docks, now) {
                    assert_eq!(due, Some(0), "it is told when it said that it would be");
                    due = self.modules[module].next_due(now);
                    let standing = self.modules[module].standing();
                    for dock in docks.iter() {
                        self.messages += 1;
                        let peer = self.peer(module, dock).unwrap();
                        if self.random.below(100) >= self.lost {
                            self.hear(peer, if dock == Front { Back } else { Front }, standing, knows);
                        }
                    }
                }
            }
        }
    }

    fn gaits(&self) -> Vec<u8> {
        self.modules.iter().map(|ledger| ledger.standing().gait).collect()
    }
}

#[test]
fn an_order_reaches_all_and_then_all_is_quiet() {
    for (size, is_ring) in [(1, false), (2, false), (2, true), (6, true), (30, false), (31, true)] {
        for at in [0, size / 2, size - 1] {
            let mut row = Row::new(size, is_ring, 1, 0);
            row.run(20);
            row.order(at, 4);
            row.run(40);
            assert_eq!(row.gaits(), vec![4; size], "{size} at {at}");
            let links = if is_ring { size } else { size - 1 };
            assert!(row.messages <= 2 * 4 * links, "{} over {links} links", row.messages);
            row.messages = 0;
            row.run(700);
            assert_eq!(row.messages, 0);
            assert!(row.modules.iter().all(|ledger| ledger.next_due(row.now).is_none()));
        }
    }
}

#[test]
fn whatever_is_lost_the_newest_order_stands_everywhere() {
    for seed in 0..10 {
        let mut row = Row::new(6, seed % 2 == 0, seed, 50);
        for gait in 2..6 {
            let at = row.random.below(6) as usize;
            row.order(at, gait);
            let wait = 100 + row.random.below(3_000) as u16;
            row.run(wait);
            // Else it may be that no module knows the order any more.
            let reset = (at + 1 + row.random.below(5) as usize) % 6;
            let is_noticed = row.random.below(2) == 0;
            row.reset(reset, is_noticed);
            row.run(15_000);
            assert_eq!(row.gaits(), [gait; 6], "seed {seed}");
        }
        row.run(15_000);
        row.messages = 0;
        row.run(700);
        assert_eq!(row.messages, 0, "seed {seed}");
    }
}

#[test]
fn who_was_reset_learns_in_a_moment_whether_or_not_its_neighbours_notice() {
    for (reset, is_noticed) in [0, 3, 5].into_iter().flat_map(|reset| [(reset, false), (reset, true)]) {
        let mut row = Row::new(6, false, 1, 0);
        row.order(2, 7);
        row.run(20);
        row.reset(reset, is_noticed);
        row.run(3);
        assert_eq!(row.gaits(), [7; 6]);
    }
}

#[test]
fn a_robot_of_which_all_were_reset_goes_by_what_it_begins_with() {
    let mut row = Row::new(6, true, 1, 0);
    row.order(2, 7);
    row.run(20);
    (0..6).for_each(|module| row.reset(module, true));
    row.run(3_000);
    assert_eq!(row.gaits(), [1; 6]);
}

#[test]
fn who_has_no_order_is_told_one_and_two_that_have_none_leave_each_other_alone() {
    let (mut ledger, theirs) = (Ledger::new(1), Standing::none(2));
    assert!(!ledger.hear(Front, theirs, true, 0));
    assert_eq!(ledger.next_due(0), None);
    ledger.set(Standing { number: 0x8001, ..Standing::none(3) }, DockSet::EMPTY, 0);
    assert!(!ledger.hear(Front, theirs, true, 0));
    let front = DockSet::of(&[Front]);
    assert_eq!(ledger.due(front, 0), Some((front, false)));
}

#[test]
fn of_two_orders_one_supersedes_the_other_and_none_itself() {
    let numbers = [0, 1, 2, 0x3FFF, 0x4000, 0x4001, 0x7FFF, 0x8001, 0x8002, 0xC001, 0xC002, 0xFFFE, 0xFFFF];
    let orders = || {
        numbers.into_iter().flat_map(|number| [3, 4].map(|gait| Standing { number, ..Standing::none(gait) }))
    };
    for (one, other) in orders().flat_map(|one| orders().map(move |other| (one, other))) {
        let wins = [one.supersedes(other), other.supersedes(one)];
        let is_same = one == other || one.number == 0 && other.number == 0;
        assert_eq!(wins, if is_same { [false; 2] } else { [wins[0], !wins[0]] }, "{one:?}, {other:?}");
        assert!(!(one.number == 0 && wins[0]), "what stands at power-up");
    }
    let of = |number| Standing { number, ..Standing::none(3) };
    assert!(of(0x8002).supersedes(of(0xFFFF)) && of(2).supersedes(of(0x7FFF)), "numbers wrap");
    assert!(of(0x8001).supersedes(of(0x3FFF)), "what was given is newer than what was recalled");
    let to_stop = Standing { gait: STOP, ..of(0x8001) };
    assert!(to_stop.supersedes(of(0x8001)), "where two are given at once");
}

#[test]
fn an_order_has_the_next_number_unless_it_was_given_already_and_stands() {
    let of = |number| Standing { number, ..Standing::none(3) };
    let next = |last, gait| of(last).next(gait, Period::OWN).map(|order| order.number);
    assert_eq!([0xFFFF, 0x7FFF, 0, 7].map(|last| next(last, 4)), [0x8001, 0x8001, 0x8001, 0x8008].map(Some));
    assert_eq!((next(0x8001, 3), next(1, 3), next(0, 3)), (None, Some(0x8002), Some(0x8001)));
    assert_eq!(next(0x8001, STOP), Some(0x8011));
    let slower = Period::from_byte(80).unwrap();
    assert_eq!(of(0x8001).next(3, slower).map(|order| order.number), Some(0x8002));
}

#[test]
fn a_record_is_an_order_or_nothing() {
    for gait in 0..=u8::MAX {
        for (number, period) in [(0, 127), (1, 127), (0x7FFF, 5), (0x8000, 80), (3, 4), (3, 255)] {
            let [low, high] = u16::to_le_bytes(number);
            let record = [gait, low, high, period];
            let order = Standing::from_record(record);
            let is_one = usize::from(gait) <= GAITS.len() && [1, 0x7FFF].contains(&number);
            assert_eq!(order.is_some(), is_one, "{record:?}");
            assert!(order.is_none_or(|order| order.to_record() == record));
        }
    }
    let given = Standing::none(0).next(4, Period::OWN).unwrap();
    assert_eq!(Standing::from_record(given.to_record()), Some(Standing { number: 1, ..given }));
}
