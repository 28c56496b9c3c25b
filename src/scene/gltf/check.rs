//! Faults of a document as the specification sees them, found in the JSON itself.
//!
//! A fault in what is drawn (buffers, accessors, meshes, nodes, scenes) that leaves its meaning open refuses the file;
//! any other is a warning.

use super::{Warnings, SUPPORTED_EXTENSIONS};
use serde_json::{Map, Value};

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
        .filter(|name| !SUPPORTED_EXTENSIONS.contains(name))
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(format!("it requires {}, which is not supported", missing.join(" and ")))
}

/// Everything else. `Err` names the first fault that refuses the file.
pub(super) fn document(root: &Value, has_binary: bool, warnings: &mut Warnings) -> Result<(), String> {
    references(root, warnings)?;
    empty_entities(root, warnings);
    extensions(root, warnings);
    buffers(root, has_binary, warnings);
    accessors(root, warnings);
    meshes(root, warnings)?;
    nodes(root, warnings)?;
    cameras_and_lights(root, warnings);
    skins_and_animations(root, warnings);
    materials(root, warnings);
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
                items.iter().for_each(|(key, item)| walk(item, &format!("{path}.{key}"), rest, visit));
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

fn list<'a>(root: &'a Value, name: &str) -> &'a [Value] {
    root.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn number(value: &Value, name: &str) -> Option<f64> {
    value.get(name).and_then(Value::as_f64)
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
    let names = |key: &str| -> Vec<&str> { list(root, key).iter().filter_map(Value::as_str).collect() };
    let (used, required) = (names("extensionsUsed"), names("extensionsRequired"));
    for name in &required {
        if !used.contains(name) {
            warnings.add(format!("extensionsRequired names {name}, extensionsUsed does not"));
        }
    }
    for (index, name) in used.iter().enumerate() {
        if used[..index].contains(name) {
            warnings.add(format!("extensionsUsed names {name} twice"));
        }
    }
    if used.contains(&"KHR_mesh_quantization") && !required.contains(&"KHR_mesh_quantization") {
        warnings.add("KHR_mesh_quantization is used but not required");
    }
    // Where each extension's object may stand: the last list or object on the way to it.
    let places: [(&str, &[&str]); 4] = [
        ("KHR_lights_punctual", &["", "nodes"]),
        ("KHR_node_visibility", &["nodes"]),
        ("KHR_texture_transform", &["Texture"]),
        ("KHR_materials_variants", &["", "primitives"]),
    ];
    walk_extensions(root, "", &mut |path, name, value| {
        if !used.contains(&name) {
            warnings.add(format!("{path}.extensions.{name}: extensionsUsed does not name it"));
        }
        let allowed = places.iter().find(|(own, _)| *own == name).map(|(_, allowed)| *allowed);
        let allowed = allowed.unwrap_or(if name.starts_with("KHR_materials_") { &["materials"] } else { return });
        let holder = path.trim_end_matches(|c: char| c == ']' || c.is_ascii_digit()).trim_end_matches('[');
        let fits = allowed.iter().any(|end| if end.is_empty() { path.is_empty() } else { holder.ends_with(end) });
        if !fits {
            warnings.add(format!("{path}.extensions.{name} does not belong there"));
        }
        if !value.is_object() {
            warnings.add(format!("{path}.extensions.{name} is not an object"));
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
                    walk_extensions(member, &format!("{path}{dot}{key}"), visit);
                }
            }
        }
        _ => {}
    }
}

fn buffers(root: &Value, has_binary: bool, warnings: &mut Warnings) {
    if has_binary && list(root, "buffers").first().is_none_or(|first| first.get("uri").is_some()) {
        warnings.add("GLB: the BIN chunk is not used");
    }
    for (index, buffer) in list(root, "buffers").iter().enumerate() {
        let uri = buffer.get("uri").and_then(Value::as_str).unwrap_or_default();
        let kind = uri.strip_prefix("data:").map(|rest| rest.split([';', ',']).next().unwrap_or_default());
        if kind.is_some_and(|kind| !["application/octet-stream", "application/gltf-buffer"].contains(&kind)) {
            warnings.add(format!(
                "buffers[{index}]: media type '{}' of the data URI is not one for buffers",
                kind.unwrap_or_default()
            ));
        }
    }
    for (index, view) in list(root, "bufferViews").iter().enumerate() {
        let stride = number(view, "byteStride");
        if stride.is_some_and(|stride| stride % 4.0 != 0.0 || !(4.0..=252.0).contains(&stride)) {
            warnings.add(format!("bufferViews[{index}].byteStride must be a multiple of 4 from 4 to 252"));
        }
        if stride > number(view, "byteLength") {
            warnings.add(format!("bufferViews[{index}].byteStride is greater than its byteLength"));
        }
        let buffer =
            view.get("buffer").and_then(Value::as_u64).and_then(|buffer| list(root, "buffers").get(buffer as usize));
        let end = number(view, "byteOffset").unwrap_or(0.0) + number(view, "byteLength").unwrap_or(0.0);
        if buffer.and_then(|buffer| number(buffer, "byteLength")).is_some_and(|length| end > length) {
            warnings.add(format!("bufferViews[{index}] does not fit into its buffer"));
        }
        if stride.is_some() && view.get("target").and_then(Value::as_u64) == Some(34963) {
            warnings.add(format!("bufferViews[{index}]: byteStride on indices"));
        }
    }
}

