//! What it takes to say that two renders agree: means with errors from independent batches, t-tests on all of them at a family-wise
//! false-alarm rate of 1e-3, and errors small enough for agreement to mean something.

use crate::adapter;
use abbe::compare::difference::threshold;
use abbe::film::Film;
use abbe::integrator::Techniques;
use abbe::reference::ReferenceIntegrator;
use abbe::render::Integrator;
use abbe::scene::Scene;
pub use abbe::validate::figure::Figure;
use serde_json::{Value, json};
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Batches of a GPU render.
pub const BATCHES: u32 = 24;
/// Blocks along each side of the film.
pub const BLOCKS: u32 = 4;
/// A bin counts if its error is below this share of its mean, a block likewise.
const BIN_ERROR: f64 = 0.003;
const BLOCK_ERROR: f64 = 0.01;

/// Two figures of the same thing: their distance in standard errors, the error itself, and the degrees of freedom of that (Welch 1947).
pub fn against(a: Figure, b: Figure) -> (f64, f64, f64) {
    let error = a.error.hypot(b.error);
    if error == 0.0 {
        let z = if a.mean == b.mean { 0.0 } else { f64::INFINITY };
        return (z, 0.0, a.dof.min(b.dof));
    }
    let share = |f: Figure| (f.error / error).powi(4) / f.dof;
    ((a.mean - b.mean) / error, error, 1.0 / (share(a) + share(b)))
}

/// What is compared of a film: the mean over the image of every bin, and the luminance of blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    pub bins: Vec<Figure>,
    pub blocks: Vec<Figure>,
}

/// Every batch: pixels, and means over blocks, each `[pixel or block][bins, X, Y, Z]`.
pub struct Batches {
    pixels: Vec<Vec<f64>>,
    means: Vec<Vec<f64>>,
    channels: usize,
}

impl Batches {
    pub fn new(scene: &Scene) -> Self {
        Batches { pixels: Vec::new(), means: Vec::new(), channels: scene.film.bins.count as usize + 3 }
    }

    /// Renders one more batch; no sample may be dropped.
    pub fn add(&mut self, integrator: &mut dyn Integrator, scene: &Scene, spp: u32) {
        let mut film = Film::new(&scene.film);
        let index = self.means.len() as u32;
        let stats = integrator.render_batch(abbe::render::Batch::even(index, spp), &mut film).expect("a batch");
        assert_eq!(stats.dropped(), 0, "samples were dropped: {stats:?}");
        self.pixels.push((0..film.pixels()).flat_map(|p| film.pixel(p).to_vec()).collect());
        self.means.push(film.block_means(scene.film.width / BLOCKS));
    }

    pub fn len(&self) -> usize {
        self.means.len()
    }

    fn figure(&self, batches: &[Vec<f64>], places: &[usize], channel: usize) -> Figure {
        let value =
            |batch: &Vec<f64>| places.iter().map(|p| batch[p * self.channels + channel]).sum::<f64>() / places.len() as f64;
        Figure::of(&batches.iter().map(value).collect::<Vec<f64>>())
    }

    /// Mean over `blocks` of channel `channel`.
    pub fn over(&self, blocks: &[usize], channel: usize) -> Figure {
        self.figure(&self.means, blocks, channel)
    }

    /// Mean over `pixels` of channel `channel`.
    pub fn over_pixels(&self, pixels: &[usize], channel: usize) -> Figure {
        self.figure(&self.pixels, pixels, channel)
    }

    /// Mean over the image and over `channels`.
    fn together(&self, channels: Range<usize>) -> Figure {
        let pixels = |batch: &Vec<f64>| batch.chunks(self.channels).map(|p| p[channels.clone()].iter().sum::<f64>()).sum::<f64>();
        let values = self.pixels.iter().map(|batch| pixels(batch) / (batch.len() / self.channels * channels.len()) as f64);
        Figure::of(&values.collect::<Vec<f64>>())
    }

    pub fn figures(&self) -> Figures {
        let all: Vec<usize> = (0..(BLOCKS * BLOCKS) as usize).collect();
        let bins = (0..self.channels - 3).map(|bin| self.over(&all, bin)).collect();
        let blocks = all.iter().map(|&block| self.over(&[block], self.channels - 2)).collect();
        Figures { bins, blocks }
    }
}

