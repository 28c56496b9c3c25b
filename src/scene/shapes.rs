//! Objects built of triangles from vertices: the square, the unit cube, the sphere. (The teapot has a file of its own.)

use super::Mesh;
use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// A square of four corners A B C D, counter-clockwise: the triangles A B C and A C D.
pub fn square(corners: [Vec3; 4]) -> Mesh {
    Mesh {
        name: "square".into(),
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The unit square in the plane y = 0, from −½ to ½, facing up.
pub fn ground() -> Mesh {
    square([(-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)].map(|(x, z)| Vec3::new(x, 0.0, z)))
}

/// The unit cube from −½ to ½: eight corners, six squares, twelve triangles, flat faces that look outward.
pub fn cube() -> Mesh {
    // Corner i has x, y, z = bits 0, 1, 2 of i.
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) - 0.5;
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        name: "cube".into(),
        positions: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        ..Mesh::default()
    }
}

/// The sphere of radius 1 about the origin, with `rings` rows of faces from pole to pole and twice as many around, and its
/// exact normals.
///
/// # Panics
/// When `rings` is below 2.
pub fn sphere(rings: u32) -> Mesh {
    assert!(rings >= 2, "a sphere of {rings} rings");
    let around = 2 * rings;
    let mut mesh = Mesh { name: "sphere".into(), ..Mesh::default() };
    for ring in 0..=rings {
        let (height, radius) =
            ((PI * f64::from(ring) / f64::from(rings)).cos(), (PI * f64::from(ring) / f64::from(rings)).sin());
        for step in 0..around {
            let angle = TAU * f64::from(step) / f64::from(around);
            let point = glam::DVec3::new(radius * angle.sin(), height, radius * angle.cos()).as_vec3();
            mesh.positions.push(point);
        }
    }
    mesh.normals = mesh.positions.iter().map(|point| point.normalize()).collect();
    for ring in 0..rings {
        for step in 0..around {
            let (upper, lower) = (ring * around, (ring + 1) * around);
            let next = (step + 1) % around;
            let [a, b, c, d] = [upper + step, lower + step, lower + next, upper + next];
            // At the poles one of the two triangles has no area.
            if ring + 1 < rings {
                mesh.triangles.push([a, b, c]);
            }
            if ring > 0 {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}
