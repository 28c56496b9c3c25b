//! Nodes and what hangs on them: cameras and lights.

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
