//! Which wavelengths the paths of a pass carry: one per stratum of the film's range, all jittered by one shared offset.
//!
//! The offset is warped inside each stratum by the distribution of the scene's emission, mixed with half uniform, so that a line of a laser or a
//! fluorescent lamp does not fall between samples; the density enters the film's weights.

use super::sample_counts::ROUND;
use crate::scene::{Bins, Light, Scene, WavelengthSampling};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{Observer, observer};
use glam::Vec4;

/// Wavelengths that camera paths of a pass choose their hero among.
pub const HEROES: usize = 4;
/// Heroes for the picture's sake, over those for the bins'.
const BY_LUMINANCE: f64 = 0.5;

/// Strata with a density each.
#[derive(Debug, Clone)]
pub struct Wavelengths {
    strata: Vec<Stratum>,
    /// Probability up to each wavelength of being the hero of a camera path, [`Self::beyond`] ones on both sides of the film's range included.
    hero_cdf: Vec<f64>,
    sampling: WavelengthSampling,
    /// Offsets of rounds of passes come in mirrored pairs.
    mirrored: bool,
}

/// One stratum: a density over cells that is constant, or linear, in each.
#[derive(Debug, Clone)]
pub struct Stratum {
    /// Cell edges, nm.
    edges: Vec<f64>,
    /// Probability up to each edge.
    cdf: Vec<f64>,
    /// Density at the ends of each cell over its mean there.
    ends: Vec<[f64; 2]>,
}

/// Emission this many times as strong in a cell as in its stratum is a line.
const LINE: f64 = 2.0;

impl Stratum {
    fn new(lo: f64, hi: f64, emission: &[(f64, Spectrum)]) -> Self {
        let mut edges = vec![lo, hi];
        emission.iter().for_each(|(_, s)| s.breakpoints(lo, hi, &mut edges));
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|a, b| *a - *b < 1e-9);
        let power = |a: f64, b: f64| emission.iter().map(|(w, s)| w * s.integral(a, b)).sum::<f64>();
        let total = power(lo, hi);
        let (mut cdf, mut ends) = (vec![0.0], Vec::new());
        let mut sum = 0.0;
        for w in edges.windows(2) {
            let width = w[1] - w[0];
            let uniform = width / (hi - lo);
            let share = if total > 0.0 { 0.5 * uniform + 0.5 * power(w[0], w[1]) / total } else { uniform };
            sum += share;
            cdf.push(sum);
            // The slope from within the cell: there may be steps at its edges. A density is not negative.
            let at = |t: f64| emission.iter().map(|(weight, s)| weight * s.eval(w[0] + t * width)).sum::<f64>();
            let slope = if total > 0.0 { 0.5 * width * (at(0.75) - at(0.25)) / (total * share) } else { 0.0 };
            ends.push([1.0 - slope.clamp(-1.0, 1.0), 1.0 + slope.clamp(-1.0, 1.0)]);
        }
        cdf.iter_mut().for_each(|c| *c /= sum);
        Self { edges, cdf, ends }
    }

    fn width(&self) -> f64 {
        self.edges[self.edges.len() - 1] - self.edges[0]
    }

    /// Does the emission stand out somewhere? (Half of the density is uniform.)
    fn has_line(&self) -> bool {
        let density = |i: usize| (self.cdf[i + 1] - self.cdf[i]) / (self.edges[i + 1] - self.edges[i]);
        (0..self.ends.len()).any(|i| density(i) * self.width() > 0.5 + 0.5 * LINE)
    }

    /// The same without slopes.
    fn in_steps(self) -> Self {
        Self { ends: vec![[1.0; 2]; self.ends.len()], ..self }
    }

    /// Wavelength and its density (per nm) for `u` in [0, 1).
    pub fn sample(&self, u: f64) -> (f64, f64) {
        let last = self.edges.len() - 2;
        let cell = self.cdf.partition_point(|&c| c <= u).saturating_sub(1).min(last);
        let (p, width) = (self.cdf[cell + 1] - self.cdf[cell], self.edges[cell + 1] - self.edges[cell]);
        let share = if p > 0.0 { ((u - self.cdf[cell]) / p).clamp(0.0, 1.0) } else { 0.5 };
        // The root of the integral of a linear density.
        let [first, second] = self.ends[cell];
        let t = 2.0 * share / (first + (first * first + (second * second - first * first) * share).max(0.0).sqrt()).max(1e-30);
        let t = t.min(1.0);
        (self.edges[cell] + t * width, p / width * (first + t * (second - first)))
    }
}

