//! Boxes around points, in f64.

use glam::DVec3;
use rayon::prelude::*;

/// Lower and upper corner of the box around points; infinite where there are none.
pub(crate) fn bounds_of(points: &[DVec3]) -> (DVec3, DVec3) {
    let none = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let with_point = |(lo, hi): (DVec3, DVec3), point: &DVec3| (lo.min(*point), hi.max(*point));
    let both = |(lo, hi): (DVec3, DVec3), other: (DVec3, DVec3)| (lo.min(other.0), hi.max(other.1));
    points.par_iter().fold(none, with_point).reduce(none, both)
}

/// The eight corners of a box.
pub(crate) fn box_corners(lo: DVec3, hi: DVec3) -> [DVec3; 8] {
    let pick = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
    std::array::from_fn(|corner| DVec3::new(pick(corner, 0), pick(corner, 1), pick(corner, 2)))
}
