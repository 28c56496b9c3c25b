//! The kernels that trace rays, and their variants that trace again what those could not.

use super::Renderer;
use crate::error::Result;
use crate::layout::{kernels, Features, KernelCode, AGAIN_PRIMARY, AGAIN_REFLECTION, AGAIN_SHADOW};
use crate::vulkan::Kernel;
use std::sync::Arc;

/// The kernels that trace rays, as far as the frame has such rays.
pub(super) struct Tracers {
    pub primary: Arc<Kernel>,
    pub shadow: Option<Arc<Kernel>>,
    pub reflection: Option<Arc<Kernel>>,
}

/// All kernels of a frame.
pub(super) struct Kernels {
    pub trace: Tracers,
    pub prepare: Arc<Kernel>,
    pub shade: Arc<Kernel>,
    pub resolve: Arc<Kernel>,
}

impl Kernels {
    /// Makes them side by side.
    pub fn new(renderer: &Renderer, features: Features) -> Result<Self> {
        let kernel = |code| renderer.kernel(code, features);
        let (trace, rest) = rayon::join(
            || -> Result<_> {
                Ok(Tracers {
                    primary: kernel(&kernels::PRIMARY)?,
                    shadow: features.shadows.then(|| kernel(&kernels::SHADOW)).transpose()?,
                    reflection: features.rays_go_on().then(|| kernel(&kernels::REFLECTION)).transpose()?,
                })
            },
            || -> Result<_> { Ok([kernel(&kernels::PREPARE)?, kernel(&kernels::SHADE)?, kernel(&kernels::RESOLVE)?]) },
        );
        let [prepare, shade, resolve] = rest?;
        Ok(Self { trace: trace?, prepare, shade, resolve })
    }
}

/// A pass that traces rays, and its kernel.
const PASSES: [(u32, &KernelCode); 3] =
    [(AGAIN_PRIMARY, &kernels::PRIMARY), (AGAIN_SHADOW, &kernels::SHADOW), (AGAIN_REFLECTION, &kernels::REFLECTION)];

/// Variants that trace again, each made when a pass first leaves rays to it: few scenes need one.
#[derive(Default)]
pub(super) struct Again {
    kernels: [Option<Arc<Kernel>>; PASSES.len()],
}

impl Again {
    /// Makes the kernels of these passes, as bits; those that are there stay.
    pub fn make(&mut self, renderer: &Renderer, passes: u32, features: Features) -> Result<()> {
        let features = Features { retrace: true, ..features };
        for (own, (pass, code)) in self.kernels.iter_mut().zip(PASSES) {
            if passes & pass != 0 && own.is_none() {
                *own = Some(renderer.kernel(code, features)?);
            }
        }
        Ok(())
    }

    /// The passes whose rays are traced again, as bits.
    pub fn passes(&self) -> u32 {
        self.kernels.iter().zip(PASSES).filter(|(own, _)| own.is_some()).map(|(_, (pass, _))| pass).sum()
    }

    /// The kernel of a pass.
    pub fn kernel(&self, pass: u32) -> Option<&Arc<Kernel>> {
        self.kernels.iter().zip(PASSES).find(|(_, (own, _))| *own == pass).and_then(|(kernel, _)| kernel.as_ref())
    }
}
