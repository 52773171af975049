//! The last part of a batch: sums of a tile go into the film, on all cores of the host, while the adapter traces the next tile. Nothing of it can fail, so
//! that the tile counts as done before.

use super::adaptive::Adaptive;
use super::brightness::Brightness;
use super::tile_sums::{TileSums, radiance_and_y};
use crate::film::Film;
use rayon::prelude::*;

/// Sums on their way to the film; of one tile, since there is one place for them.
#[derive(Debug, Default)]
pub(super) struct Landing {
    waiting: Option<Waiting>,
    room: Vec<f32>,
}

#[derive(Debug)]
struct Waiting {
    sums: TileSums,
    /// Of its blocks.
    rates: Vec<f64>,
    ends_batch: bool,
}

impl Landing {
    /// Has a tile wait that was sampled at these rates, which is the last one of its batch or not.
    pub(super) fn begin(&mut self, sums: TileSums, rates: Vec<f64>, ends_batch: bool) {
        self.waiting = Some(Waiting { sums, rates, ends_batch });
    }

    /// Brings what waits into `film`, and has `seen` and `adaptive` learn from it. Returns how many sums were cut since they are too large.
    pub(super) fn land(&mut self, film: &mut Film, seen: Option<&mut Brightness>, adaptive: Option<&mut Adaptive>) -> u64 {
        let Some(Waiting { sums, rates, ends_batch }) = self.waiting.take() else { return 0 };
        let (values, by_camera, cut) = sums.all(&mut self.room);
        film.add_batch(sums.tile, &values, sums.spp);
        if let Some(seen) = seen {
            let size = film.settings();
            seen.see((size.width, size.height), sums.tile, &values, sums.spp);
        }
        if let Some(adaptive) = adaptive {
            let by_all = || values.par_chunks_exact(sums.channels).map(radiance_and_y).collect();
            let found = if adaptive.counts_merged { by_all() } else { by_camera };
            adaptive.learn((sums.tile, &rates), &found, sums.spp, film);
            if ends_batch {
                adaptive.settle(sums.spp);
            }
        }
        cut
    }
}
