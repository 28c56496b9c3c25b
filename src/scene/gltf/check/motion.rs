//! Skins' joints in the node tree; variants of materials.

use super::{list, selected, Warnings};
use serde_json::Value;
use std::collections::BTreeSet;

/// Joints of a skin must have a common root, and its skeleton, if given, must be one.
pub(super) fn skeletons(root: &Value, warnings: &mut Warnings) {
    let nodes = list(root, "nodes");
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        list(node, "children").iter().filter_map(Value::as_u64).for_each(|child| parents[child as usize] = Some(index));
    }
    let roots = roots(&parents);
    for (path, skin) in selected(root, "skins.*") {
        let joints: Vec<usize> =
            list(skin, "joints").iter().filter_map(Value::as_u64).map(|joint| joint as usize).collect();
        if joints.windows(2).any(|pair| roots[pair[0]] != roots[pair[1]]) {
            warnings.add(format!("{path}: its joints have no common root"));
        }
        let Some(skeleton) = skin.get("skeleton").and_then(Value::as_u64) else { continue };
        let below = |joint: &usize| {
            std::iter::successors(Some(*joint), |node| parents[*node]).any(|node| node as u64 == skeleton)
        };
        if !joints.iter().all(below) {
            warnings.add(format!("{path}.skeleton is not above all of its joints"));
        }
    }
}

/// The topmost node above each, or itself. There are no cycles.
fn roots(parents: &[Option<usize>]) -> Vec<usize> {
    let mut roots: Vec<Option<usize>> =
        parents.iter().enumerate().map(|(node, up)| up.is_none().then_some(node)).collect();
    for start in 0..parents.len() {
        let mut way = Vec::new();
        let mut node = start;
        while let (None, Some(parent)) = (roots[node], parents[node]) {
            way.push(node);
            node = parent;
        }
        let root = roots[node];
        way.into_iter().for_each(|node| roots[node] = root);
    }
    roots.into_iter().enumerate().map(|(node, root)| root.unwrap_or(node)).collect()
}

/// Variants must have names, and a primitive one material for each.
pub(super) fn variants(root: &Value, warnings: &mut Warnings) {
    for (path, variant) in selected(root, "extensions.KHR_materials_variants.variants.*") {
        if variant.get("name").and_then(Value::as_str).is_none() {
            warnings.add(format!("{path} has no name"));
        }
    }
    for (path, mappings) in selected(root, "meshes.*.primitives.*.extensions.KHR_materials_variants.mappings") {
        let mut seen = BTreeSet::new();
        let all = selected(mappings, "*.variants.*");
        if !all.iter().filter_map(|(_, variant)| variant.as_u64()).all(|variant| seen.insert(variant)) {
            warnings.add(format!("{path}: a variant has several materials; the first is used"));
        }
    }
}
