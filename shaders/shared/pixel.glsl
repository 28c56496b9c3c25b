// Pixels are numbered tile by tile so that neighbours in a workgroup are neighbours in the picture.
#include "divide.glsl"

/// Every second bit of the lower six, packed: undoes the Morton interleave of a tile.
uint even_bits(uint code) {
    return (code & 1u) | ((code >> 1u) & 2u) | ((code >> 2u) & 4u);
}

/// Column and row of a pixel numbered in tile order; may lie outside a picture whose sides are no multiples of TILE.
uvec2 pixel_place(uint pixel) {
    uint tile = pixel / (TILE * TILE);
    uint code = pixel % (TILE * TILE);
    return TILE * divide(tile, frame.tiles_across).yx + uvec2(even_bits(code), even_bits(code >> 1u));
}
