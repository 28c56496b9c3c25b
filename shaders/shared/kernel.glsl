// First include of every kernel: language, contract, workgroup.
//
// A rule for all kernels: no branch and no loop depends on the frame's or the step's values alone. Mesa's software Vulkan puts
// such values into the code and compiles it anew whenever they change, 10 to 40 ms each time. Select instead, or let the
// condition depend on the thread's own data too.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "constants.glsl"
#include "layout.glsl"
#include "features.glsl"
#ifdef PLAIN
// What changes traversal most is left out before SPIR-V is optimised: optimised with it and then specialised without it,
// traversal took 6 % longer; not optimised at all, pipelines took twice as long to make.
#define INSTANCES false
#define RETRACE false
#define MOLLER_TRUMBORE false
#endif
// So are textures and alpha, which make kernels twice as long to compile, where no material has any.
#if defined(PLAIN) || defined(OPAQUE)
#define TEXTURES false
#define NORMAL_MAPS false
#define ALPHA false
#define LAYERS false
#endif
#include "bindings.glsl"
layout(local_size_x = WORKGROUP) in;

/// Pixel samples in the wave: where the back ends of queues lie.
uint samples_in_wave;

/// What every kernel does first: reads what all threads share. As long as nothing has branched, Mesa's software Vulkan reads such a word once; from
/// the first branch on once a thread, twenty instructions instead of two.
void begin() {
    frame = frame_shared;
    step_now = step_now_shared;
    samples_in_wave = step_now.pixels * step_now.samples;
}
