//! The tree of a sequence's next frame: the last one's with new boxes while that is good enough, otherwise a new one.

use super::tree::{part_space, upper_tree, Part, Rebase, Tree};
use crate::bvh::Quality;
use crate::report;
use crate::scene::Soup;
use rayon::prelude::*;
use std::ops::Range;

/// A tree is refitted for the next frame of a sequence as long as that makes it cost at most so many times what it did when it was built.
/// By the heuristic a ray then takes 1.3 times as long; a sequence's frame traces many rays, so that a new tree soon pays.
const MOST_LOOSE: f64 = 1.3;

impl Tree {
    /// The trees for the next frame of a sequence: these with new boxes if the soup has as many triangles in each part and no
    /// part's cost exceeds 1.3 times its cost when it was built; otherwise new ones.
    pub fn next(&self, soup: &Soup, rebase: Rebase, quality: Quality) -> Self {
        let refitted = self.has_parts_of(soup).then(|| self.refitted(soup, rebase));
        // Of the part that has become loosest.
        let looseness = |part: &&Part| part.bvh.stats().sah_cost / part.built_cost();
        let loosest = |tree: &Self| {
            let by_looseness = |a: &&Part, b: &&Part| looseness(a).total_cmp(&looseness(b));
            tree.parts.iter().max_by(by_looseness).map(|part| (part.built_cost(), part.bvh.stats().sah_cost))
        };
        let costs = refitted.as_ref().and_then(loosest);
        let update = |action| report::TreeUpdate {
            action,
            built_cost: costs.map(|(built, _)| built),
            refitted_cost: costs.map(|(_, refitted)| refitted),
        };
        match (refitted, costs) {
            (Some(tree), Some((built, now))) if quality == self.quality && now <= MOST_LOOSE * built => {
                Self { update: Some(update("refitted")), ..tree }
            }
            _ => {
                let tree = Self::build(soup, rebase, quality);
                Self { update: Some(update("rebuilt")), rounds_outward: self.rounds_outward, ..tree }
            }
        }
    }

    /// The soup has as many triangles in each part as the one that these trees are over.
    fn has_parts_of(&self, soup: &Soup) -> bool {
        let primitives = |part: &Part| part.bvh.order.iter().max().map_or(0, |last| *last as usize + 1);
        self.parts.len() == soup.parts.len()
            && self.parts.iter().zip(&soup.parts).all(|(part, range)| primitives(part) == range.len())
    }

    /// The same trees with the boxes of a soup whose triangles have moved.
    fn refitted(&self, soup: &Soup, rebase: Rebase) -> Self {
        let part = |(part, range): (&Part, &Range<usize>)| {
            let rebase = part_space(soup, range, rebase);
            let triangles: Vec<_> =
                soup.positions[range.clone()].par_iter().map(|corners| rebase.triangle(corners)).collect();
            let mut bvh = part.bvh.clone();
            bvh.refit(&triangles);
            Part { bvh, rebase, built_cost: Some(part.built_cost()) }
        };
        let parts: Vec<Part> = self.parts.par_iter().zip(&soup.parts).map(part).collect();
        let upper = upper_tree(soup, &parts, rebase);
        let Self { quality, rounds_outward, .. } = *self;
        Self { parts, upper, rebase, quality, rounds_outward, update: None }
    }
}
