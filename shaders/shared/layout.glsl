// THE CONTRACT, its structs: everything that crosses between host and device. build.rs translates this file to Rust
// (src/layout); a line that it does not understand is a build error. All members are 4-byte scalars or vectors of them
// under scalar block layout, so neither side has padding.

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
    /// shade: 1 when this dispatch makes rays that go on (the last light's, while there is another round, with layers in the last one, too).
    uint reflect;
    /// prepare: bit q set = queue q has been filled and is to be worked on.
    uint queues;
    /// Most items that a thread takes, see batch.glsl.
    uint most_a_thread;
    /// shade: number of the round; from 1 on samples have a throughput.
    uint round;
    /// resolve: 1 = divide by the number of samples, the band is complete.
    uint finish;
    /// Chooses between sequences of sample positions.
    uint seed;
    /// resolve: the first sample of the picture.
    uint start;
    /// Tracing again: reference of the subtree that is walked.
    uint root;
    /// Tracing again: where that is an instance, reference of the subtree of its own tree that is walked; 0 for all of it.
    uint below;
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
