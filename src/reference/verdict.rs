//! Is an answer of another program allowed by f64 arithmetic?

use crate::scene::Soup;
use glam::DVec3;
use rayon::prelude::*;

/// How far, in barycentric coordinates, a ray may pass beside an edge and still be said to hit or to miss.
const EDGE: f64 = 1e-4;
/// Relative tolerance of distances.
const DISTANCE: f64 = 1e-3;

/// Whether `met` can be the answer to a ray up to `t_max`: `None` for nothing hit, `Some(None)` for something hit,
/// `Some(Some(t))` for the nearest hit at distance t. Near an edge both hit and miss are allowed.
pub fn allows(soup: &Soup, origin: DVec3, direction: DVec3, t_max: f64, met: Option<Option<f64>>) -> bool {
    // Distance and least barycentric coordinate of whatever the ray hits or nearly hits.
    let candidates: Vec<(f64, f64)> = soup
        .positions
        .par_iter()
        .filter_map(|[a, b, c]| {
            let (edge_b, edge_c) = (*b - *a, *c - *a);
            let across = direction.cross(edge_c);
            let determinant = edge_b.dot(across);
            let from_a = origin - *a;
            let (u, around) = (from_a.dot(across) / determinant, from_a.cross(edge_b));
            let (v, t) = (direction.dot(around) / determinant, edge_c.dot(around) / determinant);
            let least = u.min(v).min(1.0 - u - v);
            (least >= -EDGE && t > 0.0 && t < t_max * (1.0 + DISTANCE)).then_some((t, least))
        })
        .collect();
    let sure_before = |limit: f64| candidates.iter().any(|(t, least)| *least > EDGE && *t < limit * (1.0 - DISTANCE));
    match met {
        None => !sure_before(t_max),
        Some(None) => !candidates.is_empty(),
        Some(Some(t)) => {
            let is_there = candidates.iter().any(|(own, _)| (own - t).abs() <= DISTANCE * t.abs().max(1.0));
            is_there && !sure_before(t)
        }
    }
}
