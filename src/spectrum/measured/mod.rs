//! Measured spectra as instruments, catalogues and spreadsheets write them: columns of text, CGATS (ArgyllCMS's `.sp` and `.ti3`
//! are such) and IES TM-27 (`.spdx`).

mod cgats;
mod text;
mod tm27;

use super::{Spectrum, unit_problem};
use crate::error::{quoted, suggest};

/// Values below 0 count as the noise of an instrument, and as 0, down to this share of the greatest.
const NOISE: f64 = 0.02;
/// Names that an error lists.
const MOST_NAMED: usize = 8;

/// One measured quantity over wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Of its column or sample; a number where the file has no names.
    pub name: String,
    /// Wavelengths, nm, finite, positive and strictly increasing; at least one.
    pub nm: Vec<f64>,
    /// Finite; as many as `nm`.
    pub values: Vec<f64>,
}

impl Series {
    /// From points in any order, each with the line that it comes from.
    ///
    /// Errors name a line that holds no wavelength or value, or wavelengths that neither rise nor fall throughout.
    fn new(name: &str, mut points: Vec<(usize, f64, f64)>) -> Result<Self, String> {
        if let Some((line, x, y)) = points.iter().find(|(_, x, y)| !(x.is_finite() && *x > 0.0 && y.is_finite())) {
            return Err(format!("line {line}: {x} nm with value {y} is not finite and positive in wavelength"));
        }
        // Some instruments count down.
        let falls = points.len() > 1 && points[1].1 < points[0].1;
        let goes_on = |w: &[(usize, f64, f64)]| if falls { w[1].1 < w[0].1 } else { w[1].1 > w[0].1 };
        if let Some(w) = points.windows(2).find(|w| !goes_on(w)) {
            let (line, x, last) = (w[1].0, w[1].1, w[0].1);
            return Err(format!("line {line}: {x} nm follows {last} nm; wavelengths must rise or fall from line to line"));
        }
        if falls {
            points.reverse();
        }
        match (points.first(), points.last()) {
            (Some(first), Some(last)) => match unit_problem(first.1, last.1) {
                Some(problem) => Err(problem),
                None => {
                    let (nm, values) = points.into_iter().map(|(_, x, y)| (x, y)).unzip();
                    Ok(Series { name: name.to_string(), nm, values })
                }
            },
            _ => Err(NOTHING.to_string()),
        }
    }

    /// Takes small values below 0 as 0, and returns how many there were.
    pub fn without_noise(&mut self) -> usize {
        let greatest = self.values.iter().copied().fold(0.0, f64::max);
        let noise = |v: f64| v < 0.0 && v >= -NOISE * greatest;
        let count = self.values.iter().filter(|v| noise(**v)).count();
        self.values.iter_mut().filter(|v| noise(**v)).for_each(|v| *v = 0.0);
        count
    }

    /// Linear between the points; `extend` holds the end values outside them.
    pub fn spectrum(self, extend: bool) -> Spectrum {
        Spectrum::Table { nm: self.nm, values: self.values, extend }
    }
}

const NOTHING: &str = "no \"nm value\" line in the file";

/// All that a file holds, by what stands in it.
///
/// Errors are lines for people, that name a line of the file where one is to blame.
pub fn read(bytes: &[u8]) -> Result<Vec<Series>, String> {
    let text = decode(bytes);
    let series = if text.trim_start().starts_with('<') {
        tm27::read(&text)?
    } else if cgats::is_cgats(&text) {
        cgats::read(&text)?
    } else {
        text::read(&text)?
    };
    if series.is_empty() { Err(NOTHING.to_string()) } else { Ok(series) }
}

/// The series of this name (without regard to case), or the only one.
///
/// The error reads `problem; remedy`.
pub fn choose(series: Vec<Series>, name: Option<&str>) -> Result<Series, String> {
    let names = || series.iter().map(|s| quoted(&s.name)).take(MOST_NAMED).collect::<Vec<_>>().join(", ");
    let (count, more) = (series.len(), if series.len() > MOST_NAMED { ", ..." } else { "" });
    let Some(name) = name else {
        let remedy = "name one of them by \"column\"";
        return if count > 1 {
            Err(format!("the file holds {count} spectra: {}{more}; {remedy}", names()))
        } else {
            series.into_iter().next().ok_or_else(|| format!("{NOTHING}; write one per line"))
        };
    };
    match series.iter().position(|s| s.name.eq_ignore_ascii_case(name.trim())) {
        Some(i) => series.into_iter().nth(i).ok_or_else(String::new),
        None => {
            let known = suggest(name, series.iter().map(|s| s.name.as_str()));
            Err(format!("the file has no column {}, but {}{more}; {known}", quoted(name), names()))
        }
    }
}

/// Text as spreadsheets and instruments save it: UTF-8, UTF-16 by its mark, or one of the old code pages, whose letters beyond ASCII are lost.
pub fn decode(bytes: &[u8]) -> String {
    let wide = |of: fn([u8; 2]) -> u16| -> String {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|c| of([c[0], c[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)).into_owned(),
    }
}
