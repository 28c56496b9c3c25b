//! Materials, and how a metallic-roughness material becomes Whitted's.
//!
//! The rule (base, metallic m, roughness r from glTF, Appendix B of the specification):
//! ```text
//! α = r²                     mirror weight w = max(0, 1 − r / ½)²      (0 from roughness ½ on: no reflection there)
//! F0 = 0.04·(1 − m) + base·m                           shininess s = clamp(2/α² − 2, 1, 1024)     (Walter et al. 2007)
//! diffuse  = base·((1 − m) + m·(1 − w)/2) / π          Lambert; a rough metal's wide lobe counts half as diffuse
//! specular = F0·(s + 8)/(8π)                           normalised Blinn–Phong (Akenine-Möller et al., 9.8)
//! mirror   = F0·w                                      ambient = 0.15·base
//! ```
//! Lights in candela and lux then give radiances that agree with glTF's own BRDF on rough surfaces.

use glam::DVec3;
use std::f64::consts::PI;

/// Radiance that reaches a surface from everywhere, as a share of its base colour.
const AMBIENT: f64 = 0.15;
/// Roughness from which on nothing is mirrored.
const MIRROR_END: f64 = 0.5;
/// Reflectance of a dielectric seen head-on.
const DIELECTRIC: f64 = 0.04;

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

/// A surface's material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, for messages.
    pub name: String,
    /// Base colour, linear RGB.
    pub base_color: DVec3,
    /// 0 dielectric … 1 metal.
    pub metallic: f64,
    /// 0 smooth … 1 rough.
    pub roughness: f64,
    /// Radiance given off, linear RGB.
    pub emission: DVec3,
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
            metallic: 1.0,
            roughness: 1.0,
            emission: DVec3::ZERO,
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
        let reflectance = DVec3::splat(DIELECTRIC * (1.0 - metallic)) + base * metallic;
        let alpha = roughness * roughness;
        let shininess = (2.0 / (alpha * alpha) - 2.0).clamp(1.0, 1024.0);
        Whitted {
            ambient: base * AMBIENT,
            diffuse: base * ((1.0 - metallic) + metallic * (1.0 - mirror_weight) / 2.0) / PI,
            specular: reflectance * (shininess + 8.0) / (8.0 * PI),
            shininess,
            mirror: reflectance * mirror_weight,
        }
    }
}
