// Queues: an array of items and counters. A pass fills a queue; `prepare` then makes what was filled ready for the pass that
// works on it, and the queue may be filled again once that pass is done. One pixel sample has at most one item
// in each queue at a time, so a queue as long as the samples in flight cannot overflow, what a sample carries along lies at its
// own place, and adding to its radiance needs no atomics. Only the queues of rays to be traced again may get more, in a wave that is worth nothing:
// no pass empties one before the host knows that it is filled.

/// Takes the next free place of a queue: one atomic operation a subgroup. A queue is filled from both ends, by either half of the workgroups:
/// software Vulkan gives each half to other threads, which would wait for each other at one counter.
uint queue_append(uint queue) {
    uvec4 lanes = subgroupBallot(true);
    bool back = gl_WorkGroupID.x >= gl_NumWorkGroups.x / 2u;
    uint counter = (back ? COUNTER_FILLING_BACK : COUNTER_FILLING) + COUNTER_LINE * queue;
    uint first = 0u;
    if (gl_SubgroupInvocationID == subgroupBallotFindLSB(lanes))
        first = atomicAdd(counters[counter], subgroupBallotBitCount(lanes));
    uint own = subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(lanes);
    return back ? samples_in_wave - 1u - own : own;
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
    uint own = atomicAdd(counters[COUNTER_FILLING + COUNTER_LINE * queue], 1u);
    if (own < uint(retrace_queue.length()))
        retrace_queue[own] = place;
}

/// A number that no item has.
const uint NO_ITEM = 0x7fffffffu;

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
