//! The four ray sets of a benchmark: primary, shadow, mirror and diffuse rays of one view, the same for every program.
//!
//! Primary rays go through the centres of the pixels. Where one hits, at `P = eye + D·t + n·ε` with the geometric normal `n`
//! on the ray's side and `ε = 1e-4 · |diagonal of the scene's box|`, the other sets start: towards the light, mirrored at the
//! surface, and in a random direction by the cosine. All in f32. Rays are listed in tiles of
//! 8 × 8 pixels, in Morton order inside a tile; pixels whose primary ray misses have no other rays.

use crate::layout::TILE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A set of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SetKind {
    /// From the eye; the nearest hit is asked for.
    Primary,
    /// To the light; whether anything is hit.
    Shadow,
    /// Mirrored at what the primary ray hit; nearest hit.
    Mirror,
    /// Scattered at what the primary ray hit; nearest hit.
    Diffuse,
}

impl SetKind {
    /// All sets.
    pub const ALL: [Self; 4] = [Self::Primary, Self::Shadow, Self::Mirror, Self::Diffuse];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::Mirror => "mirror",
            Self::Diffuse => "diffuse",
        }
    }
}

/// A ray as the files of a benchmark hold it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BenchRay {
    /// Start.
    pub origin: [f32; 3],
    /// Hits nearer than this do not count; always 0.
    pub t_min: f32,
    /// Unit direction.
    pub direction: [f32; 3],
    /// Hits beyond this do not count; negative: the pixel has no ray.
    pub t_max: f32,
}

impl BenchRay {
    /// The ray of a pixel that has none.
    pub const NONE: Self = Self { origin: [0.0; 3], t_min: 0.0, direction: [0.0, 0.0, 1.0], t_max: -1.0 };
    /// Distance to nowhere.
    const FAR: f32 = 1e30;

    fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin: origin.to_array(), t_min: 0.0, direction: direction.to_array(), t_max }
    }
}

/// Where the rays come from, world space.
#[derive(Clone, Copy, Debug, serde::Deserialize, serde::Serialize)]
pub struct BenchView {
    /// Eye.
    pub eye: [f32; 3],
    /// Point in the middle of the picture.
    pub target: [f32; 3],
    /// Up in the picture.
    pub up: [f32; 3],
    /// Vertical field of view, degrees.
    pub vfov_deg: f32,
    /// Pixels across, a multiple of the tile.
    pub width: u32,
    /// Pixels down, a multiple of the tile.
    pub height: u32,
    /// Point that shadow rays go to.
    pub light_pos: [f32; 3],
    /// Lower corner of the scene's box.
    pub bbox_min: [f32; 3],
    /// Upper corner of the scene's box.
    pub bbox_max: [f32; 3],
}

/// What a primary ray met.
#[derive(Clone, Copy, Debug)]
pub struct PrimaryHit {
    /// Distance.
    pub t: f32,
    /// Corners of the triangle, world space.
    pub corners: [Vec3; 3],
}

impl BenchView {
    /// Pixels in tile order, as indices into rows.
    pub fn order(&self) -> Vec<u32> {
        let mut order = Vec::with_capacity((self.width * self.height) as usize);
        let even_bits = |code: u32| code & 1 | code >> 1 & 2 | code >> 2 & 4;
        for top in (0..self.height).step_by(TILE as usize) {
            for left in (0..self.width).step_by(TILE as usize) {
                order.extend(
                    (0..TILE * TILE).map(|code| (top + even_bits(code >> 1)) * self.width + left + even_bits(code)),
                );
            }
        }
        order
    }

    /// One ray a pixel, row by row.
    pub fn primary(&self) -> Vec<BenchRay> {
        let [eye, target, up] = [self.eye, self.target, self.up].map(Vec3::from);
        let forward = unit(target - eye);
        let right = unit(forward.cross(up));
        let up = right.cross(forward);
        let half_height = (self.vfov_deg * 0.5 * PI / 180.0).tan();
        let half_width = half_height * self.width as f32 / self.height as f32;
        let ray = |pixel: u32| {
            let (x, y) = ((pixel % self.width) as f32, (pixel / self.width) as f32);
            let across = ((x + 0.5) / self.width as f32 * 2.0 - 1.0) * half_width;
            let upward = (1.0 - (y + 0.5) / self.height as f32 * 2.0) * half_height;
            BenchRay::new(eye, unit(forward + right * across + up * upward), BenchRay::FAR)
        };
        (0..self.width * self.height).map(ray).collect()
    }

    /// The rays of a secondary set, one a pixel, row by row, from what the primary rays met.
    pub fn secondary(&self, kind: SetKind, primary: &[BenchRay], hits: &[Option<PrimaryHit>]) -> Vec<BenchRay> {
        let size = Vec3::from(self.bbox_max) - Vec3::from(self.bbox_min);
        let epsilon = 1e-4 * size.dot(size).sqrt();
        let ray = |(pixel, (ray, hit)): (usize, (&BenchRay, &Option<PrimaryHit>))| {
            let Some(hit) = hit else { return BenchRay::NONE };
            let (eye, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
            let [a, b, c] = hit.corners;
            let normal = unit((b - a).cross(c - a));
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let origin = eye + direction * hit.t + normal * epsilon;
            match kind {
                SetKind::Primary => *ray,
                SetKind::Shadow => {
                    let offset = Vec3::from(self.light_pos) - origin;
                    let distance = offset.dot(offset).sqrt();
                    BenchRay::new(origin, offset * (1.0 / distance), distance * (1.0 - 1e-4))
                }
                SetKind::Mirror => {
                    let mirrored = unit(direction - normal * (2.0 * direction.dot(normal)));
                    BenchRay::new(origin, mirrored, BenchRay::FAR)
                }
                SetKind::Diffuse => BenchRay::new(origin, scattered(normal, pixel as u32), BenchRay::FAR),
            }
        };
        primary.iter().zip(hits).enumerate().map(ray).collect()
    }
}

/// A direction about `normal` by the cosine, the pixel's own.
fn scattered(normal: Vec3, pixel: u32) -> Vec3 {
    let uniform = |index: u32| pcg(index) as f32 * (-32.0_f32).exp2();
    let u_1 = uniform(pixel.wrapping_mul(2)).min(0.999_999_94);
    let u_2 = uniform(pixel.wrapping_mul(2).wrapping_add(1));
    let (radius, angle) = (u_1.sqrt(), TAU * u_2);
    // Duff and others, Building an orthonormal basis, revisited, JCGT 6(1) 2017.
    let sign = 1.0_f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let bitangent = Vec3::new(b, sign + normal.y * normal.y * a, -normal.y);
    unit(tangent * (radius * angle.cos()) + bitangent * (radius * angle.sin()) + normal * (1.0 - u_1).max(0.0).sqrt())
}

/// PCG-RXS-M-XS of one word (O'Neill 2014).
fn pcg(seed: u32) -> u32 {
    let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// By the reciprocal of the length, as the definition has it.
fn unit(vector: Vec3) -> Vec3 {
    vector * (1.0 / vector.dot(vector).sqrt())
}
