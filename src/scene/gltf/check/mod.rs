//! Faults of a document as the specification sees them, found in the JSON itself.
//!
//! A fault in what is drawn (buffers, accessors, meshes, nodes, scenes) that leaves its meaning open refuses the file;
//! any other is a warning.

mod animations;
mod geometry;
mod motion;
mod nodes;
mod surfaces;

use super::{short, standing, Warnings};
use crate::scene::Standing;
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// `Err` unless `asset.version` is 2.x and `minVersion` is 2.0 at most.
pub(super) fn version(root: &Value) -> Result<(), String> {
    let asset = root.get("asset").ok_or("it has no 'asset': not a glTF 2.0 document")?;
    let text = |name: &str| asset.get(name).and_then(Value::as_str);
    let version = text("version").ok_or("asset.version is missing: not a glTF 2.0 document")?;
    if version.split('.').next() != Some("2") || version.split('.').count() != 2 {
        return Err(format!("asset.version is '{version}': only glTF 2.0 is known"));
    }
    match text("minVersion") {
        Some(least) if least != "2.0" => Err(format!("asset.minVersion is '{least}': only glTF 2.0 is known")),
        _ => Ok(()),
    }
}

/// `Err` names the extensions that the file requires and we lack.
pub(super) fn required_extensions(root: &Value) -> Result<(), String> {
    let names = root.get("extensionsRequired").and_then(Value::as_array);
    let missing: Vec<&str> = names
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .filter(|name| standing(name) == Standing::Ignored)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let used: BTreeSet<&str> = list(root, "extensionsUsed").iter().filter_map(Value::as_str).collect();
    let undeclared = missing.iter().any(|name| !used.contains(name));
    let undeclared = if undeclared { "; nor does extensionsUsed name it" } else { "" };
    Err(format!("it requires {}, which glimt does not support{undeclared}", missing.join(" and ")))
}

/// Everything else. `Err` names the first fault that refuses the file.
pub(super) fn document(root: &Value, has_binary: bool, warnings: &mut Warnings) -> Result<(), String> {
    collections(root)?;
    references(root, warnings)?;
    empty_entities(root, warnings);
    extensions(root, warnings);
    geometry::buffers(root, has_binary, warnings);
    geometry::accessors(root, warnings);
    geometry::meshes(root, warnings)?;
    nodes::nodes(root, warnings)?;
    nodes::cameras_and_lights(root, warnings);
    animations::skins(root, warnings);
    animations::animations(root, warnings);
    motion::skeletons(root, warnings);
    motion::variants(root, warnings);
    surfaces::materials(root, warnings);
    surfaces::needs(root, warnings);
    surfaces::images(root, warnings);
    Ok(())
}

/// Calls `visit(path, value)` for every value that a pattern such as `nodes.*.children.*` selects; `*` is every element of an
/// array or member of an object.
fn select<'a>(root: &'a Value, pattern: &str, visit: &mut dyn FnMut(&str, &'a Value)) {
    fn walk<'a>(value: &'a Value, path: &str, rest: &[&str], visit: &mut dyn FnMut(&str, &'a Value)) {
        let Some((part, rest)) = rest.split_first() else { return visit(path, value) };
        match (*part, value) {
            ("*", Value::Array(items)) => {
                items.iter().enumerate().for_each(|(i, item)| walk(item, &format!("{path}[{i}]"), rest, visit));
            }
            ("*", Value::Object(items)) => {
                items.iter().for_each(|(key, item)| walk(item, &format!("{path}.{}", short(key)), rest, visit));
            }
            (name, _) => {
                let dot = if path.is_empty() { "" } else { "." };
                if let Some(item) = value.get(name) {
                    walk(item, &format!("{path}{dot}{name}"), rest, visit);
                }
            }
        }
    }
    walk(root, "", &pattern.split('.').collect::<Vec<_>>(), visit);
}

fn selected<'a>(root: &'a Value, pattern: &str) -> Vec<(String, &'a Value)> {
    let mut all = Vec::new();
    select(root, pattern, &mut |path, value| all.push((path.to_owned(), value)));
    all
}

pub(super) fn list<'a>(root: &'a Value, name: &str) -> &'a [Value] {
    root.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn number(value: &Value, name: &str) -> Option<f64> {
    value.get(name).and_then(Value::as_f64)
}

