//! Materials, what they need of primitives, and pictures as far as the JSON tells.

use super::{list, selected, Warnings};
use serde_json::Value;
use std::collections::BTreeSet;

/// Factors of extensions that are out of range.
pub(super) fn materials(root: &Value, warnings: &mut Warnings) {
    for (path, material) in selected(root, "materials.*") {
        let Some(extensions) = material.get("extensions").and_then(Value::as_object) else { continue };
        for (name, content) in extensions {
            for (key, value) in content.as_object().into_iter().flatten() {
                let factor = key.ends_with("Factor") || key.ends_with("Strength") || key == "dispersion";
                let largest = if key.ends_with("emissiveStrength") || key == "dispersion" || key == "thicknessFactor" {
                    f64::INFINITY
                } else {
                    1.0
                };
                let bad = value.as_f64().is_some_and(|value| {
                    (factor && !(0.0..=largest).contains(&value))
                        || (key == "ior" && value != 0.0 && value < 1.0)
                        || (key == "attenuationDistance" && value <= 0.0)
                });
                if bad {
                    warnings.add(format!("{path}.extensions.{name}.{key} is out of range"));
                }
            }
        }
    }
}

/// What can be seen of images without their bytes.
pub(super) fn images(root: &Value, warnings: &mut Warnings) {
    let webp = list(root, "extensionsUsed").iter().any(|used| used == "EXT_texture_webp");
    for (path, image) in selected(root, "images.*") {
        let uri = image.get("uri");
        if uri.is_some() == image.get("bufferView").is_some() {
            warnings.add(format!("{path} must have either a uri or a bufferView"));
        }
        let text = uri.and_then(Value::as_str);
        let view = image.get("bufferView").and_then(Value::as_u64);
        let view = view.and_then(|view| list(root, "bufferViews").get(view as usize));
        if view.is_some_and(|view| view.get("byteStride").is_some()) {
            warnings.add(format!("{path}: its bufferView has a byteStride"));
        }
        if image.get("bufferView").is_some() && image.get("mimeType").is_none() {
            warnings.add(format!("{path} has a bufferView, but no mimeType"));
        }
        if uri.is_some() && text.is_none() {
            warnings.add(format!("{path}.uri is not a string"));
        }
        let Some(text) = text else { continue };
        match text.strip_prefix("data:") {
            Some(rest) if !rest.starts_with("image/") || !rest.contains(',') || rest.contains(";;") => {
                warnings.add(format!("{path}.uri is no data URI of an image"));
            }
            Some(rest) if rest.starts_with("image/webp") && !webp => {
                warnings.add(format!("{path} is WebP, but extensionsUsed does not name EXT_texture_webp"));
            }
            None if text.split('/').next().is_some_and(|first| first.contains(':')) => {
                warnings.add(format!("{path}.uri '{text}' is not relative"));
            }
            _ => {}
        }
    }
}

/// Textures that materials have, with the names of the extensions that some belong to.
fn textures(material: &Value) -> Vec<(String, &Value)> {
    let places = ["*", "pbrMetallicRoughness.*", "extensions.*.*"];
    let all = places.iter().flat_map(|place| selected(material, place));
    all.filter(|(path, info)| path.ends_with("Texture") && info.get("index").is_some()).collect()
}

/// Texture coordinates and tangents that the materials of primitives need.
pub(super) fn needs(root: &Value, warnings: &mut Warnings) {
    let needs = |material: &Value| {
        let textures = textures(material);
        let sets: BTreeSet<u64> = textures.iter().map(|(_, info)| set(info)).collect();
        // Others make tangents from a normal map's coordinates.
        let bends = ["clearcoatNormalTexture", "anisotropyTexture"];
        let bent = textures.iter().any(|(path, _)| bends.iter().any(|name| path.ends_with(name)));
        (sets, bent && material.get("normalTexture").is_none())
    };
    let all: Vec<(BTreeSet<u64>, bool)> = list(root, "materials").iter().map(needs).collect();
    for (path, primitive) in selected(root, "meshes.*.primitives.*") {
        let material = primitive.get("material").and_then(Value::as_u64).and_then(|index| all.get(index as usize));
        let Some((sets, tangents)) = material else { continue };
        let has = |name: &str| primitive.get("attributes").is_some_and(|attributes| attributes.get(name).is_some());
        if let Some(missing) = sets.iter().find(|set| !has(&format!("TEXCOORD_{set}"))) {
            warnings.add(format!("{path}: its material needs TEXCOORD_{missing}, which it does not have"));
        }
        if *tangents && !has("TANGENT") {
            warnings.add(format!("{path}: its material needs TANGENT, which it does not have"));
        }
    }
}

/// The texture coordinates that place a texture.
fn set(info: &Value) -> u64 {
    let moved = info.pointer("/extensions/KHR_texture_transform/texCoord");
    moved.or(info.get("texCoord")).and_then(Value::as_u64).unwrap_or(0)
}
