//! Cases with a known answer: scenes whose light can be worked out on paper, rendered by the same interface as any other scene and held to
//! that answer.
//!
//! A [`Case`] is data: scenes, and rows that say what number to take from their films, what it must be, and how well. Exact numbers are
//! closed formulas or quadratures of optics in double precision ([`optics`]), or published values; none comes from what is checked. Errors are
//! those of the mean over [`BATCHES`] independent batches. All comparisons of all cases together raise a false alarm once in a thousand
//! runs (Sidak over [`FAMILY`]), and a row whose standard error exceeds what the row states is no pass: it could not have told.

mod cases;
pub mod figure;
pub mod optics;

pub use cases::all;

use crate::compare::difference::threshold;
use crate::error::Result;
use crate::film::Film;
use crate::integrator::Techniques;
use crate::render::Renderer;
use crate::scene::{LoadOptions, Scene, load_str};
use crate::stats::BatchStats;
use figure::Figure;
use serde_json::Value;
use std::path::Path;

/// Independent batches of every view.
pub const BATCHES: u32 = 24;

/// At least as many as the comparisons of all rows, so that the limits do not depend on which cases are run.
pub const FAMILY: usize = 4800;

/// A scene to render.
pub struct View {
    /// The scene, as a scene file has it.
    pub scene: Value,
    /// What JSON cannot say about it.
    pub change: Option<fn(&mut Scene)>,
    /// Samples per pixel of a batch, at a budget of 1.
    pub spp: u32,
    /// Light paths for each camera path, where a probe is not to choose.
    pub light_paths: Option<f64>,
    /// How paths are found.
    pub techniques: Techniques,
    /// Keys the random numbers. Views of one case have different seeds, unless they are to be the same picture.
    pub seed: u64,
    /// Whether a larger budget means more samples; not where the number of samples is what the case is about.
    pub scales: bool,
}

/// Numbers out of the films of a case's views, each of one batch; all of them are compared with the row's exact value. Without
/// views, the films are none.
pub type Measure = Box<dyn Fn(&[Film]) -> Vec<f64>>;

/// One number with a known value.
pub struct Row {
    /// What it is called, for ever; `case/row`.
    pub id: String,
    /// What it must be.
    pub exact: f64,
    /// How far it may be off beside its error: digits of the exact value, geometry left out of the formula, single precision.
    pub floor: f64,
    /// The greatest standard error at which agreement tells something.
    pub largest_sigma: f64,
    /// How it is measured.
    pub measure: Measure,
}

/// Scenes and what is known of them.
pub struct Case {
    /// What it is called, for ever.
    pub id: &'static str,
    /// What it is, in one line.
    pub title: &'static str,
    /// What is rendered.
    pub views: Vec<View>,
    /// What is measured.
    pub rows: Vec<Row>,
}

/// What came of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Within the limit, and the error was small enough to tell.
    Passed,
    /// Beyond the limit.
    Failed,
    /// Within the limit, but the error is too large to tell anything.
    TooNoisy,
}

/// A row's measured number beside the exact one. Of several comparisons it is that with the greatest share of its limit.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The row.
    pub id: String,
    /// Mean over the batches.
    pub measured: f64,
    /// What it must be.
    pub exact: f64,
    /// Standard error of `measured`; 0 where nothing is random.
    pub sigma: f64,
    /// The greatest deviation that is no failure.
    pub limit: f64,
    /// The greatest standard error over the row's comparisons.
    pub greatest_sigma: f64,
    /// The greatest that counts.
    pub largest_sigma: f64,
    /// How many numbers were compared.
    pub comparisons: usize,
    /// Whether it passed.
    pub verdict: Verdict,
}

/// What opens a device for a scene: with a seed, techniques and, where given, the number of light paths for each camera path.
pub type Open<'a> = &'a dyn Fn(&Scene, u64, Techniques, Option<f64>) -> Result<Box<dyn Renderer>>;

impl View {
    /// `spp` samples per pixel of each batch of `scene`.
    pub fn new(scene: Value, spp: u32) -> Self {
        View { scene, change: None, spp, light_paths: None, techniques: Techniques::default(), seed: 1, scales: true }
    }

    /// Loads the scene.
    ///
    /// # Errors
    /// [`crate::Error::Scene`], which is a defect of the case.
    pub fn load(&self) -> Result<Scene> {
        let nowhere = Path::new(".");
        let mut scene = load_str(&self.scene.to_string(), Path::new("validate"), nowhere, &LoadOptions::default())?;
        if let Some(change) = self.change {
            change(&mut scene);
        }
        Ok(scene)
    }

    /// A film for each batch.
    fn render(&self, open: Open, budget: u32, stats: &mut BatchStats) -> Result<Vec<Film>> {
        let scene = self.load()?;
        let mut renderer = open(&scene, self.seed, self.techniques, self.light_paths)?;
        let spp = self.spp * if self.scales { budget } else { 1 };
        (0..BATCHES)
            .map(|index| {
                let mut film = Film::new(&scene.film);
                *stats += renderer.render_batch(crate::render::Batch::even(index, spp), &mut film)?;
                Ok(film)
            })
            .collect()
    }
}