/// `Err` names a top-level collection that is no array, or an element of one that is no object.
fn collections(root: &Value) -> Result<(), String> {
    let names = [
        "accessors",
        "animations",
        "bufferViews",
        "buffers",
        "cameras",
        "extensionsRequired",
        "extensionsUsed",
        "images",
        "materials",
        "meshes",
        "nodes",
        "samplers",
        "scenes",
        "skins",
        "textures",
    ];
    let wrong = names.iter().find(|name| root.get(**name).is_some_and(|value| !value.is_array()));
    if let Some(name) = wrong {
        return Err(format!("{name} is not an array"));
    }
    let elements = names
        .iter()
        .filter(|name| !name.starts_with("extensions"))
        .flat_map(|name| list(root, name).iter().enumerate().map(move |(index, element)| (name, index, element)));
    let mut wrong = elements.filter(|(_, _, element)| !element.is_object());
    wrong.next().map_or(Ok(()), |(name, index, _)| Err(format!("{name}[{index}] is not an object")))
}

/// What refers to what: pattern, list that it indexes, and whether a dangling one refuses the file.
const REFERENCES: [(&str, &str, bool); 34] = [
    ("accessors.*.bufferView", "bufferViews", true),
    ("accessors.*.sparse.indices.bufferView", "bufferViews", true),
    ("accessors.*.sparse.values.bufferView", "bufferViews", true),
    ("bufferViews.*.buffer", "buffers", true),
    ("meshes.*.primitives.*.attributes.*", "accessors", true),
    ("meshes.*.primitives.*.indices", "accessors", true),
    ("meshes.*.primitives.*.material", "materials", true),
    ("meshes.*.primitives.*.targets.*.*", "accessors", true),
    ("nodes.*.camera", "cameras", true),
    ("nodes.*.children.*", "nodes", true),
    ("nodes.*.mesh", "meshes", true),
    ("nodes.*.skin", "skins", true),
    ("scene", "scenes", true),
    ("scenes.*.nodes.*", "nodes", true),
    ("skins.*.inverseBindMatrices", "accessors", true),
    ("skins.*.joints.*", "nodes", true),
    ("skins.*.skeleton", "nodes", true),
    ("animations.*.channels.*.target.node", "nodes", true),
    ("animations.*.samplers.*.input", "accessors", true),
    ("animations.*.samplers.*.output", "accessors", true),
    ("images.*.bufferView", "bufferViews", true),
    ("textures.*.sampler", "samplers", true),
    ("textures.*.source", "images", true),
    ("textures.*.extensions.EXT_texture_webp.source", "images", false),
    ("textures.*.extensions.KHR_texture_basisu.source", "images", false),
    ("materials.*.pbrMetallicRoughness.baseColorTexture.index", "textures", true),
    ("materials.*.pbrMetallicRoughness.metallicRoughnessTexture.index", "textures", true),
    ("materials.*.normalTexture.index", "textures", true),
    ("materials.*.occlusionTexture.index", "textures", true),
    ("materials.*.emissiveTexture.index", "textures", true),
    ("materials.*.extensions.*.*.index", "textures", false),
    ("nodes.*.extensions.EXT_mesh_gpu_instancing.attributes.*", "accessors", true),
    ("meshes.*.primitives.*.extensions.KHR_materials_variants.mappings.*.material", "materials", false),
    ("meshes.*.primitives.*.extensions.KHR_draco_mesh_compression.bufferView", "bufferViews", true),
];

fn references(root: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let mut refused = None;
    let mut dangling = |path: &str, value: &Value, target: &str, count: usize, refuses: bool| {
        if value.as_u64().is_none_or(|index| index >= count as u64) {
            let message = format!("{path} is {value}, but there are {count} {target}");
            if refuses {
                refused.get_or_insert(message);
            } else {
                warnings.add(message);
            }
        }
    };
    for (pattern, target, refuses) in REFERENCES {
        let count = list(root, target).len();
        select(root, pattern, &mut |path, value| dangling(path, value, target, count, refuses));
    }
    let mut lights = 0;
    select(root, "extensions.KHR_lights_punctual.lights.*", &mut |_, _| lights += 1);
    select(root, "nodes.*.extensions.KHR_lights_punctual.light", &mut |path, value| {
        dangling(path, value, "lights", lights, true)
    });
    let mut variants = 0;
    select(root, "extensions.KHR_materials_variants.variants.*", &mut |_, _| variants += 1);
    let pattern = "meshes.*.primitives.*.extensions.KHR_materials_variants.mappings.*.variants.*";
    select(root, pattern, &mut |path, value| dangling(path, value, "variants", variants, false));
    for (index, animation) in list(root, "animations").iter().enumerate() {
        let samplers = list(animation, "samplers").len();
        select(animation, "channels.*.sampler", &mut |path, value| {
            dangling(&format!("animations[{index}].{path}"), value, "samplers", samplers, true);
        });
    }
    refused.map_or(Ok(()), Err)
}

