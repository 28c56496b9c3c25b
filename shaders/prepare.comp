#version 460
#include "shared/kernel.glsl"
#include "shared/batch.glsl"

/// One thread a queue: what was filled in becomes ready, counted, and turned into indirect dispatch arguments; filling starts
/// anew.
void main() {
    begin();
    uint queue = gl_GlobalInvocationID.x;
    if (queue >= QUEUES)
        return;
    bool is_filled = (step_now.queues & (1u << queue)) != 0u;
    uint line = COUNTER_LINE * queue;
    uint filled_front = counters[COUNTER_FILLING + line];
    uint filled_back = counters[COUNTER_FILLING_BACK + line];
    uint items = is_filled ? filled_front + filled_back : counters[COUNTER_READY + queue];
    counters[COUNTER_FILLING + line] = is_filled ? 0u : filled_front;
    counters[COUNTER_FILLING_BACK + line] = is_filled ? 0u : filled_back;
    counters[COUNTER_TAKEN + line] = 0u;
    counters[COUNTER_READY + queue] = items;
    counters[COUNTER_READY_FRONT + queue] = is_filled ? filled_front : counters[COUNTER_READY_FRONT + queue];
    counters[COUNTER_TOTAL + queue] += is_filled ? items : 0u;
    // What is traced again has a thread each.
    uint each = queue < QUEUE_PRIMARY_AGAIN ? items_a_thread(items) : 1u;
    dispatches[queue] = Dispatch(workgroups_for(items, each), 1u, 1u);
}
