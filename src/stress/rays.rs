//! Cases judged ray by ray: leaks, needles.

use super::scenes::{grey, noisy_sphere, scene_of, tilt, torus, Random};
use super::{exceeds, Finding, Stress};
use crate::error::Result;
use crate::film;
use crate::render::ray_sets::SetKind;
use crate::render::{Met, Options, Prepared, Ray, Tree};
use crate::scene::{shapes, CameraChoice, Mesh, Scene};
use glam::{DMat4, DVec3};
use std::path::Path;

/// Rays that are traced at once: a picture of so many pixels.
const AT_ONCE: (u32, u32) = (512, 768);
const QUICK_AT_ONCE: (u32, u32) = (256, 256);

impl Stress<'_> {
    fn rays_at_once(&self) -> (u32, u32) {
        if self.settings.quick {
            QUICK_AT_ONCE
        } else {
            AT_ONCE
        }
    }

    /// The nearest hits of rays that `make` finds in the scene's triangles, seen from `eye`; with Settings::export under `name`.
    fn nearest(
        &self,
        name: &str,
        scene: &Scene,
        eye: DVec3,
        toward: DVec3,
        make: impl FnOnce(&Prepared, usize) -> Vec<Ray>,
    ) -> Result<(Prepared, Vec<Ray>, Vec<Met>)> {
        let (prepared, rays, [met]) = self.answers(name, scene, eye, toward, [SetKind::Diffuse], make)?;
        Ok((prepared, rays, met))
    }

    /// As [`Stress::nearest`], each kind of ray's answers.
    fn answers<const KINDS: usize>(
        &self,
        name: &str,
        scene: &Scene,
        eye: DVec3,
        toward: DVec3,
        kinds: [SetKind; KINDS],
        make: impl FnOnce(&Prepared, usize) -> Vec<Ray>,
    ) -> Result<(Prepared, Vec<Ray>, [Vec<Met>; KINDS])> {
        let size = self.rays_at_once();
        let camera = CameraChoice::LookAt { eye, target: Some(toward) };
        let options = Options { size, camera, ..self.options.clone() };
        let prepared = Prepared::new(scene, &options)?;
        let rays = make(&prepared, (size.0 * size.1) as usize);
        let tree = prepared.tree(&options);
        if let Some(folder) = &self.settings.export {
            export(folder, &format!("{}-{name}", self.case).replace(' ', "-"), &prepared, &tree, &rays)?;
        }
        let mut tracer = self.renderer.tracer(scene, &prepared, &tree)?;
        let mut answers = [const { Vec::new() }; KINDS];
        for (met, kind) in answers.iter_mut().zip(kinds) {
            *met = tracer.trace(kind, &rays, 1, &options)?.met;
        }
        drop(tracer);
        Ok((prepared, rays, answers))
    }
}

