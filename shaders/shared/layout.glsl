// THE CONTRACT: every struct and constant that crosses between host and device. build.rs translates this file to Rust
// (src/layout); a line that it does not understand is a build error. All members are 4-byte scalars or vectors of them
// under scalar block layout, so neither side has padding.

/// Invocations in a workgroup of every kernel: one 8 × 8 tile of pixels.
const uint WORKGROUP = 64u;
/// Pixels along a side of a tile. Pixels are numbered tile by tile, row by row, in Morton order inside a tile.
const uint TILE = 8u;
/// Hard bound on the depth of the tree, binary or wide: the builder keeps it, the traversal's array stack relies on it.
const uint MAX_TREE_DEPTH = 64u;
/// Nodes that the traversal's stack of registers holds.
const uint STACK_REGISTERS = 14u;
/// Most triangles in a leaf that its 32-bit reference can name.
const uint MAX_LEAF_TRIANGLES = 14u;
/// In place of a leaf's number of triangles: it is an instance.
const uint LEAF_IS_INSTANCE = 15u;
/// Quanta from the grid's edge to its middle: the boxes of the tree lie on a grid.
const float GRID_MIDDLE = 131072.0;
/// Parts of a quantum that middles of boxes are counted in.
const float GRID_PARTS = 16384.0;
/// Quanta that a box whose reach is 1 reaches to either side.
const float GRID_REACH = 65536.0;
/// Texels (16 bytes) in one tree node: a record for each of its children.
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
/// Queue of rays whose walk is to be done again: it overflowed its stack, or could not tell whether it hits.
const uint QUEUE_RETRACE = 3u;
/// Number of queues.
const uint QUEUES = 4u;
/// First counter of the items that wait in each queue while it is being filled.
const uint COUNTER_FILLING = 0u;
/// First counter of the items that the pass which empties each queue works on.
const uint COUNTER_READY = 4u;
/// First counter of the items that each queue has had in all.
const uint COUNTER_TOTAL = 8u;
/// Counter of rays whose second traversal was cut short too.
const uint COUNTER_LOST = 12u;
/// Counter that holds, as bits, which passes left rays to be traced again.
const uint COUNTER_AGAIN = 13u;
/// Number of counters.
const uint COUNTERS = 14u;
/// Bit of the primary pass where passes are bits.
const uint AGAIN_PRIMARY = 1u;
/// Bit of the shadow pass.
const uint AGAIN_SHADOW = 2u;
/// Bit of the reflection pass.
const uint AGAIN_REFLECTION = 4u;

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

/// What is constant during a frame. World space is the scene's, moved to the eye, scaled to a size of about 2²⁰ and, for a very
/// narrow view, turned along with the camera.
struct Frame {
    /// Camera position (perspective) or centre of its plane (orthographic).
    vec3 eye;
    /// Unit view direction.
    vec3 forward;
    /// Camera right, as long as half the picture is wide (at distance 1 for perspective).
    vec3 right;
    /// Camera up, as long as half the picture is high (at distance 1 for perspective).
    vec3 up;
    /// The direction from nadir to zenith.
    vec3 sky;
    /// 1: parallel rays, 0: rays through the eye.
    uint orthographic;
    /// Picture width in pixels.
    uint width;
    /// Picture height in pixels.
    uint height;
    /// Tiles in a row.
    uint tiles_across;
    /// Samples a pixel: strata_x · strata_y.
    uint samples;
    /// Strata across a pixel.
    uint strata_x;
    /// Strata down a pixel.
    uint strata_y;
    /// Background radiance straight down.
    vec3 nadir;
    /// Background radiance straight up; equal to nadir for a constant background.
    vec3 zenith;
    /// Alpha of the background: 0 where it is transparent.
    float background_alpha;
    /// World position of quantised coordinate 0.
    vec3 grid_origin;
    /// Quanta per world unit.
    vec3 grid_scale;
    /// Where the filter crosses 0 and becomes negative, in pixels from its centre; FAR if it never does.
    float filter_zero;
    /// The mean weight of a sample.
    float filter_mean;
    /// How far off surfaces rays start where FIXED_EPSILON is on.
    float fixed_epsilon;
    /// First texel of the attributes that are vertex colours; normals start at 0.
    uint first_color;
    /// First texel of those that are texture coordinates.
    uint first_texcoord;
    /// First texel of those that are tangents.
    uint first_tangent;
    /// Reflections one after the other.
    uint max_depth;
    /// Diameter of a sample's part of the picture where its ray starts, and how much it grows with the ray's length.
    vec2 cone;
};

/// What changes from dispatch to dispatch: push constants.
struct Step {
    /// First pixel of the band, in tile order.
    uint first_pixel;
    /// Pixels in the band.
    uint pixels;
    /// First sample of each pixel in this wave.
    uint first_sample;
    /// Samples of each pixel in this wave.
    uint samples;
    /// shade: the light whose shadow rays are made.
    uint light;
    /// shade: 1 when this dispatch adds what needs no light (the first light's).
    uint first_light;
    /// shade: 1 when this dispatch makes rays that go on (the last light's, while there is another round).
    uint reflect;
    /// prepare: bit q set = queue q has been filled and is to be worked on.
    uint queues;
    /// shade: number of the round; from 1 on samples have a throughput.
    uint round;
    /// resolve: 1 = divide by the number of samples, the band is complete.
    uint finish;
    /// Chooses between sequences of sample positions.
    uint seed;
    /// resolve: the first sample of the picture.
    uint start;
    /// resolve: passes whose rays are traced again, as bits.
    uint again;
    /// Tracing again: reference of the subtree that is walked.
    uint root;
    /// Tracing again: 1 = no subtree was walked before.
    uint first_part;
    /// Tracing again: 1 = this is the last subtree.
    uint last_part;
};

