//! Host code that every picture waits for: building and quantising the tree, the soup.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{criterion_group, criterion_main, Criterion};
use glimt::bvh::{quantise, reference, Aabb, Bvh};
use glimt::scene::{built_in, shapes, Instance, Material, Soup};
use glimt::Scene;

/// A ball of 2 · 256² · 2 triangles, bent so that no two are alike.
fn ball() -> Scene {
    let mut mesh = shapes::sphere(256);
    for point in &mut mesh.positions {
        *point *= 1.0 + 0.1 * (17.0 * point.x).sin() * (23.0 * point.y).cos();
    }
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_object: glam::DMat4::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

fn host(criterion: &mut Criterion) {
    let scene = ball();
    let soup = Soup::of(&scene).unwrap();
    let boxes: Vec<Aabb> = soup.positions.iter().map(|corners| Aabb::of(corners.map(|c| c.as_vec3()))).collect();
    let bvh = Bvh::over_boxes(&boxes, 6);
    let mut group = criterion.benchmark_group(format!("{} triangles", boxes.len()));
    group.sample_size(10);
    group.bench_function("soup", |bencher| bencher.iter(|| Soup::of(&scene).unwrap()));
    group.bench_function("build", |bencher| bencher.iter(|| Bvh::over_boxes(&boxes, 6)));
    group.bench_function("quantise", |bencher| {
        bencher.iter(|| quantise(&bvh, glam::Vec3::ONE, true, |child| reference(child, 0, 0)))
    });
    group.finish();
    criterion.bench_function("built-in table", |bencher| bencher.iter(|| built_in("table").unwrap()));
}

criterion_group!(benches, host);
criterion_main!(benches);