/// Writes triangles and rays as the device has them.
fn export(folder: &Path, name: &str, prepared: &Prepared, tree: &Tree, rays: &[Ray]) -> Result<()> {
    let rebase = tree.rebase;
    let mut triangles = (prepared.soup.len() as u32).to_le_bytes().to_vec();
    for corner in prepared.soup.positions.iter().flatten() {
        triangles.extend(rebase.point(*corner).to_array().iter().flat_map(|value| value.to_le_bytes()));
    }
    let mut lines = Vec::with_capacity(32 * rays.len());
    for ray in rays {
        let (origin, direction) = (rebase.point(ray.origin), rebase.direction(ray.direction));
        let values = [origin.x, origin.y, origin.z, 0.0, direction.x, direction.y, direction.z, 1e30];
        lines.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    film::write_whole(&folder.join(format!("{name}.bin")), &triangles)?;
    film::write_whole(&folder.join(format!("{name}.rays")), &lines)
}

/// Points inside a mesh in its own space, from which every ray must hit it.
type Inside = fn(&mut Random) -> DVec3;

/// Closed meshes.
pub(super) fn leaks(stress: &mut Stress) -> Result<()> {
    let in_ring: Inside = |random| {
        let angle = random.unit() * std::f64::consts::TAU;
        DVec3::new(angle.cos(), 0.0, angle.sin()) + random.in_cube() * 0.15
    };
    let meshes: [(&str, Mesh, Inside); 3] = [
        ("sphere", noisy_sphere(32), |random| random.in_cube() * 0.15),
        ("torus", torus(48, 24), in_ring),
        ("box", shapes::cube(), |random| random.in_cube() * 0.45),
    ];
    let scales = stress.few(&[1e-6, 1e-3, 1.0, 1e3, 1e6], &[1e-6, 1.0, 1e6]);
    let offsets = stress.few(&[1e1, 1e3, 1e5, 1e7], &[1e3, 1e7]);
    for (name, mesh, inside) in meshes {
        let settings = scales.iter().map(|scale| ("scale", *scale, *scale, 0.0));
        let settings = settings.chain(offsets.iter().map(|offset| ("offset", *offset, 1.0, *offset)));
        for (what, value, scale, offset) in settings.collect::<Vec<_>>() {
            stress.row(&format!("{name}, {what}"), value, |stress| {
                leak(stress, &format!("{name}-{what}-{value:e}"), &mesh, inside, scale, offset)
            })?;
        }
    }
    Ok(())
}

fn leak(stress: &Stress, name: &str, mesh: &Mesh, inside: Inside, scale: f64, offset: f64) -> Result<Finding> {
    let transform = DMat4::from_translation(DVec3::splat(offset * scale)) * DMat4::from_scale(DVec3::splat(scale));
    let scene = scene_of([(mesh.clone(), transform, grey(1.0, 0.0, 0.0))], Vec::new());
    let mut random = Random::new(11);
    let eye = transform.transform_point3(inside(&mut random));
    let make = |prepared: &Prepared, count: usize| {
        let triangles = &prepared.soup.positions;
        let ray = |index: usize| {
            let origin = transform.transform_point3(inside(&mut random));
            let [a, b, _] = triangles[random.below(triangles.len())];
            let direction = match index % 4 {
                0 => a - origin,
                1 => (a + b) * 0.5 - origin,
                _ => random.direction(),
            };
            Ray { origin, direction: direction.normalize(), t_max: f64::MAX }
        };
        (0..count).map(ray).collect()
    };
    let (_, rays, met) = stress.nearest(name, &scene, eye, eye + DVec3::Z * scale, make)?;
    let missed = met.iter().filter(|met| **met == Met::Nothing).count();
    Ok(Finding::none_of(rays.len() as u64, missed as u64))
}

/// Slivers on either side of the middle of the square.
const SLIVERS: i32 = 32;

/// A square whose middle is cut into slivers; their ends lie on its border.
fn sliced_square(width: f64) -> Mesh {
    let mut mesh = Mesh { name: "slivers".into(), ..Mesh::default() };
    let places = [-0.5].into_iter().chain((-SLIVERS..=SLIVERS).map(|i| f64::from(i) * width)).chain([0.5]);
    for x in places {
        mesh.positions.extend([-0.5, 0.5].map(|y| DVec3::new(x, y, 0.0).as_vec3()));
    }
    for column in 0..mesh.positions.len() as u32 / 2 - 1 {
        let [a, b, c, d] = [0, 2, 3, 1].map(|corner| 2 * column + corner);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Rounding error of a point's coordinates on a triangle, of their size: 16 · 2⁻²⁴.
const POINT_ERROR: f64 = 9.6e-7;

/// Slivers.
pub(super) fn needles(stress: &mut Stress) -> Result<()> {
    let aspects = stress.few(&[1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8], &[1e2, 1e4, 1e6, 1e8]);
    for (name, transform) in [("tilted", tilt()), ("along axes", DMat4::IDENTITY)] {
        for aspect in &aspects {
            stress.row(&format!("aspect, {name}"), *aspect, |stress| {
                needle(stress, &format!("{name}-{aspect:e}"), *aspect, transform)
            })?;
        }
    }
    Ok(())
}

/// Rays that miss, or hit further from where they should than the sliver's shape lets f32 know.
fn needle(stress: &Stress, name: &str, aspect: f64, transform: DMat4) -> Result<Finding> {
    let width = 1.0 / aspect.max(2.1 * f64::from(SLIVERS));
    let scene = scene_of([(sliced_square(width), transform, grey(1.0, 0.0, 0.0))], Vec::new());
    let eye = transform.transform_point3(DVec3::new(0.3, 0.2, 1.0));
    let mut random = Random::new(13);
    let make = |_: &Prepared, count: usize| {
        let ray = |index: usize| {
            let origin = transform.transform_point3(DVec3::Z * 0.7 + random.in_cube() * 0.3);
            let within = 0.98 * (random.unit() - 0.5);
            let target = match index % 4 {
                0 => DVec3::new(f64::from(random.below(2 * SLIVERS as usize) as i32 - SLIVERS) * width, within, 0.0),
                1 => DVec3::new((random.unit() * 2.0 - 1.0) * f64::from(SLIVERS) * width, within, 0.0),
                _ => DVec3::new(0.98 * (random.unit() - 0.5), within, 0.0),
            };
            let target = transform.transform_point3(target);
            Ray { origin, direction: (target - origin).normalize(), t_max: f64::MAX }
        };
        (0..count).map(ray).collect()
    };
    let (prepared, rays, met) = stress.nearest(name, &scene, eye, transform.transform_point3(DVec3::ZERO), make)?;
    let is_wrong = |(ray, met): (&Ray, &Met)| {
        let Met::Triangle { primitive, barycentrics, .. } = *met else { return true };
        let corners = prepared.soup.positions[primitive as usize];
        let [l2, l3] = barycentrics.map(f64::from);
        let point = corners[0] * (1.0 - l2 - l3) + corners[1] * l2 + corners[2] * l3;
        let beside = (point - ray.origin).reject_from(ray.direction).length();
        // A coordinate's error moves the point along the sliver as many times as it is longer than wide, at most to its end.
        let edges = [corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]];
        let longest = edges.iter().map(|edge| edge.length()).fold(0.0, f64::max);
        let height = edges[0].cross(edges[1]).length() / longest;
        let bound = (POINT_ERROR * (1.0 + longest / height.max(f64::MIN_POSITIVE))).min(longest) + POINT_ERROR;
        exceeds(beside, bound)
    };
    let wrong = rays.iter().zip(&met).filter(|pair| is_wrong(*pair)).count();
    Ok(Finding::none_of(rays.len() as u64, wrong as u64))
}

/// Rays that start on the faces of a tilted cube, outward and inward, at an angle to the face, from where the shading passes would
/// let them start; and outward from the plane of ever narrower planks.
pub(super) fn leaving_faces(stress: &mut Stress) -> Result<()> {
    for angle in stress.few(&[1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6], &[1e-2, 1e-4, 1e-6]) {
        for (name, side) in [("outward", 1.0), ("inward", -1.0)] {
            stress.row(&format!("rays {name}, grazing angle"), angle, |stress| {
                leaving(stress, &format!("{name}-{angle:e}"), shapes::cube(), side, angle, 0.0)
            })?;
        }
    }
    for aspect in stress.few(&[1e1, 1e2, 1e3, 1e4, 1e5, 1e6], &[1e3, 1e5]) {
        stress.row("rays outward, planks of aspect", aspect, |stress| {
            leaving(stress, &format!("planks-{aspect:e}"), planks(aspect), 1.0, 0.1, 2.0)
        })?;
    }
    Ok(())
}

/// Planks side by side.
const PLANKS: u32 = 16;

/// A part of a plane, of planks of length 1 that share no vertices.
fn planks(aspect: f64) -> Mesh {
    let mut mesh = Mesh { name: "planks".into(), ..Mesh::default() };
    for plank in 0..PLANKS {
        let start = [f64::from(plank), f64::from(plank + 1)].map(|edge| edge / aspect);
        let corners = [(-0.5, start[0]), (-0.5, start[1]), (0.5, start[1]), (0.5, start[0])];
        mesh.positions.extend(corners.map(|(x, z)| DVec3::new(x, 0.0, z).as_vec3()));
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|corner| 4 * plank + corner)));
    }
    mesh
}

