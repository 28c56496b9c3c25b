#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/texture.glsl"
#include "shared/alpha.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"

const uint WAITING = RETRACE ? QUEUE_SHADOW_AGAIN : QUEUE_SHADOW;

/// A shadow ray: what it carries is added to its sample, as far as nothing blocks it.
void work(uint index, uint place) {
    RayItem item = ray_item(FETCH(shadow_items, place * ITEM_TEXELS), FETCH(shadow_items, place * ITEM_TEXELS + 1u));
    Hit hit = hit_so_far(index, item.distance);
    if (!traverse(Ray(item.origin, item.direction), true, hit))
        trace_again(place, QUEUE_SHADOW_AGAIN);
    else if (is_last_part(index, hit) && hit.triangle == NO_TRIANGLE)
        add_radiance(item.sample_index, FETCH_FLOATS(shadow_radiances, item.sample_index).rgb * hit.passed);
}

#include "shared/main.glsl"
