#version 460
#include "shared/kernel.glsl"
#include "shared/pixel.glsl"

/// One thread a pixel of the band: its samples of this wave are added to the film in their order, whatever the size of
/// the waves, so that the sum is always the same; at the end it becomes the mean.
void main() {
    uint pixel = gl_GlobalInvocationID.x;
    // Rays that nobody has traced again: the host runs the wave once more.
    bool is_incomplete = counters[COUNTER_FILLING + QUEUE_RETRACE] != 0u;
    if (pixel >= step_now.pixels || is_incomplete)
        return;
    uvec2 place = pixel_place(step_now.first_pixel + pixel);
    if (place.x >= frame.width || place.y >= frame.height)
        return;
    vec4 sum = step_now.first_sample == 0u ? vec4(0.0) : film[pixel];
    for (uint i = 0u; i < step_now.samples; i++)
        sum += radiance[pixel * step_now.samples + i];
    film[pixel] = step_now.finish != 0u ? sum / float(frame.samples) : sum;
}
