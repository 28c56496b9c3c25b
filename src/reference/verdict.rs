//! Is an answer of another program allowed by f64 arithmetic?

use crate::scene::{Crossing, Soup};
use glam::DVec3;
use rayon::prelude::*;

/// How far beside an edge a ray may pass and still be said to hit or to miss: eight units in the last place of an f32, of
/// the largest coordinate of the scene or the ray. Programs that round positions cannot tell more.
const EDGE: f64 = 8.0 / 16_777_216.0;
/// Tolerance of distances, of the larger of the distance and 1.
const DISTANCE: f64 = 1e-3;

/// Whether `met` can be the answer to a ray up to `t_max`: `None` for nothing hit, `Some(None)` for something hit,
/// `Some(Some(t))` for the nearest hit at distance t. Near an edge both hit and miss are allowed.
pub fn allows(soup: &Soup, origin: DVec3, direction: DVec3, t_max: f64, met: Option<Option<f64>>) -> bool {
    let size = [origin, soup.lo, soup.hi].iter().fold(0.0_f64, |size, point| size.max(point.abs().max_element()));
    let edge = EDGE * size;
    // Distance, its tolerance, and how far inside the nearest edge, of whatever the ray hits or nearly hits.
    let candidates: Vec<(f64, f64, f64)> = soup
        .positions
        .par_iter()
        .filter_map(|corners @ [a, b, c]| {
            let (edge_b, edge_c) = (*b - *a, *c - *a);
            let Crossing { u, v, t, determinant } = Crossing::of(corners, origin, direction);
            // As seen along the ray, each barycentric coordinate times the height above its edge.
            let height = |edge: DVec3| determinant.abs() / edge.cross(direction).length() / direction.length();
            let least = (u * height(edge_c)).min(v * height(edge_b)).min((1.0 - u - v) * height(edge_c - edge_b));
            // A plane moved by the tolerance of positions is met earlier or later, the more so the more it is grazed.
            let cosine = determinant.abs() / edge_b.cross(edge_c).length() / direction.length();
            let tolerance = DISTANCE * t.abs().max(1.0) + edge / cosine;
            (least >= -edge && t > -tolerance && t < t_max + tolerance).then_some((t, tolerance, least))
        })
        .collect();
    let sure_before = |limit: f64| {
        candidates.iter().any(|(t, tolerance, least)| *least > edge && t - tolerance > 0.0 && t + tolerance < limit)
    };
    match met {
        None => !sure_before(t_max),
        Some(None) => !candidates.is_empty(),
        Some(Some(t)) => {
            let is_there = candidates.iter().any(|(own, tolerance, _)| (own - t).abs() <= *tolerance);
            is_there && !sure_before(t)
        }
    }
}
