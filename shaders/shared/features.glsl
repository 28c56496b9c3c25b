// What a scene may need. Each is a specialization constant, so that code which is switched off is never compiled; the
// host neither allocates its buffers nor records its passes. Switching one on that is not needed changes no pixel.

/// Some triangles have vertex normals.
layout(constant_id = 0) const bool SMOOTH_NORMALS = true;
/// Some triangles have vertex colours.
layout(constant_id = 1) const bool VERTEX_COLORS = true;
/// Some triangles are seen from the front only.
layout(constant_id = 2) const bool SINGLE_SIDED = true;
/// Some material has a specular coefficient and some light shines.
layout(constant_id = 3) const bool SPECULAR = true;
/// Some light shines on some material that answers it: the shadow pass.
layout(constant_id = 4) const bool SHADOWS = true;
/// Some material mirrors and the maximum depth is above 0: the reflection pass.
layout(constant_id = 5) const bool REFLECTIONS = true;
/// More than one sample a pixel: stratified positions.
layout(constant_id = 6) const bool MULTISAMPLING = true;
/// Instances share meshes: an upper tree over instances, whose leaves are trees over the triangles of a mesh.
layout(constant_id = 7) const bool INSTANCES = true;
/// The kernel traces again what overflowed or was uncertain, with a stack as deep as any tree and numbers of two floats: a variant, not a need of the scene.
layout(constant_id = 8) const bool RETRACE = true;
/// Sample positions are those of a scrambled Sobol sequence instead of stratified ones.
layout(constant_id = 9) const bool SOBOL = true;
/// Sample positions are independent of each other.
layout(constant_id = 10) const bool INDEPENDENT = true;
/// Samples are spread as a filter says, not evenly over the pixel.
layout(constant_id = 11) const bool FILTER = true;
/// Some material has a texture.
layout(constant_id = 12) const bool TEXTURES = true;
/// Some material has a normal map.
layout(constant_id = 13) const bool NORMAL_MAPS = true;
/// Some triangles are not opaque: traversal looks at alpha.
layout(constant_id = 14) const bool ALPHA = true;
/// Some surfaces let light through: rays go on behind them.
layout(constant_id = 15) const bool LAYERS = true;
/// Some triangles are so thin that rounding may move hits on them from before a ray's start to behind it.
layout(constant_id = 16) const bool THIN_TRIANGLES = true;

// Safeguards switched off, one by one, to see what they prevent. Never on in a picture.

/// Rays start a fixed distance off the surface.
layout(constant_id = 17) const bool FIXED_EPSILON = false;
/// Triangles are tested as Möller and Trumbore do, which lets rays slip through between them.
layout(constant_id = 18) const bool MOLLER_TRUMBORE = false;
/// Samples are added up without compensation.
layout(constant_id = 19) const bool PLAIN_SUMS = false;
