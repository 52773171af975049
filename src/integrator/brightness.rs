//! The picture's brightness in blocks: what the use of a light path is relative to (see guide.rs).

use crate::film::Tile;
use crate::state::{Persistent, State};
use rayon::prelude::*;
use std::io;

/// Blocks along each side of the picture.
pub(super) const BLOCKS: usize = 32;

/// Sums over the pixels of each block, row by row, of their radiance (sum over bins) and of their samples.
#[derive(Debug)]
pub(super) struct Brightness(Vec<[f64; 2]>);

impl Brightness {
    /// Nothing seen.
    pub(super) fn new() -> Self {
        Brightness(vec![[0.0; 2]; BLOCKS * BLOCKS])
    }

    /// Takes in a tile of a picture of `size`: `[pixel][bins + 3]` sums over `spp` samples. A core sums up a row of blocks, in the same order always.
    pub(super) fn see(&mut self, size: (u32, u32), tile: Tile, sums: &[f32], spp: u32) {
        let block = |at: u32, size: u32| (u64::from(at) * BLOCKS as u64 / u64::from(size)) as usize;
        let columns: Vec<usize> = (tile.x..tile.x + tile.width).map(|x| block(x, size.0)).collect();
        let channels = sums.len() / (columns.len() * tile.height as usize);
        self.0.par_chunks_mut(BLOCKS).enumerate().for_each(|(row, blocks)| {
            let rows = (tile.y..).zip(sums.chunks_exact(columns.len() * channels));
            for (_, pixels) in rows.filter(|(y, _)| block(*y, size.1) == row) {
                for (column, sums) in columns.iter().zip(pixels.chunks_exact(channels)) {
                    let radiance: f64 = sums[..channels - 3].iter().map(|&sum| f64::from(sum)).sum();
                    blocks[*column][0] += radiance;
                    blocks[*column][1] += f64::from(spp);
                }
            }
        });
    }

    /// Adds what `other` has seen, which then has seen nothing.
    pub(super) fn take(&mut self, other: &mut Brightness) {
        for (sums, more) in self.0.iter_mut().zip(&mut other.0) {
            sums.iter_mut().zip(std::mem::take(more)).for_each(|(sum, more)| *sum += more);
        }
    }

    /// Brightness that the error of a pixel is relative to, block by block: the same in the dark as the film's measure of error.
    pub(super) fn of_blocks(&self) -> impl Iterator<Item = f64> {
        let seen = self.0.iter().map(|b| b[1]).sum::<f64>();
        let mean = self.0.iter().map(|b| b[0]).sum::<f64>() / seen.max(1.0);
        self.0.iter().map(move |[sum, samples]| (sum / samples.max(1.0)).hypot(0.1 * mean))
    }
}

impl Persistent for Brightness {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        state.slice(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_seen_where_they_lie() {
        // Two bins of 1 and 2 in the left tile, of 3 and 4 in the right one; X, Y, Z do not count. A block has 2 x 3 pixels.
        let (mut seen, mut whole, size) = (Brightness::new(), Brightness::new(), (64, 96));
        for (x, width, bins) in [(0, 33, [1.0, 2.0]), (33, 31, [3.0, 4.0])] {
            let sums = [bins[0], bins[1], 9.0, 9.0, 9.0].repeat(width as usize * 96);
            seen.see(size, Tile { x, y: 0, width, height: 96 }, &sums, 4);
        }
        whole.take(&mut seen);
        let row = |sums: &Brightness| [0, 15, 16, 17, 31].map(|column| sums.0[5 * BLOCKS + column]);
        assert_eq!(row(&whole), [[18.0, 24.0], [18.0, 24.0], [30.0, 24.0], [42.0, 24.0], [42.0, 24.0]]);
        assert_eq!(row(&seen), [[0.0; 2]; 5]);
        let mean = (16.0 * 18.0 + 30.0 + 15.0 * 42.0) / 32.0 / 24.0;
        assert!((whole.of_blocks().next().unwrap() - 0.75f64.hypot(0.1 * mean)).abs() < 1e-12);
    }
}
