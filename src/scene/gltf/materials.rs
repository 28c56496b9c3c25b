//! glTF materials → [`Material`], with their extensions.

use super::{check, Document};
use crate::scene::{
    AlphaMode, Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Lobes, Map, Maps, Material, Scene, Sheen,
    Volume, Whitted,
};
use glam::DVec3;
use serde::Deserialize;
use serde_json::Value;
use std::rc::Rc;

/// `extras.whitted` of a material: exact coefficients. What is not given is 0 (shininess 1).
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WhittedExtras {
    #[serde(default)]
    ambient: Coefficient,
    #[serde(default)]
    diffuse: Coefficient,
    #[serde(default)]
    specular: Coefficient,
    #[serde(default = "one")]
    shininess: f64,
    #[serde(default)]
    mirror: Coefficient,
}

fn one() -> f64 {
    1.0
}

/// A number for all channels, or one for each.
#[derive(Deserialize)]
#[serde(untagged)]
enum Coefficient {
    Grey(f64),
    Rgb([f64; 3]),
}

impl Default for Coefficient {
    fn default() -> Self {
        Coefficient::Grey(0.0)
    }
}

impl Coefficient {
    fn rgb(&self) -> DVec3 {
        match *self {
            Coefficient::Grey(value) => DVec3::splat(value),
            Coefficient::Rgb(values) => DVec3::from_array(values),
        }
    }
}

/// The exact coefficients in a material's extras, if there are any; `Err` says what is wrong with them.
fn whitted(material: &Value) -> Result<Option<Whitted>, String> {
    let Some(given) = material.pointer("/extras/whitted") else { return Ok(None) };
    let given = WhittedExtras::deserialize(given).map_err(|error| error.to_string())?;
    let whitted = Whitted {
        ambient: given.ambient.rgb(),
        diffuse: given.diffuse.rgb(),
        specular: given.specular.rgb(),
        shininess: given.shininess,
        mirror: given.mirror.rgb(),
    };
    let all = [whitted.ambient, whitted.diffuse, whitted.specular, whitted.mirror, DVec3::splat(whitted.shininess)];
    if all.iter().any(|value| !value.is_finite() || value.min_element() < 0.0) {
        return Err("a coefficient is negative or not finite".into());
    }
    Ok(Some(whitted))
}

/// Properties of an object, with what glTF takes for those that are not there.
#[derive(Clone, Copy)]
pub(super) struct Properties<'a>(pub &'a Value);

impl<'a> Properties<'a> {
    pub fn extension(self, name: &str) -> Option<Properties<'a>> {
        self.0.get("extensions")?.get(name).filter(|value| value.is_object()).map(Properties)
    }

    /// A number that is not negative.
    fn number(self, name: &str, default: f64) -> f64 {
        self.signed(name, default).max(0.0)
    }

    fn signed(self, name: &str, default: f64) -> f64 {
        self.0.get(name).and_then(Value::as_f64).filter(|value| value.is_finite()).unwrap_or(default)
    }

    /// A number from 0 to 1.
    pub fn share(self, name: &str, default: f64) -> f64 {
        self.number(name, default).min(1.0)
    }

    pub fn color(self, name: &str, default: f64) -> DVec3 {
        let channel = |index: usize| self.0.get(name).and_then(|value| value.get(index)?.as_f64()).unwrap_or(default);
        DVec3::new(channel(0), channel(1), channel(2)).max(DVec3::ZERO)
    }
}

