// Every buffer that a kernel can see, once; build.rs makes the descriptor set layout from these lines.
// A FETCH buffer holds uvec4 texels read through FETCH(name, i): a uniform texel buffer, which software Vulkan reads 1.5 to
// 1.9 times faster, or a storage buffer where the device's texel buffers are too small. A kernel is compiled for both.
#ifdef FETCH_FROM_STORAGE
#define FETCH_BUFFER(slot, name) layout(set = 0, binding = slot, std430) readonly buffer name##_block { uvec4 name[]; };
#define FETCH(name, index) name[index]
#else
#define FETCH_BUFFER(slot, name) layout(set = 0, binding = slot) uniform usamplerBuffer name;
#define FETCH(name, index) texelFetch(name, int(index))
#endif
#define STORAGE_BUFFER(slot, type, name) layout(set = 0, binding = slot, scalar) buffer name##_block { type name[]; };
#define UNIFORM_BUFFER(slot, type, name) layout(set = 0, binding = slot, scalar) uniform name##_block { type name; };
#define PUSH_CONSTANTS(type, name) layout(push_constant, scalar) uniform name##_block { type name; };

/// Tree: NODE_TEXELS a node, one child record each: six u16 (lo.xyz, hi.xyz) on the grid, then the child's reference.
FETCH_BUFFER(0, nodes)
/// Triangles in leaf order: three positions as float bits; w = primitive, material, TRIANGLE_ flags.
FETCH_BUFFER(1, triangles)
/// Vertex normals by primitive: three vectors as float bits.
FETCH_BUFFER(2, normals)
/// Vertex colours by primitive: three linear RGB as float bits.
FETCH_BUFFER(3, colors)
/// Camera, picture, background, grid.
UNIFORM_BUFFER(4, Frame, frame)
/// Materials.
STORAGE_BUFFER(5, Material, materials)
/// Lights.
STORAGE_BUFFER(6, Light, lights)
/// Hits to shade.
STORAGE_BUFFER(7, HitItem, hit_queue)
/// Shadow rays to trace.
STORAGE_BUFFER(8, ShadowItem, shadow_queue)
/// Reflected rays to trace.
STORAGE_BUFFER(9, ReflectionItem, reflection_queue)
/// Counts of the queues' items; lost rays.
STORAGE_BUFFER(10, uint, counters)
/// Arguments of the indirect dispatches, one a queue.
STORAGE_BUFFER(11, Dispatch, dispatches)
/// Radiance of each pixel sample in flight, alpha = coverage.
STORAGE_BUFFER(12, vec4, radiance)
/// Sum, at the end mean, of each pixel's samples in the band.
STORAGE_BUFFER(13, vec4, film)

PUSH_CONSTANTS(Step, step_now)
