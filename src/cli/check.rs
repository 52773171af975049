//! `abbe check`: what a scene will show, in words, and what in it is probably not meant.

use super::device::TechniqueArgs;
use super::info::{light_name, sensor_name, summary};
use super::load::{CropArgs, MemoryArgs, Overrides, SceneArgs};
use super::{Done, Outcome, print::out, values};
use crate::integrator::Plan;
use crate::scene::{Interior, Lens, Material, Scene, advice, initial_interiors, ruling};
use crate::spectrum::{Ior, LINE_C_NM, LINE_D_NM, LINE_F_NM};
use glam::DVec3;
use std::collections::HashMap;

const EXAMPLES: &str = "Examples:
  abbe check scenes/newton.json
  abbe check model.glb
  abbe check my_scene.json --channels 40 && abbe render my_scene.json --channels 40
  abbe check my_scene.json --without light-paths     which light would not be found?
  abbe check my_scene.json --at 0,0.5,0              in which volumes is that point?

Warnings do not make a scene wrong: the exit code is 0.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    crop: CropArgs,
    #[command(flatten)]
    techniques: TechniqueArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Say which volumes this point is in, in metres, and which of them rules there
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    at: Vec<DVec3>,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    args.memory.limit();
    let overrides = Overrides { crop: args.crop.crop, ..args.scene.overrides.clone() };
    let scene = overrides.load(&args.scene.path)?;
    let plan = Plan::new(&scene, (&args.techniques).into());
    explain(&scene, &plan).iter().for_each(|line| out(line));
    args.at.iter().for_each(|p| out(&volumes_at(&scene, *p)));
    scene.notes.iter().for_each(|note| out(&format!("note: {note}")));
    let warnings: Vec<String> = advice(&scene).into_iter().chain(unfound(&plan)).collect();
    warnings.iter().for_each(|warning| out(&format!("warning: {warning}")));
    let verdict = match warnings.len() {
        0 => "no warnings".to_string(),
        1 => "1 warning".to_string(),
        n => format!("{n} warnings"),
    };
    out(&format!("{}: {verdict} ({})", args.scene.path.display(), summary(&scene)));
    Ok(Done::Completely)
}

/// What no technique of the plan finds.
pub(super) fn unfound(plan: &Plan) -> impl Iterator<Item = String> {
    plan.blind_spots.iter().map(|line| format!("not found: {line}; allow what is left out by --without"))
}

/// Which volumes a point is in, the one that rules first.
fn volumes_at(scene: &Scene, p: DVec3) -> String {
    let mut inside = initial_interiors(scene, &[p]).remove(0);
    let mut named = Vec::new();
    while !inside.is_empty() {
        let rules = ruling(scene, &inside);
        let bodies = inside.iter().filter(|i| **i == rules).count();
        inside.retain(|i| *i != rules);
        let Interior { name, priority, depth, .. } = &scene.interiors[rules];
        let how_often = if bodies > 1 { format!(", {bodies} bodies of it") } else { String::new() };
        let held = if *depth > 0 { format!(", nested {depth} deep") } else { String::new() };
        named.push(format!("{name:?} (priority {priority}{held}{how_often})"));
    }
    match named.as_slice() {
        [] => format!("at {}, {}, {}: in no volume", p.x, p.y, p.z),
        [only] => format!("at {}, {}, {}: in {only}", p.x, p.y, p.z),
        [rules, others @ ..] => format!("at {}, {}, {}: in {rules}, which rules, and in {}", p.x, p.y, p.z, others.join(", ")),
    }
}

/// Things of a kind that are named, at most.
const MOST_NAMED: usize = 12;

/// Each of `names` once, with how often it comes; of many only the first, and how many other `things` there are.
fn few(names: impl IntoIterator<Item = String>, things: &str) -> Vec<String> {
    let mut order: Vec<String> = Vec::new();
    let mut times: HashMap<String, usize> = HashMap::new();
    for name in names {
        let count = times.entry(name.clone()).or_insert(0);
        *count += 1;
        if *count == 1 {
            order.push(name);
        }
    }
    let others: usize = order.iter().skip(MOST_NAMED).map(|name| times[name]).sum();
    let named = order.iter().take(MOST_NAMED).map(|name| match times[name] {
        1 => name.clone(),
        n => format!("{name} ({n} times)"),
    });
    named.chain((others > 0).then(|| format!("and {others} more {things}"))).collect()
}

/// What will be rendered.
fn explain(scene: &Scene, plan: &Plan) -> Vec<String> {
    let (film, bins) = (&scene.film, &scene.film.bins);
    let mut lines = vec![format!(
        "{} x {} pixels of {} bins, {} to {} nm, {}",
        film.width,
        film.height,
        bins.count,
        bins.min_nm,
        bins.max_nm,
        sensor_name(&scene.sensor)
    )];
    lines.extend(plan.part.iter().map(|part| format!("part: {part}")));
    let lamps = scene.shapes.iter().filter(|s| s.emission.is_some()).map(|s| format!("{:?} (shape)", s.name));
    let lights = few(scene.lights.iter().map(light_name).chain(lamps), "lights");
    lines.push(format!("light: {}", if lights.is_empty() { "none".into() } else { lights.join(", ") }));
    let mut volumes = Vec::new();
    for interior in &scene.interiors[1..] {
        let mut parts = vec![index(&interior.ior, bins.min_nm, bins.max_nm)];
        if !interior.sigma_a.is_zero() {
            parts.push(format!("absorbs {:.3} per m at 550 nm", interior.sigma_a.eval(550.0)));
        }
        if !interior.sigma_s.is_zero() {
            parts.push(format!("scatters {:.3} per m at 550 nm", interior.sigma_s.eval(550.0)));
        }
        volumes.push(format!("volume {:?}: {}", interior.name, parts.join(", ")));
    }
    lines.extend(few(volumes, "volumes"));
    lines.extend(few(scene.lenses.iter().map(lens), "lenses"));
    let panes = scene.materials.iter().filter_map(Material::pane);
    lines.extend(few(panes.map(|ior| format!("thin panes: {}", index(ior, bins.min_nm, bins.max_nm))), "thin panes"));
    if plan.texture_bytes > 0 {
        lines.push(format!("pictures on surfaces: {:.1} MiB", plan.texture_bytes as f64 / 1048576.0));
    }
    lines.push(match &plan.light {
        Some(_) => "caustics: looked for by light paths from the lamps".into(),
        None => "caustics: none to be expected (nothing bends light, or nothing catches what is bent)".into(),
    });
    lines
}

/// What a lens does near its axis, in air.
fn lens(lens: &Lens) -> String {
    let at = [LINE_F_NM, LINE_D_NM, LINE_C_NM].map(|nm| lens.prescription.paraxial(nm));
    let mm = |metres: f64| format!("{:.3}", 1e3 * lens.scale * metres);
    let [f, d, c] = at.map(|p| mm(p.focal_length));
    let (f_number, back) = (at[1].f_number(), mm(at[1].back_focus()));
    format!(
        "lens {:?}: focal length {f} mm at F, {d} mm at d, {c} mm at C; f/{f_number:.2}, back focus {back} mm at d",
        lens.name
    )
}

fn index(ior: &Ior, lo: f64, hi: f64) -> String {
    if ior.is_constant_over(lo, hi) {
        format!("index {:.4} at all wavelengths", ior.nd())
    } else {
        format!("index {:.4} at 587.6 nm, Abbe number {:.1}", ior.nd(), ior.vd())
    }
}
