// Pixel (within the tile) of an invocation at an 8 x 8 block of it; blocks are numbered row by row.
#include "common/params.wgsl"

fn pixel_in_tile(block: u32, local: u32) -> vec2u {
    let across = (params.tile_width + 7u) / 8u;
    return vec2u(8u * (block % across) + (local & 7u), 8u * (block / across) + (local >> 3u));
}

// Whether there is such a pixel: blocks at the rim are not whole.
fn is_in_tile(pixel: vec2u) -> bool {
    return pixel.x < params.tile_width && pixel.y < params.tile_height;
}
