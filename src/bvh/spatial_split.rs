//! Splits of space, which cut triangles in two: Stich, Friedrich and Dietrich, Spatial splits in bounding volume
//! hierarchies, HPG 2009. Worth their build time where long triangles overlap each other's boxes.

use super::references::{cells_per_unit, Box4, Reference};
use glam::{Vec3, Vec4};

/// Most slices of a node's box along each axis, between which planes are tried; fewer where there are few references.
const SLICES: usize = 16;
/// Places where an edge is cut are rounded outward by this, relative to the triangle's coordinates: four roundings of 2⁻²⁴.
const CUT_ERROR: f32 = 2.5e-7;

/// A split and what it costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpatialSplit {
    /// Σ half area · references, of both sides.
    pub cost: f32,
    /// References that the plane cuts.
    pub cut: usize,
    axis: usize,
    slicing: Slicing,
    last_left: usize,
    left: Side,
    right: Side,
}

#[derive(Clone, Copy, Debug)]
struct Side {
    bounds: Box4,
    count: usize,
}

/// Slice of a coordinate along each axis: (coordinate − origin) · scale.
#[derive(Clone, Copy, Debug)]
struct Slicing {
    origin: Vec4,
    scale: Vec4,
    width: Vec4,
    slices: usize,
}

impl Slicing {
    fn over(bounds: &Box4, count: usize) -> Self {
        let slices = (4 + count / 4).min(SLICES);
        let size = bounds.hi - bounds.lo;
        let scale = cells_per_unit(slices, size);
        Self { origin: bounds.lo, scale, width: size / slices as f32, slices }
    }

    fn slices(&self, point: Vec4) -> [usize; 3] {
        let place = (point - self.origin) * self.scale;
        [place.x, place.y, place.z].map(|slice| (slice as i32).clamp(0, self.slices as i32 - 1) as usize)
    }

    /// The plane behind a slice.
    fn plane(&self, axis: usize, slice: usize) -> f32 {
        self.origin[axis] + self.width[axis] * (slice + 1) as f32
    }
}

/// Cuts a reference's box where a plane cuts its triangle.
fn cut(reference: &Box4, triangle: &[Vec3; 3], axis: usize, plane: f32) -> (Box4, Box4) {
    let corners = triangle.map(|corner| corner.extend(0.0));
    let error = corners.iter().fold(Vec4::ZERO, |most, corner| most.max(corner.abs())) * CUT_ERROR;
    let (mut left, mut right) = (Box4::EMPTY, Box4::EMPTY);
    for (start, end) in [(0, 1), (1, 2), (2, 0)].map(|(start, end)| (corners[start], corners[end])) {
        if start[axis] <= plane {
            left = left.with_point(start);
        }
        if start[axis] >= plane {
            right = right.with_point(start);
        }
        if (start[axis] < plane) != (end[axis] < plane) {
            // From the lower end, so that both triangles at an edge are cut at the same place.
            let (low, high) = if start[axis] < end[axis] { (start, end) } else { (end, start) };
            let share = (plane - low[axis]) / (high[axis] - low[axis]);
            let point = low + (high - low) * share;
            let around = Box4 { lo: point - error, hi: point + error };
            left = left.union(&around);
            right = right.union(&around);
        }
    }
    left.hi[axis] = left.hi[axis].min(plane);
    right.lo[axis] = right.lo[axis].max(plane);
    (left.intersection(reference), right.intersection(reference))
}

#[derive(Clone, Copy)]
struct Slice {
    bounds: Box4,
    /// References that begin here.
    begin: usize,
    /// References that end here.
    end: usize,
}

/// The cheapest split of space.
pub(super) fn cheapest(references: &[Reference], bounds: &Box4, triangles: &[[Vec3; 3]]) -> Option<SpatialSplit> {
    let slicing = Slicing::over(bounds, references.len());
    let mut slices = [[Slice { bounds: Box4::EMPTY, begin: 0, end: 0 }; SLICES]; 3];
    for reference in references {
        let whole = reference.bounds();
        let (first, last) = (slicing.slices(whole.lo), slicing.slices(whole.hi));
        for axis in 0..3 {
            let slices = &mut slices[axis];
            let (first, last) = (first[axis], last[axis]);
            slices[first].begin += 1;
            slices[last].end += 1;
            if first == last {
                slices[first].bounds = slices[first].bounds.union(&whole);
            } else {
                let triangle = &triangles[reference.primitive() as usize];
                match axis {
                    0 => slice_triangle::<0>(slices, &slicing, &whole, triangle, first, last),
                    1 => slice_triangle::<1>(slices, &slicing, &whole, triangle, first, last),
                    _ => slice_triangle::<2>(slices, &slicing, &whole, triangle, first, last),
                }
            }
        }
    }
    let mut best: Option<SpatialSplit> = None;
    for (axis, slices) in slices.iter().enumerate().filter(|(axis, _)| slicing.scale[*axis] > 0.0) {
        let mut rights = [Side { bounds: Box4::EMPTY, count: 0 }; SLICES];
        for index in (1..slicing.slices).rev() {
            let right = rights[index];
            let bounds = right.bounds.union(&slices[index].bounds);
            rights[index - 1] = Side { bounds, count: right.count + slices[index].end };
        }
        let mut left = Side { bounds: Box4::EMPTY, count: 0 };
        for index in 0..slicing.slices - 1 {
            left = Side { bounds: left.bounds.union(&slices[index].bounds), count: left.count + slices[index].begin };
            let right = rights[index];
            let cost = left.bounds.half_area() * left.count as f32 + right.bounds.half_area() * right.count as f32;
            let separates = left.count > 0 && right.count > 0;
            if separates && best.is_none_or(|best| cost < best.cost) {
                let cut = left.count + right.count - references.len();
                best = Some(SpatialSplit { cost, cut, axis, slicing, last_left: index, left, right });
            }
        }
    }
    best
}

