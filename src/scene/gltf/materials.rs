//! glTF materials → [`Material`].

use super::Document;
use crate::scene::{Material, Scene, Whitted};
use ::gltf::json::extras::RawValue;
use ::gltf::json::material::AlphaMode;
use ::gltf::json::validation::Checked;
use glam::DVec3;
use serde::Deserialize;

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
fn whitted(extras: &Option<Box<RawValue>>) -> Result<Option<Whitted>, String> {
    #[derive(Deserialize)]
    struct Extras {
        whitted: Option<WhittedExtras>,
    }
    let Some(raw) = extras.as_ref().filter(|raw| raw.get().contains("\"whitted\"")) else { return Ok(None) };
    let Extras { whitted: Some(given) } = serde_json::from_str(raw.get()).map_err(|error| error.to_string())? else {
        return Ok(None);
    };
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

impl Document<'_> {
    /// Adds all materials and, behind them, glTF's default material for primitives that name none.
    pub fn add_materials(&mut self, scene: &mut Scene) {
        for (index, material) in self.root.materials.iter().enumerate() {
            let factors = &material.pbr_metallic_roughness;
            let [r, g, b, _] = factors.base_color_factor.0.map(f64::from);
            let extensions = material.extensions.as_ref();
            let extension = |name: &str| extensions.and_then(|extensions| extensions.others.get(name));
            let strength = extension("KHR_materials_emissive_strength")
                .and_then(|value| value.get("emissiveStrength")?.as_f64())
                .filter(|strength| *strength >= 0.0)
                .unwrap_or(1.0);
            let exact = whitted(&material.extras).unwrap_or_else(|fault| {
                self.warnings.add(format!("materials[{index}].extras.whitted is not used: {fault}"));
                None
            });
            if material.alpha_mode != Checked::Valid(AlphaMode::Opaque) {
                self.warnings.add("approximated: a material with alpha MASK or BLEND is drawn opaque");
            }
            let unlit = extension("KHR_materials_unlit").is_some();
            let emission = DVec3::from_array(material.emissive_factor.0.map(f64::from)).max(DVec3::ZERO) * strength;
            scene.materials.push(Material {
                name: material.name.clone().unwrap_or_default(),
                base_color: DVec3::new(r, g, b).max(DVec3::ZERO),
                metallic: f64::from(factors.metallic_factor.0).clamp(0.0, 1.0),
                roughness: f64::from(factors.roughness_factor.0).clamp(0.0, 1.0),
                // Unlit is the base colour and nothing else.
                emission: if unlit { DVec3::ZERO } else { emission },
                double_sided: material.double_sided,
                unlit,
                whitted: exact,
            });
        }
        scene.materials.push(Material::default());
    }
}