/// Bytes of a component; components of an element.
fn sizes(accessor: &Value) -> Option<(u64, u64)> {
    let component = match accessor.get("componentType")?.as_u64()? {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    let components = match accessor.get("type")?.as_str()? {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    };
    Some((component, components))
}

fn accessors(root: &Value, warnings: &mut Warnings) {
    for (index, accessor) in list(root, "accessors").iter().enumerate() {
        let mut warn = |message: &str| warnings.add(format!("accessors[{index}]: {message}"));
        let Some((component, components)) = sizes(accessor) else { continue };
        let kind = accessor.get("componentType").and_then(Value::as_u64);
        if accessor.get("normalized").and_then(Value::as_bool) == Some(true) && matches!(kind, Some(5125 | 5126)) {
            warn("normalized is for 8 and 16 bit components only");
        }
        if accessor.get("byteOffset").is_some() && accessor.get("bufferView").is_none() {
            warn("byteOffset without bufferView");
        }
        let offset = number(accessor, "byteOffset").unwrap_or(0.0);
        let view = accessor
            .get("bufferView")
            .and_then(Value::as_u64)
            .and_then(|view| list(root, "bufferViews").get(view as usize));
        let view_offset = view.and_then(|view| number(view, "byteOffset")).unwrap_or(0.0);
        if offset % component as f64 != 0.0 || (offset + view_offset) % component as f64 != 0.0 {
            warn("its offset is no multiple of its component's size");
        }
        let count = number(accessor, "count").unwrap_or(0.0);
        let element = (component * components) as f64;
        if let Some(view) = view {
            let stride = number(view, "byteStride").unwrap_or(element);
            if stride < element {
                warn("the byteStride of its bufferView is less than an element");
            }
            if offset + (count - 1.0) * stride + element > number(view, "byteLength").unwrap_or(f64::INFINITY) {
                warn("it does not fit into its bufferView");
            }
        }
        let shape = accessor.get("type").and_then(Value::as_str);
        if matches!((shape, component), (Some("MAT2"), 1) | (Some("MAT3"), 1 | 2)) {
            warn("a matrix whose columns are not aligned to 4 bytes");
        }
        for name in ["min", "max"] {
            let bound = accessor.get(name).and_then(Value::as_array);
            if bound.is_some_and(|bound| bound.len() as u64 != components) {
                warn(&format!("{name} has the wrong number of components"));
            }
        }
        if let Some(sparse) = accessor.get("sparse") {
            if number(sparse, "count") > Some(count) {
                warn("sparse.count is greater than count");
            }
        }
    }
}

fn meshes(root: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let accessors = list(root, "accessors");
    let accessor = |value: &Value| value.as_u64().and_then(|index| accessors.get(index as usize));
    for (path, primitive) in selected(root, "meshes.*.primitives.*") {
        let Some(attributes) = primitive.get("attributes").and_then(Value::as_object) else {
            return Err(format!("{path} has no attributes"));
        };
        let count_of = |value: &Value| accessor(value).and_then(|accessor| number(accessor, "count"));
        let count = attributes.get("POSITION").and_then(count_of);
        for (name, value) in attributes {
            let plain = name.trim_end_matches(|c: char| c.is_ascii_digit());
            let known =
                ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"].contains(&plain);
            let numbered = name.len() > plain.len();
            if !name.starts_with('_') && (!known || numbered != plain.ends_with('_')) {
                warnings.add(format!("{path}.attributes.{name} is no attribute that glTF knows"));
            }
            if count_of(value) != count && count.is_some() {
                warnings.add(format!("{path}.attributes.{name} has another count than POSITION"));
            }
            let series = |n: usize| attributes.contains_key(&format!("{plain}{n}"));
            if plain.ends_with('_') && name[plain.len()..].parse::<usize>().is_ok_and(|n| n > 0 && !series(n - 1)) {
                warnings.add(format!("{path}.attributes.{name}: the numbers before it are missing"));
            }
            attribute_format(root, &path, name, accessor(value), warnings);
        }
        for n in 0..2 {
            if attributes.contains_key(&format!("JOINTS_{n}")) != attributes.contains_key(&format!("WEIGHTS_{n}")) {
                warnings.add(format!("{path}.attributes: JOINTS_{n} and WEIGHTS_{n} belong together"));
            }
        }
        if let Some(position) = attributes.get("POSITION").and_then(accessor) {
            if position.get("min").is_none() || position.get("max").is_none() {
                warnings.add(format!("{path}.attributes.POSITION: its accessor has no min and max"));
            }
        }
        if let Some(indices) = primitive.get("indices").and_then(accessor) {
            let kind = indices.get("componentType").and_then(Value::as_u64);
            if indices.get("type").and_then(Value::as_str) != Some("SCALAR")
                || !matches!(kind, Some(5121 | 5123 | 5125))
            {
                return Err(format!("{path}.indices are not unsigned integer scalars"));
            }
            let view = indices
                .get("bufferView")
                .and_then(Value::as_u64)
                .and_then(|view| list(root, "bufferViews").get(view as usize));
            if view.is_some_and(|view| view.get("byteStride").is_some()) {
                warnings.add(format!("{path}.indices: their bufferView has a byteStride"));
            }
            if view.and_then(|view| view.get("target")?.as_u64()) == Some(34962) {
                warnings.add(format!("{path}.indices: their bufferView is meant for vertices"));
            }
        }
        morph_targets(&path, primitive, attributes, &accessor, warnings);
    }
    mesh_weights(root, warnings);
    Ok(())
}

/// Types that an attribute may have (glTF 2.0, 3.7.2.1; KHR_mesh_quantization widens them).
fn attribute_format(root: &Value, path: &str, name: &str, accessor: Option<&Value>, warnings: &mut Warnings) {
    let Some(accessor) = accessor else { return };
    let quantized = list(root, "extensionsUsed").iter().any(|used| used == "KHR_mesh_quantization");
    let kind = accessor.get("componentType").and_then(Value::as_u64).unwrap_or(0);
    let shape = accessor.get("type").and_then(Value::as_str).unwrap_or_default();
    let plain = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let shapes: &[&str] = match plain {
        "POSITION" | "NORMAL" => &["VEC3"],
        "TANGENT" | "JOINTS_" | "WEIGHTS_" => &["VEC4"],
        "TEXCOORD_" => &["VEC2"],
        "COLOR_" => &["VEC3", "VEC4"],
        _ => return,
    };
    let kinds: &[u64] = match plain {
        "JOINTS_" => &[5121, 5123],
        "TEXCOORD_" | "COLOR_" | "WEIGHTS_" if !quantized => &[5121, 5123, 5126],
        _ if quantized => &[5120, 5121, 5122, 5123, 5126],
        _ => &[5126],
    };
    if !shapes.contains(&shape) || !kinds.contains(&kind) {
        warnings.add(format!("{path}.attributes.{name}: {shape} of component type {kind} is not allowed"));
    }
    if kind == 5125 {
        warnings.add(format!("{path}.attributes.{name}: 32 bit integers are for indices only"));
    }
    let view_index = accessor.get("bufferView").and_then(Value::as_u64);
    let view = view_index.and_then(|view| list(root, "bufferViews").get(view as usize));
    if view.and_then(|view| view.get("target")?.as_u64()) == Some(34963) {
        warnings.add(format!("{path}.attributes.{name}: its bufferView is meant for indices"));
    }
    let Some((component, components)) = sizes(accessor) else { return };
    let stride = view.and_then(|view| number(view, "byteStride"));
    if stride.unwrap_or((component * components) as f64) % 4.0 != 0.0
        || number(accessor, "byteOffset").unwrap_or(0.0) % 4.0 != 0.0
    {
        warnings.add(format!("{path}.attributes.{name}: vertices are not aligned to 4 bytes"));
    }
    let shared =
        list(root, "accessors").iter().filter(|other| other.get("bufferView").and_then(Value::as_u64) == view_index);
    if stride.is_none() && view_index.is_some() && shared.count() > 1 {
        warnings
            .add(format!("{path}.attributes.{name}: its bufferView serves several accessors and has no byteStride"));
    }
}

fn morph_targets<'a>(
    path: &str,
    primitive: &Value,
    attributes: &Map<String, Value>,
    accessor: &dyn Fn(&Value) -> Option<&'a Value>,
    warnings: &mut Warnings,
) {
    for (index, target) in list(primitive, "targets").iter().enumerate() {
        for (name, value) in target.as_object().into_iter().flatten() {
            let count = |value: &Value| accessor(value).and_then(|accessor| number(accessor, "count"));
            match attributes.get(name) {
                None => warnings.add(format!("{path}.targets[{index}].{name}: there is no such attribute to morph")),
                Some(base) if count(base) != count(value) => {
                    warnings.add(format!("{path}.targets[{index}].{name} has another count than the attribute"));
                }
                Some(_) => {}
            }
            let bounded = accessor(value).is_some_and(|own| own.get("min").is_some() && own.get("max").is_some());
            if name == "POSITION" && !bounded {
                warnings.add(format!("{path}.targets[{index}].POSITION: its accessor has no min and max"));
            }
        }
    }
}

