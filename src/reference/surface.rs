//! What lies at a hit: normals, the material with its maps, what passes it.

use super::texture::Spot;
use super::{Hit, Ray, Tracer};
use crate::scene::{AlphaMode, Material, UsedMap};
use glam::{DVec2, DVec3, DVec4};

/// A point of a surface.
pub(super) struct Surface {
    pub point: DVec3,
    /// Where shadow rays start: the mean of the point's projections onto the planes of the corners' normals, as far as it lies below
    /// them (Hanika, Ray Tracing Gems II, ch. 4).
    pub raised: DVec3,
    /// Of the triangle, on the side of the ray.
    pub plane_normal: DVec3,
    /// Interpolated and mapped, on the same side.
    pub normal: DVec3,
    /// With what maps say of this point; its own maps are gone.
    pub material: Material,
    pub tint: DVec3,
    /// Share of ambient light that arrives.
    pub occlusion: f64,
}

/// What a surface that is not opaque does to light.
pub(super) struct Veil {
    pub alpha: f64,
    pub color: DVec3,
    /// Colour of what passes inside.
    pub inside: DVec3,
    pub transmission: f64,
}

impl Tracer<'_> {
    fn material(&self, primitive: usize) -> &Material {
        &self.scene.materials[self.soup.materials[primitive] as usize]
    }

    fn map(&self, map: Option<crate::scene::Map>, is_srgb: bool, spot: &Spot) -> DVec4 {
        let value = map.and_then(|map| self.library.value(UsedMap { map, is_srgb }, spot));
        value.unwrap_or(DVec4::ONE)
    }

    fn vertex_color(&self, primitive: usize, weights: [f64; 3]) -> DVec4 {
        if !self.soup.flags[primitive].colored {
            return DVec4::ONE;
        }
        (0..3).map(|corner| self.soup.colors[primitive][corner].as_dvec4() * weights[corner]).sum()
    }

    /// Texture coordinates, and how they change along two directions in the triangle's plane.
    fn spot(&self, primitive: usize, weights: [f64; 3], axes: [DVec3; 2]) -> Spot {
        let Some(corners) = self.soup.texcoords.get(primitive) else { return Spot::default() };
        let [a, b, c] = self.soup.positions[primitive];
        let (edge_b, edge_c) = (b - a, c - a);
        let normal = edge_b.cross(edge_c);
        let area = normal.length_squared();
        let mut spot = Spot::default();
        for set in 0..2 {
            let [a, b, c] = corners.map(|sets| sets[set].as_dvec2());
            spot.at[set] = a * weights[0] + b * weights[1] + c * weights[2];
            let change = |axis: DVec3| -> DVec2 {
                let along_b = axis.cross(edge_c).dot(normal) / area;
                let along_c = edge_b.cross(axis).dot(normal) / area;
                (b - a) * along_b + (c - a) * along_c
            };
            (spot.major[set], spot.minor[set]) = (change(axes[0]), change(axes[1]));
        }
        spot
    }

    /// What passes a triangle at a point, by the finest pixels of its maps.
    pub fn veil(&self, primitive: usize, weights: [f64; 3]) -> Veil {
        let material = self.material(primitive);
        let maps = material.drawn_maps();
        let spot = self.spot(primitive, weights, [DVec3::ZERO; 2]);
        let color = material.base_color.extend(material.alpha)
            * self.vertex_color(primitive, weights)
            * self.map(maps.base_color, true, &spot);
        let alpha = match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f64::from(color.w >= cutoff),
            AlphaMode::Blend => color.w.clamp(0.0, 1.0),
        };
        let passes = if material.unlit || material.whitted.is_some() { 0.0 } else { material.transmission };
        let metallic = material.metallic * self.map(maps.metallic_roughness, false, &spot).z;
        let transmission = passes * self.map(maps.transmission, false, &spot).x * (1.0 - metallic);
        let inside = color.truncate() * material.attenuation();
        Veil { alpha, color: color.truncate(), inside, transmission }
    }

    /// The surface at a hit, seen by a ray whose cone has travelled this far.
    pub fn surface(&self, ray: &Ray, hit: &Hit, travelled: f64) -> Surface {
        let primitive = hit.primitive;
        let [a, b, c] = self.soup.positions[primitive];
        let weights = hit.weights();
        let point = a * weights[0] + b * weights[1] + c * weights[2];
        let mut plane_normal = (b - a).normalize().cross((c - a).normalize()).normalize();
        let mut normal = plane_normal;
        let front = if plane_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
        let mut raised = point;
        if self.soup.flags[primitive].smooth {
            let corners = self.soup.normals[primitive];
            normal = (0..3).map(|i| corners[i].as_dvec3() * weights[i]).sum::<DVec3>().normalize();
            for (corner, position) in [a, b, c].into_iter().enumerate() {
                let upward = corners[corner].as_dvec3() * front;
                raised -= upward * (weights[corner] * (point - position).dot(upward).min(0.0));
            }
        }
        let mut surface = Surface {
            point,
            raised,
            plane_normal,
            normal,
            material: Material { name: String::new(), ..Material::default() },
            tint: self.vertex_color(primitive, weights).truncate(),
            occlusion: 1.0,
        };
        self.apply_maps(ray, hit, travelled, &mut surface);
        if plane_normal.dot(ray.direction) > 0.0 {
            plane_normal = -plane_normal;
            surface.normal = -surface.normal;
        }
        surface.plane_normal = plane_normal;
        surface
    }

    fn apply_maps(&self, ray: &Ray, hit: &Hit, travelled: f64, surface: &mut Surface) {
        let material = self.material(hit.primitive);
        let maps = material.drawn_maps();
        let normal = surface.plane_normal;
        let [start, spread] = self.view.cone();
        let diameter = start + spread * travelled;
        let cosine = normal.dot(ray.direction).abs().max(1e-3);
        let along = ray.direction - normal * normal.dot(ray.direction);
        let along = along.try_normalize().filter(|_| along.length_squared() > 1e-12).unwrap_or_else(|| {
            let other = if normal.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
            normal.cross(other).normalize()
        });
        let axes = [along * (diameter / cosine), normal.cross(along) * diameter];
        let spot = self.spot(hit.primitive, hit.weights(), axes);
        if maps.normal.is_some() {
            surface.normal = self.mapped_normal(hit, surface.normal, material, &spot);
        }
        let rough_metal = self.map(maps.metallic_roughness, false, &spot);
        surface.tint *= self.map(maps.base_color, true, &spot).truncate();
        surface.occlusion = 1.0 + material.occlusion_strength * (self.map(maps.occlusion, false, &spot).x - 1.0);
        surface.material = Material {
            name: String::new(),
            base_color: material.base_color,
            metallic: material.metallic * rough_metal.z,
            roughness: material.roughness * rough_metal.y,
            emission: material.emission * self.map(maps.emission, true, &spot).truncate(),
            ior: material.ior,
            specular: material.specular * self.map(maps.specular, false, &spot).w,
            specular_color: material.specular_color * self.map(maps.specular_color, true, &spot).truncate(),
            transmission: material.transmission * self.map(maps.transmission, false, &spot).x,
            unlit: material.unlit,
            whitted: material.whitted,
            ..Material::default()
        };
    }

    /// The interpolated normal bent as the normal map says, about the tangents' frame.
    fn mapped_normal(&self, hit: &Hit, normal: DVec3, material: &Material, spot: &Spot) -> DVec3 {
        let weights = hit.weights();
        let corners = self.soup.tangents[hit.primitive];
        let tangent: DVec3 = (0..3).map(|i| corners[i].truncate().as_dvec3() * weights[i]).sum();
        let Some(tangent) = (tangent - normal * tangent.dot(normal)).try_normalize() else { return normal };
        let bitangent = normal.cross(tangent) * f64::from(corners[0].w).signum();
        let Some(used) = material.maps.normal.map(|map| UsedMap { map, is_srgb: false }) else { return normal };
        let Some(value) = self.library.value(used, spot) else { return normal };
        let bent = value.truncate() * 2.0 - 1.0;
        let scale = material.normal_scale;
        let mapped = tangent * (bent.x * scale) + bitangent * (bent.y * scale) + normal * bent.z;
        mapped.try_normalize().unwrap_or(normal)
    }
}
