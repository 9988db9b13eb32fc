//! The longest path through a function, by implicit path enumeration (Li and Malik, "Performance Analysis of
//! Embedded Software Using Implicit Path Enumeration", 1995): how often each edge is taken is a variable of a
//! linear program. A node is left as often as it is entered; loops and notes bound how often from above.

use std::collections::{BTreeMap, BTreeSet};

use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem, Variable};

/// The most cycles of a path: some hours. Farther numbers would not be exact, and their sums would overflow.
const MOST: u64 = 1 << 40;

/// A function's edges, and the bounds of the paths through them.
pub struct Paths<Node> {
    /// From, to, cycles.
    pub edges: Vec<(Node, Node, u64)>,
    pub loops: Vec<Bounded<Node>>,
    /// Nodes, and how often they are executed at most, together.
    pub limits: Vec<(BTreeSet<Node>, u64)>,
}

/// A loop whose header is executed `turns` times at most, each time that the loop is entered.
pub struct Bounded<Node> {
    pub header: Node,
    pub nodes: BTreeSet<Node>,
    pub turns: u64,
}

impl<Node> Default for Paths<Node> {
    fn default() -> Self {
        Paths { edges: Vec::new(), loops: Vec::new(), limits: Vec::new() }
    }
}

impl<Node: Copy + Ord> Paths<Node> {
    /// The longest path, in cycles, from one of `starts`, each with the cycles before it, to one of `ends`,
    /// each with the cycles of its own. `None` if no path leads from any start to any end.
    ///
    /// # Errors
    /// No path keeps within the bounds, a loop has no bound, or the path takes more than [`MOST`] cycles.
    pub fn longest(
        &self,
        starts: &BTreeMap<Node, u64>,
        ends: &BTreeMap<Node, u64>,
    ) -> Result<Option<u64>, microlp::Error> {
        let reached = self.reachable(starts);
        if !ends.keys().any(|end| reached.contains(end)) {
            return Ok(None);
        }
        let mut program = Problem::new(OptimizationDirection::Maximize);
        let mut ways: BTreeMap<Node, Ways> = BTreeMap::new();
        // An edge from `None` begins the path.
        let mut edges = Vec::new();
        let [mut first, mut last] = [LinearExpr::empty(), LinearExpr::empty()];
        for (&start, &length) in starts {
            let taken = program.add_var(length as f64, (0.0, 1.0));
            ways.entry(start).or_default().into.push(taken);
            first.add(taken, 1.0);
            edges.push((None, start, taken));
        }
        for &(from, to, length) in self.edges.iter().filter(|(from, _, _)| reached.contains(from)) {
            let taken = program.add_var(length as f64, (0.0, f64::INFINITY));
            if from == to {
                ways.entry(from).or_default().back.push(taken);
            } else {
                ways.entry(from).or_default().out.push(taken);
                ways.entry(to).or_default().into.push(taken);
            }
            edges.push((Some(from), to, taken));
        }
        for (&end, &length) in ends.iter().filter(|(end, _)| reached.contains(end)) {
            let taken = program.add_var(length as f64, (0.0, 1.0));
            ways.entry(end).or_default().out.push(taken);
            last.add(taken, 1.0);
        }
        program.add_constraint(first, ComparisonOp::Eq, 1.0);
        program.add_constraint(last, ComparisonOp::Eq, 1.0);
        for ways in ways.values() {
            program.add_constraint(ways.balance(), ComparisonOp::Eq, 0.0);
        }
        for one in &self.loops {
            let more = one.turns.saturating_sub(1) as f64;
            let mut turns = LinearExpr::empty();
            for &(from, to, taken) in edges.iter().filter(|(_, to, _)| one.nodes.contains(to)) {
                if from.is_none_or(|from| !one.nodes.contains(&from)) {
                    turns.add(taken, -more);
                } else if to == one.header {
                    turns.add(taken, 1.0);
                }
            }
            program.add_constraint(turns, ComparisonOp::Le, 0.0);
        }
        for (nodes, most) in &self.limits {
            let mut times = LinearExpr::empty();
            let all = nodes.iter().filter_map(|node| ways.get(node));
            all.flat_map(|ways| ways.out.iter().chain(&ways.back)).for_each(|&taken| times.add(taken, 1.0));
            program.add_constraint(times, ComparisonOp::Le, *most as f64);
        }
        // The optimum is a bound even if the counts are not whole numbers, and rounding is far below a cycle.
        let interrupted = |_| microlp::Error::InternalError("interrupted without a limit".to_owned());
        let solution = program.solve()?.into_solution().map_err(interrupted)?;
        let cycles = solution.objective().round() as u64;
        if cycles > MOST {
            return Err(microlp::Error::InternalError(format!("a path of {cycles} cycles")));
        }
        Ok(Some(cycles))
    }

    /// Whether a path through these nodes alone can come back to `header`.
    pub fn is_cycle(&self, header: Node, nodes: &BTreeSet<Node>) -> bool {
        let within = self.edges.iter().filter(|(from, to, _)| nodes.contains(from) && nodes.contains(to));
        let edges: Vec<_> = within.copied().collect();
        let next = edges.iter().filter(|(from, _, _)| *from == header).map(|&(_, to, _)| (to, 0)).collect();
        Paths { edges, ..Paths::default() }.reachable(&next).contains(&header)
    }

