//! Zemax catalogues (`.agf`): a glass begins with `NM`, `CD` are its coefficients, `LD` its range in um, `IT` its internal transmission.

use super::Glass;
use crate::spectrum::measured::Series;
use crate::spectrum::{Formula, Ior};
use std::f64::consts::PI;

/// An internal transmission of 0 is taken as half of the last digit that makers print.
const LEAST_TRANSMISSION: f64 = 5e-4;
/// Samples of less transmission are too thick to say much, if there is a thinner one.
const FAINT: f64 = 0.01;

/// Whether the text is such a catalogue.
pub(super) fn is_agf(text: &str) -> bool {
    let has = |word: &str| text.lines().any(|line| line.split_whitespace().next() == Some(word));
    has("NM") && has("CD")
}

/// One glass as the catalogue has it.
#[derive(Debug, Default)]
pub(super) struct Entry<'a> {
    pub(super) name: String,
    formula: &'a str,
    coefficients: Vec<&'a str>,
    range: Vec<&'a str>,
    comment: String,
    transmission: Vec<Vec<&'a str>>,
}

/// All glasses, in the file's order.
pub(super) fn entries(text: &str) -> Vec<Entry<'_>> {
    let mut entries: Vec<Entry> = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or_default();
        if key == "NM" {
            let name = words.next().unwrap_or_default().to_string();
            entries.push(Entry { name, formula: words.next().unwrap_or_default(), ..Entry::default() });
            continue;
        }
        let Some(entry) = entries.last_mut() else { continue };
        match key {
            "CD" => entry.coefficients = words.collect(),
            "LD" => entry.range = words.collect(),
            "GC" => entry.comment = words.collect::<Vec<_>>().join(" "),
            "IT" => entry.transmission.push(words.collect()),
            _ => {}
        }
    }
    entries
}

fn number(word: &str) -> Result<f64, String> {
    word.parse::<f64>()
        .ok()
        .filter(|v| v.is_finite())
        .ok_or_else(|| format!("{word:?} is not a finite number; mend the catalogue"))
}

impl Entry<'_> {
    /// Reads its numbers.
    pub(super) fn glass(&self) -> Result<Glass, String> {
        let within = |problem: String| format!("glass {}: {problem}", self.name);
        let formula = self.formula().map_err(within)?;
        let range_nm = match self.range.iter().map(|w| number(w)).collect::<Result<Vec<_>, _>>().map_err(within)?[..] {
            [lo, hi, ..] if lo < hi && lo >= 0.0 => (lo * 1e3, hi * 1e3),
            _ => (0.0, f64::INFINITY),
        };
        let k = self.extinction().map_err(within)?;
        Ok(Glass { name: self.name.clone(), ior: Ior { formula, range_nm, extrapolate: false }, k, source: self.comment.clone() })
    }

    /// Zemax's formulas by their numbers there.
    fn formula(&self) -> Result<Formula, String> {
        let c = self.coefficients.iter().map(|w| number(w)).collect::<Result<Vec<_>, _>>()?;
        let at = |i: usize| c.get(i).copied().unwrap_or(0.0);
        let number: f64 =
            self.formula.parse().map_err(|_| format!("{:?} is no number of a formula; mend the catalogue", self.formula))?;
        let series = |exponents: &[f64]| {
            let terms = exponents.iter().enumerate().map(|(i, e)| [at(i + 1), *e]).collect();
            Formula::Polynomial { c0: at(0), resonances: Vec::new(), terms }
        };
        let sellmeier = |terms: usize| {
            let (b, c_um2) = (0..terms).map(|i| (at(2 * i), at(2 * i + 1))).unzip();
            Formula::Sellmeier { a0: 0.0, b, c_um2 }
        };
        let resonant = |c0: f64, resonances: Vec<[f64; 3]>, terms: Vec<[f64; 2]>| Formula::Polynomial { c0, resonances, terms };
        Ok(match number as u32 {
            1 => series(&[2.0, -2.0, -4.0, -6.0, -8.0]),
            2 => sellmeier(3),
            3 => Formula::Herzberger(std::array::from_fn(at)),
            4 => resonant(1.0 + at(0), vec![[at(1), 2.0, at(2) * at(2)], [at(3), 0.0, at(4) * at(4)]], vec![]),
            5 => Formula::Powers { c0: at(0), terms: vec![[at(1), -1.0], [at(2), -3.5]] },
            6 => sellmeier(4),
            7 => resonant(at(0), vec![[at(1), 0.0, at(2)]], vec![[-at(3), 2.0]]),
            8 => resonant(at(0), vec![[at(1), 2.0, at(2)]], vec![[-at(3), 2.0]]),
            9 => resonant(at(0), vec![[at(1), 2.0, at(2)], [at(3), 2.0, at(4)]], vec![]),
            10 => series(&[2.0, -2.0, -4.0, -6.0, -8.0, -10.0, -12.0]),
            11 => sellmeier(5),
            12 => series(&[2.0, -2.0, -4.0, -6.0, -8.0, 4.0, 6.0]),
            13 => series(&[2.0, 4.0, -2.0, -4.0, -6.0, -8.0, -10.0, -12.0]),
            _ => return Err(format!("there is no formula {number}; formulas are 1 to 13")),
        })
    }

    /// From the internal transmission of samples: k = -ln T / d lambda / 4 pi. Of several thicknesses the one that says most is taken.
    fn extinction(&self) -> Result<Option<Series>, String> {
        let mut rows = Vec::new();
        for words in &self.transmission {
            if let [um, t, mm, ..] = words.iter().take(3).map(|w| number(w)).collect::<Result<Vec<_>, _>>()?[..]
                && um > 0.0
                && mm > 0.0
            {
                rows.push((um * 1e3, t, mm));
            }
        }
        // At each wavelength the clear samples first, of these the thickest, of the others the thinnest.
        let faint = |t: f64| t < FAINT;
        let key = |t: f64, mm: f64| if faint(t) { mm } else { -mm };
        rows.sort_by(|a, b| a.0.total_cmp(&b.0).then(faint(a.1).cmp(&faint(b.1))).then(key(a.1, a.2).total_cmp(&key(b.1, b.2))));
        rows.dedup_by(|b, a| a.0 == b.0);
        let k = |&(nm, t, mm): &(f64, f64, f64)| -t.clamp(LEAST_TRANSMISSION, 1.0).ln() / (mm * 1e-3) * nm * 1e-9 / (4.0 * PI);
        let series = Series { name: "k".into(), nm: rows.iter().map(|r| r.0).collect(), values: rows.iter().map(k).collect() };
        Ok((!rows.is_empty()).then_some(series))
    }
}