fn mesh_weights(root: &Value, warnings: &mut Warnings) {
    for (index, mesh) in list(root, "meshes").iter().enumerate() {
        let targets: Vec<usize> =
            list(mesh, "primitives").iter().map(|primitive| list(primitive, "targets").len()).collect();
        if targets.windows(2).any(|pair| pair[0] != pair[1]) {
            warnings.add(format!("meshes[{index}]: its primitives differ in the number of morph targets"));
        }
        if mesh.get("weights").is_some() && targets.first() != Some(&list(mesh, "weights").len()) {
            warnings.add(format!("meshes[{index}].weights are not as many as its morph targets"));
        }
    }
}

fn nodes(root: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let nodes = list(root, "nodes");
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let mut warn = |message: &str| warnings.add(format!("nodes[{index}]: {message}"));
        let has = |name: &str| node.get(name).is_some();
        if has("matrix") && (has("translation") || has("rotation") || has("scale")) {
            warn("it has a matrix and also translation, rotation or scale; the matrix is used");
        }
        if (has("skin") || has("weights")) && !has("mesh") {
            warn("it has a skin or weights but no mesh");
        }
        let mesh = node.get("mesh").and_then(Value::as_u64).and_then(|mesh| list(root, "meshes").get(mesh as usize));
        let first = mesh.and_then(|mesh| list(mesh, "primitives").first());
        if has("skin") && first.is_none_or(|primitive| primitive.pointer("/attributes/JOINTS_0").is_none()) {
            warn("it has a skin, but its mesh has no joints");
        }
        let targets = first.map_or(0, |primitive| list(primitive, "targets").len());
        if has("weights") && list(node, "weights").len() != targets {
            warn("its weights are not as many as its mesh's morph targets");
        }
        let rotation: Vec<f64> = list(node, "rotation").iter().filter_map(Value::as_f64).collect();
        let length = rotation.iter().map(|value| value * value).sum::<f64>().sqrt();
        if !rotation.is_empty() && (length - 1.0).abs() > 5e-4 {
            warn("its rotation is not a unit quaternion; it was normalised");
        }
        let matrix: Vec<f64> = list(node, "matrix").iter().filter_map(Value::as_f64).collect();
        if matrix.len() == 16 && !is_decomposable(&matrix) {
            warn("its matrix is no product of translation, rotation and scale");
        }
        for child in list(node, "children").iter().filter_map(Value::as_u64) {
            if let Some(other) = parents[child as usize].replace(index) {
                return Err(format!("nodes[{child}] is a child of nodes[{other}] and of nodes[{index}]"));
            }
        }
    }
    for start in 0..nodes.len() {
        let mut above = parents[start];
        for _ in 0..nodes.len() {
            let Some(node) = above else { break };
            if node == start {
                return Err(format!("nodes[{start}] is its own ancestor"));
            }
            above = parents[node];
        }
        // A chain as long as there are nodes costs a square; beyond this only the walk itself looks.
        if start > 4096 {
            break;
        }
    }
    select(root, "scenes.*.nodes.*", &mut |path, value| {
        if value.as_u64().is_some_and(|node| parents[node as usize].is_some()) {
            warnings.add(format!("{path} is no root: it is a child of another node"));
        }
    });
    Ok(())
}

