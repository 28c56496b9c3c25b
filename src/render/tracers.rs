//! The kernels that trace rays, and their variants that trace again what those could not.

use super::Renderer;
use crate::error::Result;
use crate::layout::{kernels, Features, KernelCode, QUEUE_PRIMARY_AGAIN, QUEUE_REFLECTION_AGAIN, QUEUE_SHADOW_AGAIN};
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

/// Queues of rays to be traced again, and the kernels whose variants do it.
const QUEUES: [(u32, &KernelCode); 3] = [
    (QUEUE_PRIMARY_AGAIN, &kernels::PRIMARY),
    (QUEUE_SHADOW_AGAIN, &kernels::SHADOW),
    (QUEUE_REFLECTION_AGAIN, &kernels::REFLECTION),
];

/// Variants that trace again, each made when rays are first left to it: few scenes need one.
#[derive(Default)]
pub(super) struct Again {
    kernels: [Option<Arc<Kernel>>; QUEUES.len()],
}

impl Again {
    /// The queues.
    pub const QUEUES: [u32; QUEUES.len()] = [QUEUES[0].0, QUEUES[1].0, QUEUES[2].0];

    /// Makes the kernel of a queue.
    pub fn make(&mut self, renderer: &Renderer, queue: u32, features: Features) -> Result<()> {
        let features = Features { retrace: true, ..features };
        for (own, (_, code)) in self.kernels.iter_mut().zip(QUEUES).filter(|(_, (own, _))| *own == queue) {
            *own = Some(renderer.kernel(code, features)?);
        }
        Ok(())
    }

    /// Whether no ray is traced again.
    pub fn is_empty(&self) -> bool {
        self.kernels.iter().all(Option::is_none)
    }

    /// The kernel of a queue.
    pub fn kernel(&self, queue: u32) -> Option<&Arc<Kernel>> {
        self.kernels.iter().zip(QUEUES).find(|(_, (own, _))| *own == queue).and_then(|(kernel, _)| kernel.as_ref())
    }
}
