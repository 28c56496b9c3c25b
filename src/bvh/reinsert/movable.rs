//! A tree whose subtrees can move, and back again.
//!
//! A child is named by its slot: child `slot % 2` of node `slot / 2`. A subtree moves together with its parent's node, which
//! becomes the parent of it and of what was in the new place; the sibling takes the parent's old slot.

use super::super::references::Box4;
use super::super::{Child, Node};
use glam::Vec4;

/// Where the root is.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// A child: 32 bytes, its half area and what it is in the lanes that the box does not need.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    lo: Vec4,
    hi: Vec4,
}

impl Slot {
    /// `content` is an inner node, or the complement of the slot where a leaf was in the tree as built.
    fn new(bounds: &Box4, content: u32) -> Self {
        let Box4 { mut lo, mut hi } = *bounds;
        (lo.w, hi.w) = (f32::from_bits(content), bounds.half_area());
        Self { lo, hi }
    }

    pub fn bounds(&self) -> Box4 {
        Box4 { lo: self.lo, hi: self.hi }
    }

    pub fn area(&self) -> f32 {
        self.hi.w
    }

    fn content(&self) -> u32 {
        self.lo.w.to_bits()
    }

    /// The inner node in this slot.
    pub fn node(&self) -> Option<usize> {
        let content = self.content();
        (content >> 31 == 0).then_some(content as usize)
    }
}

pub(super) struct Tree {
    pub slots: Vec<Slot>,
    /// Where each node is; the root is always node 0.
    pub slot_of: Vec<u32>,
    /// Levels of inner nodes from each node down, itself counted; not kept for the root.
    heights: Vec<u8>,
}

impl Tree {
    /// The tree as built, its boxes as tight as those of its leaves.
    pub fn of(nodes: &[Node]) -> Self {
        let mut slot_of = vec![NO_SLOT; nodes.len()];
        let mut slots = Vec::with_capacity(2 * nodes.len());
        for (bounds, child) in nodes.iter().flat_map(|node| node.bounds.iter().zip(&node.children)) {
            let slot = slots.len() as u32;
            let content = match *child {
                Child::Node(below) => {
                    slot_of[below as usize] = slot;
                    below
                }
                Child::Leaf { .. } => !slot,
            };
            slots.push(Slot::new(&(*bounds).into(), content));
        }
        let mut tree = Self { slots, slot_of, heights: vec![1; nodes.len()] };
        // A node comes before what is below it. Where triangles are cut, its box may be wider than its children's.
        for slot in (0..tree.slots.len() as u32).rev() {
            tree.fit(slot);
        }
        tree
    }

    pub fn slot(&self, slot: u32) -> &Slot {
        &self.slots[slot as usize]
    }

    /// Where the node of a slot is.
    pub fn above(&self, slot: u32) -> u32 {
        self.slot_of[(slot / 2) as usize]
    }

    /// Levels of inner nodes at and below a slot.
    pub fn height(&self, slot: u32) -> u8 {
        self.slot(slot).node().map_or(0, |node| self.heights[node])
    }

    /// The slots of the nodes that a slot is in, from the innermost up to the root's child.
    pub fn ancestors(&self, slot: u32) -> impl Iterator<Item = u32> + '_ {
        let above = |slot: u32| Some(self.above(slot)).filter(|above| *above != NO_SLOT);
        std::iter::successors(above(slot), move |slot| above(*slot))
    }

    /// Takes a subtree out with its parent's node and returns the half area that this frees.
    pub fn take(&mut self, from: u32) -> f32 {
        let old = self.above(from);
        let freed = self.slot(old).area();
        self.fill(old, *self.slot(from ^ 1));
        freed + self.fit_above(old)
    }

    /// Puts a subtree that was taken out beside what is at `to`.
    pub fn put(&mut self, from: u32, to: u32) {
        self.fill(from ^ 1, *self.slot(to));
        self.fill(to, Slot::new(&Box4::EMPTY, from / 2));
        self.fit_above(from);
    }

    /// Puts content in a slot.
    fn fill(&mut self, slot: u32, content: Slot) {
        self.slots[slot as usize] = content;
        if let Some(node) = content.node() {
            self.slot_of[node] = slot;
        }
    }

    /// Fits all nodes above a slot to their children and returns the half area that this frees.
    fn fit_above(&mut self, slot: u32) -> f32 {
        let mut freed = 0.0;
        let mut above = self.above(slot);
        while above != NO_SLOT {
            freed += self.slot(above).area();
            self.fit(above);
            freed -= self.slot(above).area();
            above = self.above(above);
        }
        freed
    }

    /// Makes box and height of the node in a slot, if there is one, those of its children.
    fn fit(&mut self, slot: u32) {
        if let Some(node) = self.slot(slot).node() {
            let [left, right] = [2 * node as u32, 2 * node as u32 + 1];
            self.heights[node] = 1 + self.height(left).max(self.height(right));
            let bounds = self.slot(left).bounds().union(&self.slot(right).bounds());
            self.slots[slot as usize] = Slot::new(&bounds, node as u32);
        }
    }

    /// The tree in depth-first order, with the leaves of the tree as built.
    pub fn nodes(&self, built: &[Node]) -> Vec<Node> {
        let mut nodes: Vec<Node> = Vec::with_capacity(built.len());
        let mut stack = vec![(0, NO_SLOT)];
        while let Some((node, parent)) = stack.pop() {
            let own = nodes.len() as u32;
            if let Some(parent_node) = nodes.get_mut((parent / 2) as usize) {
                parent_node.children[(parent % 2) as usize] = Child::Node(own);
            }
            let slots = [self.slots[2 * node], self.slots[2 * node + 1]];
            let leaf = |slot: &Slot| match slot.node() {
                Some(_) => Child::Node(0),
                None => built[(!slot.content() / 2) as usize].children[(!slot.content() % 2) as usize],
            };
            nodes.push(Node {
                bounds: slots.map(|slot| slot.bounds().aabb()),
                children: [leaf(&slots[0]), leaf(&slots[1])],
            });
            stack.extend([1, 0].into_iter().filter_map(|side| Some((slots[side].node()?, 2 * own + side as u32))));
        }
        nodes
    }
}
