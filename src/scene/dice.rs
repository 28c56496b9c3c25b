//! Triangles that reach from near the eye to very far away, cut into pieces that grow with their distance from it.
//!
//! In f32 a point on a triangle is known to some millionth of the triangle's size. That is nothing where the triangle is as far away as it is
//! large; on a ground of a thousand kilometres it is a metre, also right in front of the camera, and whatever stands there loses its shadow.
//! Pieces as large as they are far away keep every error in proportion to the distance from the eye.
//!
//! Whether an edge is cut, and where, depends on that edge and the eye alone, so triangles that share it stay without a gap.

use super::soup::is_thin;
use super::{Soup, TriangleFlags};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// How many times its distance from the eye a triangle or an edge may be long. Errors are then at most this many millionths of
/// the distance. Measured, not derived: with 64, slivers 170 m long 4 m away shadowed themselves here and there; with 16, up to 7 in 10 000 reflections
/// that graze a wall right in front of the eye met one of its pieces again.
const LENGTHS: f64 = 32.0;
/// Nothing nearer to the eye than this part of the scene's size counts as nearer.
const NEAREST: f64 = 1e-13;
/// A weight up to which a point lies on the edge, which is cut by itself.
const ON_EDGE: f64 = 1e-9;

/// Most pieces, but for those of one triangle more: a triangle becomes thousands of them at worst.
const MOST_PIECES: usize = 1 << 22;

/// A corner of a piece.
#[derive(Clone, Copy)]
struct Corner {
    position: DVec3,
    /// Weights of the corners of the triangle that it is a piece of.
    weights: DVec3,
}

impl Corner {
    /// The same point from either end.
    fn middle(a: &Self, b: &Self) -> Self {
        Self { position: (a.position + b.position) * 0.5, weights: (a.weights + b.weights) * 0.5 }
    }
}

/// Where the eye is and what is too near to matter.
#[derive(Clone, Copy)]
struct Eye {
    position: DVec3,
    nearest: f64,
}

impl Eye {
    /// Something of this size at this distance would lose precision.
    fn is_too_large(&self, size: f64, distance: f64) -> bool {
        size > LENGTHS * distance.max(self.nearest)
    }

    /// The same answer from either end.
    fn cuts(&self, a: DVec3, b: DVec3) -> bool {
        let (a, b) = if a.to_array() < b.to_array() { (a, b) } else { (b, a) };
        let edge = b - a;
        let along = ((self.position - a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        self.is_too_large(edge.length(), self.position.distance(a + edge * along))
    }

    /// Quickly false for nearly all triangles.
    fn may_cut(&self, corners: &[DVec3; 3]) -> bool {
        let [a, b, c] = *corners;
        let size = a.distance(b).max(a.distance(c));
        let distance = self.position.distance(a) - size;
        self.is_too_large(2.0 * size, distance)
    }
}

/// The point of a triangle's plane that is nearest to the eye, if it lies inside: barycentric weights and distance.
fn nearest_inside(corners: &[Corner; 3], eye: DVec3) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(|corner| corner.position);
    let (edge_b, edge_c, from_a) = (b - a, c - a, eye - a);
    let normal = edge_b.cross(edge_c);
    let area = normal.length_squared();
    let weight_b = from_a.cross(edge_c).dot(normal) / area;
    let weight_c = edge_b.cross(from_a).dot(normal) / area;
    let weights = DVec3::new(1.0 - weight_b - weight_c, weight_b, weight_c);
    // A triangle without area has no such point: NaN is not above 0.
    (weights.min_element() > ON_EDGE).then(|| (weights, (from_a.dot(normal) / area.sqrt()).abs()))
}

/// Cuts a triangle until no piece is too large; appends the pieces.
fn dice(corners: [Corner; 3], eye: &Eye, pieces: &mut Vec<[Corner; 3]>) {
    let [a, b, c] = corners;
    let cut = |a: &Corner, b: &Corner| eye.cuts(a.position, b.position).then(|| Corner::middle(a, b));
    let halves = [cut(&a, &b), cut(&b, &c), cut(&c, &a)];
    let parts: Vec<[Corner; 3]> = match halves {
        [Some(ab), Some(bc), Some(ca)] => vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]],
        [Some(ab), Some(bc), None] => vec![[a, ab, c], [ab, bc, c], [ab, b, bc]],
        [None, Some(bc), Some(ca)] => vec![[b, bc, a], [bc, ca, a], [bc, c, ca]],
        [Some(ab), None, Some(ca)] => vec![[c, ca, b], [ca, ab, b], [ca, a, ab]],
        [Some(ab), None, None] => vec![[a, ab, c], [ab, b, c]],
        [None, Some(bc), None] => vec![[b, bc, a], [bc, c, a]],
        [None, None, Some(ca)] => vec![[c, ca, b], [ca, a, b]],
        [None, None, None] => {
            let size = a.position.distance(b.position).max(a.position.distance(c.position));
            match nearest_inside(&corners, eye.position) {
                Some((weights, distance)) if eye.is_too_large(size, distance) => {
                    let mix = |of: fn(&Corner) -> DVec3| of(&a) * weights.x + of(&b) * weights.y + of(&c) * weights.z;
                    let foot =
                        Corner { position: mix(|corner| corner.position), weights: mix(|corner| corner.weights) };
                    vec![[a, b, foot], [b, c, foot], [c, a, foot]]
                }
                _ => {
                    pieces.push(corners);
                    return;
                }
            }
        }
    };
    for part in parts {
        dice(part, eye, pieces);
    }
}

