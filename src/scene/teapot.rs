//! The Utah teapot: Newell's 32 bicubic Bézier patches (1975), tessellated.
//!
//! 24 of the patches are quarter turns of six profiles, so it is the profiles that are stored: radius and height of four
//! control points each; Newell's quarter circle has its inner control points at 0.56 of the radius. Handle and spout are
//! two half patches each, mirrored. In the data z is up and the spout points along +x.

use super::Mesh;
use glam::{DVec3, Vec3};

/// Radius and height of control points, outer side to the left of the direction of travel.
const PROFILES: [[(f64, f64); 4]; 6] = [
    // Rim, upper and lower body.
    [(1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)],
    [(1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9)],
    [(2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)],
    // Knob and lid.
    [(0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7)],
    [(0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)],
    // Bottom, from the body inward.
    [(1.5, 0.15), (1.5, 0.075), (1.425, 0.0), (0.0, 0.0)],
];

/// Newell's distance of a quarter circle's inner control points.
const QUARTER: f64 = 0.56;

/// Rows of (x, z) along the handle and the spout for the two edges of a half patch, and the half width y of each row.
type HalfPatch = [([(f64, f64); 2], f64); 4];

/// Inner edge in the plane y = 0, then outer edge.
const HALVES: [HalfPatch; 4] = [
    // Handle.
    [
        ([(-1.6, 2.025), (-1.5, 2.25)], 0.3),
        ([(-2.3, 2.025), (-2.5, 2.25)], 0.3),
        ([(-2.7, 2.025), (-3.0, 2.25)], 0.3),
        ([(-2.7, 1.8), (-3.0, 1.8)], 0.3),
    ],
    [
        ([(-2.7, 1.8), (-3.0, 1.8)], 0.3),
        ([(-2.7, 1.575), (-3.0, 1.35)], 0.3),
        ([(-2.5, 1.125), (-2.65, 0.9375)], 0.3),
        ([(-2.0, 0.9), (-1.9, 0.6)], 0.3),
    ],
    // Spout.
    [
        ([(1.7, 1.425), (1.7, 0.6)], 0.66),
        ([(2.6, 1.425), (3.1, 0.825)], 0.66),
        ([(2.3, 2.1), (2.4, 2.025)], 0.25),
        ([(2.7, 2.4), (3.3, 2.4)], 0.25),
    ],
    [
        ([(2.7, 2.4), (3.3, 2.4)], 0.25),
        ([(2.8, 2.475), (3.525, 2.49375)], 0.25),
        ([(2.9, 2.475), (3.45, 2.5125)], 0.15),
        ([(2.8, 2.4), (3.2, 2.4)], 0.15),
    ],
];

/// Control points of a patch, rows along u.
type Patch = [[DVec3; 4]; 4];

/// All 32 patches, ∂u × ∂v outward.
fn patches() -> Vec<Patch> {
    let mut patches = Vec::new();
    for profile in PROFILES {
        for turn in 0..4 {
            let (sine, cosine) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][turn];
            let quarter = [(1.0, 0.0), (1.0, QUARTER), (QUARTER, 1.0), (0.0, 1.0)];
            patches.push(profile.map(|(radius, height)| {
                quarter.map(|(x, y)| {
                    DVec3::new(radius * (cosine * x - sine * y), radius * (sine * x + cosine * y), height)
                })
            }));
        }
    }
    for half in HALVES {
        for side in [1.0, -1.0] {
            patches.push(half.map(|([(x0, z0), (x1, z1)], width)| {
                let row = [
                    DVec3::new(x0, 0.0, z0),
                    DVec3::new(x0, side * width, z0),
                    DVec3::new(x1, side * width, z1),
                    DVec3::new(x1, 0.0, z1),
                ];
                // The mirrored half runs the other way round, so that both look outward.
                if side > 0.0 {
                    row
                } else {
                    [row[3], row[2], row[1], row[0]]
                }
            }));
        }
    }
    patches
}

