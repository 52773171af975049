//! Where the time goes: rays, what each of them tests and reads, shares of the passes, how long paths are.

use super::Args;
use super::clock::Clock;
use super::report::Report;
use crate::cli::print::{out, si};
use crate::error::Result;
use crate::film::Film;
use crate::integrator::{GpuIntegrator, Plan, Techniques};
use crate::render::Integrator;
use crate::scene::Scene;
use crate::stats::{BatchStats, Counts};
use serde_json::{Value, json};
use std::time::Duration;

/// Samples of a batch, of all pixels together, and batches.
const SAMPLES: u64 = 1 << 18;
const BATCHES: u32 = 4;
/// Bytes that the traversal fetches for a node (five vec4s) and a primitive (three), before any cache.
const NODE_BYTES: f64 = 80.0;
const PRIMITIVE_BYTES: f64 = 48.0;
/// Floating-point operations, as trace.wgsl and intersect_triangle.wgsl have them: of a node 9, and for each of 8 boxes 7 products, 6 sums, 6 minima
/// or maxima and a comparison; of a triangle, up to where its edges are compared.
const NODE_OPERATIONS: f64 = 9.0 + 8.0 * 20.0;
const PRIMITIVE_OPERATIONS: f64 = 73.0;

/// One pass of a scene.
struct Pass {
    name: &'static str,
    rays: u64,
    time: Duration,
    counts: Counts,
}

/// Measures `scene`: the time without counting, the counts with it.
pub fn run(args: &Args, scene: &Scene, report: &mut Report) -> Result<()> {
    let plan = Plan::new(scene, Techniques::from(&args.techniques));
    let (timed, spent, device) = batches(args, scene, plan.clone(), |_| ())?;
    let (clocked, ..) = batches(args, scene, plan.clone(), |integrator| {
        integrator.time_kernels();
    })?;
    let (counted, ..) = batches(args, scene, plan.counted(), |_| ())?;
    let kernels = shares(&clocked);
    let passes = [
        Pass { name: "camera", rays: counted.camera_rays, time: timed.camera_time, counts: counted.camera_counts },
        Pass { name: "light", rays: counted.rays - counted.camera_rays, time: timed.light_time, counts: counted.light_counts },
    ];
    for pass in passes.iter().filter(|pass| pass.rays > 0) {
        let seconds = pass.time.as_secs_f64();
        let per_ray = |n: u64| n as f64 / pass.rays as f64;
        let (nodes, primitives) = (per_ray(pass.counts.nodes), per_ray(pass.counts.primitives));
        let paths: u64 = pass.counts.ended.iter().sum();
        let alive: Vec<f64> = (0..pass.counts.ended.len())
            .map(|n| pass.counts.ended[n..].iter().sum::<u64>() as f64 / paths.max(1) as f64)
            .collect();
        let bytes = nodes * NODE_BYTES + primitives * PRIMITIVE_BYTES;
        let operations = nodes * NODE_OPERATIONS + primitives * PRIMITIVE_OPERATIONS;
        let row = json!({
            "series": "roofline",
            "case": scene.name,
            "pass": pass.name,
            "device": device,
            "rays": pass.rays,
            "rays_per_path": per_ray(paths).recip(),
            "rays_per_second": pass.rays as f64 / seconds.max(1e-9),
            "share_of_time": seconds / spent.max(1e-9),
            "nodes_per_ray": nodes,
            "primitives_per_ray": primitives,
            "bytes_per_ray": bytes,
            "operations_per_ray": operations,
            "alive_after_events": alive,
            "longest_dispatch_seconds": timed.longest_dispatch.as_secs_f64(),
            "share_of_clock": kernels,
        });
        if !args.json {
            out(&text(&row));
        }
        report.write(row)?;
    }
    Ok(())
}

/// Shares of the kernels in their time by the adapter's own clock; `None` if it has none.
fn shares(stats: &BatchStats) -> Option<Value> {
    let all = stats.kernel_times.iter().sum::<Duration>().as_secs_f64();
    let share = |(name, time): (&&str, &Duration)| (name.to_string(), json!(time.as_secs_f64() / all));
    (all > 0.0).then(|| Value::Object(BatchStats::KERNELS.iter().zip(&stats.kernel_times).map(share).collect()))
}

/// Counts of all batches after the first, time on the wall for them, and the device.
fn batches(
    args: &Args,
    scene: &Scene,
    plan: Plan,
    prepare: impl FnOnce(&mut GpuIntegrator),
) -> Result<(BatchStats, f64, String)> {
    let mut integrator = GpuIntegrator::with_plan(scene, args.device.as_deref(), args.seed, plan)?;
    prepare(&mut integrator);
    let mut film = Film::try_new(&scene.film)?;
    let spp = (SAMPLES / film.pixels() as u64).clamp(1, 64) as u32;
    integrator.render_batch(crate::render::Batch::even(0, spp), &mut film)?;
    let (clock, mut stats) = (Clock::start(), BatchStats::default());
    for batch in 1..=BATCHES {
        stats += integrator.render_batch(crate::render::Batch::even(batch, spp), &mut film)?;
    }
    Ok((stats, clock.spent().wall, integrator.adapter().to_string()))
}

fn text(row: &Value) -> String {
    let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    let alive = |n: usize| 100.0 * row["alive_after_events"][n].as_f64().unwrap_or(f64::NAN);
    let label = |key: &str| row[key].as_str().unwrap_or_default().to_string();
    let clock = row["share_of_clock"].as_object().map_or(" not known".to_string(), |shares| {
        shares.iter().map(|(name, share)| format!(" {name} {:.0} %", 100.0 * share.as_f64().unwrap_or(f64::NAN))).collect()
    });
    format!(
        "{:<20} {:<7} {:>3.0} % of the time, {}rays/s, {:.1} rays per path; per ray {:.1} nodes, {:.1} primitives, {:.0} bytes, \
         {:.0} operations; alive after 1, 2, 4, 8 events: {:.0}, {:.0}, {:.0}, {:.0} %; longest dispatch {:.0} ms; by the adapter's clock{}",
        label("case"),
        label("pass"),
        100.0 * number("share_of_time"),
        si(number("rays_per_second")),
        number("rays_per_path"),
        number("nodes_per_ray"),
        number("primitives_per_ray"),
        number("bytes_per_ray"),
        number("operations_per_ray"),
        alive(1),
        alive(2),
        alive(4),
        alive(8),
        1e3 * number("longest_dispatch_seconds"),
        clock
    )
}
