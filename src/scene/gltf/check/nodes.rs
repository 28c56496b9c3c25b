//! Nodes and what hangs on them: cameras, lights, skins, animations; and materials.

use super::{list, number, select, selected, Warnings};
use serde_json::Value;

pub(super) fn nodes(root: &Value, warnings: &mut Warnings) -> Result<(), String> {
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
    // Up from every node, each node once: one that is met again on the same way up is its own ancestor.
    let mut seen_from = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut node = start;
        while seen_from[node] == usize::MAX {
            seen_from[node] = start;
            let Some(parent) = parents[node] else { break };
            if seen_from[parent] == start {
                return Err(format!("nodes[{parent}] is its own ancestor"));
            }
            node = parent;
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

pub(super) fn cameras_and_lights(root: &Value, warnings: &mut Warnings) {
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
        if light.get("type").and_then(Value::as_str) == Some("spot") && light.get("spot").is_none() {
            warnings.add(format!("{path} is a spot light without a spot; default angles are used"));
        }
        let angle = |name, default| light.get("spot").map_or(default, |spot| number(spot, name).unwrap_or(default));
        if angle("innerConeAngle", 0.0) >= angle("outerConeAngle", std::f64::consts::FRAC_PI_4) {
            warnings.add(format!("{path}.spot: the inner cone angle must be less than the outer one"));
        }
    }
}

pub(super) fn skins_and_animations(root: &Value, warnings: &mut Warnings) {
    let accessors = list(root, "accessors");
    let accessor =
        |value: Option<&Value>| value.and_then(Value::as_u64).and_then(|index| accessors.get(index as usize));
    let is = |accessor: &Value, shape: &str, kind: u64| {
        accessor.get("type").and_then(Value::as_str) == Some(shape)
            && accessor.get("componentType").and_then(Value::as_u64) == Some(kind)
    };
    for (path, skin) in selected(root, "skins.*") {
        if skin.get("joints").is_none() {
            warnings.add(format!("{path} has no joints"));
        }
        if let Some(matrices) = accessor(skin.get("inverseBindMatrices")) {
            if !is(matrices, "MAT4", 5126) || number(matrices, "count") < Some(list(skin, "joints").len() as f64) {
                warnings.add(format!("{path}.inverseBindMatrices are not one MAT4 of floats a joint"));
            }
        }
    }
    for (path, animation) in selected(root, "animations.*") {
        for (index, sampler) in list(animation, "samplers").iter().enumerate() {
            let count = |name: &str| accessor(sampler.get(name)).and_then(|accessor| number(accessor, "count"));
            let cubic = sampler.get("interpolation").and_then(Value::as_str) == Some("CUBICSPLINE");
            let key_values = if cubic { 3.0 } else { 1.0 };
            if let (Some(input), Some(output)) = (count("input"), count("output")) {
                let weights = targets_weights(animation, index);
                let fits = if weights { output % (input * key_values) == 0.0 } else { output == input * key_values };
                if !fits {
                    warnings.add(format!("{path}.samplers[{index}]: {input} times do not fit {output} values"));
                }
            }
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

/// A channel of the sampler moves morph targets: then there are several values a time.
fn targets_weights(animation: &Value, sampler: usize) -> bool {
    list(animation, "channels").iter().any(|channel| {
        let own = channel.get("sampler").and_then(Value::as_u64) == Some(sampler as u64);
        let path = channel.pointer("/target/path").and_then(Value::as_str).unwrap_or_default();
        own && !["translation", "rotation", "scale"].contains(&path)
    })
}

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

/// Images are not decoded yet; what can be seen without that is checked.
pub(super) fn images(root: &Value, warnings: &mut Warnings) {
    let webp = list(root, "extensionsUsed").iter().any(|used| used == "EXT_texture_webp");
    for (path, image) in selected(root, "images.*") {
        let uri = image.get("uri");
        if uri.is_some() == image.get("bufferView").is_some() {
            warnings.add(format!("{path} must have either a uri or a bufferView"));
        }
        let text = uri.and_then(Value::as_str);
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