/// Rays that leave a convex mesh: outward they meet nothing, inward always its other side.
fn leaving(stress: &Stress, name: &str, mesh: Mesh, side: f64, angle: f64, eye: f64) -> Result<Finding> {
    let transform = tilt();
    let scene = scene_of([(mesh, transform, grey(1.0, 0.0, 0.0))], Vec::new());
    let mut random = Random::new(31);
    let make = |prepared: &Prepared, count: usize| {
        let triangles = &prepared.soup.positions;
        let ray = |_| {
            let corners = triangles[random.below(triangles.len())];
            // As the shading passes have it: an f32 point, moved off the face by its error bound and a little away from the edges.
            let (mut l2, mut l3) = (random.unit(), random.unit());
            if l2 + l3 > 1.0 {
                (l2, l3) = (1.0 - l2, 1.0 - l3);
            }
            let point = corners[0] * (1.0 - l2 - l3) + corners[1] * l2 + corners[2] * l3;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize() * side;
            let along = random.in_cube().reject_from(normal).normalize();
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0 - point;
            let largest = corners.iter().fold(0.0_f64, |largest, corner| largest.max(corner.abs().max_element()));
            let error = POINT_ERROR * largest;
            let origin = point + normal * error + middle.normalize() * (4.0 * error).min(0.01 * middle.length());
            let direction = along * angle.cos() + normal * angle.sin();
            Ray { origin: origin.as_vec3().as_dvec3(), direction, t_max: f64::MAX }
        };
        (0..count).map(ray).collect()
    };
    let eye = transform.transform_point3(DVec3::Y * eye);
    let kinds = [SetKind::Diffuse, SetKind::Shadow];
    let (_, rays, answers) = stress.answers(name, &scene, eye, DVec3::Z, kinds, make)?;
    let meets = |met: &Met| *met != Met::Nothing;
    let wrong = answers.iter().flatten().filter(|met| meets(met) != (side < 0.0)).count();
    Ok(Finding::none_of((answers.len() * rays.len()) as u64, wrong as u64))
}