    fn reachable(&self, starts: &BTreeMap<Node, u64>) -> BTreeSet<Node> {
        let mut next: BTreeMap<Node, Vec<Node>> = BTreeMap::new();
        self.edges.iter().for_each(|&(from, to, _)| next.entry(from).or_default().push(to));
        let mut reached = BTreeSet::new();
        let mut due: Vec<_> = starts.keys().copied().collect();
        while let Some(node) = due.pop() {
            if reached.insert(node) {
                due.extend(next.get(&node).into_iter().flatten());
            }
        }
        reached
    }
}

/// The edges into a node, out of it, and from it to itself.
#[derive(Default)]
struct Ways {
    into: Vec<Variable>,
    out: Vec<Variable>,
    back: Vec<Variable>,
}

impl Ways {
    /// How much more often the node is left than entered.
    fn balance(&self) -> LinearExpr {
        let mut balance = LinearExpr::empty();
        self.out.iter().for_each(|&taken| balance.add(taken, 1.0));
        self.into.iter().for_each(|&taken| balance.add(taken, -1.0));
        balance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn longest(edges: &[(u32, u32, u64)], loops: &[(u32, &[u32], u64)], end: u32) -> Option<u64> {
        let loops = loops.iter().map(|&(header, nodes, turns)| Bounded {
            header,
            nodes: nodes.iter().copied().collect(),
            turns,
        });
        let paths = Paths { edges: edges.to_vec(), loops: loops.collect(), limits: vec![] };
        paths.longest(&[(0, 0)].into(), &[(end, 0)].into()).expect("each loop is bounded")
    }

    #[test]
    fn of_two_ways_the_longer() {
        let edges = [(0, 1, 1), (0, 2, 5), (1, 3, 3), (2, 3, 1), (3, 4, 1)];
        assert_eq!(longest(&edges, &[], 4), Some(7));
        assert_eq!(longest(&edges, &[], 1), Some(1));
        assert_eq!(longest(&edges, &[], 9), None, "nothing leads there");
    }

    /// Ten turns of 3, the last of which ends at the header.
    #[test]
    fn a_loop_that_asks_first() {
        let edges = [(0, 1, 1), (1, 2, 1), (2, 1, 2), (1, 3, 2)];
        assert_eq!(longest(&edges, &[(1, &[1, 2], 10)], 3), Some(1 + 9 * 3 + 2));
    }

    /// A body of 7 that is executed ten times.
    #[test]
    fn a_loop_that_asks_last() {
        assert_eq!(longest(&[(0, 1, 1), (1, 1, 7), (1, 2, 6)], &[(1, &[1], 10)], 2), Some(1 + 9 * 7 + 6));
    }

    #[test]
    fn a_loop_in_a_loop() {
        let edges = [(0, 1, 1), (1, 2, 1), (2, 2, 4), (2, 3, 3), (3, 1, 2), (3, 4, 1)];
        let inner = 2 * 4 + 3;
        let loops: [(u32, &[u32], u64); 2] = [(1, &[1, 2, 3], 5), (2, &[2], 3)];
        assert_eq!(longest(&edges, &loops, 4), Some(1 + 4 * (1 + inner + 2) + 1 + inner + 1));
    }

    #[test]
    fn a_path_of_days_is_none() {
        let edges = vec![(0, 1, 1), (1, 1, 7), (1, 2, 6)];
        for turns in [1 << 40, u64::MAX] {
            let loops = vec![Bounded { header: 1, nodes: [1].into(), turns }];
            let paths = Paths { edges: edges.clone(), loops, limits: vec![] };
            assert!(paths.longest(&[(0, 0)].into(), &[(2, 0)].into()).is_err(), "{turns} turns");
        }
    }

    /// From the middle of a loop three more iterations follow.
    #[test]
    fn a_path_that_begins_in_a_loop() {
        let edges = vec![(1, 2, 1), (2, 1, 2), (1, 3, 5)];
        let loops = vec![Bounded { header: 1, nodes: [1, 2].into(), turns: 4 }];
        let paths = Paths { edges, loops, limits: vec![] };
        assert_eq!(paths.longest(&[(2, 10)].into(), &[(3, 0)].into()).ok(), Some(Some(10 + 2 + 2 * 3 + 5)));
    }

    #[test]
    fn one_of_two_calls() {
        let edges = vec![(0, 1, 100), (0, 2, 1), (1, 2, 1), (2, 3, 50), (2, 4, 1), (3, 4, 1)];
        let mut paths = Paths { edges, loops: vec![], limits: vec![] };
        let ends = [(4, 0)].into();
        assert_eq!(paths.longest(&[(0, 0)].into(), &ends).ok(), Some(Some(152)));
        paths.limits.push(([1, 3].into(), 1));
        assert_eq!(paths.longest(&[(0, 0)].into(), &ends).ok(), Some(Some(102)));
        paths.limits.push(([2].into(), 0));
        assert!(paths.longest(&[(0, 0)].into(), &ends).is_err(), "all ways lead by 2");
    }
}
