//! How time grows with the resolution, the triangles and the bins.

use super::Args;
use super::cases::{Case, measure};
use super::report::Report;
use super::scenes::{cornell_box, triangles};
use crate::cli::print::out;
use crate::error::Result;
use crate::geometry::bvh;
use crate::integrator::{Plan, Techniques};
use crate::scene::{Geometry, LoadOptions, Mesh, Scene};
use serde_json::{Value, json};
use std::time::Instant;

/// Triangles of the largest scene, and the time that its hierarchy may take, s.
const MANY: u32 = 1_000_000;
const MANY_SECONDS: f64 = 3.0;

/// Measures all series.
pub fn run(args: &Args, report: &mut Report) -> Result<()> {
    let options = |size: u32, channels: u32| LoadOptions {
        width: Some(size),
        height: Some(size),
        channels: Some(channels),
        ..LoadOptions::default()
    };
    let case = |name: String, scene: Result<Scene>, base: usize, limit: Option<f64>| {
        let scene = scene?;
        Ok(Case { plan: Plan::new(&scene, Techniques::default()), name, scene, base, limit })
    };

    let sizes = [256u32, 64, 128, 512, 1024].map(|size| {
        let limit = (size > 256).then_some(1.1);
        case(format!("cornell_box {size}x{size}"), cornell_box(&Value::Null, &options(size, 20)), 0, limit)
    });
    measure(args, "resolution", &sizes.into_iter().collect::<Result<Vec<_>>>()?, report)?;

    // As the logarithm grows from a thousand on.
    let counts = [1_000u32, 10_000, 100_000, MANY].map(|count| {
        let limit = f64::from(count).ln() / 1000f64.ln();
        case(format!("{count} triangles"), triangles(count, &options(256, 20)), 0, (count > 1000).then_some(limit))
    });
    measure(args, "triangles", &counts.into_iter().collect::<Result<Vec<_>>>()?, report)?;
    hierarchy(args, report)?;

    let bins = [(4, 0, None), (20, 0, Some(1.25)), (80, 1, Some(2.0))].map(|(bins, base, limit)| {
        case(format!("cornell_box, {bins} bins"), cornell_box(&Value::Null, &options(256, bins)), base, limit)
    });
    measure(args, "bins", &bins.into_iter().collect::<Result<Vec<_>>>()?, report)
}

/// Builds the hierarchy of the largest scene.
fn hierarchy(args: &Args, report: &mut Report) -> Result<()> {
    let scene = triangles(MANY, &LoadOptions::default())?;
    let boxes: Vec<_> = scene.shapes.iter().flat_map(|shape| triangle_boxes(&shape.geometry)).collect();
    let start = Instant::now();
    let built = bvh::build(&boxes, 0.0, &[], |_| true);
    let seconds = start.elapsed().as_secs_f64();
    if !args.json {
        out(&format!("BVH of {} triangles: {seconds:.2} s, limit {MANY_SECONDS} s, {} nodes", boxes.len(), built.nodes.len()));
    }
    report.write(json!({
        "series": "BVH",
        "case": format!("{} triangles", boxes.len()),
        "seconds": seconds,
        "seconds_limit": MANY_SECONDS,
        "nodes": built.nodes.len(),
    }))
}

fn triangle_boxes(geometry: &Geometry) -> Vec<(glam::Vec3, glam::Vec3)> {
    let Geometry::Mesh(mesh) = geometry else { return Vec::new() };
    let mesh: &Mesh = mesh;
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_vec3());
        (a.min(b).min(c), a.max(b).max(c))
    };
    mesh.triangles.iter().map(of).collect()
}