/// Coefficients of Whitted's model: value = constant + tint · tinted, tint being the vertex colour (1 without). Whole texels.
struct Material {
    /// Radiance whatever the light.
    vec3 ambient_tinted;
    /// Blinn–Phong exponent.
    float shininess;
    /// Radiance given off.
    vec3 emission;
    /// Lambert coefficient.
    vec3 diffuse_tinted;
    /// Blinn–Phong coefficient, part that tint leaves alone.
    vec3 specular;
    /// Blinn–Phong coefficient, part that tint multiplies.
    vec3 specular_tinted;
    /// Mirror coefficient, part that tint leaves alone.
    vec3 mirror;
    /// Mirror coefficient, part that tint multiplies.
    vec3 mirror_tinted;
    /// Fills the texel.
    vec2 unused;
};

/// What a material's coefficients come from, for places where textures change them, and what its alpha means. Whole texels.
struct Look {
    /// Base colour, linear.
    vec3 base_color;
    /// Alpha.
    float alpha;
    /// 0 dielectric … 1 metal.
    float metallic;
    /// 0 smooth … 1 rough.
    float roughness;
    /// How much the occlusion map darkens ambient light.
    float occlusion_strength;
    /// How far the normal map bends normals.
    float normal_scale;
    /// Reflectance of a dielectric seen head-on.
    vec3 dielectric;
    /// Alpha from which on a masked surface is there.
    float cutoff;
    /// Textures, 0 for none, or one more than its place: base colour and alpha.
    uint base_color_map;
    /// Roughness in green, metallic in blue.
    uint metallic_roughness_map;
    /// Normals.
    uint normal_map;
    /// Ambient light in red.
    uint occlusion_map;
    /// Emission.
    uint emission_map;
    /// Strength of a dielectric's reflection in alpha.
    uint specular_map;
    /// Its colour.
    uint specular_color_map;
    /// Transmission in red.
    uint transmission_map;
    /// Share of light that passes.
    float transmission;
    /// ALPHA_OPAQUE, ALPHA_MASK or ALPHA_BLEND.
    uint alpha_mode;
    /// 1: the coefficients follow from the factors here; 0: they are as they are, but for the base colour map, which is a tint.
    uint follows_rule;
    /// Fills the texel.
    uint unused;
    /// Colour that light takes on inside, on its way through.
    vec3 attenuation;
    /// Fills the texel.
    uint unused_too;
};

/// A texture in one of its uses. Whole texels.
struct Texture {
    /// Pixels across.
    uint width;
    /// Pixels down.
    uint height;
    /// Levels of the mipmap.
    uint levels;
    /// TEXTURE_ flags.
    uint flags;
    /// Row of the affine matrix from texture coordinates to the texture's own.
    vec3 u_from_texcoord;
    /// Fills the texel.
    uint unused_u;
    /// Second row.
    vec3 v_from_texcoord;
    /// Fills the texel.
    uint unused_v;
    /// First texel of level 0 to 3.
    uvec4 levels_from_0;
    /// First texel of level 4 to 7.
    uvec4 levels_from_4;
    /// First texel of level 8 to 11.
    uvec4 levels_from_8;
    /// First texel of level 12 to 15.
    uvec4 levels_from_12;
};

/// A light (KHR_lights_punctual). Whole texels.
struct Light {
    /// World position; unused for directional.
    vec3 position;
    /// LIGHT_POINT, LIGHT_SPOT or LIGHT_DIRECTIONAL.
    uint kind;
    /// Unit direction in which light travels; unused for point.
    vec3 direction;
    /// Distance at which the light ends, FAR if it never does.
    float range;
    /// Colour times intensity: candela, or lux for directional.
    vec3 intensity;
    /// Cone falloff: clamp(cos·spot_scale + spot_offset)².
    float spot_scale;
    /// See spot_scale.
    float spot_offset;
    /// Fills the texel.
    vec3 unused;
};

/// A part of the scene somewhere in the world: a lower tree in its own space. Whole texels.
struct Instance {
    /// Row of the affine matrix from world to part.
    vec4 part_from_world_x;
    /// Second row.
    vec4 part_from_world_y;
    /// Third row.
    vec4 part_from_world_z;
    /// Position of quantised coordinate 0 in the part's space.
    vec3 grid_origin;
    /// Reference of the lower tree's root: a node or a leaf.
    uint root;
    /// Quanta per unit of the part's space.
    vec3 grid_scale;
    /// By how much both transforms, one after the other, may enlarge rounding errors: the norm of |world_from_part|·|part_from_world|; 0 where both leave everything as it is.
    float condition;
    /// Row of the affine matrix from part to world.
    vec4 world_from_part_x;
    /// Second row.
    vec4 world_from_part_y;
    /// Third row.
    vec4 world_from_part_z;
};

/// A hit to be shaded. Whole texels.
struct HitItem {
    /// Pixel sample.
    uint sample_index;
    /// Triangle, in leaf order.
    uint triangle;
    /// Barycentrics λ2, λ3; λ1 = 1 − λ2 − λ3.
    vec2 barycentrics;
    /// Unit direction of the ray that hit.
    vec3 direction;
    /// Instance that the triangle belongs to; 0 in a flat scene.
    uint instance;
};

/// A ray to be traced: to a light, or reflected. Whole texels.
struct RayItem {
    /// Start, off the surface.
    vec3 origin;
    /// Pixel sample.
    uint sample_index;
    /// Unit direction.
    vec3 direction;
    /// How far it goes.
    float distance;
};

/// Arguments of an indirect dispatch (VkDispatchIndirectCommand).
struct Dispatch {
    /// Workgroups.
    uint x;
    /// Always 1.
    uint y;
    /// Always 1.
    uint z;
};
