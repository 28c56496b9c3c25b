//! The tree: invariants on random and on hostile input.

use glam::Vec3;
use glimt::bvh::{Aabb, Bvh, Quality};
use proptest::prelude::*;

fn point_box(center: Vec3, half: Vec3) -> Aabb {
    Aabb { lo: center - half, hi: center + half }
}

fn check(name: &str, boxes: &[Aabb]) -> Bvh {
    let bvh = Bvh::over_boxes(boxes, 6);
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
        prop_assert_eq!(Bvh::over_boxes(&boxes, 6).validate(&boxes, None), Ok(()));
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
    let good = Bvh::over_boxes(&boxes, 6);
    let mut swapped = good.clone();
    swapped.order[0] = swapped.order[1];
    assert!(swapped.validate(&boxes, None).is_err());
    let mut shrunk = good.clone();
    shrunk.nodes[0].bounds[0].hi.x -= 5.0;
    assert!(shrunk.validate(&boxes, None).is_err());
    let mut cut = good.clone();
    cut.nodes.pop();
    assert!(cut.validate(&boxes, None).is_err());
    let mut longer = good.clone();
    longer.order.push(0);
    assert!(longer.validate(&boxes, None).is_err());
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
        pool.install(|| Bvh::over_boxes(&boxes, 6))
    };
    let (one, four) = (build(1), build(4));
    assert_eq!(one.order, four.order);
    assert!(one.nodes.iter().zip(&four.nodes).all(|(a, b)| a.children == b.children && a.bounds == b.bounds));
}

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::Best];

fn boxes_of(triangles: &[[Vec3; 3]]) -> Vec<Aabb> {
    triangles.iter().map(|corners| Aabb::of(*corners)).collect()
}

/// Long thin triangles in all directions through a cube, among small ones.
fn hay(count: u32) -> Vec<[Vec3; 3]> {
    let noise = |i: u32, salt: u32| {
        let hash = (i * 7 + salt).wrapping_mul(2_654_435_761);
        (hash ^ hash >> 15).wrapping_mul(0x9e37_79b1) as f32 / u32::MAX as f32 - 0.5
    };
    (0..count)
        .map(|i| {
            let at = Vec3::new(noise(i, 0), noise(i, 1), noise(i, 2)) * 2.0;
            let along = Vec3::new(noise(i, 3), noise(i, 4), noise(i, 5)) * if i % 3 == 0 { 4.0 } else { 0.05 };
            let across = Vec3::new(noise(i, 6), noise(i, 1), noise(i, 3)) * 0.02;
            [at - along, at + along, at + across]
        })
        .collect()
}

#[test]
fn triangles_that_are_cut_stay_covered() {
    let triangles = hay(3000);
    let boxes = boxes_of(&triangles);
    let mut costs = Vec::new();
    for quality in QUALITIES {
        let bvh = Bvh::over_triangles(&triangles, quality);
        bvh.validate(&boxes, Some(&triangles)).unwrap_or_else(|fault| panic!("{quality:?}: {fault}"));
        let references = bvh.stats().references;
        println!("{quality:?}: {references} references, SAH {:.1}", bvh.stats().sah_cost);
        let most = match quality {
            Quality::Fast => 3000,
            Quality::Balanced => 3900,
            Quality::Best => 6000,
        };
        assert!(references <= most, "{quality:?}: {references} references");
        costs.push(bvh.stats().sah_cost);
    }
    assert!(costs[2] < 0.8 * costs[0] && costs[1] < costs[0], "splits of space pay: {costs:?}");
}

#[test]
fn triangles_that_need_no_cut_get_none() {
    let side = 40;
    let at = |x: u32, y: u32| Vec3::new(x as f32, (x as f32 * 0.3).sin() + (y as f32 * 0.2).cos(), y as f32);
    let quads = (0..side).flat_map(|x| (0..side).map(move |y| (x, y)));
    let triangles: Vec<[Vec3; 3]> = quads
        .flat_map(|(x, y)| [[at(x, y), at(x, y + 1), at(x + 1, y)], [at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)]])
        .collect();
    let (fast, best) = (Bvh::over_triangles(&triangles, Quality::Fast), Bvh::over_triangles(&triangles, Quality::Best));
    let references = best.stats().references;
    assert!(references <= triangles.len() * 101 / 100, "{references} references");
    assert!(best.stats().sah_cost <= fast.stats().sah_cost * 1.001);
}