/// Arrays and objects that must not be empty.
fn empty_entities(root: &Value, warnings: &mut Warnings) {
    let top = root.as_object().into_iter().flatten().filter(|(_, value)| value.is_array()).map(|(key, _)| key.clone());
    let nested = [
        "meshes.*.primitives",
        "meshes.*.primitives.*.attributes",
        "meshes.*.primitives.*.targets",
        "meshes.*.weights",
        "nodes.*.children",
        "nodes.*.weights",
        "scenes.*.nodes",
        "skins.*.joints",
        "animations.*.channels",
        "animations.*.samplers",
        "extensions.*",
        "extensions.KHR_lights_punctual.lights",
        "extensions.KHR_materials_variants.variants",
        "nodes.*.extensions.KHR_lights_punctual",
        "meshes.*.primitives.*.extensions.KHR_materials_variants",
        "meshes.*.primitives.*.extensions.KHR_materials_variants.mappings",
        "meshes.*.primitives.*.extensions.KHR_materials_variants.mappings.*.variants",
    ];
    for pattern in top.chain(nested.map(str::to_owned)) {
        select(root, &pattern, &mut |path, value| {
            let empty = value.as_array().is_some_and(Vec::is_empty) || value.as_object().is_some_and(Map::is_empty);
            if empty {
                warnings.add(format!("{path} is empty"));
            }
        });
    }
}

/// Extensions used somewhere must be declared, those required must be used, and objects must be where they belong.
fn extensions(root: &Value, warnings: &mut Warnings) {
    let names = |key: &'static str| list(root, key).iter().filter_map(Value::as_str);
    let required: BTreeSet<&str> = names("extensionsRequired").collect();
    let mut used = BTreeSet::new();
    for name in names("extensionsUsed") {
        if !used.insert(name) {
            warnings.add(format!("extensionsUsed names {name} twice"));
        }
    }
    for name in required.difference(&used) {
        warnings.add(format!("extensionsRequired names {name}, extensionsUsed does not"));
    }
    if used.contains(&"KHR_mesh_quantization") && !required.contains(&"KHR_mesh_quantization") {
        warnings.add("KHR_mesh_quantization is used but not required");
    }
    // Where each extension's object may stand: the last list or object on the way to it.
    let places: [(&str, &[&str]); 8] = [
        ("EXT_texture_webp", &["textures"]),
        ("KHR_animation_pointer", &["target"]),
        ("KHR_lights_punctual", &["", "nodes"]),
        ("KHR_mesh_quantization", &[]),
        ("KHR_node_visibility", &["nodes"]),
        ("KHR_texture_basisu", &["textures"]),
        ("KHR_texture_transform", &["Texture"]),
        ("KHR_materials_variants", &["", "primitives"]),
    ];
    walk_extensions(root, "", &mut |path, name, value| {
        let path = if path.is_empty() { String::new() } else { format!("{path}.") };
        if !used.contains(&name) {
            warnings.add(format!("{path}extensions.{name}: extensionsUsed does not name it"));
        }
        if !value.is_object() {
            warnings.add(format!("{path}extensions.{name} is not an object"));
        }
        let allowed = match places.iter().find(|(own, _)| *own == name) {
            Some((_, allowed)) => *allowed,
            None if name.starts_with("KHR_materials_") => &["materials"],
            None => return,
        };
        let holder =
            path.trim_end_matches('.').trim_end_matches(|c: char| c == ']' || c.is_ascii_digit()).trim_end_matches('[');
        let fits = allowed.iter().any(|end| if end.is_empty() { path.is_empty() } else { holder.ends_with(end) });
        if !fits {
            warnings.add(format!("{path}extensions.{name} does not belong there"));
        }
    });
}

fn walk_extensions<'a>(value: &'a Value, path: &str, visit: &mut dyn FnMut(&str, &'a str, &'a Value)) {
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| walk_extensions(item, &format!("{path}[{i}]"), visit));
        }
        Value::Object(members) => {
            for (key, member) in members {
                if let ("extensions", Value::Object(extensions)) = (key.as_str(), member) {
                    extensions.iter().for_each(|(name, content)| visit(path, name, content));
                }
                if key != "extras" {
                    let dot = if path.is_empty() { "" } else { "." };
                    walk_extensions(member, &format!("{path}{dot}{}", short(key)), visit);
                }
            }
        }
        _ => {}
    }
}

/// Writes integral floats as the integers they are and gives scenes without nodes an empty list, so that the typed reading
/// does not stumble over what the specification allows.
pub(super) fn normalise(value: &mut Value) {
    fn integers(value: &mut Value) {
        match value {
            Value::Array(items) => items.iter_mut().for_each(integers),
            Value::Object(members) => members.iter_mut().for_each(|(_, member)| integers(member)),
            Value::Number(number) => {
                let whole =
                    number.as_f64().filter(|float| number.is_f64() && float.fract() == 0.0 && float.abs() < 9e15);
                if let Some(float) = whole {
                    *value = Value::from(float as i64);
                }
            }
            _ => {}
        }
    }
    integers(value);
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
}
