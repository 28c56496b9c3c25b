//! Materials, and how a metallic-roughness material becomes Whitted's.
//!
//! The rule (base, metallic m, roughness r from glTF, Appendix B of the specification):
//! ```text
//! α = r²                     mirror weight w = max(0, 1 − r / ½)²      (0 from roughness ½ on: no reflection there)
//! F0 = f·(1 − m) + base·m                              shininess s = clamp(2/α² − 2, 1, 1024)     (Walter et al. 2007)
//! diffuse  = base·((1 − m) + m·(1 − w)/2) / π          Lambert; a rough metal's wide lobe counts half as diffuse
//! specular = F0·(s + 8)/(8π)                           normalised Blinn–Phong (Akenine-Möller et al., 9.8)
//! mirror   = F0·w                                      ambient = 0.15·base
//! ```
//! f, the reflectance of a dielectric seen head-on, is ((ior − 1)/(ior + 1))²·specular: 0.04 by default. Where light passes the surface
//! (transmission t), diffuse and ambient are (1 − t·(1 − m)) of that.
//!
//! Lights in candela and lux then give radiances that agree with glTF's own BRDF on rough surfaces.

use super::{Lobes, Maps};
use crate::layout::{AMBIENT_SHARE, MIRROR_END_ROUGHNESS};
use glam::DVec3;
use std::f64::consts::PI;

/// Radiance that reaches a surface from everywhere, as a share of its base colour.
const AMBIENT: f64 = AMBIENT_SHARE as f64;
/// Roughness from which on nothing is mirrored.
const MIRROR_END: f64 = MIRROR_END_ROUGHNESS as f64;

/// Coefficients of Whitted's model: colour = ambient + emission + Σ lights · (diffuse·(n·l) + specular·(n·h)^shininess) +
/// mirror · reflected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Whitted {
    /// Radiance whatever the lights.
    pub ambient: DVec3,
    /// Lambert coefficient.
    pub diffuse: DVec3,
    /// Blinn–Phong coefficient.
    pub specular: DVec3,
    /// Blinn–Phong exponent.
    pub shininess: f64,
    /// Mirror coefficient.
    pub mirror: DVec3,
}

/// What a surface's alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing: the surface is opaque.
    #[default]
    Opaque,
    /// The surface is there where alpha is at least this, and not there elsewhere.
    Mask(f64),
    /// The share of the light that meets the surface; the rest passes.
    Blend,
}

/// A surface's material: factors, and the maps that are multiplied with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, for messages.
    pub name: String,
    /// Base colour, linear RGB.
    pub base_color: DVec3,
    /// Alpha of the base colour.
    pub alpha: f64,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// 0 dielectric … 1 metal.
    pub metallic: f64,
    /// 0 smooth … 1 rough.
    pub roughness: f64,
    /// Radiance given off, linear RGB.
    pub emission: DVec3,
    /// Index of refraction (KHR_materials_ior); 0 stands for infinity.
    pub ior: f64,
    /// How strongly a dielectric reflects, of what its index of refraction says (KHR_materials_specular).
    pub specular: f64,
    /// Colour of a dielectric's reflection seen head-on, linear RGB.
    pub specular_color: DVec3,
    /// Share of the light that is not reflected that passes a dielectric, tinted by its base colour (KHR_materials_transmission);
    /// here straight on, without refraction.
    pub transmission: f64,
    /// How far the normal map bends normals.
    pub normal_scale: f64,
    /// How much the occlusion map darkens ambient light.
    pub occlusion_strength: f64,
    /// Maps.
    pub maps: Maps,
    /// Reflectance beyond metallic-roughness, kept for renderers that show it.
    pub lobes: Lobes,
    /// Both faces are seen; otherwise camera and reflected rays pass through the back (shadow rays never do).
    pub double_sided: bool,
    /// KHR_materials_unlit: the base colour, whatever the light.
    pub unlit: bool,
    /// Exact coefficients (`extras.whitted`) instead of the rule.
    pub whitted: Option<Whitted>,
}

impl Default for Material {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: DVec3::ONE,
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            metallic: 1.0,
            roughness: 1.0,
            emission: DVec3::ZERO,
            ior: 1.5,
            specular: 1.0,
            specular_color: DVec3::ONE,
            transmission: 0.0,
            normal_scale: 1.0,
            occlusion_strength: 1.0,
            maps: Maps::default(),
            lobes: Lobes::default(),
            double_sided: false,
            unlit: false,
            whitted: None,
        }
    }
}

impl Material {
    /// Exact coefficients, seen from both sides.
    pub fn exact(name: &str, whitted: Whitted) -> Self {
        Self { name: name.into(), double_sided: true, whitted: Some(whitted), ..Self::default() }
    }

    /// Reflectance of a dielectric seen head-on.
    pub fn dielectric(&self) -> DVec3 {
        let ratio = if self.ior > 0.0 { (self.ior - 1.0) / (self.ior + 1.0) } else { 1.0 };
        (self.specular_color * ratio * ratio).min(DVec3::ONE) * self.specular
    }

    /// Colour that light takes on inside a volume as thick as its factor says (KHR_materials_volume, Beer's law).
    pub fn attenuation(&self) -> DVec3 {
        self.lobes.volume.map_or(DVec3::ONE, |volume| {
            let lengths = volume.thickness / volume.attenuation_distance;
            volume.attenuation_color.map(|channel| if lengths > 0.0 { channel.powf(lengths) } else { 1.0 })
        })
    }

    /// Light may pass the surface, or parts of it are not there.
    pub fn is_see_through(&self) -> bool {
        self.alpha_mode != AlphaMode::Opaque || self.lets_light_through()
    }

    /// What lies behind it is seen through it.
    pub fn lets_light_through(&self) -> bool {
        self.alpha_mode == AlphaMode::Blend || (self.transmission > 0.0 && !self.unlit && self.whitted.is_none())
    }

    /// The coefficients where the surface has the vertex colour `tint`. Linear in `tint`.
    pub fn whitted(&self, tint: DVec3) -> Whitted {
        if let Some(exact) = self.whitted {
            return Whitted { ambient: exact.ambient * tint, diffuse: exact.diffuse * tint, ..exact };
        }
        let base = self.base_color * tint;
        if self.unlit {
            let none = DVec3::ZERO;
            return Whitted { ambient: base, diffuse: none, specular: none, shininess: 1.0, mirror: none };
        }
        let (metallic, roughness) = (self.metallic, self.roughness);
        let mirror_weight = (1.0 - roughness / MIRROR_END).max(0.0).powi(2);
        let reflectance = self.dielectric() * (1.0 - metallic) + base * metallic;
        let stays = 1.0 - self.transmission * (1.0 - metallic);
        let alpha = roughness * roughness;
        let shininess = (2.0 / (alpha * alpha) - 2.0).clamp(1.0, 1024.0);
        Whitted {
            ambient: base * AMBIENT * stays,
            diffuse: base * stays * ((1.0 - metallic) + metallic * (1.0 - mirror_weight) / 2.0) / PI,
            specular: reflectance * (shininess + 8.0) / (8.0 * PI),
            shininess,
            mirror: reflectance * mirror_weight,
        }
    }
}
