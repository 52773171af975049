//! Rows of the table of spectra that every pass evaluates at its wavelengths.

use crate::gpu::layout;
use crate::scene::texture::{Spectra, channel_at};
use crate::spectrum::{Ior, Spectrum};
use std::collections::HashMap;
use std::sync::Arc;

/// What one row of the per-pass spectral table holds.
#[derive(Debug, Clone, PartialEq)]
pub enum SpectrumRow {
    /// A number of each wavelength sample, of [`layout::ROW_BIN`] and the others: the film's weights, 1 / (pdf of the wavelength x bin width) for bins.
    OfSample(u32),
    /// All four of each, in texels: a part of [`layout::ROW_FILM`].
    OfSamples(u32),
    /// A spectrum.
    Spectrum(Spectrum),
    /// An index of refraction.
    Ior(Ior),
    /// The index of a volume: part 0 as above, the others a texel for each wavelength that may be a path's hero (`integrator::wavelengths::hero_texels`).
    Volume(Ior, u32),
    /// The coordinate of upsampled colours, (nm - 360) / 470.
    UpsamplingCoordinate,
    /// A thickness in nm, over the wavelength.
    Waves(f64),
    /// The number of the bin that the wavelength is in; outside them the next, if values are held there, or the number of bins.
    Channel(Arc<Spectra>, bool),
}

impl SpectrumRow {
    /// Value at `nm`; `of_sample` are the wavelength sample's own, in the order of the first rows.
    pub fn eval(&self, nm: f64, of_sample: &[f64; 4]) -> f64 {
        match self {
            SpectrumRow::OfSample(i) | SpectrumRow::OfSamples(i) => of_sample[*i as usize],
            SpectrumRow::Spectrum(s) => s.eval(nm),
            SpectrumRow::Ior(n) | SpectrumRow::Volume(n, _) => n.eval(nm),
            SpectrumRow::UpsamplingCoordinate => (nm - 360.0) / 470.0,
            SpectrumRow::Waves(thickness) => thickness / nm,
            SpectrumRow::Channel(spectra, hold) => channel_at(spectra.edges_nm(), nm, *hold) as f64,
        }
    }
}

/// As many rows as the texels of all heroes take, of films of any number of bins.
pub const HERO_ROWS: u32 = 7;

/// Rows in use, each once, so that equal spectra (and so matched indices) share a row.
#[derive(Debug)]
pub(super) struct Rows {
    pub(super) all: Vec<SpectrumRow>,
    /// Rows by what they are at three wavelengths: scenes have thousands.
    known: HashMap<[u64; 3], Vec<u32>>,
}

impl Rows {
    pub(super) fn new() -> Self {
        let mut rows = Rows { all: Vec::new(), known: HashMap::new() };
        for i in [layout::ROW_BIN, layout::ROW_X, layout::ROW_Y, layout::ROW_Z] {
            assert_eq!(rows.add(SpectrumRow::OfSample(i)), i);
        }
        rows.all.extend((0..4).map(SpectrumRow::OfSamples));
        rows
    }

    pub(super) fn add(&mut self, row: SpectrumRow) -> u32 {
        let key = [431.0, 547.0, 683.0].map(|nm| row.eval(nm, &[0.0, 1.0, 2.0, 3.0]).to_bits());
        let alike = self.known.entry(key).or_default();
        if let Some(at) = alike.iter().find(|&&at| self.all[at as usize] == row) {
            return *at;
        }
        let at = self.all.len() as u32;
        alike.push(at);
        self.all.push(row);
        at
    }

    /// The index of a volume; behind that what heroes read of it, if the scene `parts_wavelengths`.
    pub(super) fn volume(&mut self, ior: &Ior, parts_wavelengths: bool) -> u32 {
        let at = self.add(SpectrumRow::Volume(ior.clone(), 0));
        if parts_wavelengths && self.all.len() as u32 == at + 1 {
            self.all.extend((1..=HERO_ROWS).map(|part| SpectrumRow::Volume(ior.clone(), part)));
        }
        at
    }

    pub(super) fn spectrum(&mut self, s: &Spectrum) -> u32 {
        self.add(SpectrumRow::Spectrum(s.clone()))
    }
}
