// Pixel (within the tile) of an invocation: a workgroup is an 8 x 8 block; blocks are numbered row by row from the dispatch's first.
fn pixel_in_tile(group: u32, local: u32) -> vec2u {
    let block = params.first_block + group;
    let across = (params.tile_width + 7u) / 8u;
    return vec2u(8u * (block % across) + (local & 7u), 8u * (block / across) + (local >> 3u));
}
