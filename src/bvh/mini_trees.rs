//! A fast tree over many references: they are gathered by the cells of a grid, each cell gets a tree of its own, and the tops of those, where
//! the grid decided and not the surface area heuristic, give way to one tree over what is below (Ganestam, Barringer, Doggett
//! and Akenine-Möller, Bonsai: rapid bounding volume hierarchy generation using mini trees, JCGT 4(3), 2015).
//!
//! From the top down every level moves every reference through the whole memory; here that is done once, and the levels that
//! remain are those of a few hundred references.

use super::build::{Builder, Recipe, Tree};
use super::references::{cells_per_unit, Box4, Reference, Summary};
use super::{Bvh, Child, Node};
use crate::layout::MAX_TREE_DEPTH;
use glam::Vec4;
use rayon::prelude::*;

/// References for each cell of the grid; as most cells are empty, others get a few hundred.
const PER_CELL: usize = 64;
/// The finest grid has 2 to this power cells.
const MOST_CELL_BITS: u32 = 15;
/// A cell with more references gets a grid of its own: it is where a scene has its details.
const CROWD: usize = 8192;
/// References are ordered by cells in so many parts, whatever the number of threads.
const PARTS: usize = 32;
/// What remains of a mini tree has no more surface than so many times the mini trees' mean.
const LARGEST: f32 = 0.5;
/// Mini trees and the tree above them may each have half of all levels.
const FIRST_LEVEL: u32 = MAX_TREE_DEPTH / 2 + 1;
/// Larger parts of the tree are written by two threads.
const PARALLEL: usize = 4096;

/// Builds over references without splits of space.
pub(super) fn build(references: &[Reference], recipe: Recipe) -> Bvh {
    let Summary { bounds, centers, .. } = Summary::of(references);
    let builder = Builder::new(recipe, &bounds);
    let trees = mini_trees(references, &centers, &builder);
    let mean_area = trees.iter().map(|mini| mini.tree.bounds.half_area()).sum::<f32>() / trees.len() as f32;
    let subtrees: Vec<Subtree> = trees.par_iter().flat_map_iter(|mini| mini.below(LARGEST * mean_area)).collect();
    let reference = |(index, subtree): (u32, &Subtree)| {
        Reference::new(subtree.bounds.lo.truncate(), subtree.bounds.hi.truncate(), index)
    };
    let mut leaves: Vec<Reference> = (0..).zip(&subtrees).map(reference).collect();
    let above = Builder::new(Recipe { smallest: 1, leaf: 1, ..recipe }, &bounds);
    let top = above.tree(&mut leaves, FIRST_LEVEL);
    let whole = Whole::new(&top.nodes, &leaves, &subtrees);
    let Size { nodes, primitives } = whole.size(top.root);
    let (mut nodes, mut order) = (vec![Node::NOTHING; nodes], vec![0; primitives]);
    let root = whole.write(top.root, Size::default(), &mut nodes, &mut order);
    Bvh::new(root, nodes, order, bounds.aabb())
}

/// A grid over doubled centres, its cells about as long as wide.
struct Grid {
    origin: Vec4,
    cells_per_unit: Vec4,
    /// Cells along each axis, as powers of 2.
    bits: [u32; 3],
}

impl Grid {
    fn over(centers: &Box4, references: usize) -> Self {
        let size = centers.hi - centers.lo;
        let (mut bits, mut edges) = ([0; 3], size.truncate());
        for _ in 0..(references / PER_CELL).max(1).ilog2().min(MOST_CELL_BITS) {
            let longest = edges.max_position();
            edges[longest] /= 2.0;
            bits[longest] += 1;
        }
        let cells = bits.map(|bits| (1_u32 << bits) as f32);
        let cells_per_unit = cells_per_unit(1, size) * Vec4::new(cells[0], cells[1], cells[2], 0.0);
        Self { origin: centers.lo, cells_per_unit, bits }
    }

    fn cells(&self) -> usize {
        1 << self.bits.iter().sum::<u32>()
    }

