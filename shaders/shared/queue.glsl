// Queues: an array of items and counters. A pass fills a queue; `prepare` then makes what was filled ready for the pass that
// works on it, and the queue may be filled again from its start once that pass is done. One pixel sample has at most one item
// in each queue at a time, so a queue as long as the samples in flight cannot overflow, what a sample carries along lies at its
// own place, and adding to its radiance needs no atomics.

/// Takes the next free place of a queue: one atomic operation a subgroup.
uint queue_append(uint queue) {
    uvec4 lanes = subgroupBallot(true);
    uint first = 0u;
    if (subgroupElect())
        first = atomicAdd(counters[COUNTER_FILLING + queue], subgroupBallotBitCount(lanes));
    return subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(lanes);
}

/// The item of this thread, or NO_ITEM when there are fewer. Traced again, it is the one that overflowed.
const uint NO_ITEM = 0xffffffffu;
uint queue_item(uint queue) {
    uint index = gl_GlobalInvocationID.x;
    if (index >= counters[COUNTER_READY + (RETRACE ? QUEUE_RETRACE : queue)])
        return NO_ITEM;
    return RETRACE ? retrace_queue[index] : index;
}

/// Adds light to a pixel sample; the caller holds the sample's only item.
void add_radiance(uint sample_index, vec3 added) {
    radiance[sample_index].rgb = FETCH_FLOATS(radiances, sample_index).rgb + added;
}
