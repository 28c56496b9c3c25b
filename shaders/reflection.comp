#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"
#include "shared/light.glsl"

/// One thread a reflected ray: nearest hit → hit queue, or background.
void main() {
    uint thread = interleaved_thread();
    uint index = queue_item(thread, QUEUE_REFLECTION);
    if (index == NO_ITEM)
        return;
    RayItem item = ray_item(FETCH(reflection_items, index * ITEM_TEXELS), FETCH(reflection_items, index * ITEM_TEXELS + 1u));
    Hit hit = hit_so_far(thread, item.distance);
    if (!traverse(Ray(item.origin, item.direction), false, hit)) {
        retrace_queue[queue_append(QUEUE_RETRACE)] = index;
        return;
    }
    if (!is_last_part(thread, hit))
        return;
    if (hit.triangle != NO_TRIANGLE) {
        hit_queue[queue_append(QUEUE_HIT)] =
            HitItem(item.sample_index, hit.triangle, hit.barycentrics, item.direction, hit.instance);
    } else {
        vec3 factor = FETCH_FLOATS(throughputs, item.sample_index).rgb;
        add_radiance(item.sample_index, factor * background(item.direction));
    }
}
