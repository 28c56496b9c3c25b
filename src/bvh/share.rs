//! Leaves that hold the same primitives share their places in the order.
//!
//! A long triangle that spatial splits cut many times lies in many leaves, mostly with the same others: of the atrium's cables (see docs/performance.md) each
//! piece is a leaf of the same two or three. Stored once for each leaf, triangles took 1.5 times the memory that they take now.

use super::{Child, Node};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::HashMap;

/// Leaves look for each other among so many that lie one behind the other: those beyond are far away in the tree, and hardly the same.
const NEIGHBOURS: usize = 65536;

/// Where a leaf's primitives begin, and how many they are.
type Leaf = (usize, usize);

fn leaf(child: &Child) -> Option<Leaf> {
    match child {
        Child::Leaf { first, count: count @ 1.. } => Some((*first as usize, *count as usize)),
        _ => None,
    }
}

/// Renumbers the leaves below `nodes`, which lie in `order` one behind the other, so that a leaf whose primitives stand side by side in another has no places
/// of its own; returns the order that remains. Leaves still have what they had, each in an order of its own; they come in the order of their nodes.
pub(super) fn share_leaves(nodes: &mut [Node], mut order: Vec<u32>, primitives: usize) -> Vec<u32> {
    let mut leaves_of = vec![0_u32; primitives];
    order.iter().for_each(|primitive| leaves_of[*primitive as usize] += 1);
    let is_cut = |primitive: &u32| leaves_of[*primitive as usize] > 1;
    let leaves: Vec<Leaf> = nodes.iter().flat_map(|node| &node.children).filter_map(leaf).collect();
    let mut pieces = Vec::with_capacity(leaves.len().div_ceil(NEIGHBOURS));
    let mut rest = order.as_mut_slice();
    for leaves in leaves.chunks(NEIGHBOURS) {
        let (own, behind) = rest.split_at_mut(leaves.iter().map(|(_, count)| count).sum());
        pieces.push((leaves, own));
        rest = behind;
    }
    // In the order before, where each leaf's primitives stand.
    let stands: Vec<usize> = pieces.into_par_iter().flat_map_iter(|(leaves, own)| look(leaves, own, is_cut)).collect();
    let mut shared = Vec::with_capacity(primitives);
    let mut moved = vec![0_u32; order.len()];
    for ((first, count), stands) in leaves.iter().zip(&stands) {
        if first == stands {
            for place in *first..first + count {
                moved[place] = shared.len() as u32;
                shared.push(order[place]);
            }
        }
    }
    let mut stands = stands.into_iter();
    for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
        if let Child::Leaf { first, count: 1.. } = child {
            *first = stands.next().map_or(0, |place| moved[place]);
        }
    }
    shared
}

/// Puts what is cut of each leaf side by side, at its end, and returns for each of them where its primitives stand: in itself or in a larger leaf, as it lies in
/// the whole order. `order` is that of the leaves' primitives.
fn look(leaves: &[Leaf], order: &mut [u32], is_cut: impl Fn(&u32) -> bool) -> Vec<usize> {
    let begin = leaves.first().map_or(0, |(first, _)| *first);
    for (first, count) in leaves {
        order[first - begin..][..*count].sort_unstable_by_key(|primitive| (is_cut(primitive), *primitive));
    }
    let mut stands: Vec<usize> = leaves.iter().map(|(first, _)| *first).collect();
    // The largest first, of which others may be parts.
    let mut largest_first: Vec<usize> = (0..leaves.len()).collect();
    largest_first.sort_by_key(|leaf| Reverse(leaves[*leaf].1));
    let mut runs: HashMap<&[u32], usize> = HashMap::new();
    for leaf in largest_first {
        let (first, count) = leaves[leaf];
        let own = &order[first - begin..][..count];
        if let Some(place) = runs.get(own) {
            stands[leaf] = *place;
            continue;
        }
        let uncut = own.iter().take_while(|primitive| !is_cut(primitive)).count();
        for start in uncut..count {
            for end in start + 1..=count {
                runs.entry(&own[start..end]).or_insert(first + start);
            }
        }
    }
    stands
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves with these primitives, two a node, and what they hold when they share.
    fn shared(leaves: &[&[u32]]) -> (Vec<u32>, Vec<Vec<u32>>) {
        let mut order = Vec::new();
        let mut children = leaves.iter().map(|own| {
            order.extend_from_slice(own);
            Child::Leaf { first: (order.len() - own.len()) as u32, count: own.len() as u32 }
        });
        let mut nodes = Vec::new();
        while let (Some(left), right) = (children.next(), children.next()) {
            nodes.push(Node { children: [left, right.unwrap_or(Node::NOTHING.children[1])], ..Node::NOTHING });
        }
        let shared = share_leaves(&mut nodes, order, 2 * NEIGHBOURS);
        let held = nodes.iter().flat_map(|node| &node.children).filter_map(leaf).map(|(first, count)| {
            let mut held = shared[first..first + count].to_vec();
            held.sort_unstable();
            held
        });
        (shared.clone(), held.collect())
    }

    #[test]
    fn leaves_keep_what_they_hold() {
        let leaves: [&[u32]; 9] = [&[0, 7], &[7], &[1, 8, 2], &[2, 1], &[9, 8], &[8, 9], &[3], &[9, 8, 7, 4], &[5, 7]];
        let (shared, held) = shared(&leaves);
        for (own, held) in leaves.iter().zip(held) {
            let mut own = own.to_vec();
            own.sort_unstable();
            assert_eq!(own, held);
        }
        // [7], [2, 1], [9, 8] and [8, 9] stand in others, what is not cut is where it was.
        assert_eq!(shared, [0, 7, 1, 2, 8, 3, 4, 7, 8, 9, 5, 7]);
    }

    #[test]
    fn a_part_is_shared_whichever_comes_first() {
        assert_eq!(shared(&[&[4, 6], &[6, 4, 5]]).0.len(), 3);
        assert_eq!(shared(&[&[6, 4, 5], &[4, 6], &[6]]).0.len(), 3);
        assert_eq!(shared(&[&[6], &[6], &[6]]).0, [6]);
    }

    #[test]
    fn many_leaves_share_with_their_neighbours() {
        let numbers: Vec<u32> = (0..2 * NEIGHBOURS as u32 + 2).map(|place| place / 2).collect();
        let leaves: Vec<&[u32]> = numbers.chunks(1).collect();
        let (shared, held) = shared(&leaves);
        assert_eq!(shared, (0..=NEIGHBOURS as u32).collect::<Vec<_>>());
        assert!(held.iter().flatten().eq(&numbers));
    }

    #[test]
    fn what_is_not_cut_stays() {
        let leaves: [&[u32]; 3] = [&[2, 0], &[1], &[4, 3]];
        assert_eq!(shared(&leaves).0, [0, 2, 1, 3, 4]);
    }
}
