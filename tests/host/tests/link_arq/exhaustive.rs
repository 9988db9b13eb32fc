//! Every order of events that can happen on a link, with any number of faults.

use std::collections::{HashSet, VecDeque};
use std::hash::{DefaultHasher, Hash, Hasher};

use simulation::arq::{End, Event, Link, Violation};
use tasks::dock::Dock;

/// How many messages each end sends.
const MESSAGES: [u16; 2] = [2, 1];
const RETRY_LIMIT: u8 = 1;
const CAPACITY: usize = 2;
/// The most resets, of both ends together. Each begins a new epoch, so without a limit the number of states
/// would be infinite.
const RESETS: u8 = 2;

/// The next event. The ends are 0 and 1.
#[derive(Clone, Copy, Debug)]
enum Action {
    Start(usize),
    TimeOut(usize),
    Arrive(usize),
    // The rest are faults.
    Supersede(usize),
    ArriveWithoutRoom(usize),
    ArriveTwice(usize),
    Lose(usize),
    Reflect(usize),
    Reset(usize),
}

impl Action {
    fn all() -> impl Iterator<Item = Action> {
        (0..2).flat_map(|end| {
            [
                Action::Start(end),
                Action::TimeOut(end),
                Action::Arrive(end),
                Action::Supersede(end),
                Action::ArriveWithoutRoom(end),
                Action::ArriveTwice(end),
                Action::Lose(end),
                Action::Reflect(end),
                Action::Reset(end),
            ]
        })
    }

    fn is_possible(self, link: &Link) -> bool {
        match self {
            Action::Start(end) => !link.ends[end].is_busy() && link.ends[end].next < MESSAGES[end],
            Action::Supersede(end) => link.ends[end].is_busy() && link.ends[end].next < MESSAGES[end],
            Action::TimeOut(end) => link.ends[end].is_busy(),
            Action::Arrive(end)
            | Action::ArriveWithoutRoom(end)
            | Action::ArriveTwice(end)
            | Action::Lose(end) => !link.ends[end].line.is_empty(),
            Action::Reflect(end) => !link.ends[end].echoes.is_empty(),
            Action::Reset(_) => true,
        }
    }

    fn apply(self, link: &mut Link) -> Result<Event, Violation> {
        match self {
            Action::Start(end) | Action::Supersede(end) => link.start(end),
            Action::TimeOut(end) => return Ok(link.time_out(end)),
            Action::Arrive(end) => return arrive(link, end, true),
            Action::ArriveWithoutRoom(end) => return arrive(link, end, false),
            Action::ArriveTwice(end) => {
                let copy = link.ends[end].line[0].clone();
                link.ends[end].line.push_front(copy);
                return arrive(link, end, true);
            }
            Action::Lose(end) => drop(link.ends[end].line.pop_front()),
            Action::Reflect(end) => return link.reflect(end),
            Action::Reset(end) => link.reset(end),
        }
        Ok(Event::Nothing)
    }
}

fn arrive(link: &mut Link, end: usize, room: bool) -> Result<Event, Violation> {
    let wire = link.ends[end].line.pop_front().expect("the action is possible");
    link.arrive(end, &wire, room)
}

/// The step that led to a state: the index of the state before, and the action there.
#[derive(Clone, Copy)]
struct Step {
    before: usize,
    action: Action,
}

struct Search {
    /// Fingerprints of the states seen, each with the number of resets left.
    seen: HashSet<u64>,
    /// Fingerprints of the states from which recovery was tried.
    recovered: HashSet<u64>,
    /// The step to each state but the first, in the order in which the states were found.
    steps: Vec<Step>,
    /// How many attempts a message may take on a line that has become perfect.
    attempts: usize,
}

