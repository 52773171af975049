//! Scenes of many lights, materials and instances.

use super::Args;
use super::cases::{Case, measure};
use super::clock::Clock;
use super::report::Report;
use super::scenes::wavy_ball;
use crate::cli::interrupt;
use crate::cli::print::{out, percent};
use crate::error::Result;
use crate::film::Film;
use crate::integrator::{GpuIntegrator, Plan, Techniques};
use crate::render::Integrator;
use crate::scene::{Emission, Geometry, Instance, LoadOptions, Material, Mesh, Scene, Shape, load_str};
use crate::spectrum::Spectrum;
use glam::{DAffine3, DQuat, DVec3, dvec3};
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

/// Batches for the error, and their samples of a pixel.
const BATCHES: u32 = 16;
const SPP: u32 = 4;
/// Balls of the scenes of many materials.
const BALLS: u32 = 10_000;
/// Side of the hall, m.
const SIDE: f64 = 40.0;

/// Measures all series.
pub fn run(args: &Args, report: &mut Report) -> Result<()> {
    if !args.json {
        out(&format!("lights\n{:<32} {:>10} {:>10} {:>10}  chosen", "", "ns/sample", "error", "cost"));
    }
    for count in [10, 1000, 100_000] {
        let scene = lights(count)?;
        let planned = Plan::new(&scene, Techniques::default());
        let plans = [planned.clone(), planned.with_lights_by_power()];
        for plan in plans {
            lit(args, &format!("{count} lights"), &scene, plan, report)?;
        }
        if interrupt::requested() {
            return Ok(());
        }
    }
    let cases = [1, 100, BALLS].map(|count| case(format!("{BALLS} balls, {count} materials"), materials(count), 0, None));
    measure(args, "materials", &cases.into_iter().collect::<Result<Vec<_>>>()?, report)?;
    let shared = instances()?;
    let own = shared.flattened();
    let cases = [("meshes of their own", own, None), ("shared mesh", shared, Some(2.5))];
    let cases = cases.map(|(name, scene, limit)| case(format!("100 balls, {name}"), Ok(scene), 0, limit));
    measure(args, "instances", &cases.into_iter().collect::<Result<Vec<_>>>()?, report)
}

fn case(name: String, scene: Result<Scene>, base: usize, limit: Option<f64>) -> Result<Case> {
    let scene = scene?;
    Ok(Case { plan: Plan::new(&scene, Techniques::default()), name, scene, base, limit })
}

/// Error and time of a scene, and what they come to: time for an error of 1 %.
fn lit(args: &Args, name: &str, scene: &Scene, plan: Plan, report: &mut Report) -> Result<()> {
    let by = if plan.has(crate::integrator::Feature::LightGrid) { "by a grid" } else { "by power" };
    let mut integrator = GpuIntegrator::with_plan(scene, args.device.as_deref(), args.seed, plan)?;
    let mut film = Film::try_new(&scene.film)?;
    let mut warm = Film::try_new(&scene.film)?;
    integrator.render_batch(crate::render::Batch::even(0, 1), &mut warm)?;
    let clock = Clock::start();
    for index in 1..=BATCHES {
        integrator.render_batch(crate::render::Batch::even(index, SPP), &mut film)?;
    }
    let seconds = clock.spent().counted(integrator.adapter().is_cpu());
    let samples = film.pixels() as f64 * f64::from(BATCHES * SPP);
    let error = film.relative_error();
    let cost = seconds * (error / 0.01).powi(2);
    if !args.json {
        out(&format!("{name:<32} {:>10.0} {:>10} {cost:>8.1} s  {by}", 1e9 * seconds / samples, percent(error)));
    }
    report.write(json!({
        "series": "lights",
        "case": name,
        "chosen": by,
        "device": integrator.adapter().to_string(),
        "nanoseconds_per_sample": 1e9 * seconds / samples,
        "relative_error": error,
        "seconds_to_one_percent": cost,
    }))
}

