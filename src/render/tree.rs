//! The trees over a soup, and what the device gets of them.
//!
//! A flat soup has one tree over its triangles in the device's world. Where instances share parts, each part has a tree in its
//! own space, about its own centre, and an upper tree over the instances' boxes has one instance in each leaf. Every space of the
//! device is a [`Rebase`] of one of the scene's.

use crate::bvh::{quantise, reference, Aabb, Bvh, Child, DeviceNode, Grid, Quality};
use crate::layout::{Features, Instance, LEAF_IS_INSTANCE, NODE_TEXELS};
use crate::report;
use crate::scene::{bounds_of, box_corners, Placement, Projection, Soup, View};
use glam::{DMat3, DMat4, DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// The trees over a soup.
pub struct Tree {
    pub(super) parts: Vec<Part>,
    /// Over the placements; `None` for a flat soup.
    pub(super) upper: Option<Bvh>,
    /// From world space to the device's.
    pub rebase: Rebase,
    /// How it was built.
    pub quality: Quality,
    /// Boxes are rounded outward when they become coarser, as they must.
    pub rounds_outward: bool,
    /// How it came from the tree of the frame before, in a sequence.
    pub update: Option<report::TreeUpdate>,
}

/// The tree over a part of the soup.
pub(super) struct Part {
    pub bvh: Bvh,
    /// From the part's space to the device's for it.
    pub rebase: Rebase,
    /// Its cost when it was built, where it was refitted since.
    pub built_cost: Option<f64>,
}

impl Part {
    /// Its cost when it was built.
    pub fn built_cost(&self) -> f64 {
        self.built_cost.unwrap_or_else(|| self.bvh.stats().sah_cost)
    }
}

/// The space of a part on the device.
pub(super) fn part_space(soup: &Soup, range: &Range<usize>, world: Rebase) -> Rebase {
    let positions = &soup.positions[range.clone()];
    let own = || {
        let (lo, hi) = if positions.is_empty() { Default::default() } else { bounds_of(positions.as_flattened()) };
        Rebase::new(lo, hi, (lo + hi) / 2.0)
    };
    if soup.is_flat() {
        world
    } else {
        own()
    }
}

/// The tree over the placements of parts; `None` for a flat soup.
pub(super) fn upper_tree(soup: &Soup, parts: &[Part], world: Rebase) -> Option<Bvh> {
    let world_box = |placement: &Placement| {
        let part = &parts[placement.part];
        world_box(&part.bvh.bounds, &Transforms::new(placement, part.rebase, world))
    };
    let boxes = || soup.placements.par_iter().map(world_box).collect::<Vec<Aabb>>();
    (!soup.is_flat()).then(|| Bvh::over_boxes(&boxes(), 1))
}

/// A space on the device: one of the scene's, moved and scaled in f64 so that f32 is spent on what is seen, not on where the
/// scene stands or in which units it is. The scale is a power of two, which rounds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rebase {
    /// What becomes the origin.
    pub origin: DVec3,
    /// Device lengths a length of the scene.
    pub scale: f64,
    /// How it is turned.
    pub rotation: DMat3,
}

/// Size of a scene on the device, as a power of two. The cube of a length that is 10⁻¹³ of it is still a normal f32, which devices do not take for 0;
/// the cube of ten times its size is far below the largest.
const SIZE: f64 = 20.0;

/// Angle of a pixel, in radians, below which the world is turned along with the camera: f32 knows a direction to 6e-8 only, unless it lies along
/// an axis.
const NARROW: f64 = 1.5e-5;

impl Rebase {
    /// For what lies between two corners and is seen from `eye`: the eye itself becomes the origin, or what is nearest to it, so that
    /// rounding errors are in proportion to the distance from it, as the sizes of things in the picture are.
    pub fn new(lo: DVec3, hi: DVec3, eye: DVec3) -> Self {
        let size = (hi - lo).max_element();
        let exponent = if size > 0.0 && size.is_finite() { size.log2().floor() } else { SIZE };
        Self { origin: eye.clamp(lo, hi), scale: (SIZE - exponent).exp2(), rotation: DMat3::IDENTITY }
    }

    /// For a scene in this box as a view sees it.
    pub fn for_view(lo: DVec3, hi: DVec3, view: &View) -> Self {
        let camera = &view.camera;
        let rebase = Self::new(lo, hi, camera.eye);
        match camera.projection {
            Projection::Perspective { fov } if 2.0 * (fov / 2.0).tan() < NARROW * f64::from(view.height) => {
                let rotation = DMat3::from_cols(camera.right, camera.up, -camera.forward).transpose();
                Self { rotation, ..rebase }
            }
            _ => rebase,
        }
    }

    /// The world as it is.
    pub const NONE: Self = Self { origin: DVec3::ZERO, scale: 1.0, rotation: DMat3::IDENTITY };

