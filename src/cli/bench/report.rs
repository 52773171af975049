//! Rows as they come: printed, and in a file.

use super::clock::{Spent, machine, today};
use super::curves::{self, Curve};
use super::reference::RelativeMse;
use crate::cli::plot;
use crate::cli::print::{note, out, percent, si};
use crate::error::Result;
use crate::gpu::list_adapters;
use crate::output::write_text;
use crate::render::Progress;
use serde_json::{Value, json};
use std::path::Path;

/// What rows have in common.
pub struct Run {
    pub scene: String,
    /// What it is rendered by: a method of Abbe's, or another renderer.
    pub method: String,
    pub device: String,
    /// The device's time is processor time.
    pub on_cpu: bool,
    pub plan: String,
    /// Time for planning, compiling and uploading, s.
    pub setup: f64,
}

/// A render so far.
#[derive(Clone, Copy)]
pub struct Row {
    pub progress: Progress,
    pub spent: Spent,
    pub relative_mse: Option<RelativeMse>,
}

/// All rows of a call.
pub struct Report<'a> {
    file: Option<&'a Path>,
    json: bool,
    machine: String,
    date: String,
    runs: Vec<(Run, Vec<Row>)>,
    /// In the file.
    rows: Vec<Value>,
}

impl<'a> Report<'a> {
    /// Nothing yet; for `file`, and for people or as JSON on standard output.
    pub fn new(file: Option<&'a Path>, json: bool) -> Self {
        Report { file, json, machine: machine(), date: today(), runs: Vec::new(), rows: Vec::new() }
    }

    /// A run begins; its number.
    pub fn begin(&mut self, run: Run) -> usize {
        if self.runs.is_empty() && !self.json {
            out(&format!(
                "{:<20} {:<16} {:>6} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9}  device",
                "scene", "method", "spp", "set-up/s", "render/s", "CPU/s", "rays/s", "camera/s", "error", "relMSE Y", "bins"
            ));
        }
        self.runs.push((run, Vec::new()));
        self.runs.len() - 1
    }

    /// One more row of a run.
    pub fn add(&mut self, run: usize, row: Row) -> Result<()> {
        let (run, rows) = &mut self.runs[run];
        rows.push(row);
        let value = row.json(run);
        self.write(value)
    }

    /// A run is over.
    pub fn end(&self, run: usize) {
        let (run, rows) = &self.runs[run];
        if let (Some(row), false) = (rows.last(), self.json) {
            out(&row.text(run));
        }
    }

    /// What could not be measured, and why.
    pub fn not_run(&mut self, scene: &str, method: &str, why: &str) -> Result<()> {
        if !self.json {
            out(&format!("{scene}, {method}: not run, {why}"));
        }
        self.write(json!({"scene": scene, "method": method, "not_run": why}))
    }

    /// What all runs together show.
    pub fn finish(mut self) -> Result<()> {
        if list_adapters().iter().all(|adapter| adapter.is_cpu()) {
            let (device, why) = ("hardware GPU", "this machine has none");
            if !self.json {
                out(&format!("{device}: not run, {why}"));
            }
            self.write(json!({"device": device, "not_run": why}))?;
        }
        let scenes = self.curves();
        if !self.json {
            scenes.iter().flat_map(|(scene, curves)| curves::findings(scene, curves)).for_each(|line| out(&line));
        }
        let plots: Vec<_> = scenes.iter().map(|(scene, curves)| curves::plot(scene, curves)).collect();
        match self.file {
            Some(_) if plots.is_empty() => note("no scene has a reference, so there is no picture of error over time"),
            Some(path) => write_text(&path.with_extension("svg"), &plot::grid(&plots, 2))?,
            None => {}
        }
        Ok(())
    }

    /// A row, with where and when it was measured.
    pub fn write(&mut self, mut row: Value) -> Result<()> {
        row["machine"] = self.machine.as_str().into();
        row["date"] = self.date.as_str().into();
        if self.json {
            out(&row.to_string());
        }
        self.rows.push(row);
        let Some(path) = self.file else { return Ok(()) };
        let lines: Vec<String> = self.rows.iter().map(Value::to_string).collect();
        write_text(path, &format!("[\n{}\n]\n", lines.join(",\n")))
    }

    /// Error over time of all runs, by scenes.
    fn curves(&self) -> Vec<(&str, Vec<Curve>)> {
        let mut scenes: Vec<(&str, Vec<Curve>)> = Vec::new();
        for (run, rows) in &self.runs {
            let points = rows.iter().filter_map(|row| Some((row.spent.counted(run.on_cpu), row.relative_mse?.luminance)));
            let curve = Curve { name: run.method.clone(), on_cpu: run.on_cpu, points: points.collect() };
            match scenes.iter_mut().find(|(scene, _)| *scene == run.scene) {
                Some((_, curves)) => curves.push(curve),
                None => scenes.push((&run.scene, vec![curve])),
            }
        }
        scenes.retain(|(_, curves)| curves.iter().all(|curve| !curve.points.is_empty()));
        scenes
    }
}

impl Row {
    /// Rays per second of the GPU's camera pass by itself.
    fn camera_rays_per_second(&self) -> Option<f64> {
        let stats = &self.progress.stats;
        (stats.camera_rays > 0).then(|| stats.camera_rays as f64 / stats.camera_time.as_secs_f64().max(1e-9))
    }

    /// Of all passes, where rays are counted.
    fn rays_per_second(&self) -> Option<f64> {
        let rays = self.progress.stats.rays;
        (rays > 0).then(|| rays as f64 / self.spent.wall.max(1e-9))
    }

    fn text(&self, run: &Run) -> String {
        let p = &self.progress;
        let error = |e: Option<f64>| e.map_or("-".to_string(), |e| format!("{e:.2e}"));
        format!(
            "{:<20} {:<16} {:>6} {:>8.2} {:>8.2} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9}  {}",
            run.scene,
            run.method,
            p.spp,
            run.setup,
            self.spent.wall,
            self.spent.cpu.map_or("-".to_string(), |cpu| format!("{cpu:.2}")),
            self.rays_per_second().map_or("-".to_string(), si),
            self.camera_rays_per_second().map_or("-".to_string(), si),
            if p.relative_error.is_finite() { percent(p.relative_error) } else { "-".to_string() },
            error(self.relative_mse.map(|e| e.luminance)),
            error(self.relative_mse.map(|e| e.bins)),
            run.device
        )
    }

    fn json(&self, run: &Run) -> Value {
        let p = &self.progress;
        json!({
            "scene": run.scene,
            "method": run.method,
            "plan": run.plan,
            "device": run.device,
            "setup_seconds": run.setup,
            "samples_per_pixel": p.spp,
            "samples": p.stats.paths,
            "seconds": self.spent.wall,
            "cpu_seconds": self.spent.cpu,
            "rays": (p.stats.rays > 0).then_some(p.stats.rays),
            "rays_per_second": self.rays_per_second(),
            "camera_rays_per_second": self.camera_rays_per_second(),
            "relative_error": p.relative_error.is_finite().then_some(p.relative_error),
            "relative_mse": self.relative_mse.map(|e| e.luminance),
            "relative_mse_bins": self.relative_mse.map(|e| e.bins),
            "dropped": p.stats.dropped(),
        })
    }
}
