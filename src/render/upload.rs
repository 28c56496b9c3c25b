//! Scene → device buffers, in the layout of `shaders/shared/layout.glsl`.

use super::textures::Textures;
use super::tree::{DeviceTree, Rebase};
use super::Renderer;
use crate::error::Result;
use crate::layout::{
    self, binding, Features, ALPHA_BLEND, ALPHA_MASK, ALPHA_OPAQUE, FAR, LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SPOT,
    PRECEDENCE_THIN, TILE, TRIANGLE_COLORED, TRIANGLE_SEE_THROUGH, TRIANGLE_SINGLE_SIDED, TRIANGLE_SMOOTH,
    TRIANGLE_TEXELS,
};
use crate::scene::{self, AlphaMode, LightKind, Projection, Soup, UsedMap, View};
use crate::vulkan::{Access, Buffer, Commands, Memory, Usage};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// A triangle as kernels fetch it: its corners, with numbers of its own behind each.
type TriangleTexels = [[u32; 4]; TRIANGLE_TEXELS as usize];

/// All that is uploaded.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub scene: &'a scene::Scene,
    pub soup: &'a Soup,
    pub view: &'a View,
    pub tree: &'a DeviceTree,
    /// From world space to the device's.
    pub rebase: Rebase,
    pub textures: &'a Textures,
}

