#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"

/// One thread a shadow item: if nothing blocks the light, it is added to the item's sample.
void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= queue_items(QUEUE_SHADOW))
        return;
    ShadowItem item = shadow_queue[index];
    if (!any_hit(Ray(item.origin, item.direction), item.distance))
        add_radiance(item.sample_index, item.radiance);
}