impl Document<'_> {
    /// Adds all materials and, behind them, glTF's default material for primitives that name none.
    pub fn add_materials(&mut self, scene: &mut Scene) {
        let raw = Rc::clone(&self.raw);
        for (index, material) in check::list(&raw, "materials").iter().enumerate() {
            let (path, own) = (format!("materials[{index}]"), Properties(material));
            let mut material = self.material(&path, own);
            self.read_spec_gloss(&path, own, index, &mut material);
            scene.materials.push(material);
        }
        scene.materials.push(Material::default());
    }

    fn material(&mut self, path: &str, own: Properties) -> Material {
        let none = Value::Null;
        let factors = Properties(own.0.get("pbrMetallicRoughness").unwrap_or(&none));
        let exact = whitted(own.0).unwrap_or_else(|fault| {
            self.warnings.add(format!("ignored: {path}.extras.whitted: {fault}"));
            None
        });
        let strength =
            own.extension("KHR_materials_emissive_strength").map_or(1.0, |e| e.number("emissiveStrength", 1.0));
        let specular = own.extension("KHR_materials_specular").unwrap_or(Properties(&none));
        let transmission = own.extension("KHR_materials_transmission").unwrap_or(Properties(&none));
        let unlit = own.extension("KHR_materials_unlit").is_some();
        let mut map = |of: Properties, name: &str| self.map(path, of, name);
        let maps = Maps {
            base_color: map(factors, "baseColorTexture"),
            metallic_roughness: map(factors, "metallicRoughnessTexture"),
            normal: map(own, "normalTexture"),
            occlusion: map(own, "occlusionTexture"),
            emission: map(own, "emissiveTexture"),
            specular: map(specular, "specularTexture"),
            specular_color: map(specular, "specularColorTexture"),
            transmission: map(transmission, "transmissionTexture"),
        };
        let of_map = |name: &str, value: &str, default: f64| {
            own.0.get(name).map_or(default, |info| Properties(info).signed(value, default))
        };
        let base_alpha = factors.0.get("baseColorFactor").and_then(|color| color.get(3)?.as_f64()).unwrap_or(1.0);
        let alpha_mode = match own.0.get("alphaMode").and_then(Value::as_str) {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask(own.number("alphaCutoff", 0.5)),
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => {
                self.warnings.add(format!("{path}.alphaMode '{other}' is unknown; OPAQUE is used"));
                AlphaMode::Opaque
            }
        };
        Material {
            name: own.0.get("name").and_then(Value::as_str).unwrap_or_default().into(),
            base_color: factors.color("baseColorFactor", 1.0),
            alpha: base_alpha.clamp(0.0, 1.0),
            alpha_mode,
            metallic: factors.share("metallicFactor", 1.0),
            roughness: factors.share("roughnessFactor", 1.0),
            // Unlit is the base colour and nothing else.
            emission: if unlit { DVec3::ZERO } else { own.color("emissiveFactor", 0.0) * strength },
            ior: own.extension("KHR_materials_ior").map_or(1.5, |e| e.number("ior", 1.5)),
            specular: specular.share("specularFactor", 1.0),
            specular_color: specular.color("specularColorFactor", 1.0),
            transmission: transmission.share("transmissionFactor", 0.0),
            normal_scale: of_map("normalTexture", "scale", 1.0),
            occlusion_strength: of_map("occlusionTexture", "strength", 1.0).clamp(0.0, 1.0),
            maps,
            lobes: self.lobes(path, own),
            double_sided: own.0.get("doubleSided").and_then(Value::as_bool).unwrap_or(false),
            unlit,
            whitted: exact,
        }
    }

    fn lobes(&mut self, path: &str, own: Properties) -> Lobes {
        let mut map = |of: Properties, name: &str| self.map(path, of, name);
        let extension = |name: &str| own.extension(&format!("KHR_materials_{name}"));
        Lobes {
            clearcoat: extension("clearcoat").map(|e| Clearcoat {
                factor: e.share("clearcoatFactor", 0.0),
                roughness: e.share("clearcoatRoughnessFactor", 0.0),
                map: map(e, "clearcoatTexture"),
                roughness_map: map(e, "clearcoatRoughnessTexture"),
                normal_map: map(e, "clearcoatNormalTexture"),
            }),
            sheen: extension("sheen").map(|e| Sheen {
                color: e.color("sheenColorFactor", 0.0),
                roughness: e.share("sheenRoughnessFactor", 0.0),
                color_map: map(e, "sheenColorTexture"),
                roughness_map: map(e, "sheenRoughnessTexture"),
            }),
            iridescence: extension("iridescence").map(|e| Iridescence {
                factor: e.share("iridescenceFactor", 0.0),
                ior: e.number("iridescenceIor", 1.3),
                thickness: [
                    e.number("iridescenceThicknessMinimum", 100.0),
                    e.number("iridescenceThicknessMaximum", 400.0),
                ],
                map: map(e, "iridescenceTexture"),
                thickness_map: map(e, "iridescenceThicknessTexture"),
            }),
            anisotropy: extension("anisotropy").map(|e| Anisotropy {
                strength: e.share("anisotropyStrength", 0.0),
                rotation: e.signed("anisotropyRotation", 0.0),
                map: map(e, "anisotropyTexture"),
            }),
            volume: extension("volume").map(|e| Volume {
                thickness: e.number("thicknessFactor", 0.0),
                thickness_map: map(e, "thicknessTexture"),
                attenuation_distance: e.number("attenuationDistance", f64::INFINITY),
                attenuation_color: e.color("attenuationColor", 1.0),
            }),
            dispersion: extension("dispersion").map_or(0.0, |e| e.number("dispersion", 0.0)),
            diffuse_transmission: extension("diffuse_transmission").map(|e| DiffuseTransmission {
                factor: e.share("diffuseTransmissionFactor", 0.0),
                color: e.color("diffuseTransmissionColorFactor", 1.0),
                map: map(e, "diffuseTransmissionTexture"),
                color_map: map(e, "diffuseTransmissionColorTexture"),
            }),
        }
    }

    /// A texture on a surface.
    pub(super) fn map(&mut self, path: &str, of: Properties, name: &str) -> Option<Map> {
        let info = of.0.get(name).filter(|info| info.is_object())?;
        let texture = info.get("index").and_then(Value::as_u64).map(|index| index as usize)?;
        if texture >= self.root_textures() {
            return None;
        }
        let transform = Properties(info).extension("KHR_texture_transform");
        let own_set = info.get("texCoord").and_then(Value::as_u64).unwrap_or(0);
        let set = transform.and_then(|e| e.0.get("texCoord")?.as_u64()).unwrap_or(own_set);
        if set > 1 {
            self.warnings.add(format!("approximated: {path}.{name} is placed by TEXCOORD_{set}; TEXCOORD_0 is used"));
        }
        Some(Map {
            texture,
            texcoord: if set == 1 { 1 } else { 0 },
            transform: transform.map_or(Map::UNMOVED, texture_transform),
        })
    }
}