#[test]
fn hostile_triangles_keep_depth_and_memory_bounded() {
    let needle = |i: u32, scale: f32| {
        [Vec3::ZERO, Vec3::new(1.0, i as f32 * 1e-6, 1.0) * scale, Vec3::new(1.0, 1.0, i as f32 * 1e-7) * scale]
    };
    let nested: Vec<_> = (0..120).map(|i| needle(i, (i as f32 - 60.0).exp2())).collect();
    let same = vec![[Vec3::ZERO, Vec3::ONE, Vec3::new(1.0, 0.0, 0.5)]; 20_000];
    let fan: Vec<_> = (0..20_000).map(|i| needle(i, 1.0)).collect();
    let flat: Vec<_> = (0..5000).map(|i| [Vec3::ZERO, Vec3::X * i as f32, Vec3::X]).collect();
    for (name, triangles) in
        [("nested", nested), ("all the same", same), ("a fan", fan), ("without area", flat), ("none", Vec::new())]
    {
        for quality in QUALITIES {
            let bvh = Bvh::over_triangles(&triangles, quality);
            let references = bvh.stats().references;
            println!("{name}, {quality:?}: {references} references, depth {}", bvh.depth);
            bvh.validate(&boxes_of(&triangles), Some(&triangles))
                .unwrap_or_else(|fault| panic!("{name}, {quality:?}: {fault}"));
            assert!(references <= 2 * triangles.len());
        }
    }
}

#[test]
fn trees_over_triangles_do_not_depend_on_the_number_of_threads() {
    let triangles = hay(120_000);
    for quality in [Quality::Fast, Quality::Best] {
        let build = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Bvh::over_triangles(&triangles, quality))
        };
        let (one, three) = (build(1), build(3));
        assert!(one.order == three.order);
        assert_eq!(one.stats().references > triangles.len(), quality == Quality::Best);
        assert!(one.nodes.iter().zip(&three.nodes).all(|(a, b)| a.children == b.children && a.bounds == b.bounds));
    }
}

/// A grid's cells may hold nothing, a few or nearly all; the tree is valid and costs about what splits from the top down give.
#[test]
fn fast_trees_over_many_triangles_are_good_wherever_they_lie() {
    let small = |at: Vec3| [at, at + Vec3::new(0.01, 0.0, 0.002), at + Vec3::new(0.0, 0.01, 0.003)];
    let scattered = |count| hay(count).into_iter().map(|[a, ..]| a);
    let even: Vec<_> = scattered(60_000).map(small).collect();
    let mut stadium: Vec<_> = scattered(40_000).map(|at| small(at * 1e-3)).collect();
    stadium.push(small(Vec3::splat(1e4)).map(|corner| corner * 2.0));
    let shrinking: Vec<_> = scattered(40_000)
        .zip(0..)
        .map(|(at, i)| small(at).map(|corner| corner * (-((i % 40) as f32)).exp2()))
        .collect();
    let plane: Vec<_> = scattered(20_000).map(|at| small(at * Vec3::new(1.0, 0.0, 1.0))).collect();
    let line: Vec<_> = scattered(20_000).map(|at| small(at * Vec3::X)).collect();
    for (name, triangles) in [
        ("even", even),
        ("in a corner", stadium),
        ("ever smaller", shrinking),
        ("on a plane", plane),
        ("on a line", line),
        ("hay", hay(20_000)),
    ] {
        let boxes = boxes_of(&triangles);
        let (fast, top_down) = (Bvh::over_triangles(&triangles, Quality::Fast), Bvh::over_boxes(&boxes, 6));
        fast.validate(&boxes, None).unwrap_or_else(|fault| panic!("{name}: {fault}"));
        let ratio = fast.stats().sah_cost / top_down.stats().sah_cost;
        println!("{name}: depth {} and {}, SAH {ratio:.3}", fast.depth, top_down.depth);
        assert!(ratio < 1.15, "{name}: {ratio}");
    }
}

