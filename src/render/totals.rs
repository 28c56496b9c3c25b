//! What the waves of a frame took, for its report.

use super::tracers::Again;
use super::Plan;
use crate::layout::{COUNTER_TOTAL, QUEUES, QUEUE_HIT, QUEUE_REFLECTION, QUEUE_SHADOW};
use crate::report;
use crate::scene::View;

/// What a frame tells besides its pixels.
pub(super) struct Outcome {
    pub passes: Vec<report::Pass>,
    pub rays: report::Rays,
    pub queue_bytes: u64,
}

/// Sums over waves.
pub(super) struct Totals {
    passes: Vec<report::Pass>,
    /// Items that each queue has had.
    queued: [u64; QUEUES as usize],
    /// Samples of each pixel.
    samples: u64,
    /// Waves of each pixel.
    waves: u64,
}

impl Totals {
    pub fn new(plan: &Plan) -> Self {
        let pass = |planned: &super::PlannedPass| report::Pass { name: planned.name, ..Default::default() };
        Self { passes: plan.passes.iter().map(pass).collect(), queued: [0; QUEUES as usize], samples: 0, waves: 0 }
    }

    /// So many samples of each pixel, of which a wave took at most so many.
    pub fn add_samples(&mut self, count: u32, wave_samples: u32) {
        self.samples += u64::from(count);
        self.waves += u64::from(count.div_ceil(wave_samples));
    }

    pub fn add_times(&mut self, times: &[(&'static str, f64)]) {
        for (name, ms) in times {
            if !self.passes.iter().any(|pass| pass.name == *name) {
                self.passes.push(report::Pass { name, ..Default::default() });
            }
            if let Some(pass) = self.passes.iter_mut().find(|pass| pass.name == *name) {
                pass.dispatches += 1;
                pass.ms += ms;
            }
        }
    }

    pub fn add_counters(&mut self, counters: &[u32]) {
        for (queue, total) in self.queued.iter_mut().enumerate() {
            *total += u64::from(counters[COUNTER_TOTAL as usize + queue]);
        }
    }

    pub fn outcome(&self, view: &View, plan: &Plan) -> Outcome {
        let mut passes = self.passes.clone();
        let pixels = u64::from(view.width) * u64::from(view.height);
        let primary = pixels * self.samples;
        let queued = |queue: u32| self.queued[queue as usize];
        let (shadow, reflection) = (queued(QUEUE_SHADOW), queued(QUEUE_REFLECTION));
        for pass in &mut passes {
            pass.items = match pass.name {
                "primary" => primary,
                "shade" => self.queued[QUEUE_HIT as usize] * u64::from(plan.lights),
                "shadow" => shadow,
                "reflection" => reflection,
                "retrace" => Again::QUEUES.into_iter().map(queued).sum(),
                "resolve" => pixels * self.waves,
                _ => pass.dispatches,
            };
        }
        let rays = report::Rays { primary, shadow, reflection };
        Outcome { passes, rays, queue_bytes: plan.queue_bytes() }
    }
}
