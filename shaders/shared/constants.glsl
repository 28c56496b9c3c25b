// THE CONTRACT, its constants: numbers that host and device share. build.rs translates this file to Rust (src/layout); a line that it does not
// understand is a build error.

/// Invocations in a workgroup of every kernel: one 8 × 8 tile of pixels.
const uint WORKGROUP = 64u;
/// Pixels along a side of a tile. Pixels are numbered tile by tile, row by row, in Morton order inside a tile.
const uint TILE = 8u;
/// Hard bound on the depth of the tree, binary or wide: the builder keeps it, the traversal's array stack relies on it.
const uint MAX_TREE_DEPTH = 64u;
/// Most triangles in a leaf that its 32-bit reference can name.
const uint MAX_LEAF_TRIANGLES = 14u;
/// In place of a leaf's number of triangles: it is an instance.
const uint LEAF_IS_INSTANCE = 15u;
/// Quanta from the grid's edge to its middle: the boxes of the tree lie on a grid, see src/bvh/quantise.rs.
const float GRID_MIDDLE = 131072.0;
/// Parts of a quantum that middles of boxes are counted in.
const float GRID_PARTS = 16384.0;
/// How far the last bits of an axis are shifted to be bits of a float, the box's reach.
const uint REACH_SHIFT = 14u;
/// Where they are then.
const uint REACH_MASK = 0x0fffc000u;
/// The float's other bits: its exponent's first ones.
const uint REACH_EXPONENT = 0x30000000u;
/// Quanta that a box whose reach is 1 reaches to either side.
const float GRID_REACH = 65536.0;
/// Texels (16 bytes) in one tree node: its four children's boxes along x, along y and along z, and their references.
const uint NODE_TEXELS = 4u;
/// Texels in one triangle of the traversal, and in one triangle's normals, colours, texture coordinates or tangents.
const uint TRIANGLE_TEXELS = 3u;
/// Texels in a Material and the Look behind it.
const uint MATERIAL_TEXELS = 13u;
/// The first of a Look's among them.
const uint LOOK_TEXEL = 6u;
/// Texels in a Texture.
const uint TEXTURE_TEXELS = 7u;
/// Texels in a Light.
const uint LIGHT_TEXELS = 4u;
/// Texels in an Instance.
const uint INSTANCE_TEXELS = 8u;
/// Texels in a HitItem or a RayItem.
const uint ITEM_TEXELS = 2u;
/// Texels in what a ray that is traced again has hit so far.
const uint PARTIAL_HIT_TEXELS = 2u;

/// Added to the precedence of a triangle whose back is hit; its own is below.
const uint PRECEDENCE_BACK = 0x80000000u;
/// The last bit of a triangle's precedence: its longest edge is at least 32 times as long as it is high.
const uint PRECEDENCE_THIN = 1u;
/// Bits of a triangle's material word below its flags.
const uint MATERIAL_BITS = 28u;
/// Triangle flag: it is not opaque everywhere.
const uint TRIANGLE_SEE_THROUGH = 0x10000000u;
/// Triangle flag: only the front face (counter-clockwise) is seen by camera and reflection rays.
const uint TRIANGLE_SINGLE_SIDED = 0x20000000u;
/// Triangle flag: it has vertex normals.
const uint TRIANGLE_SMOOTH = 0x40000000u;
/// Triangle flag: it has vertex colours.
const uint TRIANGLE_COLORED = 0x80000000u;

