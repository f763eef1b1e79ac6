//! Circles: sets of more than one node each of which leads to every other.

use std::collections::{BTreeMap, BTreeSet};

/// The circles of a graph, largest first (Tarjan 1972, *Depth-first search and
/// linear graph algorithms*).
pub fn circles<T: Ord + Clone>(graph: &BTreeMap<T, BTreeSet<T>>) -> Vec<Vec<T>> {
    let mut search = Search { graph, marks: BTreeMap::new(), stack: Vec::new(), found: Vec::new() };
    for node in graph.keys() {
        if !search.marks.contains_key(node) {
            search.visit(node);
        }
    }
    let mut found = search.found;
    found.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    found
}

struct Mark {
    index: usize,
    low: usize,
    on_stack: bool,
}

struct Search<'a, T> {
    graph: &'a BTreeMap<T, BTreeSet<T>>,
    marks: BTreeMap<T, Mark>,
    stack: Vec<T>,
    found: Vec<Vec<T>>,
}

impl<T: Ord + Clone> Search<'_, T> {
    fn visit(&mut self, node: &T) -> usize {
        let index = self.marks.len();
        self.marks.insert(node.clone(), Mark { index, low: index, on_stack: true });
        self.stack.push(node.clone());
        let mut low = index;
        for next in self.graph.get(node).into_iter().flatten() {
            low = match self.marks.get(next) {
                None => low.min(self.visit(next)),
                Some(mark) if mark.on_stack => low.min(mark.index),
                Some(_) => low,
            };
        }
        if let Some(mark) = self.marks.get_mut(node) {
            mark.low = low;
        }
        if low == index {
            let from = self.stack.iter().position(|other| other == node).unwrap_or(0);
            let circle = self.stack.split_off(from);
            for member in &circle {
                if let Some(mark) = self.marks.get_mut(member) {
                    mark.on_stack = false;
                }
            }
            if circle.len() > 1 {
                self.found.push(circle);
            }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_found_and_a_chain_is_none() {
        let graph: BTreeMap<_, BTreeSet<_>> = [
            ("a", BTreeSet::from(["b"])),
            ("b", BTreeSet::from(["c"])),
            ("c", BTreeSet::from(["a", "d"])),
            ("d", BTreeSet::from(["e"])),
            ("e", BTreeSet::new()),
        ]
        .into();
        let found = circles(&graph);
        assert_eq!(found.len(), 1);
        assert_eq!(BTreeSet::from_iter(found[0].clone()), BTreeSet::from(["a", "b", "c"]));
    }
}
