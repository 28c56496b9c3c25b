// Last include of a kernel that works on a queue: its main. The kernel says where its items are counted, `WAITING`, and what is done for one,
// `work(index, place)`: its place in the queue that it came from, and, of an item that is traced again, its index in the retrace queue, too.
//
// Batches, as persistent threads take them (Aila and Laine, HPG 2009): the threads of a subgroup take a batch of items from a counter, as many side by
// side as they are, and work on one after the other. What all share is read once a batch; and who is faster takes more, where software Vulkan
// gives each of its threads a fixed part of the workgroups and waits for the slowest. A subgroup takes one batch and ends, as the driver does not allow
// more rounds: the dispatch must have subgroups enough, and has some to spare (batch.glsl). Where a thread takes one item it needs no counter.
#include "batch.glsl"

void main() {
    begin();
    bool is_first = WAITING == QUEUE_PRIMARY_AGAIN && !RETRACE;
    uint items = is_first ? samples_in_wave : counters[COUNTER_READY + WAITING];
    uint front = is_first ? samples_in_wave : counters[COUNTER_READY_FRONT + WAITING];
    uvec4 lanes = subgroupBallot(true);
    uint side_by_side = subgroupBallotBitCount(lanes);
    // What is traced again stays where its walk is kept: a place in the retrace queue a thread.
    uint each = RETRACE ? 1u : items_a_thread(items);
    uint first = 0u;
    if (each > 1u && subgroupElect())
        first = atomicAdd(counters[COUNTER_TAKEN + COUNTER_LINE * WAITING], side_by_side * each);
    first = subgroupBroadcastFirst(first);
    uint index = each > 1u ? first + subgroupBallotExclusiveBitCount(lanes) : gl_GlobalInvocationID.x;
    uint end = min(each > 1u ? first + side_by_side * each : index + 1u, items);
    do {
        if (index < end)
            work(index, RETRACE ? retrace_queue[index] : index < front ? index : samples_in_wave - 1u - (index - front));
        index += side_by_side;
    } while (index < end && index != NO_ITEM);
    // Whether all of them had the rounds that they needed: a thread that has none left makes one of this loop. See is_complete in traverse.glsl.
    uint rounds = 0u;
    do {
        rounds++;
    } while (rounds <= side_by_side && rounds != NO_ITEM);
    if (each > 1u && rounds <= side_by_side)
        atomicAdd(counters[COUNTER_CUT], 1u);
}
