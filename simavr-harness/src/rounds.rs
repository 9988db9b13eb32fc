//! Decides which modules run next and how far, so that no module gets more than a window ahead of the modules
//! at its docks.

/// The fewest modules of a half. With fewer, the robot is not divided: threads would wait for each other.
const FEWEST: usize = 16;

/// The modules in two halves that take turns, where no two modules of a half are joined. A robot that is not
/// divided has all modules in the first half.
pub(crate) type Halves = [Vec<usize>; 2];

/// The cycle that each half has come to, and which half runs next.
pub(crate) struct Rounds {
    take_turns: bool,
    reached: [u64; 2],
    /// The longest window that each half allows, in cycles: the shortest frame of its own modules.
    windows: [u64; 2],
    last: usize,
}

/// A half of the modules, and the cycle up to which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Round {
    pub half: usize,
    pub end: u64,
}

impl Rounds {
    /// Begins with all modules at cycle `from`. `window` is the longest window that all of them allow.
    pub fn new(halves: &Halves, from: u64, window: u64) -> Self {
        Self { take_turns: !halves[1].is_empty(), reached: [from; 2], windows: [window; 2], last: 1 }
    }

    /// The next round on the way to `target`; `None` if all modules have come there.
    pub fn next(&mut self, target: u64) -> Option<Round> {
        let (half, other) = if self.take_turns { (1 - self.last, self.last) } else { (0, 0) };
        if self.reached[half] >= target {
            return None;
        }
        let window = self.windows[0].min(self.windows[1]);
        let end = (self.reached[other] + window).min(target);
        self.reached[half] = end;
        self.last = half;
        Some(Round { half, end })
    }

    /// Notes that the half that ran last allows windows of up to `window` cycles from now on.
    pub fn bear(&mut self, window: u64) {
        self.windows[self.last] = window;
    }
}

/// Divides the modules into halves. `joined` has the modules that each module is joined to.
pub(crate) fn halves(joined: &[Vec<usize>]) -> Halves {
    let are_enough = |halves: &Halves| halves.iter().all(|half| half.len() >= FEWEST);
    divide(joined).filter(are_enough).unwrap_or_else(|| [(0..joined.len()).collect(), Vec::new()])
}

/// `None` if some modules form a ring of odd length, which cannot be divided.
fn divide(joined: &[Vec<usize>]) -> Option<Halves> {
    let mut of = vec![None; joined.len()];
    for start in 0..joined.len() {
        let mut waiting = vec![(start, of[start].unwrap_or(0))];
        while let Some((module, half)) = waiting.pop() {
            match of[module] {
                None => {
                    of[module] = Some(half);
                    waiting.extend(joined[module].iter().map(|&other| (other, 1 - half)));
                }
                Some(is) if is != half => return None,
                Some(_) => {}
            }
        }
    }
    Some([0, 1].map(|half| (0..of.len()).filter(|&module| of[module] == Some(half)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(modules: usize) -> Vec<Vec<usize>> {
        let near = |module: usize| [module.wrapping_sub(1), module + 1].into_iter().filter(|&n| n < modules);
        (0..modules).map(|module| near(module).collect()).collect()
    }

    fn ring(modules: usize) -> Vec<Vec<usize>> {
        (0..modules).map(|module| vec![(module + 1) % modules, (module + modules - 1) % modules]).collect()
    }

    /// Runs rounds to `target`; each window is drawn from `windows` in turn. Returns how often modules ran.
    fn run(joined: &[Vec<usize>], target: u64, windows: &[u64]) -> usize {
        let halves = halves(joined);
        let mut rounds = Rounds::new(&halves, 0, windows[0]);
        let mut reached = vec![0; joined.len()];
        let mut runs = 0;
        for window in windows.iter().cycle() {
            let Some(Round { half, end }) = rounds.next(target) else { break };
            let before = reached.clone();
            for &module in &halves[half] {
                assert!(end > reached[module], "module {module} stands still at {end}");
                for &other in &joined[module] {
                    let ahead = end.saturating_sub(before[other]);
                    assert!(ahead <= *windows.iter().max().unwrap(), "{module} is {ahead} ahead of {other}");
                }
                reached[module] = end;
                runs += 1;
            }
            rounds.bear(*window);
        }
        assert!(reached.iter().all(|&cycle| cycle == target), "{reached:?}");
        runs
    }

    #[test]
    fn halves_take_turns_of_two_windows() {
        // To 100, 300, 500 .. 1500, 1600 and to 200, 400 .. 1600.
        assert_eq!(run(&chain(32), 1600, &[100]), 16 * 9 + 16 * 8);
        assert_eq!(run(&ring(64), 1600, &[100]), 32 * 9 + 32 * 8);
    }

    #[test]
    fn modules_that_are_few_or_joined_in_an_odd_ring_run_at_once() {
        for joined in [chain(31), ring(65), vec![vec![0]; 64]] {
            assert_eq!(run(&joined, 1600, &[100]), 16 * joined.len());
        }
    }

    #[test]
    fn windows_may_shrink_and_grow() {
        run(&chain(40), 10_000, &[100, 7, 55, 100, 1, 99]);
        run(&ring(41), 10_000, &[100, 7, 55, 100, 1, 99]);
    }

    #[test]
    fn all_come_to_each_target() {
        let mut rounds = Rounds::new(&halves(&chain(32)), 0, 100);
        for target in [1000, 1050, 1051, 4000] {
            while rounds.next(target).is_some() {}
            assert_eq!(rounds.reached, [target; 2]);
        }
    }
}
