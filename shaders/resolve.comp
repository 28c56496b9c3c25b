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
    vec4 sum = mix(FETCH_FLOATS(film_so_far, pixel), vec4(0.0), bvec4(step_now.first_sample == 0u));
    // A bound of this thread, not of the dispatch: see kernel.glsl.
    uint samples = min(step_now.samples, ~pixel);
    for (uint i = 0u; i < samples; i++)
        sum += FETCH_FLOATS(radiances, pixel * step_now.samples + i);
    film[pixel] = sum / (step_now.finish != 0u ? float(frame.samples) : 1.0);
}
