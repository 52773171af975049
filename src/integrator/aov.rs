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

/// Runs `pass` over the `tiles` of `bounds`, a part of the image that `params` describes; `resources` are the scene's and the table of albedos.
pub(super) fn run(
    (gpu, halt): (&Gpu, &Halt),
    mut pass: Pass,
    (bounds, tiles): (Tile, &[Tile]),
    resources: &[(&str, &Resource)],
    (uniforms, counters): (&Resource, &(Resource, Staging)),
    params: Params,
) -> Result<AovBuffers> {
    let width = bounds.width as usize;
    let mut sums = vec![[0.0; 8]; bounds.pixels()];
    for tile in tiles {
        let (columns, bytes) = (tile.width as usize, u64::from(tile.width) * u64::from(tile.height) * size_of::<Sums>() as u64);
        let found = gpu.empty_storage("AOVs", bytes)?;
        let resources = [resources, &[("params", uniforms), ("aovs", &found)]].concat();
        let params = Params { tile_x: tile.x, tile_y: tile.y, tile_width: tile.width, tile_height: tile.height, ..params };
        let job = Job { gpu, halt, timer: None, uniforms, counters, resources: &resources, params };
        job.run(&mut pass, tile.width.div_ceil(8) * tile.height.div_ceil(8), u32::MAX)?;
        let tile = tile.within(bounds);
        for (row, found) in gpu.read::<Sums>(&found, bytes)?.chunks_exact(columns).enumerate() {
            let first = (tile.y as usize + row) * width + tile.x as usize;
            sums[first..first + columns].copy_from_slice(found);
        }
    }
    Ok(AovBuffers::new(params.samples, sums))
}