impl Wavelengths {
    /// Strata of the scene's film.
    pub fn new(scene: &Scene) -> Self {
        let bins = &scene.film.bins;
        let count = Self::per_path(bins.count);
        let emission = emission(scene);
        let edge = |i: u32| Bins { count, ..*bins }.edge_nm(i);
        let mut strata: Vec<Stratum> = (0..count).map(|i| Stratum::new(edge(i), edge(i + 1), &emission)).collect();
        let mirrored = strata.iter().any(Stratum::has_line);
        if !mirrored {
            strata = strata.into_iter().map(Stratum::in_steps).collect();
        }
        let power = |i: u32| emission.iter().map(|(w, s)| w * s.integral(edge(i), edge(i + 1))).sum::<f64>();
        let cmf = observer(Observer::Cie1931);
        let luminance = |i: u32| power(i) * cmf.eval(0.5 * (edge(i) + edge(i + 1)))[1];
        let beyond = Self::beyond(count);
        let film = |i: u32| i.checked_sub(beyond).filter(|i| *i < count);
        // Bins want wavelengths alike; the picture wants those that it is bright by.
        let (even, power, luminance) = (|_| 1.0, |i| film(i).map_or(0.0, power), |i| film(i).map_or(0.0, luminance));
        let wanted: Vec<(f64, Vec<f64>)> = [(1.0, &even as &dyn Fn(u32) -> f64), (1.0, &power), (BY_LUMINANCE, &luminance)]
            .iter()
            .filter_map(|(share, weight)| {
                let weights: Vec<f64> = (0..count + 2 * beyond).map(weight).collect();
                let total: f64 = weights.iter().sum();
                // No luminance outside the visible range.
                (total > 0.0).then(|| (*share, weights.iter().map(|w| w / total).collect()))
            })
            .collect();
        let all: f64 = wanted.iter().map(|(share, _)| share).sum();
        let mut hero_cdf = vec![0.0];
        for i in 0..(count + 2 * beyond) as usize {
            hero_cdf.push(hero_cdf[i] + wanted.iter().map(|(share, weights)| share / all * weights[i]).sum::<f64>());
        }
        Self { strata, hero_cdf, sampling: scene.film.sampling, mirrored }
    }

    /// The wavelengths that camera paths of a pass choose their hero among, spread evenly over their probabilities from `u` in [0, 1), and
    /// 1 / (`HEROES` times the probability) of each. In the mean over `u` the weights of every wavelength sum up to 1. They are numbered from the first of those that lie
    /// before the film's range.
    pub fn heroes(&self, u: f64) -> [(u32, f64); HEROES] {
        let last = self.hero_cdf.len() - 2;
        let total = self.hero_cdf[last + 1];
        std::array::from_fn(|i| {
            let at = (i as f64 + u) / HEROES as f64 * total;
            let hero = (self.hero_cdf.partition_point(|&c| c <= at) - 1).min(last);
            (hero as u32, total / (HEROES as f64 * (self.hero_cdf[hero + 1] - self.hero_cdf[hero])))
        })
    }

    /// Of so many wavelengths that a path carries, how many on either side of the film's range are heroes as well: those at its ends share their ways. None where a set
    /// of bits has no room to tell (shaders/path/hero.wgsl).
    pub fn beyond(wavelengths: u32) -> u32 {
        if wavelengths > 30 { 0 } else { (wavelengths - 1) / 3 }
    }

