//! What the host has to do for a batch, and how long the adapter waits for it: the least of several batches, since whatever else the machine does adds to it.

use super::Args;
use super::report::Report;
use super::scenes::cornell_box;
use crate::cli::interrupt;
use crate::cli::print::out;
use crate::error::Result;
use crate::film::Film;
use crate::integrator::{GpuIntegrator, Plan, Techniques};
use crate::render::{Batch, Integrator, Stop};
use crate::scene::LoadOptions;
use serde_json::{Value, json};
use std::time::Instant;

/// Resolutions.
const SIZES: [(u32, u32); 2] = [(512, 512), (1920, 1080)];
/// Samples of a batch, unless told otherwise, and batches.
const SPP: u32 = 16;
const BATCHES: u32 = 8;
/// Light paths for each camera path: what they leave to do for the host does not depend on it.
const LIGHT_PATHS: f64 = 0.125;

/// Measures all sizes, without and with light paths.
pub fn run(args: &Args, report: &mut Report) -> Result<()> {
    let glass = json!({
        "materials": {"glass": {"dielectric": {"ior": "N-SF11"}}},
        "shapes": [{"sphere": {"center": [0.4, 0.36, 0.3], "radius": 0.35}, "material": "glass"}],
    });
    let all = Techniques::default();
    let camera = Techniques { light_paths: false, merging: false, guiding: false, ..all };
    if !args.json {
        out(&format!(
            "{:<34} {:>10} {:>10} {:>12} {:>7} {:>9}",
            "a batch", "device/ms", "host/ms", "unhidden/ms", "waits", "read/MB"
        ));
    }
    for size in SIZES {
        for (name, more, techniques) in [("camera paths", &Value::Null, camera), ("guided light paths", &glass, all)] {
            if interrupt::requested() {
                return Ok(());
            }
            measure(args, &format!("{}x{}, {name}", size.0, size.1), more, size, techniques, report)?;
        }
    }
    Ok(())
}

/// Of one batch: time that the host waited, and worked while the adapter had nothing to do, ms; waits; MB that came back.
type Spent = [f64; 4];

fn measure(args: &Args, case: &str, more: &Value, size: (u32, u32), techniques: Techniques, report: &mut Report) -> Result<()> {
    let scene = cornell_box(more, &LoadOptions { width: Some(size.0), height: Some(size.1), ..args.overrides.options() })?;
    let mut integrator = GpuIntegrator::with_plan(&scene, args.device.as_deref(), args.seed, Plan::new(&scene, techniques))?;
    integrator.set_light_paths(LIGHT_PATHS);
    let mut film = Film::try_new(&scene.film)?;
    let spp = Stop::from(args.stop).spp.unwrap_or(SPP);
    let mut index = 0;
    let mut least = |ahead: bool| -> Result<Spent> {
        let mut batches = Vec::new();
        // Of the first one the probes are a part, and its memory is new.
        for count in 0..=BATCHES {
            let (begun, before) = (Instant::now(), integrator.traffic());
            let batch = Batch::even(index, spp);
            index += 1;
            if ahead { integrator.render_ahead(batch, &mut film) } else { integrator.render_batch(batch, &mut film) }?;
            let (all, traffic) = (begun.elapsed(), integrator.traffic() - before);
            let host = all.saturating_sub(traffic.waited);
            let ms = [traffic.waited, host].map(|t| 1e3 * t.as_secs_f64());
            if interrupt::requested() {
                break;
            }
            if count > 0 {
                batches.push([ms[0], ms[1], traffic.waits as f64, 1e-6 * traffic.bytes_read as f64]);
            }
        }
        integrator.settle(&mut film);
        Ok(std::array::from_fn(|i| batches.iter().map(|b| b[i]).fold(f64::INFINITY, f64::min)))
    };
    let ([device, unhidden, waits, read], [_, host, ..]) = (least(true)?, least(false)?);
    if interrupt::requested() {
        return Ok(());
    }
    if !args.json {
        out(&format!("{case:<34} {device:>10.1} {host:>10.1} {unhidden:>12.1} {waits:>7} {read:>9.1}"));
    }
    report.write(json!({
        "series": "host",
        "case": case,
        "device": integrator.adapter().to_string(),
        "samples_per_pixel": spp,
        "tiles": integrator.tile_count(),
        "device_ms_per_batch": device,
        "host_ms_per_batch": host,
        "unhidden_host_ms_per_batch": unhidden,
        "waits_per_batch": waits,
        "megabytes_read_per_batch": read,
    }))
}
