//! Lights as KHR_lights_punctual has them.

use glam::{DMat4, DVec3};

/// How light leaves a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// In all directions from the position.
    Point,
    /// In a cone from the position along the direction, falling off between the two half-angles.
    Spot {
        /// Cosine of the half-angle at which the falloff begins.
        inner_cosine: f64,
        /// Cosine of the half-angle at which no light is left.
        outer_cosine: f64,
    },
    /// Parallel, along the direction, from infinitely far.
    Directional,
}

/// A light, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// How light leaves it.
    pub kind: LightKind,
    /// Where it is; unused for directional.
    pub position: DVec3,
    /// Unit direction in which light travels; unused for point.
    pub direction: DVec3,
    /// Colour times intensity: candela, or lux for directional. Linear RGB.
    pub intensity: DVec3,
    /// Distance at which it has faded to nothing, if it does.
    pub range: Option<f64>,
}

impl Light {
    /// A point light of some candela.
    pub fn point(position: DVec3, intensity: DVec3) -> Self {
        Self { kind: LightKind::Point, position, direction: DVec3::NEG_Z, intensity, range: None }
    }

    /// Parallel light of some lux, travelling along `direction`.
    pub fn directional(direction: DVec3, intensity: DVec3) -> Self {
        let direction = direction.normalize();
        Self { kind: LightKind::Directional, position: DVec3::ZERO, direction, intensity, range: None }
    }

    /// The light with its node's transform applied: it sits at the node's origin and shines along its −z; scale does not
    /// change its strength.
    pub fn placed(mut self, world_from_node: &DMat4) -> Self {
        self.position = world_from_node.transform_point3(DVec3::ZERO);
        self.direction = world_from_node.transform_vector3(DVec3::NEG_Z).try_normalize().unwrap_or(DVec3::NEG_Z);
        self
    }

    /// No light comes from it.
    pub fn is_dark(&self) -> bool {
        self.intensity.max_element() <= 0.0
    }
}
