//! Colours that a picture's space cannot show, such as those of a spectrum.
//!
//! A colour with a negative component keeps its lightness, nearly its hue, and as much of its saturation as fits. Lightness and hue are Oklab's,
//! in which scaling the light keeps the hue: so the most saturated colours of every hue, "the ring", are the mixtures of two neighbouring
//! primaries, scaled to any lightness. Two departures from the plain rule are made for spectra, and grow from nothing at the gamut's border:
//!
//! - Oklab continues the hue of the red primary towards the purple side: long-wave light would turn pink. Cutting negative components off makes it
//!   the pure primary, but makes one colour of all that lies beyond a primary. The hue taken lies between the two, and never stands still.
//! - The ring has corners at the primaries, which show as lines in a smooth spectrum. Colours far outside go to a ring with its corners rounded off.

use super::oklab::{ROOTS_TO_LAB, XYZ_TO_LMS, hue_degrees, oklab_of_lms, saturation};
use super::wgsl;
use crate::color::convert::{Matrix, apply, multiply};
use crate::color::space::Space;

/// How far the hue moves from Oklab's to that of the cut colour.
const HUE_SHARE: f64 = 2.0 / 3.0;
/// Rounding reaches this far to both sides of a hue, degrees.
const ROUNDING: f64 = 12.0;
/// Rounding is complete for colours that lose this share of their saturation.
const FAR_OUTSIDE: f64 = 0.4;
/// Entries of the ring, so many that what is cut off its corners between them is less than a step of 8 bits.
const ENTRIES: usize = 36000;
/// Entries of the rounded ring.
const ROUNDED_ENTRIES: usize = 3600;

/// What is done about colours outside the gamut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gamut {
    /// Keep hue and lightness, give up saturation.
    #[default]
    Map,
    /// Cut every component to [0, 1].
    Clip,
    /// Leave negative components and those above 1 as they are; what 8 and 16 bits cannot hold is cut there.
    Keep,
}

impl Gamut {
    /// All of them by name.
    pub const NAMED: [(&str, Gamut); 3] = [("map", Gamut::Map), ("clip", Gamut::Clip), ("keep", Gamut::Keep)];
}

/// The map of one space.
#[derive(Debug, Clone)]
pub struct GamutMap {
    to_lms: Matrix,
    /// The most saturated colour of every hue, of lightness 1.
    ring: Vec<[f64; 3]>,
    /// The same with its corners rounded off.
    rounded: Vec<[f64; 3]>,
}

impl GamutMap {
    /// The map into `space`.
    pub fn new(space: Space) -> Self {
        let to_lms = multiply(&XYZ_TO_LMS, &multiply(&Space::Srgb.to_xyz(), &space.to(Space::Srgb)));
        let mut map = GamutMap { to_lms, ring: Vec::new(), rounded: Vec::new() };
        map.ring = map.sharp_ring();
        let reach = (ROUNDING / 360.0 * ROUNDED_ENTRIES as f64) as usize;
        let mean = |i: usize| {
            let mut sum = [0.0; 3];
            for d in 0..=2 * reach {
                // A raised cosine has no corners of its own.
                let weight = 1.0 + (std::f64::consts::PI * (d as f64 / reach as f64 - 1.0)).cos();
                let p = map.ring[(i + ROUNDED_ENTRIES + d - reach) % ROUNDED_ENTRIES * (ENTRIES / ROUNDED_ENTRIES)];
                (0..3).for_each(|c| sum[c] += weight * p[c]);
            }
            map.of_lightness_one(sum)
        };
        map.rounded = (0..ROUNDED_ENTRIES).map(mean).collect();
        map
    }

