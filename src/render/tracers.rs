//! The kernels that trace rays, and their variants that trace again what those could not.

use super::Renderer;
use crate::error::Result;
use crate::layout::{kernels, Features, KernelCode, QUEUE_PRIMARY_AGAIN, QUEUE_REFLECTION_AGAIN, QUEUE_SHADOW_AGAIN};
use crate::vulkan::{Compiled, Kernel};
use std::sync::Arc;

/// The kernels that trace rays, as far as the frame has such rays.
#[derive(Clone)]
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
    /// Those that were compiled ahead.
    pub compiled: Compiled,
}

impl Kernels {
    /// Makes them.
    pub fn new(renderer: &Renderer, features: Features) -> Result<Self> {
        let shadow = features.shadows.then_some(&kernels::SHADOW);
        let reflection = features.rays_go_on().then_some(&kernels::REFLECTION);
        let always = [&kernels::PRIMARY, &kernels::SHADE, &kernels::RESOLVE];
        let all: Vec<_> = always.into_iter().chain(shadow).chain(reflection).collect();
        let compiled = renderer.make_kernels(&all, features)?;
        let kernel = |code| renderer.kernel(code, features);
        Ok(Self {
            trace: Tracers {
                primary: kernel(&kernels::PRIMARY)?,
                shadow: shadow.map(kernel).transpose()?,
                reflection: reflection.map(kernel).transpose()?,
            },
            prepare: renderer.prepare.clone(),
            shade: kernel(&kernels::SHADE)?,
            resolve: kernel(&kernels::RESOLVE)?,
            compiled,
        })
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

    /// Makes the kernels of some queues.
    pub fn make(&mut self, renderer: &Renderer, queues: &[u32], features: Features) -> Result<()> {
        let features = Features { retrace: true, ..features };
        let codes = QUEUES.iter().filter(|(queue, _)| queues.contains(queue)).map(|(_, code)| *code);
        renderer.make_kernels(&codes.collect::<Vec<_>>(), features)?;
        for (own, (_, code)) in self.kernels.iter_mut().zip(QUEUES).filter(|(_, (queue, _))| queues.contains(queue)) {
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
