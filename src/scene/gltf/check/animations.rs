//! Animations, and the matrices of skins.

use super::{list, number, selected, Warnings};
use serde_json::Value;
use std::collections::BTreeSet;

/// The accessor that a value names.
fn accessor<'a>(root: &'a Value, value: Option<&Value>) -> Option<&'a Value> {
    list(root, "accessors").get(value?.as_u64()? as usize)
}

fn is(accessor: &Value, shape: &str, kinds: &[u64]) -> bool {
    accessor.get("type").and_then(Value::as_str) == Some(shape)
        && accessor.get("componentType").and_then(Value::as_u64).is_some_and(|kind| kinds.contains(&kind))
}

/// The buffer view of an accessor has a distance between its elements.
fn has_stride(root: &Value, accessor: &Value) -> bool {
    let view = accessor.get("bufferView").and_then(Value::as_u64);
    view.and_then(|view| list(root, "bufferViews").get(view as usize))
        .is_some_and(|view| view.get("byteStride").is_some())
}

pub(super) fn skins(root: &Value, warnings: &mut Warnings) {
    for (path, skin) in selected(root, "skins.*") {
        if skin.get("joints").is_none() {
            warnings.add(format!("{path} has no joints"));
        }
        if let Some(matrices) = accessor(root, skin.get("inverseBindMatrices")) {
            if !is(matrices, "MAT4", &[5126]) || number(matrices, "count") < Some(list(skin, "joints").len() as f64) {
                warnings.add(format!("{path}.inverseBindMatrices are not one MAT4 of floats a joint"));
            }
            if has_stride(root, matrices) {
                warnings.add(format!("{path}.inverseBindMatrices: their bufferView has a byteStride"));
            }
        }
    }
}

pub(super) fn animations(root: &Value, warnings: &mut Warnings) {
    for (path, animation) in selected(root, "animations.*") {
        for name in ["channels", "samplers"] {
            if animation.get(name).is_none() {
                warnings.add(format!("{path} has no {name}"));
            }
        }
        let paths = paths(animation);
        for (index, sampler) in list(animation, "samplers").iter().enumerate() {
            one_sampler(root, &format!("{path}.samplers[{index}]"), sampler, &paths[index], warnings);
        }
        channels(root, &path, animation, warnings);
    }
}

/// The paths that each sampler moves.
fn paths(animation: &Value) -> Vec<BTreeSet<&str>> {
    let mut paths = vec![BTreeSet::new(); list(animation, "samplers").len()];
    for channel in list(animation, "channels") {
        let sampler = channel.get("sampler").and_then(Value::as_u64).and_then(|index| paths.get_mut(index as usize));
        if let Some(sampler) = sampler {
            sampler.insert(channel.pointer("/target/path").and_then(Value::as_str).unwrap_or_default());
        }
    }
    paths
}

/// Types of values that a path may have: floats, or normalised integers for rotations and weights.
fn formats(path: &str) -> Option<(&'static str, &'static [u64])> {
    match path {
        "translation" | "scale" => Some(("VEC3", &[5126])),
        "rotation" => Some(("VEC4", &[5120, 5121, 5122, 5123, 5126])),
        "weights" => Some(("SCALAR", &[5120, 5121, 5122, 5123, 5126])),
        _ => None,
    }
}

fn one_sampler(root: &Value, place: &str, sampler: &Value, paths: &BTreeSet<&str>, warnings: &mut Warnings) {
    let cubic = sampler.get("interpolation").and_then(Value::as_str) == Some("CUBICSPLINE");
    let (input, output) = (accessor(root, sampler.get("input")), accessor(root, sampler.get("output")));
    let count = |accessor: Option<&Value>| accessor.and_then(|accessor| number(accessor, "count"));
    if let (Some(times), Some(values)) = (count(input), count(output)) {
        let key_values = times * if cubic { 3.0 } else { 1.0 };
        // Morph targets have several values a time.
        let weights = paths.iter().any(|path| !["translation", "rotation", "scale"].contains(path));
        let fits = if weights { values % key_values == 0.0 } else { values == key_values };
        if !fits {
            warnings.add(format!("{place}: {times} times do not fit {values} values"));
        }
        if cubic && times < 2.0 {
            warnings.add(format!("{place}: a cubic spline needs two times at least"));
        }
    }
    if let Some(input) = input {
        if !is(input, "SCALAR", &[5126]) || input.get("min").is_none() || input.get("max").is_none() {
            warnings.add(format!("{place}.input must be float scalars with min and max"));
        }
    }
    if let Some(output) = output {
        let wrong = paths.iter().find(|path| formats(path).is_some_and(|(shape, kinds)| !is(output, shape, kinds)));
        if let Some(path) = wrong {
            warnings.add(format!("{place}.output has a type that {path} must not have"));
        }
    }
    if [input, output].into_iter().flatten().any(|accessor| has_stride(root, accessor)) {
        warnings.add(format!("{place}: the bufferView of its input or output has a byteStride"));
    }
}

fn channels(root: &Value, path: &str, animation: &Value, warnings: &mut Warnings) {
    let mut targets = BTreeSet::new();
    for (index, channel) in list(animation, "channels").iter().enumerate() {
        let mut warn = |message: &str| warnings.add(format!("{path}.channels[{index}]{message}"));
        if channel.get("sampler").is_none() {
            warn(" has no sampler");
        }
        let Some(target) = channel.get("target") else {
            warn(" has no target");
            continue;
        };
        if !targets.insert(target.to_string()) {
            warn(": its target has another channel already");
        }
        let node = target.get("node").and_then(Value::as_u64);
        let node = node.and_then(|node| list(root, "nodes").get(node as usize));
        if node.is_some_and(|node| node.get("matrix").is_some()) {
            warn(": its node has a matrix, which cannot be animated");
        }
        let moved = target.get("path").and_then(Value::as_str).unwrap_or_default();
        let mesh = node.and_then(|node| list(root, "meshes").get(node.get("mesh")?.as_u64()? as usize));
        let morphs =
            mesh.and_then(|mesh| list(mesh, "primitives").first()).is_some_and(|own| own.get("targets").is_some());
        if moved == "weights" && node.is_some() && !morphs {
            warn(": its node has no morph targets");
        }
        pointer(target, moved, &mut warn);
    }
}

/// KHR_animation_pointer, which is not played: what a channel with it must be.
fn pointer(target: &Value, path: &str, warn: &mut dyn FnMut(&str)) {
    let Some(extension) = target.pointer("/extensions/KHR_animation_pointer") else { return };
    if path != "pointer" {
        warn(": it has a pointer, but its path is another");
    }
    if target.get("node").is_some() {
        warn(": it has a pointer and a node");
    }
    if extension.get("pointer").and_then(Value::as_str).is_none_or(|pointer| !pointer.starts_with('/')) {
        warn(": its pointer does not begin with '/'");
    }
}
