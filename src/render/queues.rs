//! What the host knows of the device's queues: shaders/shared/queue.glsl and batch.glsl.

use crate::layout::{
    COUNTERS, COUNTER_CUT, COUNTER_FILLING, COUNTER_FILLING_BACK, COUNTER_LINE, COUNTER_LOST, COUNTER_READY,
    COUNTER_READY_FRONT, COUNTER_TAKEN, COUNTER_TOTAL, ITEMS_FOR_EACH, MOST_A_THREAD, QUEUES, WORKGROUP,
};
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

// Lines and parts of the counters do not overlap.
const _: () = {
    let all = COUNTER_LINE * QUEUES;
    assert!(COUNTER_FILLING_BACK == COUNTER_FILLING + all && COUNTER_TAKEN == COUNTER_FILLING_BACK + all);
    assert!(COUNTER_READY == COUNTER_TAKEN + all && COUNTER_READY_FRONT == COUNTER_READY + QUEUES);
    assert!(COUNTER_TOTAL == COUNTER_READY_FRONT + QUEUES && COUNTER_LOST == COUNTER_TOTAL + QUEUES);
    assert!(COUNTER_CUT == COUNTER_LOST + 1 && COUNTERS == COUNTER_CUT + 1);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_workgroups_for_all_items_and_never_more_than_a_driver_must_allow() {
        let most_items = 65_535 * WORKGROUP;
        let edges = (0..=70).flat_map(|each| (ITEMS_FOR_EACH * each).saturating_sub(2)..ITEMS_FOR_EACH * each + 3);
        for items in edges.chain((0..most_items).step_by(9_973)).chain([most_items]) {
            for most in [1, 4, MOST_A_THREAD] {
                let each = (items / ITEMS_FOR_EACH).clamp(1, most);
                let groups = workgroups_for(items, most);
                assert!(groups * WORKGROUP * each >= items, "{items} items, {each} a thread: {groups}");
                assert!(groups <= 65_535, "{items} items, {each} a thread: {groups}");
                // Where a thread takes one, its number says which.
                assert!(each > 1 || groups == items.div_ceil(WORKGROUP), "{items} items: {groups}");
            }
        }
    }
}