/// The columns are orthogonal, none is zero, and the last row is that of an affine matrix.
fn is_decomposable(matrix: &[f64]) -> bool {
    let column = |index: usize| glam::DVec3::from_slice(&matrix[4 * index..]);
    let [x, y, z] = [column(0), column(1), column(2)];
    let skew = |a: glam::DVec3, b: glam::DVec3| a.dot(b).abs() > 1e-3 * a.length() * b.length();
    let affine = matrix[3] == 0.0 && matrix[7] == 0.0 && matrix[11] == 0.0 && matrix[15] == 1.0;
    affine && [x, y, z].iter().all(|axis| axis.length() > 0.0) && !skew(x, y) && !skew(y, z) && !skew(z, x)
}

fn cameras_and_lights(root: &Value, warnings: &mut Warnings) {
    for (path, camera) in selected(root, "cameras.*") {
        let kind = camera.get("type").and_then(Value::as_str).unwrap_or_default();
        if camera.get(kind).is_none() || (camera.get("perspective").is_some() && camera.get("orthographic").is_some()) {
            warnings.add(format!("{path} must have exactly what its type '{kind}' says"));
        }
        for (kind, properties) in camera.as_object().into_iter().flatten() {
            let value = |name: &str| number(properties, name);
            if value("zfar").is_some_and(|far| value("znear").is_some_and(|near| far <= near)) {
                warnings.add(format!("{path}.{kind}: zfar is not beyond znear"));
            }
            if value("xmag") == Some(0.0) || value("ymag") == Some(0.0) {
                warnings.add(format!("{path}.{kind}: xmag and ymag must not be 0"));
            }
            if ["yfov", "aspectRatio", "znear", "zfar"].iter().any(|name| value(name).is_some_and(|value| value < 0.0))
            {
                warnings.add(format!("{path}.{kind}: a value is out of range"));
            }
        }
    }
    for (path, light) in selected(root, "extensions.KHR_lights_punctual.lights.*") {
        let angle = |name, default| light.get("spot").map_or(default, |spot| number(spot, name).unwrap_or(default));
        if angle("innerConeAngle", 0.0) >= angle("outerConeAngle", std::f64::consts::FRAC_PI_4) {
            warnings.add(format!("{path}.spot: the inner cone angle must be less than the outer one"));
        }
    }
}

