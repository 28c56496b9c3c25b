#version 460
#include "shared/kernel.glsl"
#include "shared/batch.glsl"

/// One thread a queue: nothing of it is taken yet. What was filled in becomes ready, counted, and turned into indirect dispatch
/// arguments; filling starts anew.
void main() {
    begin();
    uint queue = gl_GlobalInvocationID.x;
    if (queue >= QUEUES)
        return;
    uint line = COUNTER_LINE * queue;
    counters[COUNTER_TAKEN + line] = 0u;
    if ((step_now.queues & (1u << queue)) == 0u)
        return;
    uint front = counters[COUNTER_FILLING + line];
    uint items = front + counters[COUNTER_FILLING_BACK + line];
    counters[COUNTER_FILLING + line] = 0u;
    counters[COUNTER_FILLING_BACK + line] = 0u;
    counters[COUNTER_READY + queue] = items;
    counters[COUNTER_READY_FRONT + queue] = front;
    counters[COUNTER_TOTAL + queue] += items;
    // What is traced again has a thread each.
    uint each = queue < QUEUE_PRIMARY_AGAIN ? items_a_thread(items) : 1u;
    dispatches[queue] = Dispatch(workgroups_for(items, each), 1u, 1u);
}
