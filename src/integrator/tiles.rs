//! The tiles of a picture, and the blocks of 8 x 8 pixels of a tile.

use super::{Feature, Plan, merge};
use crate::film::Tile;
use crate::gpu::Gpu;

/// Most bytes of a tile's splats, and half as many of its film, through a lens as many: the host holds both once more.
const TILE_BYTES: u64 = 1 << 30;

/// Every block has one sample in every pass.
pub(super) fn even_rates(tile: Tile) -> Vec<f64> {
    vec![1.0; blocks(tile) as usize]
}

/// Blocks of 8 x 8 pixels that a tile takes.
pub(super) fn blocks(tile: Tile) -> u32 {
    tile.width.div_ceil(8) * tile.height.div_ceil(8)
}

/// Tiles of these `bounds` whose film (or splats, twice as large) and visible points of one pass fit an adapter's binding, in whole 8 x 8 blocks, and halved
/// so often; the largest first.
pub(super) fn tiles(gpu: &Gpu, plan: &Plan, bounds: Tile, halvings: u32) -> Vec<Tile> {
    let Tile { width, height, .. } = bounds;
    let point = if plan.has(Feature::Merging) { merge::point_bytes(plan) } else { 0 };
    let pixels = gpu.max_binding().min(TILE_BYTES) / (8 * u64::from(plan.bins + 3)).max(point);
    let columns = if u64::from(width) * 8 > pixels { (pixels / 64 * 8) as u32 } else { width };
    let rows = (pixels / u64::from(columns.next_multiple_of(8)) / 8 * 8).clamp(8, 1 << 20) as u32;
    let mut tiles = Vec::new();
    for y in (0..height).step_by(rows as usize) {
        for x in (0..width).step_by(columns as usize) {
            let (width, height) = (columns.min(width - x), rows.min(height - y));
            tiles.push(Tile { x: bounds.x + x, y: bounds.y + y, width, height });
        }
    }
    for _ in 0..halvings {
        tiles = tiles.into_iter().flat_map(halves).collect();
    }
    tiles
}

/// A tile in two of whole blocks, if it has more than a row of them.
fn halves(tile: Tile) -> impl Iterator<Item = Tile> {
    let upper = (tile.height / 2).next_multiple_of(8).min(tile.height);
    let lower = Tile { y: tile.y + upper, height: tile.height - upper, ..tile };
    [Tile { height: upper, ..tile }, lower].into_iter().filter(|tile| tile.height > 0)
}
