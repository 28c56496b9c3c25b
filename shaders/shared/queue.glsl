// Queues: an array of items and counters. A pass fills a queue; `prepare` then makes what was filled ready for the pass that
// works on it, and the queue may be filled again from its start once that pass is done. One pixel sample has at most one item
// in each queue at a time, so a queue as long as the samples in flight cannot overflow, what a sample carries along lies at its
// own place, and adding to its radiance needs no atomics. Only the queues of rays to be traced again may get more, in a wave that is worth nothing:
// no pass empties one before the host knows that it is filled.

/// Takes the next free place of a queue: one atomic operation a subgroup.
uint queue_append(uint queue) {
    uvec4 lanes = subgroupBallot(true);
    uint first = 0u;
    if (gl_SubgroupInvocationID == subgroupBallotFindLSB(lanes))
        first = atomicAdd(counters[COUNTER_FILLING + queue], subgroupBallotBitCount(lanes));
    return subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(lanes);
}

// Items are written as whole texels: of a struct, and of a part of a vector, software Vulkan writes member by member, each in a loop over
// the threads.

void append_hit(HitItem item) {
    uint texel = queue_append(QUEUE_HIT) * ITEM_TEXELS;
    hit_queue[texel] = uvec4(item.sample_index, item.triangle, floatBitsToUint(item.barycentrics));
    hit_queue[texel + 1u] = uvec4(floatBitsToUint(item.direction), item.instance);
}

void append_shadow_ray(RayItem item) {
    uint texel = queue_append(QUEUE_SHADOW) * ITEM_TEXELS;
    shadow_queue[texel] = uvec4(floatBitsToUint(item.origin), item.sample_index);
    shadow_queue[texel + 1u] = floatBitsToUint(vec4(item.direction, item.distance));
}

void append_reflection_ray(RayItem item) {
    uint texel = queue_append(QUEUE_REFLECTION) * ITEM_TEXELS;
    reflection_queue[texel] = uvec4(floatBitsToUint(item.origin), item.sample_index);
    reflection_queue[texel + 1u] = floatBitsToUint(vec4(item.direction, item.distance));
}

/// Leaves a ray, by its place in the queue that it came from, to be traced again. So few are that each takes its own place: to take
/// one for all of a subgroup costs instructions where no ray is left, too.
void trace_again(uint place, uint queue) {
    uint own = atomicAdd(counters[COUNTER_FILLING + queue], 1u);
    if (own < uint(retrace_queue.length()))
        retrace_queue[own] = place;
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

/// The item of a thread, or NO_ITEM when there are fewer. Traced again, it is the place of the one that was left.
const uint NO_ITEM = 0xffffffffu;
uint queue_item(uint index, uint queue) {
    if (index >= counters[COUNTER_READY + queue])
        return NO_ITEM;
    return RETRACE ? retrace_queue[index] : index;
}

/// Adds light to a pixel sample; the caller holds the sample's only item.
void add_radiance(uint sample_index, vec3 added) {
    vec4 before = FETCH_FLOATS(radiances, sample_index);
    radiance[sample_index] = vec4(before.rgb + added, before.a);
}

/// Adds to a pixel sample's alpha: of what is still clear, the share that something covers.
void add_coverage(uint sample_index, float covered) {
    float before = FETCH_FLOATS(radiances, sample_index).a;
    radiance[sample_index].a = before + (1.0 - before) * covered;
}
