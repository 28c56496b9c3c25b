//! Buffers, accessors, meshes.

use super::{list, number, selected, Warnings};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};

pub(super) fn buffers(root: &Value, has_binary: bool, warnings: &mut Warnings) {
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
        if number(view, "byteLength") == Some(0.0) {
            warnings.add(format!("bufferViews[{index}].byteLength is 0"));
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

pub(super) fn accessors(root: &Value, warnings: &mut Warnings) {
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

pub(super) fn meshes(root: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let accessors = list(root, "accessors");
    let accessor = |value: &Value| value.as_u64().and_then(|index| accessors.get(index as usize));
    // How many accessors each buffer view serves.
    let mut users: BTreeMap<u64, usize> = BTreeMap::new();
    for view in accessors.iter().filter_map(|accessor| accessor.get("bufferView")?.as_u64()) {
        *users.entry(view).or_default() += 1;
    }
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
            attribute_format(root, &users, &path, name, accessor(value), warnings);
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
        for (index, target) in list(primitive, "targets").iter().enumerate() {
            for (name, value) in target.as_object().into_iter().flatten() {
                if is_for_indices(root, accessor(value)) {
                    warnings.add(format!("{path}.targets[{index}].{name}: its bufferView is meant for indices"));
                }
            }
        }
    }
    mixed_views(root, warnings);
    mesh_weights(root, warnings);
    Ok(())
}

/// Types that an attribute may have (glTF 2.0, 3.7.2.1; KHR_mesh_quantization widens them).
fn attribute_format(
    root: &Value,
    users: &BTreeMap<u64, usize>,
    path: &str,
    name: &str,
    accessor: Option<&Value>,
    warnings: &mut Warnings,
) {
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
        _ => {
            if kind == 5125 {
                warnings.add(format!("{path}.attributes.{name}: 32 bit integers are for indices only"));
            }
            return;
        }
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
    let view_index = accessor.get("bufferView").and_then(Value::as_u64);
    let view = view_index.and_then(|view| list(root, "bufferViews").get(view as usize));
    if is_for_indices(root, Some(accessor)) {
        warnings.add(format!("{path}.attributes.{name}: its bufferView is meant for indices"));
    }
    let Some((component, components)) = sizes(accessor) else { return };
    let stride = view.and_then(|view| number(view, "byteStride"));
    let offset = number(accessor, "byteOffset").unwrap_or(0.0);
    if view.is_some() && (stride.unwrap_or((component * components) as f64) % 4.0 != 0.0 || offset % 4.0 != 0.0) {
        warnings.add(format!("{path}.attributes.{name}: vertices are not aligned to 4 bytes"));
    }
    if stride.is_none() && view_index.is_some_and(|view| users.get(&view) > Some(&1)) {
        warnings
            .add(format!("{path}.attributes.{name}: its bufferView serves several accessors and has no byteStride"));
    }
}

/// The buffer view of an accessor is declared to hold indices.
fn is_for_indices(root: &Value, accessor: Option<&Value>) -> bool {
    let view = accessor.and_then(|accessor| accessor.get("bufferView")?.as_u64());
    let view = view.and_then(|view| list(root, "bufferViews").get(view as usize));
    view.and_then(|view| view.get("target")?.as_u64()) == Some(34963)
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
            if !["POSITION", "NORMAL", "TANGENT"].contains(&name.as_str()) {
                warnings.add(format!("ignored: morph targets of {name}"));
            }
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

/// A buffer view holds indices or vertices.
fn mixed_views(root: &Value, warnings: &mut Warnings) {
    let accessors = list(root, "accessors");
    let views = |pattern: &str| -> BTreeSet<u64> {
        let all = selected(root, pattern).into_iter();
        all.filter_map(|(_, value)| accessors.get(value.as_u64()? as usize)?.get("bufferView")?.as_u64()).collect()
    };
    let (indices, vertices) = (views("meshes.*.primitives.*.indices"), views("meshes.*.primitives.*.attributes.*"));
    for view in indices.intersection(&vertices) {
        warnings.add(format!("bufferViews[{view}] holds both indices and vertices"));
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