    /// A direction; its length stays.
    pub fn direction(&self, direction: DVec3) -> Vec3 {
        (self.rotation * direction).as_vec3()
    }

    /// Whether directions change.
    pub fn turns(&self) -> bool {
        self.rotation != DMat3::IDENTITY
    }

    /// A point.
    pub fn point(&self, point: DVec3) -> Vec3 {
        self.exact(point).as_vec3()
    }

    /// The corners of a triangle.
    pub fn triangle(&self, corners: &[DVec3; 3]) -> [Vec3; 3] {
        corners.map(|corner| self.point(corner))
    }

    /// A point, not yet rounded.
    fn exact(&self, point: DVec3) -> DVec3 {
        self.rotation * ((point - self.origin) * self.scale)
    }

    /// As a matrix.
    fn matrix(&self) -> DMat4 {
        DMat4::from_mat3(self.rotation * self.scale) * DMat4::from_translation(-self.origin)
    }
}

/// Sizes on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeSize {
    /// Wide nodes of all trees.
    pub nodes: usize,
    /// Triangles in the order of leaves; one that was cut counts wherever leaves do not share it.
    pub triangles: usize,
    /// Instances; 0 in a flat scene.
    pub instances: usize,
}

/// What the device gets.
pub(super) struct DeviceTree {
    /// All trees' nodes; the root is node 0.
    pub nodes: Vec<DeviceNode>,
    /// Grid of the root's tree.
    pub grid: Grid,
    /// Primitives in leaf order.
    pub order: Vec<u32>,
    /// In the order of the upper tree's leaves.
    pub instances: Vec<Instance>,
    /// The space of each primitive's positions, by part: its first primitive and the space.
    rebases: Vec<(usize, Rebase)>,
}

impl DeviceTree {
    /// From the space of a primitive's part to the device's.
    pub fn rebase_of(&self, primitive: usize) -> Rebase {
        let part = self.rebases.partition_point(|(first, _)| *first <= primitive);
        self.rebases[part - 1].1
    }
}

impl Tree {
    /// Builds the trees over a soup in a world of the device's.
    pub fn build(soup: &Soup, rebase: Rebase, quality: Quality) -> Self {
        let part = |range: &Range<usize>| {
            let rebase = part_space(soup, range, rebase);
            let positions = &soup.positions[range.clone()];
            Part {
                bvh: Bvh::over(range.len(), |index| rebase.triangle(&positions[index]), quality),
                rebase,
                built_cost: None,
            }
        };
        let parts: Vec<Part> = soup.parts.par_iter().map(part).collect();
        let upper = upper_tree(soup, &parts, rebase);
        Self { parts, upper, rebase, quality, rounds_outward: true, update: None }
    }

    /// The features with what the trees themselves need.
    pub fn features(&self, features: Features) -> Features {
        Features { instances: features.instances || self.upper.is_some(), ..features }
    }

    /// Sizes on the device.
    pub fn size(&self) -> TreeSize {
        let parts = self.parts.iter().map(|part| &part.bvh);
        TreeSize {
            nodes: parts.clone().chain(&self.upper).map(|bvh| bvh.wide.nodes.len()).sum(),
            triangles: parts.map(|bvh| bvh.order.len()).sum(),
            instances: self.upper.as_ref().map_or(0, |upper| upper.order.len()),
        }
    }

    /// Counts for a report: the deepest path through both levels; the cost of the tree that rays enter first, with an instance
    /// counted as one triangle.
    pub fn report(&self) -> report::Tree {
        let root = self.upper.as_ref().or(self.parts.first().map(|part| &part.bvh)).map(Bvh::stats);
        let nodes = self.size().nodes;
        let lower = self.parts.iter().map(|part| part.bvh.wide.depth);
        report::Tree {
            nodes,
            depth: lower.max().unwrap_or(0) + self.upper.as_ref().map_or(0, |upper| upper.wide.depth),
            sah_cost: root.map_or(0.0, |stats| stats.sah_cost),
            bytes: 16 * u64::from(NODE_TEXELS) * nodes as u64,
            update: self.update,
        }
    }

