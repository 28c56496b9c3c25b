#version 460
#include "shared/kernel.glsl"

/// One thread a queue: what was filled in becomes ready, counted, and turned into indirect dispatch arguments; filling starts
/// anew.
void main() {
    begin();
    uint queue = gl_GlobalInvocationID.x;
    if (queue >= QUEUES)
        return;
    bool is_filled = (step_now.queues & (1u << queue)) != 0u;
    uint filling = counters[COUNTER_FILLING + queue];
    uint items = is_filled ? filling : counters[COUNTER_READY + queue];
    counters[COUNTER_FILLING + queue] = filling - (is_filled ? items : 0u);
    counters[COUNTER_READY + queue] = items;
    counters[COUNTER_TOTAL + queue] += is_filled ? items : 0u;
    dispatches[queue] = Dispatch((items + WORKGROUP - 1u) / WORKGROUP, 1u, 1u);
}
