//! Trees get cheaper and stay valid.

use super::*;
use crate::bvh::{Aabb, Bvh, Child, Quality, Wide};
use glam::Vec3;

/// Half area of all inner nodes but the root.
fn area(bvh: &Bvh) -> f32 {
    let children = bvh.nodes.iter().flat_map(|node| node.bounds.iter().zip(&node.children));
    children.filter(|(_, child)| matches!(child, Child::Node(_))).map(|(bounds, _)| bounds.half_area()).sum()
}

/// Moves subtrees of a tree over these boxes again and again, checks that all invariants hold and that the area never grows,
/// and returns the share that is left.
fn share_left(boxes: &[Aabb], built: &Bvh) -> f32 {
    let mut bvh = Bvh { depth: MAX_TREE_DEPTH, ..built.clone() };
    for _ in 0..5 {
        let before = area(&bvh);
        bvh.nodes = reinsert(&bvh.nodes);
        assert_eq!(bvh.validate(boxes, None), Ok(()));
        // Sums in another order round otherwise.
        assert!(area(&bvh) <= before * 1.000_01, "{before} {}", area(&bvh));
    }
    area(&bvh) / area(built)
}

/// Triangles all over a cube of `scale`, `size` of it large.
fn soup(count: u32, size: f32, scale: f32) -> Vec<[Vec3; 3]> {
    let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8).wrapping_mul(0x9e37_79b1) as f32 / u32::MAX as f32;
    let at = |i: u32| Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
    (0..count)
        .map(|i| [at(i), at(i) + at(i + count) * size, at(i) + at(i + 2 * count) * size])
        .map(|corners| corners.map(|corner| corner * scale))
        .collect()
}

#[test]
fn costs_fall_and_never_rise() {
    for (size, scale, most) in [(0.3, 1.0, 0.97), (1e-3, 1.0, 0.95), (0.0, 1.0, 0.95), (0.3, 1e25, 1.0)] {
        for count in [1, 2, 3, 5, 20, 300, 20_000] {
            let triangles = soup(count, size, scale);
            let boxes: Vec<Aabb> = triangles.iter().map(|corners| Aabb::of(*corners)).collect();
            let share = share_left(&boxes, &Bvh::over_triangles(&triangles, Quality::Fast));
            println!("{count} of {size} times {scale}: {share}");
            // Not a number where areas are infinite: then nothing moves.
            assert!(count < 20_000 || share.is_nan() || share < most, "{share}");
        }
    }
}

#[test]
fn the_same_tree_on_any_number_of_threads() {
    let built = Bvh::over_triangles(&soup(30_000, 0.1, 1.0), Quality::Fast);
    let moved = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| reinsert(&built.nodes))
    };
    let (one, four) = (moved(1), moved(4));
    assert!(one.iter().zip(&four).all(|(a, b)| a.children == b.children && a.bounds == b.bounds));
    assert!(one.iter().zip(&built.nodes).any(|(a, b)| a.children != b.children));
}

#[test]
fn a_subtree_does_not_go_deeper_than_a_tree_may() {
    // Each node holds a box and the next node, a little smaller, as deep as can be; what belongs in the last is in the second.
    let cube = |size: f32| Aabb { lo: Vec3::ZERO, hi: Vec3::splat(size) };
    let mut boxes = vec![cube(0.1), cube(0.2)];
    let leaf = |first: u32| Child::Leaf { first, count: 1 };
    let mut nodes = Vec::new();
    for depth in 1..=MAX_TREE_DEPTH {
        let size = (MAX_TREE_DEPTH - depth + 1) as f32;
        boxes.push(if depth < MAX_TREE_DEPTH { cube(size) } else { cube(0.3) });
        let next = Node { bounds: [cube(size), cube(size - 1.0)], children: [leaf(depth + 1), Child::Node(depth)] };
        nodes.push(next);
    }
    nodes[1] = Node { bounds: [cube(0.2), cube(62.0)], children: [Child::Node(64), Child::Node(2)] };
    boxes[3] = cube(0.25);
    nodes[63] = Node { bounds: [cube(0.3), cube(0.25)], children: [leaf(65), leaf(3)] };
    nodes.push(Node { bounds: [cube(0.1), cube(0.2)], children: [leaf(0), leaf(1)] });
    let order = (0..66).collect();
    let share =
        share_left(&boxes, &Bvh { nodes, order, bounds: cube(64.0), depth: MAX_TREE_DEPTH, wide: Wide::default() });
    assert!(share < 1.0, "{share}");
}