    /// The trees for rays that start in the scene or at `eye`.
    pub(super) fn for_device(&self, soup: &Soup, eye: DVec3) -> DeviceTree {
        let eye = self.rebase.exact(eye);
        let mut device = DeviceTree {
            nodes: Vec::new(),
            grid: Grid { origin: Vec3::ZERO, scale: Vec3::ONE },
            order: Vec::with_capacity(self.size().triangles),
            instances: Vec::new(),
            rebases: soup.parts.iter().zip(&self.parts).map(|(range, part)| (range.start, part.rebase)).collect(),
        };
        let Some(upper) = &self.upper else {
            for part in &self.parts {
                let quantised =
                    quantise(&part.bvh, eye.abs().as_vec3(), self.rounds_outward, |child| reference(child, 0, 0));
                (device.nodes, device.grid) = (quantised.nodes, quantised.grid);
                device.order.clone_from(&part.bvh.order);
            }
            // Only kernels that were told to expect instances look at it: the scene as it is.
            let whole = Transforms { world_from_part: DMat4::IDENTITY, part_from_world: DMat4::IDENTITY };
            device.instances.push(Instance { condition: 0.0, ..whole.instance(&device.grid, 0) });
            return device;
        };
        // A leaf of the upper tree names its instance by its place.
        let refer = |child: Child| match child {
            Child::Node(index) => index,
            Child::Leaf { first, .. } => !(first << 4 | LEAF_IS_INSTANCE),
        };
        let quantised = quantise(upper, eye.abs().as_vec3(), self.rounds_outward, refer);
        (device.nodes, device.grid) = (quantised.nodes, quantised.grid);
        let transforms: Vec<Transforms> = soup
            .placements
            .par_iter()
            .map(|placement| Transforms::new(placement, self.parts[placement.part].rebase, self.rebase))
            .collect();
        let starts = [upper.bounds.lo.as_dvec3(), upper.bounds.hi.as_dvec3(), eye];
        let mut reach = vec![DVec3::ZERO; self.parts.len()];
        for (placement, transforms) in soup.placements.iter().zip(&transforms) {
            let reach = &mut reach[placement.part];
            for point in box_corners(starts[0], starts[1]).into_iter().chain([starts[2]]) {
                *reach = reach.max(transforms.part_from_world.transform_point3(point).abs());
            }
        }
        let mut lower = Vec::new();
        for ((part, range), reach) in self.parts.iter().zip(&soup.parts).zip(reach) {
            let first_node = device.nodes.len() as u32;
            let first_primitive = device.order.len() as u32;
            let refer = |child| reference(child, first_node, first_primitive);
            let quantised = quantise(&part.bvh, reach.as_vec3(), self.rounds_outward, refer);
            // A tree of one leaf has a node only so that a flat scene has a root.
            let root = match part.bvh.nodes[0].children {
                [leaf @ Child::Leaf { .. }, Child::Leaf { count: 0, .. }] => refer(leaf),
                _ => first_node,
            };
            device.nodes.extend(quantised.nodes);
            device.order.extend(part.bvh.order.iter().map(|primitive| primitive + range.start as u32));
            lower.push((quantised.grid, root));
        }
        let instance = |index: &u32| {
            let (grid, root) = lower[soup.placements[*index as usize].part];
            transforms[*index as usize].instance(&grid, root)
        };
        device.instances = upper.order.par_iter().map(instance).collect();
        device
    }
}

/// The box of an instance in the device's world, rounded outward.
fn world_box(bounds: &Aabb, transforms: &Transforms) -> Aabb {
    let corners = box_corners(bounds.lo.as_dvec3(), bounds.hi.as_dvec3());
    let corners = corners.map(|corner| transforms.world_from_part.transform_point3(corner));
    let (lo, hi) = corners.iter().fold((corners[0], corners[0]), |(lo, hi), corner| (lo.min(*corner), hi.max(*corner)));
    let error = lo.abs().max(hi.abs()) * 2.5e-7;
    Aabb { lo: (lo - error).as_vec3(), hi: (hi + error).as_vec3() }
}

/// Between the device's world and its space for a part.
struct Transforms {
    world_from_part: DMat4,
    part_from_world: DMat4,
}

impl Transforms {
    fn new(placement: &Placement, part: Rebase, world: Rebase) -> Self {
        let world_from_part = world.matrix() * placement.world_from_part * part.matrix().inverse();
        Self { world_from_part, part_from_world: world_from_part.inverse() }
    }

    fn instance(&self, grid: &Grid, root: u32) -> Instance {
        let row = |matrix: &DMat4, row| matrix.row(row).as_vec4().to_array();
        let sizes = |matrix: &DMat4| {
            let matrix = DMat3::from_mat4(*matrix);
            DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
        };
        let enlarged = sizes(&self.world_from_part) * sizes(&self.part_from_world) * DVec3::ONE;
        Instance {
            part_from_world_x: row(&self.part_from_world, 0),
            part_from_world_y: row(&self.part_from_world, 1),
            part_from_world_z: row(&self.part_from_world, 2),
            grid_origin: grid.origin.into(),
            root,
            grid_scale: grid.scale.into(),
            condition: enlarged.max_element() as f32,
            world_from_part_x: row(&self.world_from_part, 0),
            world_from_part_y: row(&self.world_from_part, 1),
            world_from_part_z: row(&self.world_from_part, 2),
        }
    }
}
