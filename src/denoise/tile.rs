//! Tiles of the picture, which a core takes one at a time: what it needs of all planes stays in its cache, and rows have a length that the compiler knows.

use super::planes::Size;

/// Pixels across a tile; what of it lies beyond the picture is filtered for nothing.
pub const WIDTH: usize = 64;
/// Pixels down a tile.
pub const HEIGHT: usize = 16;
/// Pixels to every side that a tile's pixels may be compared with.
pub const MARGIN: usize = 11;
/// Columns of a tile and its surroundings, and some more, so that rows come in whole vectors.
const SPAN: usize = 96;
/// Rows of a tile and its surroundings.
pub const ROWS: usize = HEIGHT + 2 * MARGIN;

/// Values of a tile's pixels.
pub type Tile = [[f32; WIDTH]; HEIGHT];

/// A plane's values of a tile and of [`MARGIN`] pixels around it. Beyond the picture they are those of its edge.
#[derive(Debug)]
pub struct Window(Vec<[f32; SPAN]>);

impl Window {
    /// Of the tile that begins at column `x` and row `y`.
    pub fn new(size: Size, plane: &[f32], (x, y): (usize, usize)) -> Self {
        let mut window = Self(vec![[0.0; SPAN]; ROWS]);
        for (row, values) in window.0.iter_mut().enumerate() {
            let of = &plane[(y + row).saturating_sub(MARGIN).min(size.height - 1) * size.width..][..size.width];
            if let Some(within) = x.checked_sub(MARGIN).and_then(|first| of.get(first..first + SPAN)) {
                values.copy_from_slice(within);
            } else {
                for (column, value) in values.iter_mut().enumerate() {
                    *value = of[(x + column).saturating_sub(MARGIN).min(size.width - 1)];
                }
            }
        }
        window
    }

    /// Infinite beyond the picture, else 0.
    pub fn outside(size: Size, (x, y): (usize, usize)) -> Self {
        let mut window = Self(vec![[f32::INFINITY; SPAN]; ROWS]);
        let columns = MARGIN.saturating_sub(x)..(size.width + MARGIN - x).min(SPAN);
        for row in MARGIN.saturating_sub(y)..(size.height + MARGIN - y).min(ROWS) {
            window.0[row][columns.clone()].fill(0.0);
        }
        window
    }

    /// `N` values from a row and column on, [`MARGIN`] and [`MARGIN`] being the tile's first pixel.
    #[inline(always)]
    pub fn at<const N: usize>(&self, row: usize, column: usize) -> &[f32; N] {
        self.0[row][column..].first_chunk().expect("a window is as wide as it takes")
    }
}