    /// Wavelengths a path carries for a film of `bins`: one per bin up to 32, for fewer than four a multiple of them.
    pub fn per_path(bins: u32) -> u32 {
        match bins {
            0..4 => bins * 4u32.div_ceil(bins.max(1)),
            4..=32 => bins,
            _ => 32,
        }
    }

    /// Number of a pass's offset in their sequence, and whether it is mirrored: where there are lines every other round of passes has the offsets of the one before,
    /// mirrored.
    pub fn point(&self, pass: u64) -> (u64, bool) {
        let round = u64::from(ROUND);
        if self.mirrored { (pass / (2 * round) * round + pass % round, pass / round % 2 == 1) } else { (pass, false) }
    }

    /// Wavelengths (nm) and densities (per nm) of a pass with offset `u` in [0, 1).
    pub fn pass(&self, u: f64) -> Vec<(f64, f64)> {
        let middle = |s: &Stratum| {
            let (lo, hi) = (s.edges[0], s.edges[s.edges.len() - 1]);
            (0.5 * (lo + hi), 1.0 / (hi - lo))
        };
        self.strata
            .iter()
            .map(|s| match self.sampling {
                WavelengthSampling::Continuous => s.sample(u),
                WavelengthSampling::Centres => middle(s),
            })
            .collect()
    }
}

/// What shaders read at each wavelength that may be the hero of a path, from the first before the film's range on: the index of refraction, and what it changes by to the next
/// wavelength. `index` has those within the range; beyond it goes on as its image in the point at the end, `beyond` wavelengths to either side.
pub fn hero_texels(index: &[f64], beyond: u32) -> Vec<Vec4> {
    let (last, beyond) = (index.len() as i64 - 1, i64::from(beyond));
    let at = |i: i64| {
        let end = i.clamp(0, last);
        2.0 * index[end as usize] - index[(2 * end - i).clamp(0, last) as usize]
    };
    (-beyond..=last + beyond).map(|i| Vec4::new(at(i) as f32, (0.5 * (at(i + 1) - at(i - 1))) as f32, 0.0, 0.0)).collect()
}

