//! What host and device share, generated from `shaders/shared/{constants,layout,bindings,features}.glsl` by `build.rs`.
//!
//! Structs are `#[repr(C)]` with 4-byte members only, which is exactly GLSL's scalar block layout. Holds no logic.

// Used by build.rs and by the tests.
#[allow(dead_code)]
pub mod translate;

#[allow(clippy::excessive_precision)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
    include!(concat!(env!("OUT_DIR"), "/layout.rs"));
}
pub use generated::*;

/// Features as specialization constants.
mod generated_features {
    include!(concat!(env!("OUT_DIR"), "/features.rs"));
}
pub use generated_features::Features;

impl Features {
    /// Rays go on after a hit: reflected, or behind a surface.
    pub fn rays_go_on(&self) -> bool {
        self.reflections || self.layers
    }

    /// Names and values of what a scene may need: all but the variant of a kernel and safeguards that are off.
    pub fn needs(&self) -> impl Iterator<Item = (&'static str, bool)> {
        const OTHERS: [&str; 4] = ["retrace", "fixed_epsilon", "moller_trumbore", "plain_sums"];
        self.list().into_iter().filter(|(name, _)| !OTHERS.contains(name))
    }
}

/// Descriptor slots.
pub mod binding {
    use super::{Binding, BindingKind};
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

/// SPIR-V of every kernel, in both ways of fetching.
pub mod kernels {
    use super::{KernelCode, SpirV};
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}

/// How the device reaches a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// Read-only `uvec4` texels: a storage texel buffer on software Vulkan, a storage buffer elsewhere.
    Fetch,
    /// A storage buffer.
    Storage,
    /// A uniform buffer.
    Uniform,
}

/// One line of `bindings.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Descriptor slot in set 0.
    pub slot: u32,
    /// Name in the shaders.
    pub name: &'static str,
    /// How it is reached.
    pub kind: BindingKind,
    /// The slot whose buffer this one shows, if it has none of its own.
    pub view_of: Option<u32>,
}

/// One kernel, compiled.
#[derive(Clone, Copy, Debug)]
pub struct KernelCode {
    /// File name without `.comp`: also the pass, its timing row and its debug label.
    pub name: &'static str,
    /// SPIR-V that fetches from texel buffers.
    pub texel_fetch: SpirV,
    /// SPIR-V that fetches from storage buffers.
    pub storage_fetch: SpirV,
}

/// SPIR-V of a kernel in three variants.
#[derive(Clone, Copy, Debug)]
pub struct SpirV {
    /// Without instances, textures, alpha, tracing again and other triangle tests, whatever its specialization constants say.
    pub plain: &'static [u8],
    /// Without textures and alpha.
    pub opaque: &'static [u8],
    /// With everything.
    pub full: &'static [u8],
}

impl SpirV {
    /// The smallest variant that has these features.
    pub fn with(&self, features: Features) -> &'static [u8] {
        let Features { instances, retrace, moller_trumbore, textures, alpha, layers, .. } = features;
        match (textures || alpha || layers, instances || retrace || moller_trumbore) {
            (true, _) => self.full,
            (false, true) => self.opaque,
            (false, false) => self.plain,
        }
    }
}
