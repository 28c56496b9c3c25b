//! Skins' joints in the node tree; variants of materials.

use super::{list, selected, Warnings};
use serde_json::Value;
use std::collections::BTreeSet;

/// A node's topmost ancestor, and the places of its subtree in a depth-first walk.
#[derive(Clone, Copy, Default)]
struct Place {
    root: usize,
    first: usize,
    end: usize,
}

/// Joints of a skin must have a common root, and its skeleton, if given, must be one. There are no cycles any more.
pub(super) fn skeletons(root: &Value, warnings: &mut Warnings) {
    let places = places(list(root, "nodes"));
    for (path, skin) in selected(root, "skins.*") {
        let joints = list(skin, "joints").iter().filter_map(Value::as_u64).map(|joint| places[joint as usize]);
        let joints: Vec<Place> = joints.collect();
        if joints.windows(2).any(|pair| pair[0].root != pair[1].root) {
            warnings.add(format!("{path}: its joints have no common root"));
        }
        let Some(skeleton) = skin.get("skeleton").and_then(Value::as_u64) else { continue };
        let above = places[skeleton as usize];
        if !joints.iter().all(|joint| (above.first..above.end).contains(&joint.first)) {
            warnings.add(format!("{path}.skeleton is not above all of its joints"));
        }
    }
}

fn places(nodes: &[Value]) -> Vec<Place> {
    let children =
        |node: usize| list(&nodes[node], "children").iter().filter_map(Value::as_u64).map(|child| child as usize);
    let mut is_child = vec![false; nodes.len()];
    (0..nodes.len()).flat_map(children).for_each(|child| is_child[child] = true);
    let mut places = vec![Place::default(); nodes.len()];
    let mut next = 0;
    for root in (0..nodes.len()).filter(|node| !is_child[*node]) {
        // Each node is met on the way down and on the way up.
        let mut stack = vec![(root, false)];
        while let Some((node, is_done)) = stack.pop() {
            if is_done {
                places[node].end = next;
                continue;
            }
            places[node] = Place { root, first: next, end: next };
            next += 1;
            stack.push((node, true));
            stack.extend(children(node).map(|child| (child, false)));
        }
    }
    places
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