/// Attributes at the corners of a triangle, as far as the soup has them.
struct Attributes {
    normals: Option<[Vec3; 3]>,
    colors: Option<[Vec4; 3]>,
    texcoords: Option<[[Vec2; 2]; 3]>,
    tangents: Option<[Vec4; 3]>,
}

/// The mean of the corners' vectors.
fn mix<T: Copy + std::ops::Mul<f32, Output = T> + std::iter::Sum>(of: [T; 3], weights: DVec3) -> T {
    (0..3).map(|corner| of[corner] * weights[corner] as f32).sum()
}

impl Soup {
    fn attributes_of(&self, primitive: usize) -> Attributes {
        Attributes {
            normals: self.normals.get(primitive).copied(),
            colors: self.colors.get(primitive).copied(),
            texcoords: self.texcoords.get(primitive).copied(),
            tangents: self.tangents.get(primitive).copied(),
        }
    }

    /// Adds a piece of a triangle with these attributes, whose corners have these weights in it.
    fn push_piece(&mut self, piece: &[Corner; 3], of: &Attributes) {
        let weights = piece.map(|corner| corner.weights);
        self.positions.push(piece.map(|corner| corner.position));
        self.normals.extend(of.normals.map(|normals| weights.map(|weights| mix(normals, weights))));
        self.colors.extend(of.colors.map(|colors| weights.map(|weights| mix(colors, weights))));
        self.texcoords.extend(
            of.texcoords
                .map(|sets| weights.map(|weights| [0, 1].map(|set| mix(sets.map(|corner| corner[set]), weights)))),
        );
        self.tangents.extend(of.tangents.map(|tangents| {
            // The sign is the same at all corners.
            weights.map(|weights| mix(tangents, weights).truncate().extend(tangents[0].w))
        }));
    }

    /// Puts the last triangle of another soup in the place of a triangle, but for its material and flags.
    fn replace_with_last(&mut self, primitive: usize, from: &mut Soup) {
        fn last<T>(to: &mut [T], primitive: usize, from: &mut Vec<T>) {
            if let Some(value) = from.pop() {
                to[primitive] = value;
            }
        }
        last(&mut self.positions, primitive, &mut from.positions);
        last(&mut self.normals, primitive, &mut from.normals);
        last(&mut self.colors, primitive, &mut from.colors);
        last(&mut self.texcoords, primitive, &mut from.texcoords);
        last(&mut self.tangents, primitive, &mut from.tangents);
    }

    /// Puts the triangles of another soup behind the first `at`.
    fn insert(&mut self, at: usize, from: Soup) {
        fn insert<T>(to: &mut Vec<T>, at: usize, from: Vec<T>) {
            if !from.is_empty() {
                to.splice(at..at, from);
            }
        }
        insert(&mut self.positions, at, from.positions);
        insert(&mut self.materials, at, from.materials);
        insert(&mut self.flags, at, from.flags);
        insert(&mut self.normals, at, from.normals);
        insert(&mut self.colors, at, from.colors);
        insert(&mut self.texcoords, at, from.texcoords);
        insert(&mut self.tangents, at, from.tangents);
    }

    /// Cuts triangles that reach from near the eye to very far away into pieces that grow with their distance from it, so that f32
    /// errors do too; without gaps. Only what stands in world space is cut,
    /// not the meshes that instances share.
    pub fn dice(&mut self, eye: DVec3) {
        let Some(range) = self.placements.first().filter(|_| self.has_own_part()).map(|_| self.parts[0].clone()) else {
            return;
        };
        let eye = Eye { position: eye, nearest: (self.hi - self.lo).max_element() * NEAREST };
        let cut: Vec<usize> =
            range.clone().into_par_iter().filter(|index| eye.may_cut(&self.positions[*index])).collect();
        let mut added = Soup::default();
        for primitive in cut {
            if added.len() > MOST_PIECES {
                self.warnings.push("approximated: too many triangles reach from near the camera to far away".into());
                break;
            }
            let [a, b, c] = self.positions[primitive];
            let corner = |position, weights| Corner { position, weights };
            let mut pieces = Vec::new();
            dice([corner(a, DVec3::X), corner(b, DVec3::Y), corner(c, DVec3::Z)], &eye, &mut pieces);
            let Some((first, rest)) = pieces.split_first().filter(|(_, rest)| !rest.is_empty()) else { continue };
            let attributes = self.attributes_of(primitive);
            let mut one = Soup::default();
            one.push_piece(first, &attributes);
            self.replace_with_last(primitive, &mut one);
            self.flags[primitive].thin = is_thin(&self.positions[primitive]);
            for piece in rest {
                added.push_piece(piece, &attributes);
                added.materials.push(self.materials[primitive]);
                let thin = is_thin(&piece.map(|corner| corner.position));
                added.flags.push(TriangleFlags { thin, ..self.flags[primitive] });
            }
        }
        // Behind the triangles that stand alone, so that these keep their numbers.
        let count = added.len();
        self.insert(range.end, added);
        self.parts[0].end += count;
        for part in &mut self.parts[1..] {
            *part = part.start + count..part.end + count;
        }
    }
}
