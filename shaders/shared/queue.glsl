// Queues: an array of items and counters. A pass fills a queue; `prepare` then makes what was filled ready for the pass that
// works on it, and the queue may be filled again from its start once that pass is done. One pixel sample has at most one item in each queue at a time, so a queue as
// long as the samples in flight cannot overflow, and adding to a sample's radiance needs no atomics.

/// Takes the next free place of a queue.
uint queue_append(uint queue) {
    return atomicAdd(counters[COUNTER_FILLING + queue], 1u);
}

/// Items to work on.
uint queue_items(uint queue) {
    return counters[COUNTER_READY + queue];
}

/// Adds light to a pixel sample; the caller holds the sample's only item.
void add_radiance(uint sample_index, vec3 added) {
    radiance[sample_index].rgb += added;
}