/// Adds the part of a triangle in each of its slices, within a box, to the slices' boxes. Good enough to estimate costs:
/// rounding is not bounded.
fn slice_triangle<const AXIS: usize>(
    slices: &mut [Slice; SLICES],
    slicing: &Slicing,
    whole: &Box4,
    triangle: &[Vec3; 3],
    first: usize,
    last: usize,
) {
    let along = |point: Vec4| point.to_array()[AXIS];
    let corners = triangle.map(|corner| corner.extend(0.0));
    let mut parts = [Box4::EMPTY; SLICES];
    for corner in corners {
        if along(corner) >= along(whole.lo) && along(corner) <= along(whole.hi) {
            let part = &mut parts[slicing.slices(corner)[AXIS].clamp(first, last)];
            *part = part.with_point(corner);
        }
    }
    for (start, end) in [(0, 1), (1, 2), (2, 0)].map(|(start, end)| (corners[start], corners[end])) {
        let (low, high) = if along(start) < along(end) { (start, end) } else { (end, start) };
        let slope = (high - low) / (along(high) - along(low));
        let mut meet = |plane: f32, left: Option<usize>, right: Option<usize>| {
            if along(low) < plane && plane < along(high) {
                let point = low + slope * (plane - along(low));
                for side in [left, right].into_iter().flatten() {
                    parts[side] = parts[side].with_point(point);
                }
            }
        };
        meet(along(whole.lo), None, Some(first));
        for slice in first..last {
            meet(slicing.plane(AXIS, slice), Some(slice), Some(slice + 1));
        }
        meet(along(whole.hi), Some(last), None);
    }
    for (slice, part) in slices.iter_mut().zip(&parts).take(last + 1).skip(first) {
        slice.bounds = slice.bounds.union(&part.intersection(whole));
    }
}

impl SpatialSplit {
    /// Moves the `count` references at the front of `space` to its two sides, cutting those on the plane or giving them
    /// whole to one side where that is cheaper; the parts that come to be take free space behind. Returns how many are left
    /// of the plane and how many there are now.
    pub fn partition(&self, space: &mut [Reference], count: usize, triangles: &[[Vec3; 3]]) -> (usize, usize) {
        let (mut left, mut right) = (0, count);
        let mut total = count;
        let plane = self.slicing.plane(self.axis, self.last_left);
        // Left of `left`: left of the plane. From `right` on: right of it.
        while left < right {
            let reference = space[left];
            let whole = reference.bounds();
            let first = self.slicing.slices(whole.lo)[self.axis];
            let last = self.slicing.slices(whole.hi)[self.axis];
            let side = if last <= self.last_left {
                Verdict::Left
            } else if first > self.last_left {
                Verdict::Right
            } else {
                self.verdict(&whole, &triangles[reference.primitive() as usize], plane, total < space.len())
            };
            match side {
                Verdict::Left => left += 1,
                Verdict::Right => {
                    right -= 1;
                    space.swap(left, right);
                }
                Verdict::Both(left_part, right_part) => {
                    space[left] = reference.with_bounds(&left_part);
                    space[total] = reference.with_bounds(&right_part);
                    left += 1;
                    total += 1;
                }
            }
        }
        (left, total)
    }

    fn verdict(&self, whole: &Box4, triangle: &[Vec3; 3], plane: f32, has_room: bool) -> Verdict {
        let (left_part, right_part) = cut(whole, triangle, self.axis, plane);
        if left_part.is_empty() {
            return Verdict::Right;
        }
        if right_part.is_empty() {
            return Verdict::Left;
        }
        let (left, right) = (&self.left, &self.right);
        let (left_count, right_count) = (left.count as f32, right.count as f32);
        let both = left.bounds.half_area() * left_count + right.bounds.half_area() * right_count;
        let only_left =
            left.bounds.union(whole).half_area() * left_count + right.bounds.half_area() * (right_count - 1.0);
        let only_right =
            left.bounds.half_area() * (left_count - 1.0) + right.bounds.union(whole).half_area() * right_count;
        if has_room && both < only_left && both < only_right {
            Verdict::Both(left_part, right_part)
        } else if only_left <= only_right {
            Verdict::Left
        } else {
            Verdict::Right
        }
    }
}

/// Where a reference goes.
enum Verdict {
    Left,
    Right,
    Both(Box4, Box4),
}