    fn cell_of(&self, reference: &Reference) -> u32 {
        let place = (reference.doubled_center() - self.origin) * self.cells_per_unit;
        let [x_bits, y_bits, z_bits] = self.bits;
        let along = |place: f32, bits: u32| (place as u32).min((1 << bits) - 1);
        along(place.x, x_bits) | along(place.y, y_bits) << x_bits | along(place.z, z_bits) << (x_bits + y_bits)
    }
}

/// A part of the references by cells.
struct ByCell<'a> {
    references: &'a [Reference],
    /// Their places, cell after cell.
    places: Vec<u32>,
    /// Where each cell's begin, and the end of the last.
    starts: Vec<u32>,
}

impl<'a> ByCell<'a> {
    fn new(references: &'a [Reference], grid: &Grid) -> Self {
        let cells: Vec<u32> = references.iter().map(|reference| grid.cell_of(reference)).collect();
        // Counted two further on, summed up, then moved on as places are filled: so each start ends up where it belongs.
        let mut starts = vec![0; grid.cells() + 2];
        for cell in &cells {
            starts[*cell as usize + 2] += 1;
        }
        let mut before = 0;
        for start in &mut starts {
            before += *start;
            *start = before;
        }
        let mut places = vec![0; references.len()];
        for (place, cell) in (0..).zip(&cells) {
            let next = &mut starts[*cell as usize + 1];
            places[*next as usize] = place;
            *next += 1;
        }
        Self { references, places, starts }
    }

    fn in_cell(&self, cell: usize) -> impl Iterator<Item = Reference> + '_ {
        let places = &self.places[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        places.iter().map(|place| self.references[*place as usize])
    }
}

/// The tree of a cell.
struct MiniTree {
    tree: Tree,
    /// In the order of its leaves.
    primitives: Vec<u32>,
}

/// A tree for each cell of a grid, or for each of its own grid's where it is crowded.
fn mini_trees(references: &[Reference], centers: &Box4, builder: &Builder) -> Vec<MiniTree> {
    let grid = Grid::over(centers, references.len());
    let parts = references.par_chunks(references.len().div_ceil(PARTS));
    let parts: Vec<ByCell> = parts.map(|part| ByCell::new(part, &grid)).collect();
    let trees = |cell: usize| {
        let mut own: Vec<Reference> = parts.iter().flat_map(|part| part.in_cell(cell)).collect();
        if own.is_empty() {
            return Vec::new();
        }
        if own.len() > CROWD && own.len() < references.len() {
            return mini_trees(&own, &Summary::of(&own).centers, builder);
        }
        let tree = builder.tree(&mut own, FIRST_LEVEL);
        vec![MiniTree { tree, primitives: own.iter().map(Reference::primitive).collect() }]
    };
    (0..grid.cells()).into_par_iter().flat_map_iter(trees).collect()
}

impl MiniTree {
    /// Its largest subtrees with no more than so much half area, in the order of their leaves.
    fn below(&self, largest: f32) -> Vec<Subtree<'_>> {
        let Tree { bounds, root, nodes } = &self.tree;
        let mut subtrees = Vec::new();
        let mut open = vec![(*root, *bounds, nodes.len(), self.primitives.len())];
        while let Some((root, bounds, node_end, place_end)) = open.pop() {
            match root {
                Child::Node(node) if bounds.half_area() > largest => {
                    let Node { bounds, children } = &nodes[node as usize];
                    let left_end = match children[1] {
                        Child::Node(right) => right as usize,
                        Child::Leaf { .. } => node_end,
                    };
                    open.push((children[1], bounds[1].into(), node_end, place_end));
                    open.push((children[0], bounds[0].into(), left_end, self.first_place(children[1]) as usize));
                }
                _ => {
                    let first_node = match root {
                        Child::Node(node) => node as usize,
                        Child::Leaf { .. } => node_end,
                    };
                    let first_place = self.first_place(root);
                    subtrees.push(Subtree {
                        bounds,
                        root,
                        nodes: &nodes[first_node..node_end],
                        first_place,
                        primitives: &self.primitives[first_place as usize..place_end],
                    });
                }
            }
        }
        subtrees
    }

    /// Place of the first primitive below a child.
    fn first_place(&self, mut child: Child) -> u32 {
        loop {
            match child {
                Child::Node(node) => child = self.tree.nodes[node as usize].children[0],
                Child::Leaf { first, .. } => return first,
            }
        }
    }
}

