//! Cases measured in turns, each by the ratio to another one: what others do on the machine meanwhile falls on all of them.

use super::Args;
use super::clock::{Clock, Spent};
use super::report::Report;
use crate::cli::interrupt;
use crate::cli::print::out;
use crate::error::Result;
use crate::film::Film;
use crate::integrator::{GpuIntegrator, Plan};
use crate::render::Integrator;
use crate::scene::Scene;
use serde_json::json;

/// Samples of a turn, of all pixels together, and those of a pixel in each of its batches, whatever the resolution.
const SAMPLES: u64 = 1 << 19;
const SPP: u32 = 8;
/// Turns of every case.
const TURNS: u32 = 3;

/// Something to measure the time per sample of.
pub struct Case {
    pub name: String,
    pub scene: Scene,
    pub plan: Plan,
    /// The case, by its place in the list, that it is compared with.
    pub base: usize,
    /// Greatest ratio that is as it should be, if that is known.
    pub limit: Option<f64>,
}

/// A case under way.
struct Runner<'a> {
    case: &'a Case,
    integrator: GpuIntegrator,
    film: Film,
    /// Until the pipelines were there, and until the first sample of every pixel was, s.
    setup: f64,
    first_pixels: Spent,
    /// Time per sample of each turn, s.
    times: Vec<f64>,
}

/// Measures `cases` and reports them as rows of `series`.
pub fn measure(args: &Args, series: &str, cases: &[Case], report: &mut Report) -> Result<()> {
    let mut runners = Vec::new();
    for case in cases {
        let clock = Clock::start();
        let mut integrator = GpuIntegrator::with_plan(&case.scene, args.device.as_deref(), args.seed, case.plan.clone())?;
        let setup = clock.spent().wall;
        let mut film = Film::try_new(&case.scene.film)?;
        integrator.render_batch(crate::render::Batch::even(0, 1), &mut film)?;
        runners.push(Runner { case, integrator, film, setup, first_pixels: clock.spent(), times: Vec::new() });
    }
    for turn in 1..=TURNS {
        for runner in &mut runners {
            runner.turn(turn)?;
        }
        if interrupt::requested() {
            return Ok(());
        }
    }
    if !args.json {
        out(&format!(
            "{series}\n{:<32} {:>10} {:>8} {:>8} {:>10} {:>14}",
            "", "ns/sample", "ratio", "limit", "set-up/s", "first pixels/s"
        ));
    }
    for runner in &runners {
        runner.report(args, series, &runners[runner.case.base], report)?;
    }
    Ok(())
}

impl Runner<'_> {
    fn turn(&mut self, turn: u32) -> Result<()> {
        let batch = self.film.pixels() as u64 * u64::from(SPP);
        let batches = SAMPLES.div_ceil(batch) as u32;
        let clock = Clock::start();
        for index in turn * batches..(turn + 1) * batches {
            self.integrator.render_batch(crate::render::Batch::even(index, SPP), &mut self.film)?;
        }
        let time = clock.spent().counted(self.integrator.adapter().is_cpu());
        self.times.push(time / (batch * u64::from(batches)) as f64);
        Ok(())
    }

    fn report(&self, args: &Args, series: &str, base: &Runner, report: &mut Report) -> Result<()> {
        let ratio = median(self.times.iter().zip(&base.times).map(|(a, b)| a / b).collect());
        let (nanoseconds, limit) = (1e9 * median(self.times.clone()), self.case.limit);
        if !args.json {
            let limit = limit.map_or(String::new(), |limit| format!("{limit:.2}"));
            out(&format!(
                "{:<32} {nanoseconds:>10.0} {ratio:>8.3} {limit:>8} {:>10.2} {:>14.2}",
                self.case.name, self.setup, self.first_pixels.wall
            ));
        }
        report.write(json!({
            "series": series,
            "case": self.case.name,
            "relative_to": base.case.name,
            "device": self.integrator.adapter().to_string(),
            "nanoseconds_per_sample": nanoseconds,
            "ratio": ratio,
            "ratio_limit": limit,
            "setup_seconds": self.setup,
            "first_pixels_seconds": self.first_pixels.wall,
            "first_pixels_cpu_seconds": self.first_pixels.cpu,
        }))
    }
}

/// The one in the middle.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
