#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"
#include "shared/light.glsl"

/// One thread a reflected ray: nearest hit → hit queue, or background.
void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= queue_items(QUEUE_REFLECTION))
        return;
    ReflectionItem item = reflection_queue[index];
    Hit hit = nearest_hit(Ray(item.origin, item.direction));
    if (hit.triangle == NO_TRIANGLE) {
        add_radiance(item.sample_index, item.throughput * background(item.direction));
        return;
    }
    hit_queue[queue_append(QUEUE_HIT)] =
        HitItem(item.sample_index, hit.triangle, hit.barycentrics, item.direction, item.throughput);
}