/// What remains of a mini tree: a part that is small enough.
struct Subtree<'a> {
    bounds: Box4,
    /// Numbered as in the mini tree, as are the nodes' children.
    root: Child,
    nodes: &'a [Node],
    /// Place of the first primitive in the mini tree.
    first_place: u32,
    primitives: &'a [u32],
}

/// Sizes of a part of the tree, or how much comes before it.
#[derive(Clone, Copy, Default)]
struct Size {
    nodes: usize,
    primitives: usize,
}

impl std::ops::Add for Size {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { nodes: self.nodes + other.nodes, primitives: self.primitives + other.primitives }
    }
}

/// The tree above the subtrees, with them.
struct Whole<'a> {
    top: &'a [Node],
    /// Which subtree each leaf of `top` is.
    leaves: &'a [Reference],
    subtrees: &'a [Subtree<'a>],
    /// Sizes at and below each node of `top`.
    sizes: Vec<Size>,
}

impl<'a> Whole<'a> {
    fn new(top: &'a [Node], leaves: &'a [Reference], subtrees: &'a [Subtree<'a>]) -> Self {
        let mut whole = Self { top, leaves, subtrees, sizes: vec![Size::default(); top.len()] };
        for (index, node) in top.iter().enumerate().rev() {
            let [left, right] = node.children.map(|child| whole.size(child));
            whole.sizes[index] = Size { nodes: 1, primitives: 0 } + left + right;
        }
        whole
    }

    /// The subtree at a leaf of the tree above.
    fn subtree(&self, place: u32) -> &Subtree<'a> {
        &self.subtrees[self.leaves[place as usize].primitive() as usize]
    }

    fn size(&self, child: Child) -> Size {
        match child {
            Child::Node(node) => self.sizes[node as usize],
            Child::Leaf { first, .. } => {
                let subtree = self.subtree(first);
                Size { nodes: subtree.nodes.len(), primitives: subtree.primitives.len() }
            }
        }
    }

    /// Writes what is at and below a child, in depth-first order; returns it as numbered behind what is `before` it in the tree.
    fn write(&self, child: Child, before: Size, nodes: &mut [Node], order: &mut [u32]) -> Child {
        match child {
            Child::Leaf { first, .. } => {
                let Subtree { root, nodes: from, first_place, primitives, .. } = self.subtree(first);
                order.copy_from_slice(primitives);
                let first_node = match root {
                    Child::Node(node) => *node,
                    Child::Leaf { .. } => 0,
                };
                let moved = |child: Child| match child {
                    Child::Node(node) => Child::Node(node - first_node + before.nodes as u32),
                    Child::Leaf { first, count } => {
                        Child::Leaf { first: first - first_place + before.primitives as u32, count }
                    }
                };
                for (node, from) in nodes.iter_mut().zip(*from) {
                    *node = Node { children: from.children.map(moved), ..*from };
                }
                moved(*root)
            }
            Child::Node(node) => {
                let Node { bounds, children } = self.top[node as usize];
                let left_size = self.size(children[0]);
                let before_left = before + Size { nodes: 1, primitives: 0 };
                let (own, below) = nodes.split_at_mut(1);
                let is_large = below.len() > PARALLEL;
                let (left_nodes, right_nodes) = below.split_at_mut(left_size.nodes);
                let (left_order, right_order) = order.split_at_mut(left_size.primitives);
                let mut left = || self.write(children[0], before_left, left_nodes, left_order);
                let mut right = || self.write(children[1], before_left + left_size, right_nodes, right_order);
                let (left, right) = if is_large { rayon::join(left, right) } else { (left(), right()) };
                own[0] = Node { bounds, children: [left, right] };
                Child::Node(before.nodes as u32)
            }
        }
    }
}
