#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/texture.glsl"
#include "shared/alpha.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"
#include "shared/light.glsl"
#include "shared/way.glsl"

const uint WAITING = RETRACE ? QUEUE_REFLECTION_AGAIN : QUEUE_REFLECTION;

/// A ray that was reflected or goes on behind a surface: nearest hit → hit queue, or background.
void work(uint index, uint place) {
    RayItem item = ray_item(FETCH(reflection_items, place * ITEM_TEXELS), FETCH(reflection_items, place * ITEM_TEXELS + 1u));
    Hit hit = hit_so_far(index, item.distance);
    if (!traverse(Ray(item.origin, item.direction), false, hit))
        trace_again(place, QUEUE_REFLECTION_AGAIN);
    else if (is_last_part(index, hit)) {
        vec4 left = FETCH_FLOATS(throughputs, item.sample_index);
        Way way = way_of(left.w);
        if (hit.triangle != NO_TRIANGLE) {
            if (TEXTURES)
                throughput[item.sample_index].w = word_of(Way(way.travelled + hit.t, way.mirrors));
            append_hit(HitItem(item.sample_index, hit.triangle, hit.barycentrics, item.direction, hit.instance));
        } else {
            add_radiance(item.sample_index, left.rgb * background(item.direction));
            if (LAYERS && way.mirrors == 0u)
                add_coverage(item.sample_index, frame.background_alpha);
        }
    }
}

#include "shared/main.glsl"
