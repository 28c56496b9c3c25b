//! What rays ask of a tree, counted on the host: how much of a ray's time is the tree's doing, and how much that of rays that wait for each other.

use super::ray_sets::SetKind;
use super::{Prepared, Ray, Tree};
use crate::bvh::{Quantised, Steps};
use crate::report::Work;
use crate::scene::Crossing;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

impl Tree {
    /// The steps of a set's rays, alone and with `lanes` of them in step, as they lie beside each other in their set. For soups that are flat, their triangles opaque
    /// and seen from either side; edges within rounding go either way, as rays are counted here, not answered.
    pub fn work(&self, prepared: &Prepared, kind: SetKind, rays: &[Ray], lanes: usize) -> Work {
        let (soup, rebase) = (&prepared.soup, self.rebase);
        let device = self.for_device(soup, prepared.view.camera.eye);
        let tree = Quantised { nodes: device.nodes, grid: device.grid };
        let triangles: Vec<[DVec3; 3]> = device
            .order
            .par_iter()
            .map(|primitive| rebase.triangle(&soup.positions[*primitive as usize]).map(Vec3::as_dvec3))
            .collect();
        let walk = |ray: &Ray| {
            let (origin, direction) = (rebase.point(ray.origin), rebase.direction(ray.direction));
            let t_max = (ray.t_max * rebase.scale) as f32;
            tree.walk(origin, direction, t_max, |places, t_max| {
                let met = triangles[places]
                    .iter()
                    .map(|corners| Crossing::of(corners, origin.as_dvec3(), direction.as_dvec3()));
                let nearest =
                    met.filter(Crossing::is_hit).fold(f32::INFINITY, |nearest, met| nearest.min(met.t as f32));
                let is_met = nearest < *t_max;
                *t_max = t_max.min(nearest);
                is_met && kind == SetKind::Shadow
            })
        };
        let group = |rays: &[Ray]| {
            let walks: Vec<Vec<Steps>> = rays.iter().map(walk).collect();
            (walks.iter().flatten().copied().sum::<Steps>(), Steps::in_step(&walks))
        };
        let none = || (Steps::default(), Steps::default());
        let (alone, in_step) = rays.par_chunks(lanes.max(1)).map(group).reduce(none, |a, b| (a.0 + b.0, a.1 + b.1));
        let mean = |steps: u64, of: usize| steps as f64 / of.max(1) as f64;
        let groups = rays.len().div_ceil(lanes.max(1));
        Work {
            nodes: mean(alone.nodes, rays.len()),
            triangles: mean(alone.primitives, rays.len()),
            lanes,
            node_rounds: mean(in_step.nodes, groups),
            triangle_rounds: mean(in_step.primitives, groups),
        }
    }
}