fn skins_and_animations(root: &Value, warnings: &mut Warnings) {
    let accessors = list(root, "accessors");
    let accessor =
        |value: Option<&Value>| value.and_then(Value::as_u64).and_then(|index| accessors.get(index as usize));
    let is = |accessor: &Value, shape: &str, kind: u64| {
        accessor.get("type").and_then(Value::as_str) == Some(shape)
            && accessor.get("componentType").and_then(Value::as_u64) == Some(kind)
    };
    for (path, skin) in selected(root, "skins.*") {
        if let Some(matrices) = accessor(skin.get("inverseBindMatrices")) {
            if !is(matrices, "MAT4", 5126) || number(matrices, "count") < Some(list(skin, "joints").len() as f64) {
                warnings.add(format!("{path}.inverseBindMatrices are not one MAT4 of floats a joint"));
            }
        }
    }
    for (path, animation) in selected(root, "animations.*") {
        for (index, sampler) in list(animation, "samplers").iter().enumerate() {
            if let Some(input) = accessor(sampler.get("input")) {
                if !is(input, "SCALAR", 5126) || input.get("min").is_none() || input.get("max").is_none() {
                    warnings.add(format!("{path}.samplers[{index}].input must be float scalars with min and max"));
                }
            }
        }
        let mut targets: Vec<&Value> = Vec::new();
        for (index, channel) in list(animation, "channels").iter().enumerate() {
            let Some(target) = channel.get("target") else { continue };
            if targets.contains(&target) {
                warnings.add(format!("{path}.channels[{index}]: its target has another channel already"));
            }
            targets.push(target);
            let node =
                target.get("node").and_then(Value::as_u64).and_then(|node| list(root, "nodes").get(node as usize));
            if node.is_some_and(|node| node.get("matrix").is_some()) {
                warnings.add(format!("{path}.channels[{index}]: its node has a matrix, which cannot be animated"));
            }
        }
    }
}

/// Factors outside 0 to 1 and textures whose coordinates no mesh has.
fn materials(root: &Value, warnings: &mut Warnings) {
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
