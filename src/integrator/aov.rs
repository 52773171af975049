//! The pass of AOVs on the GPU: compiled and run when it is asked for, and no part of a render.

use super::dispatch::{Job, Pass};
use crate::error::Result;
use crate::film::Tile;
use crate::film::aov::{Albedo, AovBuffers, Sums};
use crate::gpu::layout::Params;
use crate::gpu::{Gpu, Resource, Staging};
use crate::render::Halt;
use glam::{DVec3, Vec4};

/// Albedos as the shader reads them.
pub(super) fn table(albedos: &[Albedo]) -> Vec<Vec4> {
    albedos.iter().map(|a| DVec3::from(a.rgb).as_vec3().extend(a.presence as f32)).collect()
}

/// Runs `pass` over the `tiles` of `bounds`, a part of the image that `params` describes; `resources` are the scene's and the table of albedos. The kernel
/// finds one set of sums, or with what is `behind` two.
pub(super) fn run(
    (gpu, halt): (&Gpu, &Halt),
    mut pass: Pass,
    (bounds, tiles): (Tile, &[Tile]),
    resources: &[(&str, &Resource)],
    (uniforms, counters): (&Resource, &(Resource, Staging)),
    params: Params,
    behind: bool,
) -> Result<AovBuffers> {
    let (width, sets) = (bounds.width as usize, 1 + usize::from(behind));
    let mut sums = vec![vec![[0.0; 8]; bounds.pixels()]; sets];
    for tile in tiles {
        let columns = tile.width as usize;
        let bytes = (columns * tile.height as usize * sets * size_of::<Sums>()) as u64;
        let found = gpu.empty_storage("AOVs", bytes)?;
        let resources = [resources, &[("params", uniforms), ("aovs", &found)]].concat();
        let params = Params { tile_x: tile.x, tile_y: tile.y, tile_width: tile.width, tile_height: tile.height, ..params };
        let job = Job { gpu, halt, timer: None, uniforms, counters, resources: &resources, params };
        job.run(&mut pass, tile.width.div_ceil(8) * tile.height.div_ceil(8), u32::MAX)?;
        let tile = tile.within(bounds);
        for (row, found) in gpu.read::<Sums>(&found, bytes)?.chunks_exact(sets * columns).enumerate() {
            let first = (tile.y as usize + row) * width + tile.x as usize;
            for (set, sums) in sums.iter_mut().enumerate() {
                let of_set = found[set..].iter().step_by(sets);
                sums[first..first + columns].iter_mut().zip(of_set).for_each(|(sums, found)| *sums = *found);
            }
        }
    }
    let behind = behind.then(|| AovBuffers::new(params.samples, sums.swap_remove(1)));
    Ok(AovBuffers::new(params.samples, sums.swap_remove(0)).with_behind(behind))
}
