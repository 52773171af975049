//! Large pictures: how fast the camera pass is when they take many tiles, and what it costs to trace the light paths for each of these again.

use super::Args;
use super::clock::{Clock, peak_memory};
use super::report::Report;
use super::scenes::cornell_box;
use crate::cli::interrupt;
use crate::cli::print::{out, si};
use crate::error::Result;
use crate::film::Film;
use crate::integrator::GpuIntegrator;
use crate::integrator::{Plan, Techniques};
use crate::render::Integrator;
use crate::scene::LoadOptions;
use crate::stats::BatchStats;
use serde_json::{Value, json};

/// Resolutions of the camera pass alone, the first being what others are compared with; and with light paths, whose cost grows with pixels times tiles.
const CAMERA_SIZES: [(u32, u32); 3] = [(512, 512), (2048, 2048), (7680, 4204)];
const LIGHT_SIZES: [(u32, u32); 3] = [(512, 512), (1024, 1024), (2048, 2048)];
/// Camera rays per second of the camera pass, to those of the first picture, that are as they should be.
const LEAST_RATIO: f64 = 0.9;
/// Light paths for each camera path, the same for all sizes.
const LIGHT_PATHS: f64 = 0.25;
/// Samples of a measurement, of all pixels together, at least; one of each pixel to a batch, at every size, since the film is updated once for a pixel's samples
/// of a batch.
const SAMPLES: u64 = 1 << 22;

/// Measures all sizes.
pub fn run(args: &Args, report: &mut Report) -> Result<()> {
    let camera =
        Techniques { light_paths: false, merging: false, guiding: false, adaptive_sampling: false, ..Techniques::default() };
    let mut first: Option<Value> = None;
    for size in CAMERA_SIZES {
        let row = measure(args, &Value::Null, size, camera)?;
        let base = first.get_or_insert(row.clone());
        let ratio = |key: &str| row[key].as_f64().zip(base[key].as_f64()).map_or(f64::NAN, |(a, b)| a / b);
        let (pass, film) = (ratio("camera_rays_per_second"), ratio("rays_per_second"));
        if !args.json {
            let memory = row["peak_memory_bytes"]
                .as_u64()
                .map_or(String::new(), |b| format!(", at most {:.1} GB of memory", b as f64 / 1e9));
            let at = format!("cornell_box {}x{}, {} tiles", size.0, size.1, row["tiles"]);
            let speed = si(row["camera_rays_per_second"].as_f64().unwrap_or(f64::NAN));
            out(&format!("{at}: camera/s {speed}, ratio {pass:.2}, limit {LEAST_RATIO}; with the film {film:.2}{memory}"));
        }
        write(report, row, json!({"ratio": pass, "ratio_limit": LEAST_RATIO, "ratio_with_film": film}))?;
    }
    let glass = json!({
        "materials": {"glass": {"dielectric": {"ior": 1.7}}},
        "shapes": [{"sphere": {"center": [0.4, 0.36, 0.3], "radius": 0.35}, "material": "glass"}],
    });
    for size in LIGHT_SIZES {
        let row = measure(args, &glass, size, Techniques::default())?;
        let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        let share = number("light_seconds") / number("camera_seconds");
        if !args.json {
            let at = format!("cornell_box with a glass ball {}x{}, {} tiles", size.0, size.1, row["tiles"]);
            out(&format!(
                "{at}: light paths took {share:.2} times what camera paths did, {:.2} per tile",
                share / number("tiles")
            ));
        }
        write(report, row, json!({"light_over_camera": share}))?;
    }
    Ok(())
}

/// Some batches after a first one.
fn measure(args: &Args, more: &Value, size: (u32, u32), techniques: Techniques) -> Result<Value> {
    let scene = cornell_box(more, &LoadOptions { width: Some(size.0), height: Some(size.1), ..args.overrides.options() })?;
    let mut integrator = GpuIntegrator::with_plan(&scene, args.device.as_deref(), args.seed, Plan::new(&scene, techniques))?;
    integrator.set_light_paths(LIGHT_PATHS);
    let mut film = Film::try_new(&scene.film)?;
    let batches = SAMPLES.div_ceil(film.pixels() as u64) as u32;
    // Dispatches find their size meanwhile.
    integrator.render_batch(crate::render::Batch::even(0, 1), &mut film)?;
    let clock = Clock::start();
    let mut stats = BatchStats::default();
    for batch in 1..=batches {
        if interrupt::requested() {
            break;
        }
        stats += integrator.render_batch(crate::render::Batch::even(batch, 1), &mut film)?;
    }
    let spent = clock.spent();
    Ok(json!({
        "case": format!("{}x{}", size.0, size.1),
        "device": integrator.adapter().to_string(),
        "tiles": integrator.tile_count(),
        "samples": stats.paths,
        "camera_rays_per_second": stats.camera_rays as f64 / stats.camera_time.as_secs_f64().max(1e-9),
        "rays_per_second": stats.rays as f64 / spent.counted(integrator.adapter().is_cpu()).max(1e-9),
        "camera_seconds": stats.camera_time.as_secs_f64(),
        "light_seconds": stats.light_time.as_secs_f64(),
        "seconds": spent.wall,
        "cpu_seconds": spent.cpu,
        "longest_dispatch_seconds": stats.longest_dispatch.as_secs_f64(),
        "peak_memory_bytes": peak_memory(),
    }))
}

fn write(report: &mut Report, mut row: Value, more: Value) -> Result<()> {
    row["series"] = "tiles".into();
    more.as_object().into_iter().flatten().for_each(|(key, value)| row[key] = value.clone());
    report.write(row)
}
