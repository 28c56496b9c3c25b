//! Cameras: where rays start and in which directions they go.

use super::{Scene, Soup};
use crate::error::{Error, Result};
use glam::{DMat4, DVec3};

/// Vertical field of view of cameras that nobody described, 45°.
const DEFAULT_FOV: f64 = std::f64::consts::FRAC_PI_4;

/// How a camera maps the picture to rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Rays through the eye.
    Perspective {
        /// Vertical field of view, radians.
        fov: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the height of the picture, metres.
        half_height: f64,
    },
}

/// A camera, world space. Its axes are unit and orthogonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position.
    pub eye: DVec3,
    /// View direction.
    pub forward: DVec3,
    /// To the right of the picture.
    pub right: DVec3,
    /// To the top of the picture.
    pub up: DVec3,
    /// Perspective or orthographic.
    pub projection: Projection,
}

/// Which camera to use.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum CameraChoice {
    /// The file's first, or one that frames the scene.
    #[default]
    Auto,
    /// The file's, by index or name.
    Named(String),
    /// This one.
    Fixed(Camera),
    /// From `eye` to `target`.
    LookAt {
        /// Position.
        eye: DVec3,
        /// Point in the middle of the picture; the scene's centre if not given.
        target: Option<DVec3>,
    },
    /// At `target + radius·(sin φ sin θ, cos φ, sin φ cos θ)`, looking at it; radius 0 looks outward from the target.
    Orbit {
        /// Degrees about y, from +z towards +x.
        theta: f64,
        /// Degrees from +y.
        phi: f64,
        /// Metres.
        radius: f64,
        /// Point in the middle of the picture; the scene's centre if not given.
        target: Option<DVec3>,
    },
}

impl Camera {
    /// A camera at `eye` that looks along `forward`.
    ///
    /// # Errors
    /// `Usage` when a vector is zero or not finite, or `forward` is parallel to `up`.
    pub fn looking(eye: DVec3, forward: DVec3, up: DVec3, projection: Projection) -> Result<Self> {
        let bad = |why: &str| Error::Usage(format!("camera at {eye}: {why}"));
        if !eye.is_finite() {
            return Err(Error::Usage("the camera's position is not finite".into()));
        }
        let forward =
            forward.try_normalize().ok_or_else(|| bad("it does not look anywhere (eye and target coincide)"))?;
        let up_hint = up.try_normalize().ok_or_else(|| bad("its up vector has no direction"))?;
        let right = forward.cross(up_hint);
        if right.length() < 1e-9 {
            return Err(bad("its view direction is parallel to its up vector; give another --up"));
        }
        let right = right.normalize();
        Ok(Self { eye, forward, right, up: right.cross(forward), projection })
    }

    /// A camera of a glTF node: at its origin, looking along −z, y up.
    pub fn of_node(world_from_node: &DMat4, projection: Projection) -> Result<Self> {
        let axis = |v| world_from_node.transform_vector3(v);
        let eye = world_from_node.transform_point3(DVec3::ZERO);
        Self::looking(eye, axis(DVec3::NEG_Z), axis(DVec3::Y), projection)
    }

    /// Right and up, as long as half the picture at distance 1 (perspective) or everywhere (orthographic).
    pub fn half_axes(&self, aspect: f64) -> (DVec3, DVec3) {
        let half_height = match self.projection {
            Projection::Perspective { fov } => (fov / 2.0).tan(),
            Projection::Orthographic { half_height } => half_height,
        };
        (self.right * half_height * aspect, self.up * half_height)
    }

    fn framing(bounds: Option<(DVec3, DVec3)>, up: DVec3, aspect: f64, fov: f64) -> Result<Self> {
        let (lo, hi) = bounds.unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
        let (center, radius) = ((lo + hi) / 2.0, ((hi - lo).length() / 2.0).max(f64::MIN_POSITIVE));
        let narrow = fov.min(2.0 * ((fov / 2.0).tan() * aspect).atan());
        let distance = radius / (narrow / 2.0).sin();
        orbit(30.0, 70.0, distance, center, up, Projection::Perspective { fov })
    }
}

fn orbit(theta: f64, phi: f64, radius: f64, target: DVec3, up: DVec3, projection: Projection) -> Result<Camera> {
    let (theta, phi) = (theta.to_radians(), phi.to_radians());
    let outward = DVec3::new(phi.sin() * theta.sin(), phi.cos(), phi.sin() * theta.cos());
    Camera::looking(target + radius * outward, -outward, up, projection)
}

impl CameraChoice {
    /// The camera depends on where the scene's triangles are, so that it would follow them through a sequence.
    pub fn frames(&self, scene: &Scene) -> bool {
        match self {
            Self::Auto => scene.cameras.is_empty(),
            Self::LookAt { target, .. } | Self::Orbit { target, .. } => target.is_none(),
            Self::Named(_) | Self::Fixed(_) => false,
        }
    }
}

impl Scene {
    /// The camera that `choice` means, for a picture of this scene and its `soup`, of `aspect` = width / height. `up` is used where the choice has no
    /// up of its own; `fov` (radians, vertical) replaces any perspective camera's.
    ///
    /// # Errors
    /// `Usage` when there is no such camera or it cannot look at anything.
    pub fn camera(
        &self,
        soup: &Soup,
        choice: &CameraChoice,
        up: DVec3,
        fov: Option<f64>,
        aspect: f64,
    ) -> Result<Camera> {
        let perspective = Projection::Perspective { fov: fov.unwrap_or(DEFAULT_FOV) };
        let bounds = soup.bounds();
        let center = || bounds.map_or(DVec3::ZERO, |(lo, hi)| (lo + hi) / 2.0);
        let mut camera = match choice {
            CameraChoice::Auto => match self.cameras.first() {
                Some((_, camera)) => *camera,
                None => Camera::framing(bounds, up, aspect, fov.unwrap_or(DEFAULT_FOV))?,
            },
            CameraChoice::Named(name) => self.named_camera(name)?,
            CameraChoice::Fixed(camera) => *camera,
            CameraChoice::LookAt { eye, target } => {
                Camera::looking(*eye, target.unwrap_or_else(center) - *eye, up, perspective)?
            }
            CameraChoice::Orbit { theta, phi, radius, target } => {
                orbit(*theta, *phi, *radius, target.unwrap_or_else(center), up, perspective)?
            }
        };
        if let (Projection::Perspective { .. }, Some(fov)) = (camera.projection, fov) {
            camera.projection = Projection::Perspective { fov };
        }
        Ok(camera)
    }

    fn named_camera(&self, name: &str) -> Result<Camera> {
        let by_index = name.parse::<usize>().ok().and_then(|index| self.cameras.get(index));
        let found = by_index.or_else(|| self.cameras.iter().find(|(own, _)| own == name));
        found.map(|(_, camera)| *camera).ok_or_else(|| {
            let names = self.cameras.iter().enumerate().map(|(index, (own, _))| format!("{index} '{own}'"));
            let names = names.collect::<Vec<_>>().join(", ");
            let there_is = if names.is_empty() { "it has none".into() } else { format!("it has {names}") };
            Error::Usage(format!("{}: no camera '{name}'; {there_is}", self.name))
        })
    }
}
