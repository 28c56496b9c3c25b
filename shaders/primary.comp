#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/random.glsl"
#include "shared/filter.glsl"
#include "shared/texture.glsl"
#include "shared/alpha.glsl"
#include "shared/intersect.glsl"
#include "shared/traverse.glsl"
#include "shared/light.glsl"
#include "shared/pixel.glsl"

/// The ray through a point of the picture, in pixels from the upper left corner.
Ray camera_ray(vec2 point) {
    vec2 plane = vec2(point.x / float(frame.width) * 2.0 - 1.0, 1.0 - point.y / float(frame.height) * 2.0);
    vec3 offset = frame.right * plane.x + frame.up * plane.y;
    float parallel = float(frame.orthographic);
    return Ray(frame.eye + parallel * offset, normalize(frame.forward + (1.0 - parallel) * offset));
}

/// Camera rays wait in no queue, but are counted with those that are traced again.
const uint WAITING = QUEUE_PRIMARY_AGAIN;

/// A pixel sample: camera ray → nearest hit → hit queue, or background. What a hit's sample begins with, shade writes.
void work(uint index, uint sample_index) {
    uint pixel = sample_index;
    uint sample_of_wave = 0u;
    if (MULTISAMPLING) {
        uvec2 divided = divide(sample_index, step_now.samples);
        pixel = divided.x;
        sample_of_wave = divided.y;
    }
    uvec2 place = pixel_place(step_now.first_pixel + pixel);
    if (place.x < frame.width && place.y < frame.height) {
        vec2 inside = vec2(0.5);
        if (MULTISAMPLING) {
            vec2 point = sample_position(place.y * frame.width + place.x, step_now.first_sample + sample_of_wave);
            if (FILTER)
                point = filtered(point);
            inside = mix(inside, point, bvec2(frame.samples > 1u));
        }
        Ray ray = camera_ray(vec2(place) + inside);
        Hit hit = hit_so_far(index, FAR);
        if (!traverse(ray, false, hit))
            trace_again(sample_index, QUEUE_PRIMARY_AGAIN);
        else if (is_last_part(index, hit)) {
            if (hit.triangle != NO_TRIANGLE)
                append_hit(HitItem(sample_index, hit.triangle, hit.barycentrics, ray.direction, hit.instance));
            else
                radiance[sample_index] = vec4(background(ray.direction), frame.background_alpha);
        }
    }
}

#include "shared/main.glsl"