#[test]
fn the_budget_of_cuts_goes_where_boxes_are_empty() {
    // Three thousand long triangles, and far away seven times as many small ones that need no cut.
    let mut triangles = hay(3000);
    for i in 0..21_000_u32 {
        let at = Vec3::new(50.0 + (i % 145) as f32, (i / 145) as f32, 0.0);
        triangles.push([at, at + Vec3::X * 0.9, at + Vec3::Y * 0.9]);
    }
    let bvh = Bvh::over_triangles(&triangles, Quality::Balanced);
    let made = bvh.stats().references - triangles.len();
    println!("{made} parts of a budget of {}", triangles.len() * 3 / 10);
    // Shared out by numbers, the long ones would get 900.
    assert!(made > 2500, "{made} parts");
}

#[test]
fn a_refitted_tree_holds_triangles_that_moved() {
    let before = hay(3000);
    // Waves through everything, then all thrown about.
    let wave = |point: Vec3| point + Vec3::new(point.y.sin(), (3.0 * point.z).cos(), point.x * point.y) * 0.2;
    let waved: Vec<[Vec3; 3]> = before.iter().map(|corners| corners.map(wave)).collect();
    let mut thrown = before.clone();
    thrown.reverse();
    for quality in QUALITIES {
        let built = Bvh::over_triangles(&before, quality);
        for (name, after) in [("as before", &before), ("waved", &waved), ("thrown about", &thrown)] {
            let mut bvh = built.clone();
            bvh.refit(after);
            bvh.validate(&boxes_of(after), Some(after)).unwrap_or_else(|fault| panic!("{quality:?}, {name}: {fault}"));
            assert!(bvh.order == built.order && bvh.depth == built.depth);
            let (cost, refitted) = (built.stats().sah_cost, bvh.stats().sah_cost);
            println!("{quality:?}, {name}: SAH {cost:.1} built, {refitted:.1} refitted");
            // Without cuts nothing is lost by refitting to the same triangles.
            assert!(name != "as before" || quality != Quality::Fast || (refitted - cost).abs() < 1e-9 * cost);
            assert!(name != "thrown about" || refitted > 1.5 * cost);
        }
        assert!(built.validate(&boxes_of(&waved), Some(&waved)).is_err(), "without refitting it must not hold");
    }
    for few in [0, 1, 2] {
        let mut bvh = Bvh::over_triangles(&before[..few], Quality::Best);
        bvh.refit(&waved[..few]);
        bvh.validate(&boxes_of(&waved[..few]), Some(&waved[..few])).unwrap();
    }
}

/// Long diagonal triangles in thousands, which spatial splits cut; the leaves that hold their parts share them.
#[test]
fn trees_over_real_models_hold_every_triangle() {
    let Some(corpus) = super::support::corpus() else { return };
    let scenes = corpus.join("../bench/scenes");
    for name in ["s1", "s4"] {
        let scene = glimt::scene::gltf::read(&scenes.join(name).with_extension("glb"), &Default::default()).unwrap();
        let soup = glimt::scene::Soup::of(&scene).unwrap();
        let triangles: Vec<[Vec3; 3]> =
            soup.positions.iter().map(|corners| corners.map(|corner| corner.as_vec3())).collect();
        let bvh = Bvh::over_triangles(&triangles, Quality::Best);
        let (stored, references, own) = (bvh.order.len(), bvh.stats().references, triangles.len());
        println!("{name}: {stored} places for {references} references of {own} triangles");
        assert!(stored * 100 <= own * 105, "{name}: {stored} places for {own} triangles");
        assert_eq!(references * 2 > own * 3, name == "s4");
        bvh.validate(&boxes_of(&triangles), Some(&triangles)).unwrap_or_else(|fault| panic!("{name}: {fault}"));
    }
}
