//! The triangle soup: every instance's triangles in world space.

use super::{Instance, Scene};
use crate::error::{Error, Result};
use glam::{DMat3, DVec3, Vec3};

/// What is known of a triangle besides its corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangleFlags {
    /// Only its front is seen.
    pub single_sided: bool,
    /// It has normals.
    pub smooth: bool,
    /// It has colours.
    pub colored: bool,
}

/// Triangles of all instances, in the order of instances and their meshes. A triangle's number is its *primitive*.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    /// Corners, world space, counter-clockwise seen from the front.
    pub positions: Vec<[DVec3; 3]>,
    /// Index into the scene's materials.
    pub materials: Vec<u32>,
    /// Flags.
    pub flags: Vec<TriangleFlags>,
    /// Unit normals at the corners, world space; zero where not smooth; empty if no triangle is.
    pub normals: Vec<[Vec3; 3]>,
    /// Colours at the corners; white where not coloured; empty if no triangle is.
    pub colors: Vec<[Vec3; 3]>,
    /// Lower corner of the box around everything.
    pub lo: DVec3,
    /// Upper corner.
    pub hi: DVec3,
    /// What was dropped.
    pub warnings: Vec<String>,
}

/// Most triangles: a leaf's reference has 27 bits for its first triangle.
const MAX_TRIANGLES: usize = 1 << 27;

/// Sizes between which the kernels' products of three lengths stay within f32.
const SIZES: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// What became of an instance.
struct Added {
    /// Its transform has no volume: nothing of it was added.
    flattened: bool,
    /// Triangles that were dropped because a corner is not finite.
    not_finite: usize,
}

impl Soup {
    /// All triangles of a scene. Positions are transformed in f64; normals by the cofactor matrix, which is the inverse
    /// transpose up to a factor and exists for every matrix; a mirroring transform swaps two corners.
    ///
    /// # Errors
    /// `Content` when there are more than 2²⁷ triangles, or the scene is too large or too small to be computed.
    pub fn of(scene: &Scene) -> Result<Self> {
        let count = scene.triangle_count();
        if count >= MAX_TRIANGLES {
            return Err(Error::content(&scene.name, format!("{count} triangles: at most {MAX_TRIANGLES}")));
        }
        let used = || scene.instances.iter().map(|instance| &scene.meshes[instance.mesh]);
        let smooth = used().any(|mesh| !mesh.normals.is_empty());
        let colored = used().any(|mesh| !mesh.colors.is_empty());
        let mut soup = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, ..Self::default() };
        soup.positions.reserve(count);
        let mut not_finite = 0;
        let mut flattened = vec![0; scene.meshes.len()];
        for instance in &scene.instances {
            let added = soup.add(scene, instance, smooth, colored);
            not_finite += added.not_finite;
            flattened[instance.mesh] += usize::from(added.flattened);
        }
        for (mesh, count) in scene.meshes.iter().zip(flattened).filter(|(_, count)| *count > 0) {
            let name = &mesh.name;
            soup.warnings.push(format!("dropped {count} instances of mesh '{name}': their transforms flatten them"));
        }
        if not_finite > 0 {
            soup.warnings.push(format!("dropped {not_finite} triangles with a corner that is not a finite number"));
        }
        if soup.positions.is_empty() {
            (soup.lo, soup.hi) = (DVec3::ZERO, DVec3::ZERO);
            soup.warnings.push("there is no triangle to draw: the picture shows only the background".into());
        }
        let size = (soup.hi - soup.lo).max_element();
        if size != 0.0 && !SIZES.contains(&size) {
            let (least, most) = (SIZES.start(), SIZES.end());
            let message = format!("the scene is {size:.1e} m wide: only {least:.0e} to {most:.0e} m can be computed");
            return Err(Error::content(&scene.name, message));
        }
        Ok(soup)
    }

    /// Adds an instance.
    fn add(&mut self, scene: &Scene, instance: &Instance, smooth: bool, colored: bool) -> Added {
        let mesh = &scene.meshes[instance.mesh];
        let linear = DMat3::from_mat4(instance.world_from_object);
        let determinant = linear.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return Added { flattened: true, not_finite: 0 };
        }
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        // Scaled so that the product cannot underflow; a mirroring transform keeps normals on the front.
        let size = cofactors.to_cols_array().iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        let world_normal = |normal: &Vec3| {
            let world = (cofactors * (determinant.signum() / size)) * normal.as_dvec3();
            world.try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
        };
        let points: Vec<DVec3> =
            mesh.positions.iter().map(|p| instance.world_from_object.transform_point3(p.as_dvec3())).collect();
        let normals: Vec<Vec3> = mesh.normals.iter().map(world_normal).collect();
        let mut not_finite = 0;
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|index| index as usize);
            let corners = if determinant < 0.0 { [a, c, b] } else { [a, b, c] };
            let positions = corners.map(|corner| points[corner]);
            if !positions.iter().all(|point| point.is_finite() && point.abs().max_element() < 1e30) {
                not_finite += 1;
                continue;
            }
            for point in positions {
                self.lo = self.lo.min(point);
                self.hi = self.hi.max(point);
            }
            self.positions.push(positions);
            self.materials.push(mesh.material as u32);
            // A normal without a direction makes the whole triangle flat.
            let corner_normals =
                if normals.is_empty() { [Vec3::ZERO; 3] } else { corners.map(|corner| normals[corner]) };
            let is_smooth = corner_normals.iter().all(|normal| normal.length_squared() > 0.5);
            if smooth {
                self.normals.push(corner_normals);
            }
            if colored {
                let white = mesh.colors.is_empty();
                self.colors.push(corners.map(|corner| if white { Vec3::ONE } else { mesh.colors[corner] }));
            }
            self.flags.push(TriangleFlags {
                single_sided: !scene.materials[mesh.material].double_sided,
                smooth: is_smooth,
                colored: !mesh.colors.is_empty(),
            });
        }
        Added { flattened: false, not_finite }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// No triangles.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Lower and upper corner of the box around everything; `None` when there is nothing.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        (!self.is_empty()).then_some((self.lo, self.hi))
    }

    /// Centre of the box around everything: the origin of the device's world, so that f32 is spent on the scene and not
    /// on its distance from the file's origin.
    pub fn center(&self) -> DVec3 {
        (self.lo + self.hi) / 2.0
    }
}