impl Case {
    /// Renders all views with `budget` times the least number of samples, and measures. Counts what was traced and dropped in `stats`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where nothing can render.
    pub fn run(&self, open: Open, budget: u32, stats: &mut BatchStats) -> Result<Vec<Outcome>> {
        let views = self.views.iter().map(|view| view.render(open, budget, stats)).collect::<Result<Vec<_>>>()?;
        let batches = if views.is_empty() { 1 } else { BATCHES as usize };
        let films: Vec<Vec<Film>> = (0..batches).map(|i| views.iter().map(|view| view[i].clone()).collect()).collect();
        Ok(self.rows.iter().map(|row| row.judge(&films)).collect())
    }
}

impl Row {
    /// A row without floor; see [`Row::floor`].
    pub fn new(id: impl Into<String>, exact: f64, largest_sigma: f64, measure: impl Fn(&[Film]) -> Vec<f64> + 'static) -> Self {
        Row { id: id.into(), exact, floor: 0.0, largest_sigma, measure: Box::new(measure) }
    }

    /// The same, allowed to be off by `floor`.
    pub fn floor(self, floor: f64) -> Self {
        Row { floor, ..self }
    }

    fn judge(&self, batches: &[Vec<Film>]) -> Outcome {
        let values: Vec<Vec<f64>> = batches.iter().map(|films| (self.measure)(films)).collect();
        let figures: Vec<Figure> =
            (0..values[0].len()).map(|i| Figure::of(&values.iter().map(|v| v[i]).collect::<Vec<_>>())).collect();
        let limit = |f: &Figure| self.floor + if f.error > 0.0 { threshold(FAMILY, f.dof) * f.error } else { 0.0 };
        // Written so that NaN is the worst of all and never passes.
        let share = |f: &Figure| {
            let off = (f.mean - self.exact).abs();
            if off == 0.0 {
                0.0
            } else if off.is_nan() {
                f64::INFINITY
            } else {
                off / limit(f)
            }
        };
        let worst = figures.iter().copied().max_by(|a, b| share(a).total_cmp(&share(b)));
        let worst = worst.unwrap_or(Figure { mean: f64::NAN, error: f64::NAN, dof: 1.0 });
        let greatest_sigma = figures.iter().map(|f| f.error).fold(0.0, f64::max);
        let verdict = if share(&worst) > 1.0 {
            Verdict::Failed
        } else if greatest_sigma > self.largest_sigma {
            Verdict::TooNoisy
        } else {
            Verdict::Passed
        };
        Outcome {
            id: self.id.clone(),
            measured: worst.mean,
            exact: self.exact,
            sigma: worst.error,
            limit: limit(&worst),
            greatest_sigma,
            largest_sigma: self.largest_sigma,
            comparisons: figures.len(),
            verdict,
        }
    }
}

/// A row of its own: all samples that are missing because they were NaN, infinite, negative or too large, or ended by the driver.
pub fn dropped(stats: &BatchStats) -> Outcome {
    let count = stats.dropped() as f64;
    Row::new("dropped-samples", 0.0, 0.0, move |_| vec![count]).judge(&[vec![]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(values: &[f64], exact: f64, floor: f64, largest_sigma: f64) -> Verdict {
        let settings = View::new(cases::smallest_scene(), 1).load().unwrap().film;
        let films: Vec<Vec<Film>> = values
            .iter()
            .map(|v| {
                let mut film = Film::new(&settings);
                film.add_batch_f64(&[*v, 0.0, 0.0, 0.0], 1);
                vec![film]
            })
            .collect();
        Row::new("x", exact, largest_sigma, |f| vec![f[0].mean_of(0)]).floor(floor).judge(&films).verdict
    }

    #[test]
    fn a_row_passes_only_if_it_is_right_and_can_tell() {
        let near: Vec<f64> = (0..24).map(|i| 1.0 + 0.01 * f64::from(i % 2)).collect();
        assert_eq!(judged(&near, 1.005, 0.0, 0.01), Verdict::Passed);
        assert_eq!(judged(&near, 1.1, 0.0, 0.01), Verdict::Failed);
        assert_eq!(judged(&near, 1.1, 0.2, 0.01), Verdict::Passed);
        assert_eq!(judged(&near, 1.005, 0.0, 1e-4), Verdict::TooNoisy);
        // Without noise only the floor is left.
        assert_eq!(judged(&[1.0; 24], 1.0, 0.0, 0.0), Verdict::Passed);
        assert_eq!(judged(&[1.0; 24], 1.0 + 1e-9, 0.0, 1.0), Verdict::Failed);
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(judged(&[bad; 24], 1.0, 1.0, 1.0), Verdict::Failed);
        }
    }
}