/// Cubic Bernstein polynomials and their derivatives at t.
fn bernstein(t: f64) -> ([f64; 4], [f64; 4]) {
    let s = 1.0 - t;
    (
        [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
        [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t],
    )
}

fn combine(patch: &Patch, along_u: &[f64; 4], along_v: &[f64; 4]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (row, weight_u) in patch.iter().zip(along_u) {
        for (point, weight_v) in row.iter().zip(along_v) {
            sum += *point * *weight_u * *weight_v;
        }
    }
    sum
}

/// Point and unit normal of a patch. Where a row has shrunk to a point (knob, bottom) the normal is the one close by.
fn evaluate(patch: &Patch, u: f64, v: f64) -> (DVec3, DVec3) {
    let ((weights_u, slopes_u), (weights_v, slopes_v)) = (bernstein(u), bernstein(v));
    let point = combine(patch, &weights_u, &weights_v);
    let normal = combine(patch, &slopes_u, &weights_v).cross(combine(patch, &weights_u, &slopes_v));
    if normal.length() < 1e-9 {
        let inside = if u < 0.5 { u + 1e-4 } else { u - 1e-4 };
        return (point, evaluate(patch, inside, v).1);
    }
    (point, normal.normalize())
}

/// The teapot with `steps` × `steps` squares a patch, standing on y = 0 with its axis at the origin and its spout along
/// +x; 3.15 high. Triangles without area, at the ends of knob and bottom, are left out.
///
/// # Panics
/// When `steps` is 0.
pub fn teapot(steps: u32) -> Mesh {
    assert!(steps > 0, "a teapot of no triangles");
    let y_up = |v: DVec3| Vec3::new(v.x as f32, v.z as f32, -v.y as f32);
    let mut mesh = Mesh { name: "teapot".into(), ..Mesh::default() };
    for patch in patches() {
        let first = mesh.positions.len() as u32;
        for i in 0..=steps {
            for j in 0..=steps {
                let (point, normal) =
                    evaluate(&patch, f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                mesh.positions.push(y_up(point));
                mesh.normals.push(y_up(normal));
            }
        }
        for i in 0..steps {
            for j in 0..steps {
                let a = first + i * (steps + 1) + j;
                let (b, c, d) = (a + steps + 1, a + steps + 2, a + 1);
                for triangle in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = triangle.map(|corner| mesh.positions[corner as usize]);
                    if (q - p).cross(r - p).length() > 1e-9 {
                        mesh.triangles.push(triangle);
                    }
                }
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_32_patches_and_their_normals_point_outward() {
        assert_eq!(patches().len(), 32);
        let mesh = teapot(8);
        // Distance to a skeleton inside each part: the axis for the body, the middle lines for handle and spout.
        let agree = mesh.triangles.iter().filter(|triangle| {
            let [p, q, r] = triangle.map(|corner| mesh.positions[corner as usize]);
            let normal: Vec3 = triangle.iter().map(|corner| mesh.normals[*corner as usize]).sum();
            (q - p).cross(r - p).dot(normal) > 0.0
        });
        assert_eq!(agree.count(), mesh.triangles.len(), "winding against normals");
        for (index, patch) in patches().iter().enumerate() {
            let all: DVec3 = patch.iter().flatten().sum::<DVec3>() / 16.0;
            let (point, normal) = evaluate(patch, 0.5, 0.5);
            let outward = match index {
                // Rim: its middle is its top. Lid and bottom: up and down.
                0..4 | 16..20 => DVec3::Z,
                20..24 => DVec3::NEG_Z,
                4..16 => DVec3::new(point.x, point.y, 0.0),
                _ => DVec3::new(0.0, all.y, 0.0),
            };
            assert!(normal.dot(outward) > 0.0, "patch {index}: normal {normal} at {point}");
        }
    }
}