impl Scene<'_> {
    /// Makes the buffer of a slot that holds scene data; `None` for the frame's own slots.
    pub fn buffer(&self, renderer: &Renderer, slot: u32, features: Features) -> Option<Result<Buffer>> {
        let make = |name, bytes: &[u8], usage| Buffer::with_data(&renderer.device, name, bytes, usage);
        Some(match slot {
            binding::NODES => make("nodes", bytemuck::cast_slice(&self.tree.nodes), Usage::Fetch),
            binding::TRIANGLES => {
                let bytes = self.tree.order.len() * size_of::<TriangleTexels>();
                Buffer::filled(&renderer.device, "triangles", bytes as u64, Usage::Fetch, |target| {
                    self.write_triangles(bytemuck::cast_slice_mut(target));
                })
            }
            binding::ATTRIBUTES => make("attributes", bytemuck::cast_slice(&self.attributes(features)), Usage::Fetch),
            binding::TEXTURES => make("textures", bytemuck::cast_slice(&self.textures.records), Usage::Fetch),
            binding::PIXELS => make("pixels", bytemuck::cast_slice(&self.textures.pixels), Usage::Fetch),
            binding::INSTANCES => {
                let instances = if features.instances { self.tree.instances.as_slice() } else { &[] };
                make("instances", bytemuck::cast_slice(instances), Usage::Fetch)
            }
            binding::FRAME => make("frame", bytemuck::bytes_of(&self.frame(features)), Usage::Uniform),
            binding::MATERIALS => {
                let materials: Vec<_> = self.scene.materials.iter().map(|own| self.material(own)).collect();
                make("materials", bytemuck::cast_slice(&materials), Usage::Fetch)
            }
            binding::LIGHTS => {
                let lights: Vec<_> = self.view.lights.iter().map(|light| self.light(light)).collect();
                // The shade pass reads light 0 even where shadows are forced on without any: a dark one.
                let lights = if lights.is_empty() { vec![layout::Light::default()] } else { lights };
                let lights = if features.shadows { lights.as_slice() } else { &[] };
                make("lights", bytemuck::cast_slice(lights), Usage::Fetch)
            }
            binding::FILTER_STEPS => {
                let steps = if features.filter { self.view.filter.steps() } else { Vec::new() };
                let texels: Vec<[f32; 4]> = steps.iter().map(|[start, end]| [*start, *end, 0.0, 0.0]).collect();
                make("filter steps", bytemuck::cast_slice(&texels), Usage::Fetch)
            }
            _ => return None,
        })
    }

    /// Writes triangles in leaf order.
    fn write_triangles(&self, target: &mut [TriangleTexels]) {
        let soup = self.soup;
        let precedence = scene::precedence(self.scene, soup);
        let triangle = |primitive: &u32| {
            let index = *primitive as usize;
            let flags = soup.flags[index];
            let bits = [
                (flags.single_sided, TRIANGLE_SINGLE_SIDED),
                (flags.smooth, TRIANGLE_SMOOTH),
                (flags.colored, TRIANGLE_COLORED),
                (flags.see_through, TRIANGLE_SEE_THROUGH),
            ];
            let bits_of_flags: u32 = bits.iter().filter(|(on, _)| *on).map(|(_, bit)| bit).sum();
            let precedence = precedence[index] & !PRECEDENCE_THIN | if flags.thin { PRECEDENCE_THIN } else { 0 };
            let extra = [*primitive, soup.materials[index] | bits_of_flags, precedence];
            let rebase = self.tree.rebase_of(index);
            let texel = |corner: usize| with_bits(rebase.point(soup.positions[index][corner]), extra[corner]);
            [texel(0), texel(1), texel(2)]
        };
        target.par_iter_mut().zip(&self.tree.order).for_each(|(texels, primitive)| *texels = triangle(primitive));
    }

    /// What primitives have besides positions, kind after kind, three texels each; kinds that the scene needs and lacks are zeros.
    fn attributes(&self, features: Features) -> Vec<[[u32; 4]; 3]> {
        let turned = |normal: Vec3| {
            let is_in_world = self.rebase.turns() && self.soup.is_flat();
            if is_in_world {
                self.rebase.direction(normal.as_dvec3())
            } else {
                normal
            }
        };
        let bits = |vector: Vec4| vector.to_array().map(f32::to_bits);
        let mut all = Vec::with_capacity(attribute_kinds(features) as usize * self.soup.len());
        if features.smooth_normals {
            all.extend(self.per_primitive(&self.soup.normals, |normal| bits(turned(*normal).extend(0.0))));
        }
        if features.vertex_colors {
            all.extend(self.per_primitive(&self.soup.colors, |color| bits(*color)));
        }
        if features.textures {
            all.extend(self.per_primitive(&self.soup.texcoords, |[first, second]| {
                [first.x, first.y, second.x, second.y].map(f32::to_bits)
            }));
        }
        if features.normal_maps {
            all.extend(
                self.per_primitive(&self.soup.tangents, |tangent| bits(turned(tangent.truncate()).extend(tangent.w))),
            );
        }
        all
    }

    /// Three texels a primitive; zeros where the soup has no such data.
    fn per_primitive<T: Sync>(&self, corners: &[[T; 3]], texel: impl Fn(&T) -> [u32; 4] + Sync) -> Vec<[[u32; 4]; 3]> {
        if corners.is_empty() {
            return vec![[[0; 4]; 3]; self.soup.len()];
        }
        corners.par_iter().map(|[a, b, c]| [texel(a), texel(b), texel(c)]).collect()
    }

    fn frame(&self, features: Features) -> layout::Frame {
        let view = self.view;
        let (mut right, mut up) = view.camera.half_axes(f64::from(view.width) / f64::from(view.height));
        let is_orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
        if is_orthographic {
            right *= self.rebase.scale;
            up *= self.rebase.scale;
        }
        let (strata_x, strata_y) = view.strata();
        let kind = self.soup.len() as u32 * TRIANGLE_TEXELS;
        let first_color = if features.smooth_normals { kind } else { 0 };
        let first_texcoord = first_color + if features.vertex_colors { kind } else { 0 };
        let first_tangent = first_texcoord + if features.textures { kind } else { 0 };
        let [start, spread] = view.cone();
        layout::Frame {
            eye: self.rebase.point(view.camera.eye).into(),
            forward: self.rebase.direction(view.camera.forward).into(),
            right: self.rebase.direction(right).into(),
            up: self.rebase.direction(up).into(),
            sky: self.rebase.direction(DVec3::Y).into(),
            orthographic: u32::from(is_orthographic),
            width: view.width,
            height: view.height,
            tiles_across: view.width.div_ceil(TILE),
            samples: view.samples,
            strata_x,
            strata_y,
            nadir: view.background.radiance(DVec3::NEG_Y).as_vec3().into(),
            zenith: view.background.radiance(DVec3::Y).as_vec3().into(),
            background_alpha: view.background.alpha() as f32,
            grid_origin: self.tree.grid.origin.into(),
            grid_scale: self.tree.grid.scale.into(),
            filter_zero: view.filter.zero().min(f64::from(FAR)) as f32,
            filter_mean: view.filter.mean_weight() as f32,
            fixed_epsilon: (1e-4 * self.rebase.scale) as f32,
            first_color,
            first_texcoord,
            first_tangent,
            max_depth: view.max_depth,
            cone: [(start * self.rebase.scale) as f32, spread as f32],
        }
    }

    /// A material and its look. The coefficients are linear in the tint: what is left at tint 0 is constant, the rest is multiplied.
    fn material(&self, material: &scene::Material) -> MaterialAndLook {
        let (constant, full) = (material.whitted(DVec3::ZERO), material.whitted(DVec3::ONE));
        let coefficients = layout::Material {
            ambient_tinted: full.ambient.as_vec3().into(),
            emission: material.emission.as_vec3().into(),
            diffuse_tinted: full.diffuse.as_vec3().into(),
            specular: constant.specular.as_vec3().into(),
            specular_tinted: (full.specular - constant.specular).as_vec3().into(),
            shininess: full.shininess as f32,
            mirror: constant.mirror.as_vec3().into(),
            mirror_tinted: (full.mirror - constant.mirror).as_vec3().into(),
            unused: [0.0; 2],
        };
        let maps = material
            .drawn_maps()
            .list()
            .map(|(map, is_srgb)| map.map_or(0, |map| self.textures.number_of(&UsedMap { map, is_srgb })));
        let [base_color, metallic_roughness, normal, occlusion, emission, specular, specular_color, transmission] =
            maps;
        let (alpha_mode, cutoff) = match material.alpha_mode {
            AlphaMode::Opaque => (ALPHA_OPAQUE, 0.0),
            AlphaMode::Mask(cutoff) => (ALPHA_MASK, cutoff),
            AlphaMode::Blend => (ALPHA_BLEND, 0.0),
        };
        let follows_rule = material.whitted.is_none() && !material.unlit;
        let look = layout::Look {
            base_color: material.base_color.as_vec3().into(),
            alpha: material.alpha as f32,
            metallic: material.metallic as f32,
            roughness: material.roughness as f32,
            occlusion_strength: material.occlusion_strength as f32,
            normal_scale: material.normal_scale as f32,
            dielectric: material.dielectric().as_vec3().into(),
            cutoff: cutoff as f32,
            base_color_map: base_color,
            metallic_roughness_map: metallic_roughness,
            normal_map: normal,
            occlusion_map: occlusion,
            emission_map: emission,
            specular_map: specular,
            specular_color_map: specular_color,
            transmission_map: transmission,
            transmission: if follows_rule { material.transmission as f32 } else { 0.0 },
            alpha_mode,
            follows_rule: u32::from(follows_rule),
            unused: 0,
            attenuation: material.attenuation().as_vec3().into(),
            unused_too: 0,
        };
        MaterialAndLook { material: coefficients, look }
    }

    fn light(&self, light: &scene::Light) -> layout::Light {
        let (kind, spot_scale, spot_offset) = match light.kind {
            LightKind::Point => (LIGHT_POINT, 0.0, 0.0),
            LightKind::Directional => (LIGHT_DIRECTIONAL, 0.0, 0.0),
            LightKind::Spot { inner_cosine, outer_cosine } => {
                // KHR_lights_punctual's own formula, with its guard against equal angles.
                let scale = 1.0 / (inner_cosine - outer_cosine).max(0.001);
                (LIGHT_SPOT, scale, -outer_cosine * scale)
            }
        };
        // Irradiance falls with the square of lengths, which are scaled; parallel light does not fall.
        let square = if light.kind == LightKind::Directional { 1.0 } else { self.rebase.scale * self.rebase.scale };
        layout::Light {
            kind,
            position: self.rebase.point(light.position).into(),
            direction: self.rebase.direction(light.direction).into(),
            intensity: (light.intensity * square).as_vec3().into(),
            range: light.range.map_or(FAR, |range| (range * self.rebase.scale) as f32),
            spot_scale: spot_scale as f32,
            spot_offset: spot_offset as f32,
            unused: [0.0; 3],
        }
    }
}

