//! A ray and a triangle in f64: for what judges and counts the device's answers, on the host.

use glam::DVec3;

/// Where a line crosses a triangle's plane. Not finite where it runs along it.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Barycentric coordinate of the second corner.
    pub u: f64,
    /// Of the third.
    pub v: f64,
    /// Distance from the ray's origin, in lengths of its direction.
    pub t: f64,
    /// Six times the volume that the direction and the edges span: positive where the ray comes to the front.
    pub determinant: f64,
}

impl Crossing {
    /// Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 2(1) 1997.
    pub fn of([a, b, c]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Self {
        let (edge_b, edge_c, from_a) = (*b - *a, *c - *a, origin - *a);
        let across = direction.cross(edge_c);
        let determinant = edge_b.dot(across);
        let around = from_a.cross(edge_b);
        Self {
            u: from_a.dot(across) / determinant,
            v: direction.dot(around) / determinant,
            t: edge_c.dot(around) / determinant,
            determinant,
        }
    }

    /// Whether the ray meets the triangle, its edges included, in front of its origin.
    pub fn is_hit(&self) -> bool {
        self.u >= 0.0 && self.v >= 0.0 && self.u + self.v <= 1.0 && self.t > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_met_where_it_is() {
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 4.0];
        let to = |x, y| Crossing::of(&corners, DVec3::new(x, y, 6.0), DVec3::NEG_Z * 2.0);
        let met = to(0.5, 1.0);
        assert_eq!((met.u, met.v, met.t), (0.25, 0.25, 3.0));
        assert!(met.is_hit() && met.determinant > 0.0);
        assert!(to(0.0, 4.0).is_hit());
        assert!(![to(-0.1, 1.0), to(1.0, -0.1), to(1.1, 2.1)].iter().any(Crossing::is_hit));
        // From behind, away from it, and along it.
        let meets = |origin, direction| Crossing::of(&corners, origin, direction);
        let behind = meets(DVec3::new(0.5, 1.0, -1.0), DVec3::Z);
        assert!(behind.is_hit() && behind.determinant < 0.0);
        assert!(!meets(DVec3::new(0.5, 1.0, -1.0), DVec3::NEG_Z).is_hit());
        assert!(!meets(DVec3::new(-1.0, 1.0, 0.0), DVec3::X).is_hit());
    }
}