/// The matrix of KHR_texture_transform: scaled, then rotated, then moved.
fn texture_transform(own: Properties) -> [[f64; 3]; 2] {
    let pair = |name: &str, default: f64| {
        [0, 1].map(|index| own.0.get(name).and_then(|value| value.get(index)?.as_f64()).unwrap_or(default))
    };
    let ([scale_u, scale_v], [offset_u, offset_v]) = (pair("scale", 1.0), pair("offset", 0.0));
    let (sine, cosine) = own.signed("rotation", 0.0).sin_cos();
    [[cosine * scale_u, sine * scale_v, offset_u], [-sine * scale_u, cosine * scale_v, offset_v]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn texture_transforms_scale_turn_and_move() {
        let quarter = json!({"offset": [0.0, 1.0], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.25]});
        let [u, v] = texture_transform(Properties(&quarter));
        let at = |row: [f64; 3], x: f64, y: f64| row[0] * x + row[1] * y + row[2];
        // The extension's own example: the texture's upper left quarter, turned.
        assert!((at(u, 1.0, 1.0) - 0.25).abs() < 1e-12 && (at(v, 1.0, 1.0) - 0.5).abs() < 1e-12);
        assert_eq!(texture_transform(Properties(&json!({}))), Map::UNMOVED);
    }

    #[test]
    fn a_coefficient_is_grey_or_rgb() {
        let material = json!({"extras": {"whitted": {"diffuse": 0.5, "mirror": [0.1, 0.2, 0.3]}}});
        let whitted = whitted(&material).unwrap().unwrap();
        assert_eq!((whitted.diffuse, whitted.mirror), (DVec3::splat(0.5), DVec3::new(0.1, 0.2, 0.3)));
        assert!(super::whitted(&json!({"extras": {"whitted": {"diffuse": -1}}})).is_err());
        assert!(super::whitted(&json!({"extras": {"whitted": {"gloss": 1}}})).is_err());
    }
}