/// Kinds of attributes on the device.
pub(super) fn attribute_kinds(features: Features) -> u64 {
    let Features { smooth_normals, vertex_colors, textures, normal_maps, .. } = features;
    [smooth_normals, vertex_colors, textures, normal_maps].map(u64::from).iter().sum()
}

/// What lies in the buffer of materials.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct MaterialAndLook {
    material: layout::Material,
    look: layout::Look,
}

fn with_bits(vector: Vec3, bits: u32) -> [u32; 4] {
    [vector.x.to_bits(), vector.y.to_bits(), vector.z.to_bits(), bits]
}

/// Makes the buffer of a slot that only the frame itself writes.
pub(super) fn frame_buffer(renderer: &Renderer, slot: u32, name: &'static str, bytes: u64) -> Result<Buffer> {
    let is_viewed = binding::ALL.iter().any(|binding| binding.view_of == Some(slot));
    let usage = match slot {
        binding::DISPATCHES => Usage::Indirect,
        _ if is_viewed => Usage::FetchedStorage,
        _ => Usage::Storage,
    };
    Buffer::new(&renderer.device, name, bytes, usage, Memory::Device)
}

/// A copy of a whole buffer that the host can read.
pub(super) fn read_back(renderer: &Renderer, buffer: &Buffer) -> Result<Buffer> {
    let copy = Buffer::new(&renderer.device, "read back", buffer.bytes, Usage::Storage, Memory::ReadBack)?;
    let mut commands = Commands::new(&renderer.device, 0)?;
    commands.copy(buffer, &copy, 0, buffer.bytes);
    // The copy: it wrote, the host reads.
    commands.barrier(Access::Transfer, Access::HostRead);
    commands.submit_and_wait()?;
    Ok(copy)
}
