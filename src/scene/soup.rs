//! The triangle soup: every instance's triangles in world space, or, where many instances share a mesh, its triangles once and
//! the places where they stand.

use super::bounds::{bounds_of, box_corners};
use super::sharing::{is_flat, shared_meshes, Instancing};
use super::{Instance, Mesh, Scene};
use crate::error::{Error, Result};
use crate::layout::MATERIAL_BITS;
use glam::{DMat3, DMat4, DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::ops::Range;

/// What is known of a triangle besides its corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangleFlags {
    /// Only its front is seen.
    pub single_sided: bool,
    /// It has normals.
    pub smooth: bool,
    /// It has colours.
    pub colored: bool,
    /// Its material is not opaque.
    pub see_through: bool,
    /// Its longest edge is at least 32 times as long as it is high.
    pub thin: bool,
}

/// How long a triangle is for its height if f32 does not know its hits well enough: then rounding may take a ray that leaves it for one that
/// meets it. Of random rays that leave triangles as large as the scene, 1 in 10 000 does at 1 : 32, 1 in 30 at 1 : 1000.
const THIN: f64 = 32.0;

/// Whether hits on a triangle are not known well enough in f32.
pub(super) fn is_thin([a, b, c]: &[DVec3; 3]) -> bool {
    let longest = a.distance_squared(*b).max(b.distance_squared(*c)).max(c.distance_squared(*a));
    // Twice the area is the longest edge times the height.
    (*b - *a).cross(*c - *a).length() * THIN <= longest
}

/// Where a part of a soup stands.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Index into [`Soup::parts`].
    pub part: usize,
    /// Space of the part's positions to world space.
    pub world_from_part: DMat4,
}

/// Triangles of all instances, in the order of instances and their meshes. A triangle's number is its *primitive*.
///
/// A flat soup is one part, placed once, whose positions are in world space. Otherwise each mesh that instances share is a part
/// in object space, and what is not shared is one more part in world space.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    /// Primitives of each part.
    pub parts: Vec<Range<usize>>,
    /// Where the parts stand.
    pub placements: Vec<Placement>,
    /// Triangles that can be seen: those of a part count as often as it stands somewhere.
    pub placed: usize,
    /// Corners in the space of their part, counter-clockwise seen from the front.
    pub positions: Vec<[DVec3; 3]>,
    /// Index into the scene's materials.
    pub materials: Vec<u32>,
    /// Flags.
    pub flags: Vec<TriangleFlags>,
    /// Unit normals at the corners in the space of their part; zero where not smooth; empty if no triangle is.
    pub normals: Vec<[Vec3; 3]>,
    /// Colours and alphas at the corners; opaque white where not coloured; empty if no triangle is.
    pub colors: Vec<[Vec4; 3]>,
    /// Two sets of texture coordinates at the corners; empty if no triangle has a texture.
    pub texcoords: Vec<[[Vec2; 2]; 3]>,
    /// Unit tangents at the corners in the space of their part, w = sign of the bitangent; empty if no triangle has a normal map.
    pub tangents: Vec<[Vec4; 3]>,
    /// Lower corner of the box around everything, world space.
    pub lo: DVec3,
    /// Upper corner.
    pub hi: DVec3,
    /// What was dropped.
    pub warnings: Vec<String>,
}

/// Most triangles: a leaf's reference has 27 bits for its first triangle.
const MAX_TRIANGLES: usize = 1 << 27;

/// Most materials: a triangle's word for it also holds flags.
const MAX_MATERIALS: usize = 1 << MATERIAL_BITS;

/// Sizes of scenes. The device gets them scaled; this is what the scene's own f32 positions and intensities can mean.
const SIZES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Most points times places that are gone through for the box around a shared mesh; beyond them its own box is placed, which may be
/// larger than what is in it.
const MOST_PLACED_POINTS: usize = 1 << 31;

/// What became of an instance.
struct Added {
    /// Its transform has no volume: nothing of it was added.
    flattened: bool,
    /// Triangles that were dropped because a corner is not finite.
    not_finite: usize,
}

impl Soup {
    /// All triangles of a scene in world space. Positions are transformed in f64; normals by the cofactor matrix, which is the
    /// inverse transpose up to a factor and exists for every matrix; a mirroring transform swaps two corners.
    ///
    /// # Errors
    /// `Content` when there are more than 2²⁷ triangles, or the scene is too large or too small to be computed.
    pub fn of(scene: &Scene) -> Result<Self> {
        Self::with(scene, Instancing::Flat)
    }

