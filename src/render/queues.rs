//! What the host knows of the device's queues: shaders/shared/queue.glsl and batch.glsl.

use crate::layout::{COUNTER_FILLING, COUNTER_FILLING_BACK, COUNTER_LINE, ITEMS_FOR_EACH, MOST_A_THREAD, WORKGROUP};
use crate::vulkan::DeviceKind;

/// The counter of what waits at the front of a queue that is being filled.
pub(super) fn filling(queue: u32) -> usize {
    (COUNTER_FILLING + COUNTER_LINE * queue) as usize
}

/// Likewise at its back.
pub(super) fn filling_back(queue: u32) -> usize {
    (COUNTER_FILLING_BACK + COUNTER_LINE * queue) as usize
}

/// Most items that a thread works on one after the other: many on a processor, which reads once for all of them what they share. Other devices
/// want more threads than a picture has rays.
pub(super) fn most_a_thread(kind: DeviceKind) -> u32 {
    if kind == DeviceKind::Cpu {
        MOST_A_THREAD
    } else {
        1
    }
}

/// Workgroups for so many camera rays; for what waits in queues `prepare` says the same.
pub(super) fn workgroups_for(samples: u32, most_a_thread: u32) -> u32 {
    let each = (samples / ITEMS_FOR_EACH).clamp(1, most_a_thread);
    let needed = samples.div_ceil(WORKGROUP * each);
    needed + if each > 1 { needed.div_ceil(4) } else { 0 }
}
