// Last include of a kernel that works on a queue: its main. The kernel says where its items are counted, `WAITING`, and what is done for one,
// `work(index, place)`: its place in the queue that it came from, and, of an item that is traced again, its index in the retrace queue, too.
//
// Persistent threads (Aila and Laine, HPG 2009): the threads of a subgroup take a batch of items from a counter, as many side by side
// as they are, and work on one after the other. What all share is read once a batch; and who is faster takes more, where software Vulkan
// gives each of its threads a fixed part of the workgroups and waits for the slowest.
#include "batch.glsl"

void main() {
    begin();
    // What is traced again stays where its walk is kept: a place in the retrace queue a thread.
    bool is_first = WAITING == QUEUE_PRIMARY_AGAIN && !RETRACE;
    uint items = is_first ? samples_in_wave : counters[COUNTER_READY + WAITING];
    uint front = is_first ? samples_in_wave : counters[COUNTER_READY_FRONT + WAITING];
    uvec4 lanes = subgroupBallot(true);
    uint side_by_side = subgroupBallotBitCount(lanes);
    uint each = items_a_thread(items);
    uint first = 0u;
    if (!RETRACE && subgroupElect())
        first = atomicAdd(counters[COUNTER_TAKEN + COUNTER_LINE * WAITING], side_by_side * each);
    first = subgroupBroadcastFirst(first);
    uint index = RETRACE ? gl_GlobalInvocationID.x : first + subgroupBallotExclusiveBitCount(lanes);
    uint end = min(RETRACE ? index + 1u : first + side_by_side * each, items);
    do {
        if (index < end)
            work(index, RETRACE ? retrace_queue[index] : index < front ? index : samples_in_wave - 1u - (index - front));
        index += side_by_side;
    } while (index < end && index != NO_ITEM);
    // Never by itself, see is_complete in traverse.glsl.
    if (index < end)
        atomicAdd(counters[COUNTER_CUT], 1u);
}
