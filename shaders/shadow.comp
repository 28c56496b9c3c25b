#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/texture.glsl"
#include "shared/alpha.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"

/// One thread a shadow ray: what it carries is added to its sample, as far as nothing blocks it.
void main() {
    begin();
    uint thread = interleaved_thread();
    uint index = queue_item(thread, RETRACE ? QUEUE_SHADOW_AGAIN : QUEUE_SHADOW);
    if (index == NO_ITEM)
        return;
    RayItem item = ray_item(FETCH(shadow_items, index * ITEM_TEXELS), FETCH(shadow_items, index * ITEM_TEXELS + 1u));
    Hit hit = hit_so_far(thread, item.distance);
    if (!traverse(Ray(item.origin, item.direction), true, hit)) {
        trace_again(index, QUEUE_SHADOW_AGAIN);
        return;
    }
    if (!is_last_part(thread, hit))
        return;
    if (hit.triangle == NO_TRIANGLE)
        add_radiance(item.sample_index, FETCH_FLOATS(shadow_radiances, item.sample_index).rgb * hit.passed);
}
