//! The tree: invariants on random and on hostile input.

use glam::Vec3;
use glimt::bvh::{Aabb, Bvh};
use proptest::prelude::*;

fn point_box(center: Vec3, half: Vec3) -> Aabb {
    Aabb { lo: center - half, hi: center + half }
}

fn check(name: &str, boxes: &[Aabb]) -> Bvh {
    let bvh = Bvh::build(boxes);
    bvh.validate(boxes, None).unwrap_or_else(|fault| panic!("{name}: {fault}"));
    let stats = bvh.stats();
    println!("{name}: {} boxes, {} nodes, depth {}, SAH {:.1}", boxes.len(), stats.nodes, stats.depth, stats.sah_cost);
    bvh
}

proptest! {
    #[test]
    fn random_boxes(seeds in prop::collection::vec((any::<[i16; 3]>(), any::<[u8; 3]>()), 0..400)) {
        let boxes: Vec<Aabb> = seeds
            .iter()
            .map(|(at, size)| point_box(Vec3::from_array(at.map(f32::from)), Vec3::from_array(size.map(f32::from))))
            .collect();
        prop_assert_eq!(Bvh::build(&boxes).validate(&boxes, None), Ok(()));
    }
}

#[test]
fn few_boxes() {
    for count in 0..6 {
        let boxes: Vec<Aabb> = (0..count).map(|i| point_box(Vec3::splat(i as f32), Vec3::ONE)).collect();
        check("few", &boxes);
    }
}

#[test]
fn hostile_boxes_keep_depth_and_memory_bounded() {
    let same = vec![point_box(Vec3::ONE, Vec3::ONE); 100_000];
    check("equal centroids", &same);
    let nested: Vec<Aabb> = (0..120).map(|i| point_box(Vec3::ZERO, Vec3::splat((i as f32 - 60.0).exp2()))).collect();
    check("nested, each twice the last", &nested);
    let growing: Vec<Aabb> =
        (0..120).map(|i| point_box(Vec3::X * (i as f32 - 60.0).exp2(), Vec3::splat(1e-20))).collect();
    check("centroids at powers of two", &growing);
    let mut diagonal: Vec<Aabb> =
        (0..50_000).map(|i| point_box(Vec3::new((i % 223) as f32, (i / 223) as f32, 0.0), Vec3::splat(0.4))).collect();
    diagonal.push(point_box(Vec3::ZERO, Vec3::splat(1e4)));
    check("one diagonal longer than the rest", &diagonal);
    let line: Vec<Aabb> = (0..100_000).map(|i| point_box(Vec3::X * 1.0001_f32.powi(i % 40_000), Vec3::ZERO)).collect();
    check("a geometric line of points", &line);
}

#[test]
fn a_broken_tree_is_noticed() {
    let boxes: Vec<Aabb> =
        (0..100).map(|i| point_box(Vec3::new(i as f32, (i * 7 % 13) as f32, 0.0), Vec3::ONE)).collect();
    let good = Bvh::build(&boxes);
    let mut swapped = good.clone();
    swapped.order[0] = swapped.order[1];
    assert!(swapped.validate(&boxes, None).is_err());
    let mut shrunk = good.clone();
    shrunk.nodes[0].bounds[0].hi.x -= 5.0;
    assert!(shrunk.validate(&boxes, None).is_err());
    let mut cut = good.clone();
    cut.nodes.pop();
    assert!(cut.validate(&boxes, None).is_err());
}

#[test]
fn the_same_tree_on_any_number_of_threads() {
    let boxes: Vec<Aabb> = (0..60_000_u32)
        .map(|i| {
            let hash =
                |salt: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(salt).wrapping_mul(0x9e37_79b1) >> 8) as f32;
            point_box(Vec3::new(hash(1), hash(2), hash(3)), Vec3::splat(3e4))
        })
        .collect();
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Bvh::build(&boxes))
    };
    let (one, four) = (build(1), build(4));
    assert_eq!(one.order, four.order);
    assert!(one.nodes.iter().zip(&four.nodes).all(|(a, b)| a.children == b.children && a.bounds == b.bounds));
}