    /// The triangles of a scene, those of shared meshes once.
    ///
    /// # Errors
    /// As [`Soup::of`].
    pub fn with(scene: &Scene, instancing: Instancing) -> Result<Self> {
        let used = || scene.instances.iter().map(|instance| &scene.meshes[instance.mesh]);
        let attributes = Attributes {
            smooth: used().any(|mesh| !mesh.normals.is_empty()),
            colored: used().any(|mesh| !mesh.colors.is_empty()),
            textured: used().any(|mesh| scene.materials[mesh.material].drawn_maps().any()),
            tangents: used().any(|mesh| scene.materials[mesh.material].drawn_maps().normal.is_some()),
        };
        let shared = shared_meshes(scene, instancing, attributes.count());
        let is_own = |instance: &&Instance| !shared[instance.mesh];
        let triangles = |mesh: &Mesh| mesh.triangles.len();
        let count = scene.instances.iter().filter(is_own).map(|own| triangles(&scene.meshes[own.mesh])).sum::<usize>()
            + scene
                .meshes
                .iter()
                .zip(&shared)
                .filter(|(_, shared)| **shared)
                .map(|(mesh, _)| triangles(mesh))
                .sum::<usize>();
        if count >= MAX_TRIANGLES {
            return Err(Error::content(&scene.name, format!("{count} triangles: at most {MAX_TRIANGLES}")));
        }
        if scene.materials.len() > MAX_MATERIALS {
            let count = scene.materials.len();
            return Err(Error::content(&scene.name, format!("{count} materials: at most {MAX_MATERIALS}")));
        }
        let bytes = (count * attributes.host_bytes()) as u64;
        if let Some(most) = scene.max_memory.filter(|most| bytes > *most) {
            let message = format!("{count} triangles take {bytes} bytes, more than {most} (see --max-memory)");
            return Err(Error::content(&scene.name, message));
        }
        let mut soup = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, ..Self::default() };
        soup.positions.reserve(count);
        let mut not_finite = 0;
        let mut flattened = vec![0; scene.meshes.len()];
        for instance in scene.instances.iter().filter(is_own) {
            let added = soup.add(scene, instance, attributes);
            not_finite += added.not_finite;
            flattened[instance.mesh] += usize::from(added.flattened);
        }
        (soup.lo, soup.hi) = bounds_of(soup.positions.as_flattened());
        let own = soup.positions.len();
        if own > 0 || !shared.contains(&true) {
            soup.parts.push(0..own);
            soup.placements.push(Placement { part: 0, world_from_part: DMat4::IDENTITY });
            soup.placed = own;
        }
        let mut places = vec![Vec::new(); scene.meshes.len()];
        for instance in scene.instances.iter().filter(|instance| shared[instance.mesh]) {
            places[instance.mesh].push(instance.world_from_object);
        }
        for mesh in (0..scene.meshes.len()).filter(|mesh| shared[*mesh]) {
            not_finite += soup.add_shared(scene, mesh, attributes, &places[mesh], &mut flattened[mesh]);
        }
        for (mesh, count) in scene.meshes.iter().zip(flattened).filter(|(_, count)| *count > 0) {
            let name = &mesh.name;
            soup.warnings.push(format!("ignored: {count} instances of mesh '{name}': their transforms flatten them"));
        }
        if not_finite > 0 {
            soup.warnings.push(format!("ignored: {not_finite} triangles with a corner that is not a finite number"));
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

    /// Adds a mesh once and the places where it stands as placements; returns how many triangles are not finite.
    fn add_shared(
        &mut self,
        scene: &Scene,
        mesh: usize,
        attributes: Attributes,
        places: &[DMat4],
        flattened: &mut usize,
    ) -> usize {
        let first = self.positions.len();
        let once = Instance { mesh, world_from_object: DMat4::IDENTITY };
        let not_finite = self.add(scene, &once, attributes).not_finite;
        let part = self.parts.len();
        self.parts.push(first..self.positions.len());
        let mut points: Vec<DVec3> = self.positions[first..].iter().flatten().copied().collect();
        points.sort_by(|a, b| a.to_array().map(f64::to_bits).cmp(&b.to_array().map(f64::to_bits)));
        points.dedup();
        if points.len().saturating_mul(places.len()) > MOST_PLACED_POINTS {
            let (lo, hi) = bounds_of(&points);
            points = box_corners(lo, hi).to_vec();
        }
        for world_from_part in places.iter().copied() {
            if is_flat(&world_from_part) {
                *flattened += 1;
                continue;
            }
            for point in &points {
                let point = world_from_part.transform_point3(*point);
                self.lo = self.lo.min(point);
                self.hi = self.hi.max(point);
            }
            self.placements.push(Placement { part, world_from_part });
            self.placed += self.parts[part].len();
        }
        not_finite
    }

    /// Adds an instance.
    fn add(&mut self, scene: &Scene, instance: &Instance, attributes: Attributes) -> Added {
        let Attributes { smooth, colored, textured, tangents } = attributes;
        let mesh = &scene.meshes[instance.mesh];
        let linear = DMat3::from_mat4(instance.world_from_object);
        let determinant = linear.determinant();
        if is_flat(&instance.world_from_object) {
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
            mesh.positions.par_iter().map(|p| instance.world_from_object.transform_point3(p.as_dvec3())).collect();
        let normals: Vec<Vec3> = mesh.normals.par_iter().map(world_normal).collect();
        // A tangent lies in the surface and moves with it; a mirroring transform turns the bitangent round.
        let world_tangent = |tangent: Vec4| {
            let world = (linear * tangent.truncate().as_dvec3()).try_normalize().unwrap_or(DVec3::ZERO);
            world.as_vec3().extend(tangent.w * determinant.signum() as f32)
        };
        let places = if determinant < 0.0 { [0, 2, 1] } else { [0, 1, 2] };
        let can_be_drawn = |point: &DVec3| point.is_finite() && point.abs().max_element() < 1e30;
        let are_all_drawn = points.par_iter().all(can_be_drawn);
        let is_drawn = |corners: &[u32; 3]| corners.iter().all(|corner| can_be_drawn(&points[*corner as usize]));
        let all = 0..mesh.triangles.len();
        let some: Option<Vec<usize>> = (!are_all_drawn)
            .then(|| all.clone().into_par_iter().filter(|index| is_drawn(&mesh.triangles[*index])).collect());
        let count = some.as_ref().map_or(all.len(), Vec::len);
        let drawn = || (0..count).into_par_iter().map(|place| some.as_ref().map_or(place, |some| some[place]));
        let corners = |index: usize| places.map(|place: usize| mesh.triangles[index][place] as usize);
        // A normal without a direction makes the whole triangle flat.
        let corner_normals = |index: usize| match normals.is_empty() {
            true => [Vec3::ZERO; 3],
            false => corners(index).map(|corner| normals[corner]),
        };
        let is_smooth = |normals: [Vec3; 3]| normals.iter().all(|normal| normal.length_squared() > 0.5);
        self.positions.par_extend(drawn().map(|index| corners(index).map(|corner| points[corner])));
        self.materials.resize(self.materials.len() + count, mesh.material as u32);
        if smooth {
            self.normals.par_extend(drawn().map(corner_normals));
        }
        if colored {
            let color = |corner: usize| mesh.colors.get(corner).copied().unwrap_or(Vec4::ONE);
            self.colors.par_extend(drawn().map(|index| corners(index).map(color)));
        }
        if textured {
            let texcoord = |corner: usize| mesh.texcoords.get(corner).copied().unwrap_or_default();
            self.texcoords.par_extend(drawn().map(|index| corners(index).map(texcoord)));
        }
        if tangents {
            let own = |index: usize| mesh.tangents.get(index).copied().unwrap_or_default();
            self.tangents.par_extend(drawn().map(|index| places.map(|place| world_tangent(own(index)[place]))));
        }
        let material = &scene.materials[mesh.material];
        self.flags.par_extend(drawn().map(|index| TriangleFlags {
            single_sided: !material.double_sided,
            smooth: is_smooth(corner_normals(index)),
            colored: !mesh.colors.is_empty(),
            see_through: material.is_see_through(),
            thin: is_thin(&corners(index).map(|corner| points[corner])),
        }));
        Added { flattened: false, not_finite: mesh.triangles.len() - count }
    }

    /// The first part holds what stands alone, in world space.
    pub(super) fn has_own_part(&self) -> bool {
        self.placements.first().is_some_and(|first| first.part == 0 && first.world_from_part == DMat4::IDENTITY)
            && self.placements.iter().filter(|placement| placement.part == 0).count() == 1
    }

    /// Every triangle is there once, in world space.
    pub fn is_flat(&self) -> bool {
        self.placements.len() <= 1
    }

    /// Number of triangles that are there, however often they are placed.
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

/// What some triangle of the soup has besides its corners.
#[derive(Clone, Copy)]
struct Attributes {
    smooth: bool,
    colored: bool,
    textured: bool,
    tangents: bool,
}

impl Attributes {
    /// Bytes that a triangle takes in the soup.
    fn host_bytes(&self) -> usize {
        let corners = [
            (self.smooth, size_of::<[Vec3; 3]>()),
            (self.colored, size_of::<[Vec4; 3]>()),
            (self.textured, size_of::<[[Vec2; 2]; 3]>()),
            (self.tangents, size_of::<[Vec4; 3]>()),
        ];
        let attributes: usize = corners.into_iter().filter(|(has, _)| *has).map(|(_, bytes)| bytes).sum();
        size_of::<[DVec3; 3]>() + size_of::<u32>() + size_of::<TriangleFlags>() + attributes
    }

    /// How many there are.
    fn count(&self) -> usize {
        [self.smooth, self.colored, self.textured, self.tangents].into_iter().filter(|has| *has).count()
    }
}