/// Renders on the GPU.
pub fn gpu(scene: &Scene, seed: u64, spp: u32) -> Batches {
    gpu_with(scene, seed, spp, Techniques::default())
}

/// Likewise, with some techniques only.
pub fn gpu_with(scene: &Scene, seed: u64, spp: u32, techniques: Techniques) -> Batches {
    let mut integrator = adapter::with(scene, seed, techniques).expect("an adapter for the scene");
    let mut batches = Batches::new(scene);
    for _ in 0..BATCHES {
        batches.add(&mut integrator, scene, spp);
    }
    batches
}

/// One comparison: what of, the two figures, and the share of the mean below which their error must lie to count.
pub struct Pair {
    pub what: String,
    pub ours: Figure,
    pub theirs: Figure,
    pub small: f64,
}

/// Tells whether all pairs agree. Panics where one that counts does not, or where less than `share` of them count.
pub fn agree(name: &str, pairs: &[Pair], share: f64) {
    let family = pairs.len();
    let (mut counted, mut greatest, mut wrong) = (0, 0.0f64, Vec::new());
    for Pair { what, ours, theirs, small } in pairs {
        let (z, error, dof) = against(*ours, *theirs);
        let line = format!(
            "{name}: {what}: {:.6e} +- {:.1e}, reference {:.6e} +- {:.1e}, z = {z:.2}",
            ours.mean, ours.error, theirs.mean, theirs.error
        );
        if !error.is_finite() || error > small * theirs.mean.abs() {
            println!("{line}: does not count, its error is {:.2} %", 100.0 * error / theirs.mean);
            continue;
        }
        counted += 1;
        greatest = greatest.max(z.abs());
        if z.is_nan() || z.abs() > threshold(family, dof) {
            wrong.push(format!("{line}, limit {:.2}", threshold(family, dof)));
        }
    }
    println!("{name}: {counted} of {family} comparisons count, greatest |z| {greatest:.2}; {}", noise(pairs, share));
    assert!(wrong.is_empty(), "{}\nif {name} was changed on purpose: tools/make-references {name}", wrong.join("\n"));
    assert!(
        counted as f64 >= share * family as f64,
        "{name}: only {counted} of {family} comparisons have errors small enough to tell anything"
    );
}

/// What limits a comparison: the errors that `share` of the pairs keep to, in units of those that count, together and on each side.
fn noise(pairs: &[Pair], share: f64) -> String {
    let kept_to = |error: &dyn Fn(&Pair) -> f64| {
        let mut errors: Vec<f64> = pairs.iter().map(|p| error(p) / (p.small * p.theirs.mean.abs())).collect();
        errors.sort_by(f64::total_cmp);
        errors[((share * errors.len() as f64).ceil() as usize).saturating_sub(1)]
    };
    format!(
        "errors {:.2} of what counts (ours {:.2}, the reference's {:.2})",
        kept_to(&|p| p.ours.error.hypot(p.theirs.error)),
        kept_to(&|p| p.ours.error),
        kept_to(&|p| p.theirs.error)
    )
}

/// Pairs of all bins and blocks; `coarseness` times the usual errors still count.
pub fn pairs(ours: &Figures, theirs: &Figures, coarseness: f64) -> Vec<Pair> {
    assert_eq!((ours.bins.len(), ours.blocks.len()), (theirs.bins.len(), theirs.blocks.len()), "another film");
    let list = |what: &str, ours: &[Figure], theirs: &[Figure], small: f64| {
        let of = |(i, (&ours, &theirs)): (usize, (&Figure, &Figure))| Pair { what: format!("{what} {i}"), ours, theirs, small };
        ours.iter().zip(theirs).enumerate().map(of).collect::<Vec<_>>()
    };
    let mut all = list("bin", &ours.bins, &theirs.bins, coarseness * BIN_ERROR);
    all.extend(list("block", &ours.blocks, &theirs.blocks, coarseness * BLOCK_ERROR));
    all
}

/// Three quarters of all comparisons must count.
const SHARE: f64 = 0.75;

/// Holds the GPU to the stored reference of `name`. `coarseness` above 1 is for scenes whose light is hard to find: the errors that still
/// count, in units of the usual ones.
pub fn gpu_agrees_with_reference(name: &str, scene: &Scene, spp: u32, coarseness: f64) {
    let reference = read(name);
    agree(name, &pairs(&gpu(scene, 1, spp).figures(), &reference, coarseness), SHARE);
}

