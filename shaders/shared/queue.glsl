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

/// Leaves a ray of this pass, with its place in the queue that it came from, to be traced again.
void trace_again(uint place, uint pass) {
    atomicOr(counters[COUNTER_AGAIN], pass);
    retrace_queue[queue_append(QUEUE_RETRACE)] = place;
}

/// Workgroups that stay neighbours when the grid is interleaved: no divisor or multiple of the tiles in a row of common widths.
const uint STRETCH = 24u;

/// The number of this thread. Stretches of workgroups take even places first, then odd ones: software Vulkan gives each of its
/// threads one contiguous part of the grid, and so all get their share of every part of the picture. Neighbours in a stretch
/// meet the same nodes, and caches still hold them: interleaved one by one, shadow rays took 10 % longer.
uint interleaved_thread() {
    uint stretches = gl_NumWorkGroups.x / STRETCH;
    uint half_count = (stretches + 1u) / 2u;
    uint own = gl_WorkGroupID.x / STRETCH;
    uint place = own < half_count ? 2u * own : 2u * (own - half_count) + 1u;
    // What does not fill a stretch stays where it is.
    uint stretch = own < stretches ? place : own;
    return (stretch * STRETCH + gl_WorkGroupID.x % STRETCH) * WORKGROUP + gl_LocalInvocationIndex;
}

/// The item of a thread, or NO_ITEM when there are fewer. Traced again, it is the one that overflowed.
const uint NO_ITEM = 0xffffffffu;
uint queue_item(uint index, uint queue) {
    if (index >= counters[COUNTER_READY + (RETRACE ? QUEUE_RETRACE : queue)])
        return NO_ITEM;
    return RETRACE ? retrace_queue[index] : index;
}

/// Adds light to a pixel sample; the caller holds the sample's only item.
void add_radiance(uint sample_index, vec3 added) {
    radiance[sample_index].rgb = FETCH_FLOATS(radiances, sample_index).rgb + added;
}

/// Adds to a pixel sample's alpha: of what is still clear, the share that something covers.
void add_coverage(uint sample_index, float covered) {
    float before = FETCH_FLOATS(radiances, sample_index).a;
    radiance[sample_index].a = before + (1.0 - before) * covered;
}