/// Emission spectra of the scene, weighted alike by their mean over the film.
fn emission(scene: &Scene) -> Vec<(f64, Spectrum)> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let shapes = scene.shapes.iter().filter_map(|s| s.emission.as_ref().map(|e| e.radiance.shape()));
    let lights = scene.lights.iter().map(Light::spectrum);
    let mut out: Vec<(f64, Spectrum)> = Vec::new();
    for s in shapes.chain(lights) {
        let mean = s.mean(lo, hi);
        if mean > 0.0 && !out.iter().any(|(_, known)| known == s) {
            out.push((1.0 / mean, s.clone()));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::scene::HERO_ROWS;

    #[test]
    fn every_wavelength_is_the_hero_as_often_as_it_should_be() {
        let emission = [0.1, 0.4, 0.0, 0.2, 0.3];
        let mut hero_cdf = vec![0.0];
        emission.iter().for_each(|e| hero_cdf.push(hero_cdf[hero_cdf.len() - 1] + 0.1 + 0.5 * e));
        let strata = vec![Stratum::new(0.0, 1.0, &[]); 5];
        let w = Wavelengths { strata, hero_cdf, sampling: WavelengthSampling::Continuous, mirrored: false };
        let (n, mut kept) = (10_000, [0.0; 5]);
        for i in 0..n {
            let heroes = w.heroes((f64::from(i) + 0.5) / f64::from(n));
            heroes.iter().for_each(|(hero, weight)| kept[*hero as usize] += weight);
        }
        for k in kept {
            assert!((k / f64::from(n) - 1.0).abs() < 1e-3, "{kept:?}");
        }
    }

    #[test]
    fn a_stratum_integrates_a_line_and_a_smooth_spectrum_alike() {
        let line = Spectrum::Band { center_nm: 405.0, width_nm: 0.1, height: 10.0 };
        let s = Stratum::new(400.0, 420.0, &[(1.0, line.clone())]);
        let n = 1000;
        let (mut in_line, mut flat) = (0.0, 0.0);
        let mut hits = 0;
        for i in 0..n {
            let (nm, pdf) = s.sample((f64::from(i) + 0.5) / f64::from(n));
            assert!((400.0..=420.0).contains(&nm));
            hits += u32::from(line.eval(nm) > 0.0);
            in_line += line.eval(nm) / pdf / f64::from(n);
            flat += 1.0 / pdf / f64::from(n);
        }
        assert!(hits > 450, "half of the samples belong to the line: {hits}");
        assert!((in_line - 1.0).abs() < 5e-3, "{in_line}");
        assert!((flat - 20.0).abs() < 0.05, "{flat}");
    }

    #[test]
    fn the_density_of_a_line_is_that_of_its_samples() {
        let line =
            Spectrum::Table { nm: vec![400.0, 406.0, 408.0, 410.0, 420.0], values: vec![0.1, 0.1, 5.0, 0.1, 0.1], extend: false };
        let s = Stratum::new(400.0, 420.0, &[(1.0, line.clone())]);
        assert!(s.has_line());
        for i in 1..1000 {
            let (u, du) = (f64::from(i) / 1000.0, 1e-6);
            let ([below, _], (_, pdf), [above, _]) = ([s.sample(u - du).0, 0.0], s.sample(u), [s.sample(u + du).0, 0.0]);
            assert!((pdf * (above - below) / (2.0 * du) - 1.0).abs() < 1e-2, "{u}: {pdf}, {below} to {above}");
        }
        // What a line is weighed with is the same on both sides of where its table bends.
        let weights = [407.99, 408.01].map(|nm| {
            let near = |u: &f64| (s.sample(*u).0 - nm).abs();
            let u = (0..100_000).map(|i| f64::from(i) / 1e5).min_by(|a, b| near(a).total_cmp(&near(b))).expect("one");
            line.eval(s.sample(u).0) / s.sample(u).1
        });
        assert!((weights[0] / weights[1] - 1.0).abs() < 0.01, "{weights:?}");
        assert!(!Stratum::new(400.0, 420.0, &[(1.0, Spectrum::Blackbody { kelvin: 3000.0, scale: 1.0 })]).has_line());
    }

    #[test]
    fn texels_of_all_heroes_have_room() {
        for bins in 1..=400 {
            let wavelengths = Wavelengths::per_path(bins);
            let heroes = wavelengths + 2 * Wavelengths::beyond(wavelengths);
            assert!(heroes <= HERO_ROWS * wavelengths.div_ceil(4), "{bins}");
        }
    }

    #[test]
    fn indices_of_heroes_beyond_the_range_are_images() {
        let texels = hero_texels(&[1.7, 1.6, 1.54, 1.5], 1);
        let expected = [(1.8, -0.08), (1.7, -0.1), (1.6, -0.08), (1.54, -0.05), (1.5, -0.04), (1.46, -0.05)];
        assert_eq!(texels.len(), expected.len());
        for (texel, (index, change)) in texels.iter().zip(expected) {
            assert!((texel - Vec4::new(index, change, 0.0, 0.0)).abs().max_element() < 1e-6, "{texels:?}");
        }
    }

    #[test]
    fn few_and_many_bins_get_whole_strata() {
        for bins in 1..=400 {
            let wavelengths = Wavelengths::per_path(bins);
            assert!(
                (4..=32).contains(&wavelengths) && (wavelengths.is_multiple_of(bins) || wavelengths == 32),
                "{bins}: {wavelengths}"
            );
        }
    }
}