/// Holds the GPU with some techniques only to the stored reference of `name`.
pub fn techniques_agree_with_reference(name: &str, scene: &Scene, spp: u32, coarseness: f64, techniques: Techniques) {
    agree(name, &pairs(&gpu_with(scene, 2, spp, techniques).figures(), &read(name), coarseness), SHARE);
}

/// Holds the GPU, with each `bins / reference's bins` of its bins taken together, to the stored reference of `name`.
pub fn gpu_agrees_after_binning(name: &str, scene: &Scene, spp: u32) {
    let reference = read(name);
    let batches = gpu(scene, 1, spp);
    let width = scene.film.bins.count as usize / reference.bins.len();
    let bins = (0..reference.bins.len()).map(|bin| batches.together(bin * width..(bin + 1) * width)).collect();
    agree(name, &pairs(&Figures { bins, blocks: batches.figures().blocks }, &reference, 1.0), SHARE);
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/reference").join(format!("{name}.json"))
}

fn read(name: &str) -> Figures {
    let text = std::fs::read_to_string(path(name));
    let text = text.unwrap_or_else(|e| panic!("no reference of {name} ({e}): tools/make-references {name}"));
    let value: Value = serde_json::from_str(&text).expect("a reference in JSON");
    let dof = value["batches"].as_f64().expect("a count of batches") - 1.0;
    let list = |key: &str| {
        let row = |v: &Value| v.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect::<Vec<_>>();
        let (means, errors) = (row(&value[key]["mean"]), row(&value[key]["error"]));
        means.into_iter().zip(errors).map(|(mean, error)| Figure { mean, error, dof }).collect()
    };
    Figures { bins: list("bins"), blocks: list("blocks") }
}

/// Renders `scene` by the plain estimator that it names until the errors are well below what counts, or the time is up.
pub fn make_reference(name: &str, scene: &Scene, limit: Duration) {
    const FIRST: Duration = Duration::from_millis(500);
    let mut integrator = ReferenceIntegrator::new(scene, scene.reference, 7).expect("a scene this estimator can see");
    let (mut spp, start) = (1, Instant::now());
    // A batch of half a second.
    while spp < 1 << 20 {
        let start = Instant::now();
        Batches::new(scene).add(&mut integrator, scene, spp);
        if start.elapsed() > FIRST {
            break;
        }
        spp *= 2;
    }
    let mut batches = Batches::new(scene);
    let fine = |figures: &[Figure], small: f64| figures.iter().all(|f| f.error < 0.5 * small * f.mean);
    loop {
        batches.add(&mut integrator, scene, spp);
        if batches.len() >= 32 {
            let figures = batches.figures();
            if start.elapsed() > limit || fine(&figures.bins, BIN_ERROR) && fine(&figures.blocks, BLOCK_ERROR) {
                break;
            }
        }
    }
    let figures = batches.figures();
    let worst = |figures: &[Figure]| figures.iter().map(|f| f.error / f.mean).fold(0.0, f64::max);
    println!(
        "{name}: {:?}, {} batches of {spp} spp, {:.0} s, errors at most {:.2} % of bins, {:.2} % of blocks",
        scene.reference,
        batches.len(),
        start.elapsed().as_secs_f64(),
        100.0 * worst(&figures.bins),
        100.0 * worst(&figures.blocks)
    );
    let digits = |v: f64| format!("{v:.7e}").parse::<f64>().unwrap_or(v);
    let list = |figures: &[Figure]| {
        let of = |f: &dyn Fn(&Figure) -> f64| figures.iter().map(|v| digits(f(v))).collect::<Vec<f64>>();
        json!({"mean": of(&|f| f.mean), "error": of(&|f| f.error)})
    };
    let estimator = format!("{:?}", scene.reference).to_lowercase();
    let value = json!({
        "source": format!("abbe's {estimator} reference estimator, {} batches of {spp} samples per pixel", batches.len()),
        "batches": batches.len(),
        "bins": list(&figures.bins),
        "blocks": list(&figures.blocks),
    });
    std::fs::write(path(name), format!("{value:#}\n").replace("\n      ", " ").replace("\n    ]", " ]"))
        .expect("a place for the reference");
}
