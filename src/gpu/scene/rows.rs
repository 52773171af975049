//! Rows of the table of spectra that every pass evaluates at its wavelengths.

use crate::spectrum::{Ior, Spectrum};
use std::collections::HashMap;

/// What one row of the per-pass spectral table holds.
#[derive(Debug, Clone, PartialEq)]
pub enum SpectrumRow {
    /// The film's weight for its bins: 1 / (pdf of the wavelength x bin width).
    FilmBin,
    /// The film's weight for X, Y or Z.
    FilmXyz(usize),
    /// A spectrum.
    Spectrum(Spectrum),
    /// An index of refraction.
    Ior(Ior),
    /// The coordinate of upsampled colours, (nm - 360) / 470.
    UpsamplingCoordinate,
    /// A thickness in nm, over the wavelength.
    Waves(f64),
}

impl SpectrumRow {
    /// Value at `nm`; `weights` are the film's: bin, X, Y, Z.
    pub fn eval(&self, nm: f64, weights: &[f64; 4]) -> f64 {
        match self {
            SpectrumRow::FilmBin => weights[0],
            SpectrumRow::FilmXyz(i) => weights[1 + i],
            SpectrumRow::Spectrum(s) => s.eval(nm),
            SpectrumRow::Ior(n) => n.eval(nm),
            SpectrumRow::UpsamplingCoordinate => (nm - 360.0) / 470.0,
            SpectrumRow::Waves(thickness) => thickness / nm,
        }
    }
}

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
        for row in [SpectrumRow::FilmBin, SpectrumRow::FilmXyz(0), SpectrumRow::FilmXyz(1), SpectrumRow::FilmXyz(2)] {
            rows.add(row);
        }
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

    pub(super) fn spectrum(&mut self, s: &Spectrum) -> u32 {
        self.add(SpectrumRow::Spectrum(s.clone()))
    }
}