    /// Linear RGB without negative components for any linear RGB; what has none stays as it is.
    pub fn without_negatives(&self, rgb: [f64; 3]) -> [f64; 3] {
        let cut = rgb.map(|v| v.max(0.0));
        if cut == rgb {
            return rgb;
        }
        let lab = self.oklab(rgb);
        if lab[0] <= 0.0 || cut == [0.0; 3] {
            return [0.0; 3];
        }
        let own = hue_degrees(lab);
        let turn = (hue_degrees(self.oklab(cut)) - own + 540.0).rem_euclid(360.0) - 180.0;
        let hue = (own + HUE_SHARE * turn).rem_euclid(360.0);
        let sharp = at(&self.ring, hue);
        let lost = 1.0 - saturation(self.oklab(sharp)) / saturation(lab);
        let t = (lost / FAR_OUTSIDE).clamp(0.0, 1.0);
        let share = t * t * (3.0 - 2.0 * t);
        let rounded = at(&self.rounded, hue);
        let p = self.of_lightness_one(std::array::from_fn(|i| sharp[i] + share * (rounded[i] - sharp[i])));
        p.map(|v| v * lab[0].powi(3))
    }

    /// Names and values of the numbers of [`GamutMap::without_negatives`] for the same on a GPU.
    pub(super) fn wgsl(&self) -> String {
        [
            wgsl::matrix("RGB_TO_LMS", &self.to_lms),
            wgsl::matrix("ROOTS_TO_LAB", &ROOTS_TO_LAB),
            wgsl::number("HUE_SHARE", HUE_SHARE),
            wgsl::number("FAR_OUTSIDE", FAR_OUTSIDE),
            wgsl::count("RING", ENTRIES),
            wgsl::count("ROUNDED_RING", ROUNDED_ENTRIES),
        ]
        .concat()
    }

    /// The most saturated colours of every hue, sharp and rounded.
    pub(super) fn rings(&self) -> [&[[f64; 3]]; 2] {
        [&self.ring, &self.rounded]
    }

    fn oklab(&self, rgb: [f64; 3]) -> [f64; 3] {
        oklab_of_lms(apply(&self.to_lms, rgb))
    }

    fn of_lightness_one(&self, rgb: [f64; 3]) -> [f64; 3] {
        let l = self.oklab(rgb)[0];
        rgb.map(|v| v / (l * l * l))
    }

    fn sharp_ring(&self) -> Vec<[f64; 3]> {
        // From primary to primary in small steps; where a step passes an entry's hue, the entry lies between its ends. In some spaces the hue
        // turns back by a fraction of a degree just before blue: steps that do not get further are left out.
        const STEPS: usize = 4000;
        let mixture = |step: usize| {
            let (from, t) = (step / STEPS % 3, (step % STEPS) as f64 / STEPS as f64);
            let mut rgb = [0.0; 3];
            rgb[from] = 1.0 - t;
            rgb[(from + 1) % 3] = t;
            rgb
        };
        let mut ring = vec![[0.0; 3]; ENTRIES];
        let entry = |rgb| hue_degrees(self.oklab(rgb)) / 360.0 * ENTRIES as f64;
        let mut a = mixture(0);
        for step in 1..=3 * STEPS {
            let b = mixture(step);
            let from = entry(a);
            let half = 0.5 * ENTRIES as f64;
            let length = (entry(b) - from + half).rem_euclid(ENTRIES as f64) - half;
            if length <= 0.0 {
                continue;
            }
            for i in from.ceil() as usize..=(from + length).floor() as usize {
                let t = (i as f64 - from) / length;
                ring[i % ENTRIES] = self.of_lightness_one(std::array::from_fn(|c| a[c] + t * (b[c] - a[c])));
            }
            a = b;
        }
        ring
    }
}

/// A ring's colour at a hue in degrees.
fn at(ring: &[[f64; 3]], hue: f64) -> [f64; 3] {
    let x = hue / 360.0 * ring.len() as f64;
    let (i, t) = (x as usize, x.fract());
    let (a, b) = (ring[i % ring.len()], ring[(i + 1) % ring.len()]);
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

/// The largest component of a colour brought below 1: unchanged up to `knee`, above approaching 1.
pub fn shoulder(max: f64, knee: f64) -> f64 {
    if max <= knee { max } else { 1.0 - (1.0 - knee) * (-(max - knee) / (1.0 - knee)).exp() }
}
