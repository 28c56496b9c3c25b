// Every buffer that a kernel can see, once; build.rs makes the descriptor set layout from these lines.
// A FETCH buffer holds uvec4 texels read through FETCH(name, i): on software Vulkan a storage texel buffer, which it reads twice as
// fast as a storage buffer and, because it does not call a function for it, faster than a uniform texel buffer; elsewhere
// a storage buffer. A kernel is compiled for both. That a texel's number has 27 bits spares software Vulkan an instruction for each thread's
// address, which it would extend by its sign otherwise: in all a twentieth of a node's visit.
// A FETCH_VIEW shows a storage buffer that an earlier pass wrote in the same way.
#ifdef FETCH_FROM_STORAGE
#define FETCH_BUFFER(slot, name) layout(set = 0, binding = slot, std430) readonly buffer name##_block { uvec4 name[]; };
#define FETCH(name, index) name[index]
#else
#define FETCH_BUFFER(slot, name) layout(set = 0, binding = slot, rgba32ui) uniform readonly restrict uimageBuffer name;
#define FETCH(name, index) imageLoad(name, int((index) & 0x7ffffffu))
#endif
#define FETCH_VIEW(slot, name, of) FETCH_BUFFER(slot, name)
// A texel as floats.
#define FETCH_FLOATS(name, index) uintBitsToFloat(FETCH(name, index))
#define STORAGE_BUFFER(slot, type, name) layout(set = 0, binding = slot, scalar) buffer name##_block { type name[]; };
// What all threads share is a variable that `begin` (kernel.glsl) reads.
#define UNIFORM_BUFFER(slot, type, name) layout(set = 0, binding = slot, scalar) uniform name##_block { type name##_shared; }; type name;
#define PUSH_CONSTANTS(type, name) layout(push_constant, scalar) uniform name##_block { type name##_shared; }; type name;

/// Tree: NODE_TEXELS a node: its four children's boxes on the grid (src/bvh/quantise.rs) along x, along y, along z, and their references.
FETCH_BUFFER(0, nodes)
/// Triangles in leaf order: three positions as float bits; w = primitive; material and TRIANGLE_ flags; precedence.
FETCH_BUFFER(1, triangles)
/// By primitive, as float bits: three vertex normals; from frame.first_color on three linear RGBA colours; from frame.first_texcoord on two
/// sets of texture coordinates at three corners; from frame.first_tangent on three tangents, w = sign of the bitangent.
FETCH_BUFFER(2, attributes)
/// Materials, MATERIAL_TEXELS each: a Material and a Look.
FETCH_BUFFER(3, materials)
/// Lights, LIGHT_TEXELS each.
FETCH_BUFFER(4, lights)
/// Instances, INSTANCE_TEXELS each, in the order of the upper tree's leaves.
FETCH_BUFFER(5, instances)
/// Textures, TEXTURE_TEXELS each.
FETCH_BUFFER(6, textures)
/// Pixels of all levels of all textures, row by row: four of 8 bits or two of 16 bits a channel in a texel.
FETCH_BUFFER(7, pixels)
/// Camera, picture, background, grid.
UNIFORM_BUFFER(8, Frame, frame)
/// Hits to shade: a HitItem in ITEM_TEXELS.
STORAGE_BUFFER(9, uvec4, hit_queue)
/// The same, to be read.
FETCH_VIEW(10, hit_items, hit_queue)
/// Shadow rays to trace: a RayItem in ITEM_TEXELS.
STORAGE_BUFFER(11, uvec4, shadow_queue)
/// The same, to be read.
FETCH_VIEW(12, shadow_items, shadow_queue)
/// Reflected rays to trace, likewise.
STORAGE_BUFFER(13, uvec4, reflection_queue)
/// The same, to be read.
FETCH_VIEW(14, reflection_items, reflection_queue)
/// Rays to trace again: pixel samples, or places in the queue that they came from.
STORAGE_BUFFER(15, uint, retrace_queue)
/// Counts of what waits in queues and what is taken; of rays that are lost, and threads that were cut short.
STORAGE_BUFFER(16, uint, counters)
/// Arguments of the indirect dispatches, one a queue.
STORAGE_BUFFER(17, Dispatch, dispatches)
/// What each pixel sample's shadow ray adds if nothing blocks it.
STORAGE_BUFFER(18, vec4, shadow_radiance)
/// The same, to be read.
FETCH_VIEW(19, shadow_radiances, shadow_radiance)
/// What is left on each pixel sample's way of what arrives at its end; w = Way, see way.glsl.
STORAGE_BUFFER(20, vec4, throughput)
/// The same, to be read.
FETCH_VIEW(21, throughputs, throughput)
/// Radiance of each pixel sample in flight, alpha = coverage.
STORAGE_BUFFER(22, vec4, radiance)
/// The same, to be read; what another thread of the same pass adds is not seen.
FETCH_VIEW(23, radiances, radiance)
/// Sum, at the end mean, of each pixel's samples in the band.
STORAGE_BUFFER(24, vec4, film)
/// The same, to be read.
FETCH_VIEW(25, film_so_far, film)
/// What rounding took from each pixel's sum, with the sum of the weights; with LAYERS a texel for its alpha, too.
STORAGE_BUFFER(26, vec4, film_rest)
/// The same, to be read.
FETCH_VIEW(27, film_rest_so_far, film_rest)
/// Offsets from the pixel's centre at which FILTER_STEPS equal parts of a filter's weight end: this one's and the next one's.
FETCH_BUFFER(28, filter_steps)
/// Tracing again subtree by subtree: what each ray in the retrace queue has hit so far, PARTIAL_HIT_TEXELS each.
STORAGE_BUFFER(29, uvec4, partial_hits)

PUSH_CONSTANTS(Step, step_now)
