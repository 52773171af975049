//! Glasses from files: refractiveindex.info's (`.yml`), Zemax catalogues (`.agf`), and columns of text with an index and, it may be, an extinction
//! coefficient ([`super::measured`]).

mod agf;
mod rii;

use super::measured::{self, Series};
use super::{Ior, Spectrum};
use crate::error::{quoted, suggest};
use std::f64::consts::PI;

/// Names that an error lists.
const MOST_NAMED: usize = 6;

/// A transparent material of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Glass {
    /// Its name there; empty where the file has none.
    pub name: String,
    /// Index of refraction, as the file gives it.
    pub ior: Ior,
    /// Extinction coefficient k over wavelength, where the file has it.
    pub k: Option<Series>,
    /// Where the file says that it comes from, and what it remarks.
    pub source: String,
}

impl Glass {
    /// Absorption coefficient 4 pi k / lambda, m^-1; end values are held outside its table.
    pub fn absorption(&self) -> Option<Spectrum> {
        let k = self.k.as_ref()?;
        let values = k.nm.iter().zip(&k.values).map(|(nm, k)| 4.0 * PI * k / (nm * 1e-9)).collect();
        Some(Spectrum::Table { nm: k.nm.clone(), values, extend: true })
    }
}

/// The glass of this name (without regard to case), or the only one, of a file.
///
/// The error reads `problem; remedy`.
pub fn read(bytes: &[u8], name: Option<&str>) -> Result<Glass, String> {
    let text = measured::decode(bytes);
    if agf::is_agf(&text) {
        let entries = agf::entries(&text);
        let names = || entries.iter().map(|e| e.name.as_str());
        let found = match name {
            Some(name) => entries.iter().find(|e| e.name.eq_ignore_ascii_case(name.trim())),
            None => entries.first().filter(|_| entries.len() == 1),
        };
        return match (found, name) {
            (Some(entry), _) => entry.glass(),
            (None, Some(name)) => Err(format!("the catalogue has no glass {}; {}", quoted(name), suggest(name, names()))),
            (None, None) => {
                let some: Vec<&str> = names().take(MOST_NAMED).collect();
                Err(format!(
                    "the catalogue has {} glasses; name one of them by \"name\", such as {}",
                    entries.len(),
                    some.join(", ")
                ))
            }
        };
    }
    if rii::is_rii(&text) {
        return rii::read(&text);
    }
    columns(bytes, name)
}

/// All glasses of a file, in its order.
///
/// The error reads `problem; remedy`.
pub fn read_all(bytes: &[u8]) -> Result<Vec<Glass>, String> {
    let text = measured::decode(bytes);
    if agf::is_agf(&text) { agf::entries(&text).iter().map(agf::Entry::glass).collect() } else { Ok(vec![read(bytes, None)?]) }
}

/// Index and extinction coefficient by the names of their columns, or the only column as the index.
fn columns(bytes: &[u8], name: Option<&str>) -> Result<Glass, String> {
    let remedy = "write one \"nm n\" per line, or use a file of refractiveindex.info or a Zemax catalogue";
    let series = measured::read(bytes).map_err(|problem| format!("{problem}; {remedy}"))?;
    let k = series.iter().find(|s| s.name.eq_ignore_ascii_case("k")).cloned().map(|mut k| {
        k.without_noise();
        k
    });
    let indices: Vec<Series> = series.into_iter().filter(|s| !s.name.eq_ignore_ascii_case("k")).collect();
    let is_n = |s: &Series| s.name.eq_ignore_ascii_case("n");
    let n = measured::choose(indices.clone(), name.or_else(|| indices.iter().any(is_n).then_some("n")))?;
    let points: Vec<(f64, f64)> = n.nm.iter().copied().zip(n.values.iter().copied()).collect();
    let k = k.map(check_k).transpose()?;
    Ok(Glass { name: String::new(), ior: Ior::table(&points)?, k, source: String::new() })
}

/// Extinction coefficients are 0 or more.
fn check_k(k: Series) -> Result<Series, String> {
    match k.values.iter().position(|v| *v < 0.0) {
        Some(i) => {
            Err(format!("the extinction coefficient {} at {} nm is negative; use values of 0 or more", k.values[i], k.nm[i]))
        }
        None => Ok(k),
    }
}