impl Search {
    /// Searches breadth first, so that a path to a violation is a shortest one.
    fn explore(&mut self, start: Link, resets: u8) {
        let mut frontier = VecDeque::from([(start, resets, 0)]);
        while let Some((link, resets, place)) = frontier.pop_front() {
            if self.recovered.insert(fingerprint(&link)) {
                self.recovers(link.clone(), place);
            }
            for action in Action::all().filter(|action| action.is_possible(&link)) {
                let is_reset = matches!(action, Action::Reset(_));
                let Some(resets) = resets.checked_sub(is_reset.into()) else { continue };
                let mut next = link.clone();
                if let Err(violation) = action.apply(&mut next) {
                    panic!("{violation:?} when {action:?} follows {:?}", self.way_to(place));
                }
                if self.seen.insert(fingerprint(&(&next, resets))) {
                    self.steps.push(Step { before: place, action });
                    frontier.push_back((next, resets, self.steps.len()));
                }
            }
        }
    }

    /// The actions up to a state.
    fn way_to(&self, place: usize) -> Vec<Action> {
        let step = |place: usize| place.checked_sub(1).map(|index| self.steps[index]);
        let steps = std::iter::successors(step(place), |last| step(last.before));
        let mut way: Vec<Action> = steps.map(|step| step.action).collect();
        way.reverse();
        way
    }

    /// Continues without faults: outstanding messages come to an end, and then new messages pass in both
    /// directions at once.
    fn recovers(&self, mut link: Link, place: usize) {
        self.settle(&mut link, [false; 2], place);
        let mut delivered = [false; 2];
        for _ in 0..self.attempts {
            for end in (0..2).filter(|end| !delivered[*end]) {
                link.start(end);
            }
            delivered = self.settle(&mut link, delivered, place);
        }
        assert_eq!(delivered, [true; 2], "no recovery after {:?}", self.way_to(place));
    }

    /// Runs until nothing is outstanding or under way. Returns the ends whose messages were delivered.
    fn settle(&self, link: &mut Link, mut delivered: [bool; 2], place: usize) -> [bool; 2] {
        for _ in 0..100 {
            let arrival = [Action::Arrive(0), Action::Arrive(1)];
            let time_out = [Action::TimeOut(0), Action::TimeOut(1)];
            let mut next = arrival.into_iter().chain(time_out).enumerate();
            let Some((index, action)) = next.find(|(_, action)| action.is_possible(link)) else {
                return delivered;
            };
            match action.apply(link) {
                Ok(event) => delivered[index % 2] |= event == Event::Delivered,
                Err(violation) => panic!("{violation:?} when settling after {:?}", self.way_to(place)),
            }
        }
        panic!("no end after {:?}", self.way_to(place));
    }
}

fn fingerprint(state: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    state.hash(&mut hasher);
    hasher.finish()
}

/// Searches all orders of events.
fn search(docks: [Dock; 2], seeds: [u16; 2], attempts: usize) {
    let ends = [0, 1].map(|end| End::new(docks[end], seeds[end], RETRY_LIMIT));
    let (seen, recovered) = (HashSet::new(), HashSet::new());
    let mut search = Search { seen, recovered, steps: Vec::new(), attempts };
    search.explore(Link::new(ends, CAPACITY), RESETS);
    println!("{} states", search.seen.len());
    assert!(search.seen.len() > 100_000, "the search ends early");
}

#[test]
fn docks_of_different_number_with_different_epochs() {
    search([Dock::Back, Dock::Front], [0x1020, 0x3080], 1);
}

#[test]
fn docks_of_different_number_with_equal_epochs() {
    search([Dock::Back, Dock::Front], [0x1020, 0x1020], 1);
}

#[test]
fn docks_of_the_same_number_with_different_epochs() {
    search([Dock::Left, Dock::Left], [0x1020, 0x3080], 1);
}

/// Each end takes the other for its own reflection until one of them begins a new epoch.
#[test]
fn docks_of_the_same_number_with_equal_epochs() {
    search([Dock::Left, Dock::Left], [0x1020, 0x3020], 3);
}