/// A hall with rows of pillars, without light.
fn hall(more: &str) -> Result<Scene> {
    let s = SIDE / 2.0;
    let pillars: Vec<String> = (0..36)
        .map(|i| {
            let (x, z) = (f64::from(i % 6) * 6.0 - 15.0, f64::from(i / 6) * 6.0 - 15.0);
            format!(r#"{{"box": {{"min": [{x}, 0, {z}], "max": [{}, 4, {}]}}, "material": "white"}}"#, x + 0.5, z + 0.5)
        })
        .collect();
    let text = format!(
        r#"{{"film": {{"width": 128, "height": 128}},
        "camera": {{"perspective": {{"eye": [0, 2, {}], "target": [0, 1.5, 0], "vfov_deg": 60}}}},
        "materials": {{"white": {{"diffuse": {{"reflectance": 0.6}}}}}},
        "shapes": [{{"box": {{"min": [-{s}, 0, -{s}], "max": [{s}, 4, {s}]}}, "material": "white"}}, {}] {more}}}"#,
        s - 1.0,
        pillars.join(", ")
    );
    load_str(&text, Path::new("hall"), Path::new("."), &LoadOptions::default())
}

/// The hall under so many lights: triangles, two to a small lamp, spread below its ceiling.
fn lights(count: u32) -> Result<Scene> {
    let mut scene = hall("")?;
    let lamps = count / 2;
    let across = f64::from(lamps).sqrt().ceil();
    let half = 0.2 * SIDE / across / 2.0;
    let mut mesh = Mesh::default();
    for i in 0..lamps {
        let at = |v: f64| ((v + 0.5) / across - 0.5) * SIDE;
        let center = dvec3(at((f64::from(i) % across).floor()), 3.9, at((f64::from(i) / across).floor()));
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| center + half * dvec3(x, 0.0, z)));
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v: u32| v + first)));
    }
    let geometry = Geometry::Mesh(Arc::new(mesh));
    let radiance = Spectrum::Constant(100.0).into();
    let emission = Some(Emission { radiance, two_sided: false });
    scene.shapes.push(Shape { name: "lamps".into(), geometry, material: 0, interior: None, emission });
    Ok(scene)
}

/// The hall with balls of so many materials.
fn materials(count: u32) -> Result<Scene> {
    let mut scene = hall(r#", "lights": [{"constant": {"radiance": 1}}]"#)?;
    scene.shapes.truncate(1);
    let first = scene.materials.len();
    scene.materials.extend((0..count).map(|i| {
        let reflectance = Spectrum::Constant(0.2 + 0.6 * f64::from(i) / f64::from(count)).into();
        Material::Diffuse { reflectance }
    }));
    let across = f64::from(BALLS).sqrt().ceil();
    let radius = 0.4 * SIDE / across;
    for i in 0..BALLS {
        let at = |v: f64| ((v + 0.5) / across - 0.5) * SIDE;
        let center = dvec3(at((f64::from(i) % across).floor()), radius, at((f64::from(i) / across).floor()));
        let (geometry, material) = (Geometry::Sphere { center, radius }, first + (i % count) as usize);
        scene.shapes.push(Shape { name: format!("ball {i}"), geometry, material, interior: None, emission: None });
    }
    Ok(scene)
}

/// A hundred balls of ten thousand triangles on a floor.
fn instances() -> Result<Scene> {
    let mut scene = hall(r#", "lights": [{"constant": {"radiance": 1}}]"#)?;
    scene.shapes.truncate(1);
    let mesh = Arc::new(wavy_ball(DVec3::ZERO, 1.0, 100, 51));
    for i in 0..100 {
        let at = dvec3(f64::from(i % 10) * 3.5 - 16.0, 1.2, f64::from(i / 10) * 3.5 - 16.0);
        let place = DAffine3::from_rotation_translation(DQuat::from_rotation_y(f64::from(i)), at);
        let geometry = Geometry::Instance(Instance::new(mesh.clone(), place));
        scene.shapes.push(Shape { name: format!("ball {i}"), geometry, material: 0, interior: None, emission: None });
    }
    Ok(scene)
}