/// Queue of hits that wait to be shaded.
const uint QUEUE_HIT = 0u;
/// Queue of lights that wait for their shadow ray.
const uint QUEUE_SHADOW = 1u;
/// Queue of reflected rays that wait to be traced.
const uint QUEUE_REFLECTION = 2u;
/// Queue of camera rays whose walk is to be done again: it overflowed its stack, or could not tell whether it hits. It shares its array with the next two.
const uint QUEUE_PRIMARY_AGAIN = 3u;
/// Queue of such shadow rays.
const uint QUEUE_SHADOW_AGAIN = 4u;
/// Queue of such reflected rays.
const uint QUEUE_REFLECTION_AGAIN = 5u;
/// Number of queues.
const uint QUEUES = 6u;
/// Counters from one queue to the next where threads count at the same time: a cache line of its own for each, which processors would otherwise
/// take from each other.
const uint COUNTER_LINE = 16u;
/// First counter of the items that wait at the front of each queue while it is being filled.
const uint COUNTER_FILLING = 0u;
/// Likewise at its back.
const uint COUNTER_FILLING_BACK = 96u;
/// First counter of the items of each queue that threads have taken; of camera rays it is that of the queue of those that are traced again.
const uint COUNTER_TAKEN = 192u;
/// First counter of the items that the pass which empties each queue works on.
const uint COUNTER_READY = 288u;
/// First counter of those among them that wait at the front.
const uint COUNTER_READY_FRONT = 294u;
/// First counter of the items that each queue has had in all.
const uint COUNTER_TOTAL = 300u;
/// Counter of rays whose second traversal was cut short too.
const uint COUNTER_LOST = 306u;
/// Counter of threads that the driver did not allow enough rounds for their batch.
const uint COUNTER_CUT = 307u;
/// Number of counters.
const uint COUNTERS = 308u;

/// Most items that a thread takes one after the other, on a device where that pays.
const uint MOST_A_THREAD = 64u;
/// Items for each that a thread takes: so that there are at least 64 workgroups to be shared by a processor's threads.
const uint ITEMS_FOR_EACH = 4096u;

/// Steps of the table that a filter's sample positions are read from.
const uint FILTER_STEPS = 1024u;

/// Light kind: all directions from a point.
const uint LIGHT_POINT = 0u;
/// Light kind: a cone from a point.
const uint LIGHT_SPOT = 1u;
/// Light kind: parallel light from infinitely far.
const uint LIGHT_DIRECTIONAL = 2u;

/// Radiance that reaches a surface from everywhere, as a share of its base colour.
const float AMBIENT_SHARE = 0.15;
/// Roughness from which on nothing is mirrored.
const float MIRROR_END_ROUGHNESS = 0.5;

/// Alpha mode: opaque.
const uint ALPHA_OPAQUE = 0u;
/// Alpha mode: there, or not there.
const uint ALPHA_MASK = 1u;
/// Alpha mode: the share that is there.
const uint ALPHA_BLEND = 2u;
/// Most surfaces that a ray goes through, one behind the other; what is behind the last one is taken for the background.
const uint MAX_LAYERS = 32u;

/// Bits of Texture.flags: how it goes on beyond its left and right edges.
const uint TEXTURE_WRAP_U = 3u;
/// Beyond its upper and lower edges, two bits further.
const uint TEXTURE_WRAP_V = 12u;
/// Value of those bits: turned round. 0 is repeated.
const uint WRAP_MIRROR = 1u;
/// Value of those bits: its outermost pixels.
const uint WRAP_CLAMP = 2u;
/// The nearest pixel where pixels are large.
const uint TEXTURE_MAGNIFY_NEAREST = 0x10u;
/// The nearest pixel where pixels are small.
const uint TEXTURE_MINIFY_NEAREST = 0x20u;
/// It has a mipmap.
const uint TEXTURE_MIPMAP = 0x40u;
/// The nearest level of the mipmap.
const uint TEXTURE_LEVEL_NEAREST = 0x80u;
/// Colours are sRGB.
const uint TEXTURE_SRGB = 0x100u;
/// 16 bits a channel, two pixels a texel; otherwise 8 and four.
const uint TEXTURE_WIDE = 0x200u;
/// It is placed by the second set of texture coordinates.
const uint TEXTURE_SECOND_SET = 0x400u;
/// Most places along a footprint that are read.
const uint MAX_PROBES = 8u;

/// Distance that stands for infinity, in world units.
const float FAR = 1e30;
