//! On a GPU, in single precision, what [`Developer`] does. The shader, `shaders/develop.wgsl`, repeats the arithmetic; all numbers in it are the
//! Developer's. XYZ from bins is not done here: to copy the bins of 2000x1500 pixels for the adapter takes longer (0.29 s) than to add them up (0.22 s).

use super::gamut::Gamut;
use super::picture::{Developer, Whole};
use super::wgsl;
use crate::error::Result;
use crate::gpu::{Gpu, Kernel, kernel_source};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The shader's root file.
const ROOT: &str = "develop.wgsl";

/// What the shader can be asked for.
pub const FEATURES: [&str; 6] = ["TONE_REINHARD", "TONE_ACES", "TONE_AGX", "GAMUT_MAP", "GAMUT_CLIP", "ENCODE"];

/// Most pixels at a time: one dispatch of 16384 workgroups, few enough for any driver's watchdog.
const STRIP: usize = 1 << 20;

/// As [`Developer::linear_image`].
///
/// # Errors
/// [`crate::Error::Device`] if the adapter refuses or is lost.
pub fn linear_image(gpu: &Gpu, developer: &Developer, xyz: &[[f32; 3]]) -> Result<Vec<[f32; 3]>> {
    let mut rgb = Vec::with_capacity(xyz.len());
    develop(gpu, developer, false, xyz, |strip| rgb.extend(strip))?;
    Ok(rgb)
}

/// As [`Developer::encoded`].
///
/// # Errors
/// [`crate::Error::Device`] if the adapter refuses or is lost.
pub fn encoded(gpu: &Gpu, developer: &Developer, xyz: &[[f32; 3]], whole: Whole) -> Result<Vec<[u16; 3]>> {
    let mut numbers = Vec::with_capacity(xyz.len());
    develop(gpu, developer, true, xyz, |strip| {
        let first = numbers.len();
        let pixel = |(i, rgb): (usize, &[f32; 3])| whole.of(first + i, rgb.map(f64::from));
        numbers.par_extend(strip.par_iter().enumerate().map(pixel));
    })?;
    Ok(numbers)
}

/// WGSL of the development of `developer`, as encoded components or else as linear ones.
///
/// # Errors
/// Says what is amiss in `shaders/`.
pub fn develop_source(developer: &Developer, encode: bool) -> std::result::Result<String, String> {
    let (constants, features) = setting(developer, encode);
    kernel_source(ROOT, &constants, &features)
}

fn setting(developer: &Developer, encode: bool) -> (String, BTreeMap<&'static str, bool>) {
    let (tone, curve) = developer.tone.wgsl();
    let constants = [
        wgsl::matrix("TO_RGB", &developer.to_rgb),
        wgsl::number("KNEE", developer.tone.knee()),
        tone,
        developer.map.wgsl(),
        wgsl::transfer(&developer.transfer),
    ];
    let gamut = match developer.gamut {
        Gamut::Map => "GAMUT_MAP",
        Gamut::Clip => "GAMUT_CLIP",
        Gamut::Keep => "",
    };
    let is_on = |name| name == curve || name == gamut || (name == "ENCODE" && encode);
    (constants.concat(), FEATURES.into_iter().map(|name| (name, is_on(name))).collect())
}

fn develop(gpu: &Gpu, developer: &Developer, encode: bool, xyz: &[[f32; 3]], mut take: impl FnMut(Vec<[f32; 3]>)) -> Result<()> {
    let (constants, features) = setting(developer, encode);
    let kernel = Kernel::new(gpu, ROOT, &constants, &features)?;
    let [ring, rounded] = developer.map.rings().map(texels);
    let (ring, rounded) = (gpu.table("ring", &ring)?, gpu.table("rounded ring", &rounded)?);
    let strip = STRIP.min(gpu.max_binding() as usize / 12).min(xyz.len()).max(1);
    let pixels = gpu.empty_storage("pixels", 12 * strip as u64)?;
    let out = gpu.empty_storage("picture", 12 * strip as u64)?;
    let resources = [("ring", &ring), ("rounded_ring", &rounded), ("pixels", &pixels), ("out", &out)];
    let bindings = kernel.bind(gpu, &resources)?;
    for xyz in xyz.chunks(strip) {
        gpu.write(&pixels, xyz);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        kernel.dispatch(&mut encoder, &bindings, xyz.len().div_ceil(64) as u32);
        gpu.queue.submit([encoder.finish()]);
        take(gpu.read(&out, 12 * xyz.len() as u64)?);
    }
    Ok(())
}

/// For a table of texels.
fn texels(rows: &[[f64; 3]]) -> Vec<[f32; 4]> {
    rows.iter().map(|v| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0]).collect()
}
