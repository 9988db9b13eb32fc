//! The loops of a function, and those inside of them.

use std::collections::BTreeSet;

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use stack_bound::flow::{Flow, Place};

/// A loop: every path into it leads through its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loop<Node> {
    pub header: Node,
    /// All of its nodes, including those of loops inside of it.
    pub nodes: BTreeSet<Node>,
    /// The loops inside of it, by header.
    pub inner: Vec<Loop<Node>>,
}

/// The outermost loops of a function that begins at `entry`.
///
/// # Errors
/// A second place at which a loop can be entered: no compiler makes such code from a program's loops.
pub fn of(flow: &Flow, entry: Place) -> Result<Vec<Loop<Place>>, Place> {
    let nodes = flow.nodes.keys().copied().collect();
    let next = |(&from, node): (&Place, &stack_bound::flow::Node)| {
        node.next.iter().map(move |&(to, _)| (from, to)).collect::<Vec<_>>()
    };
    let edges: Vec<_> = flow.nodes.iter().flat_map(next).collect();
    loops(&nodes, entry, &edges)
}

/// The outermost loops among `nodes`, by header.
fn loops<Node: Copy + Ord + std::hash::Hash>(
    nodes: &BTreeSet<Node>,
    entry: Node,
    edges: &[(Node, Node)],
) -> Result<Vec<Loop<Node>>, Node> {
    let mut graph = DiGraphMap::<Node, ()>::new();
    let within = edges.iter().filter(|(from, to)| nodes.contains(from) && nodes.contains(to));
    for &(from, to) in within.clone() {
        graph.add_edge(from, to, ());
    }
    let mut found = Vec::new();
    for component in tarjan_scc(&graph) {
        let component: BTreeSet<_> = component.into_iter().collect();
        if let Some(one) = component.first()
            && component.len() == 1
            && !graph.contains_edge(*one, *one)
        {
            continue;
        }
        let is_entered = |node: &Node| {
            *node == entry || edges.iter().any(|(from, to)| to == node && !component.contains(from))
        };
        let mut entered = component.iter().copied().filter(is_entered);
        let Some(header) = entered.next() else { continue }; // nothing leads here
        if let Some(other) = entered.next() {
            return Err(other);
        }
        let forward: Vec<_> = within.clone().copied().filter(|&(_, to)| to != header).collect();
        found.push(Loop { header, inner: loops(&component, header, &forward)?, nodes: component });
    }
    found.sort_by_key(|one| one.header);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(edges: &[(u32, u32)]) -> Result<Vec<Loop<u32>>, u32> {
        let nodes = edges.iter().flat_map(|&(from, to)| [from, to]).collect();
        loops(&nodes, 0, edges)
    }

    #[test]
    fn a_loop_in_a_loop() {
        let found = of(&[(0, 1), (1, 2), (2, 2), (2, 3), (3, 1), (3, 4)]).expect("each has one header");
        let inner = Loop { header: 2, nodes: [2].into(), inner: vec![] };
        assert_eq!(found, [Loop { header: 1, nodes: [1, 2, 3].into(), inner: vec![inner] }]);
    }

    #[test]
    fn no_loop() {
        assert_eq!(of(&[(0, 1), (0, 2), (1, 3), (2, 3)]), Ok(vec![]));
    }

    #[test]
    fn the_entry_may_be_a_header() {
        assert_eq!(of(&[(0, 1), (1, 0)]).map(|found| found[0].header), Ok(0));
    }

    #[test]
    fn two_ways_in() {
        assert_eq!(of(&[(0, 1), (0, 2), (1, 2), (2, 1)]), Err(2));
    }
}
