//! Which wavelengths the channels of a spectral image are: from their names, or from a table of bands for files that do not say.

use super::{Quantity, open_plain};
use crate::error::{Error, Result};
use crate::spectrum::unit_problem;
use std::path::Path;

/// The channels of a file that are spectral.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Selection {
    pub quantity: Quantity,
    /// Index of every spectral channel in the file, and what turns its values into bin means.
    pub channels: Vec<(usize, f64)>,
    /// Centres, nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Where the bins join, nm.
    pub edges_nm: Vec<f64>,
}

/// A band table, for files whose channels do not name their wavelengths, such as those of Mitsuba 3's `specfilm`.
#[derive(Debug, Clone, PartialEq)]
pub enum Bands {
    /// Channels by name.
    Table(Vec<Band>),
    /// Channels whose names end in a number, in the order of the numbers: bands of equal width from the first wavelength, nm, to the second. A
    /// channel holds the integral of radiance over its band.
    Range(f64, f64),
}

/// A line of a band table.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Name of the channel.
    pub channel: String,
    /// First wavelength, nm.
    pub lo_nm: f64,
    /// Last wavelength, nm.
    pub hi_nm: f64,
    /// The channel holds the integral of radiance times this over the band; `None`: the mean radiance.
    pub response: Option<f64>,
}

const REMEDY: &str = "write one 'CHANNEL LOW_NM HIGH_NM [RESPONSE or mean]' per line";

impl Bands {
    /// Reads a table: one `CHANNEL LOW_NM HIGH_NM [RESPONSE]` per line, `#` begins a comment. A channel holds the integral over its band of
    /// radiance times RESPONSE (1 unless given, as of a sensor with a flat response), or with the word `mean` the mean radiance.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be read or is no such table.
    pub fn read(path: &Path) -> Result<Bands> {
        let text = open_plain(path).and_then(|(file, _)| std::io::read_to_string(file));
        let text = text.map_err(|e| Error::file(path, format!("cannot read: {e}"), "check the path"))?;
        Self::parse(&text).map_err(|problem| Error::file(path, problem, REMEDY))
    }

    /// Reads a table's text; the error says what is wrong with it.
    pub fn parse(text: &str) -> std::result::Result<Bands, String> {
        let mut bands = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            if words.is_empty() {
                continue;
            }
            bands.push(Band::parse(&words).ok_or_else(|| format!("line {}: \"{}\" is no band", i + 1, line.trim()))?);
        }
        bands.sort_by(|a, b| a.lo_nm.total_cmp(&b.lo_nm));
        // Channels give their edges to a thousandth of a nm at best.
        let apart = |w: &&[Band]| (w[0].hi_nm - w[1].lo_nm).abs() > 2e-3;
        if let Some(w) = bands.windows(2).find(apart) {
            return Err(format!(
                "the band {} ends at {} nm, and {} begins at {} nm",
                w[0].channel, w[0].hi_nm, w[1].channel, w[1].lo_nm
            ));
        }
        match (bands.first(), bands.last()) {
            (Some(first), Some(last)) => unit_problem(first.lo_nm, last.hi_nm).map_or(Ok(Bands::Table(bands)), Err),
            _ => Err("no band in the table".to_string()),
        }
    }

    /// Finds the bands among a file's channels; `None` if it has none of them.
    pub(crate) fn select(&self, names: &[String]) -> Option<std::result::Result<Selection, String>> {
        match self {
            Bands::Table(bands) => {
                let find = |band: &Band| names.iter().position(|name| *name == band.channel);
                bands.iter().any(|band| find(band).is_some()).then(|| {
                    let mut found = Vec::new();
                    for band in bands {
                        found.push((find(band).ok_or_else(|| format!("no channel {}", band.channel))?, band.scale()));
                    }
                    let edges = bands.iter().map(|b| b.lo_nm).chain(bands.last().map(|b| b.hi_nm)).collect();
                    Ok(Selection::joined(found, edges))
                })
            }
            Bands::Range(lo, hi) => {
                let mut numbered: Vec<(u64, usize)> =
                    names.iter().enumerate().filter_map(|(i, name)| Some((last_number(name)?, i))).collect();
                numbered.sort_unstable();
                (!numbered.is_empty()).then(|| {
                    if let Some(w) = numbered.windows(2).find(|w| w[0].0 == w[1].0) {
                        return Err(format!("channels {} and {} have the same number", names[w[0].1], names[w[1].1]));
                    }
                    let width = (hi - lo) / numbered.len() as f64;
                    let edges = (0..=numbered.len()).map(|i| lo + width * i as f64).collect();
                    Ok(Selection::joined(numbered.iter().map(|&(_, i)| (i, 1.0 / width)).collect(), edges))
                })
            }
        }
    }
}

impl Band {
    fn parse(words: &[&str]) -> Option<Band> {
        let (&[channel, lo, hi], rest) = words.split_first_chunk::<3>()?;
        let response = match rest {
            [] => Some(1.0),
            ["mean"] => None,
            [response] => Some(response.parse().ok().filter(|r: &f64| r.is_finite() && *r > 0.0)?),
            _ => return None,
        };
        let (lo_nm, hi_nm) = (lo.parse().ok()?, hi.parse().ok()?);
        (lo_nm > 0.0 && hi_nm > lo_nm && hi_nm < 1e6).then(|| Band { channel: channel.to_string(), lo_nm, hi_nm, response })
    }

    /// What turns the channel into mean radiance.
    fn scale(&self) -> f64 {
        self.response.map_or(1.0, |response| 1.0 / (response * (self.hi_nm - self.lo_nm)))
    }
}

/// The number that a name ends in.
fn last_number(name: &str) -> Option<u64> {
    name[name.trim_end_matches(|c: char| c.is_ascii_digit()).len()..].parse().ok()
}

impl Selection {
    fn joined(channels: Vec<(usize, f64)>, edges_nm: Vec<f64>) -> Self {
        let wavelengths_nm = edges_nm.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        Selection { quantity: Quantity::Emissive, channels, wavelengths_nm, edges_nm }
    }

    /// The channels, of those of these names, that are not spectral.
    pub fn others(&self, names: &[String]) -> Vec<usize> {
        (0..names.len()).filter(|channel| !self.channels.iter().any(|(c, _)| c == channel)).collect()
    }

    /// The channels that the layout names: those of emission, or if there are none, those of reflectance. Bins reach half-way to their neighbours,
    /// and the first and last as far to the other side; a single one is 1 nm wide. `None` if there are none at all.
    pub fn of_layout(names: &[String]) -> Option<std::result::Result<Selection, String>> {
        [(Quantity::Emissive, "S0."), (Quantity::Reflective, "T.")].into_iter().find_map(|(quantity, prefix)| {
            let mut found: Vec<(f64, usize)> =
                names.iter().enumerate().filter_map(|(i, name)| Some((wavelength_nm(name.strip_prefix(prefix)?)?, i))).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            (!found.is_empty()).then(|| {
                if let Some(twice) = found.windows(2).find(|w| w[0].0 == w[1].0) {
                    return Err(format!("two channels at {} nm", twice[0].0));
                }
                let channels = found.iter().map(|&(_, i)| (i, 1.0)).collect();
                let wavelengths_nm: Vec<f64> = found.iter().map(|f| f.0).collect();
                let edges_nm = half_way(&wavelengths_nm);
                Ok(Selection { quantity, channels, wavelengths_nm, edges_nm })
            })
        })
    }
}

/// Edges of bins, at least one, around these centres.
fn half_way(nm: &[f64]) -> Vec<f64> {
    let inner: Vec<f64> = nm.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let (first, last) = (nm[0], nm[nm.len() - 1]);
    let ends = (inner.first().map_or(first - 0.5, |e| 2.0 * first - e), inner.last().map_or(last + 0.5, |e| 2.0 * last - e));
    [ends.0].into_iter().chain(inner).chain([ends.1]).collect()
}

/// The wavelength in nm of `<number><prefix><m|Hz>`, the number with a decimal comma (the layout's grammar, section 3 of the paper); `None`
/// for anything else.
fn wavelength_nm(rest: &str) -> Option<f64> {
    // SI prefixes but "da", which is no use for light.
    const PREFIXES: &str = "YZEPTGMkhdcmunp";
    const EXPONENTS: [i32; 15] = [24, 21, 18, 15, 12, 9, 6, 3, 2, -1, -2, -3, -6, -9, -12];
    let (rest, is_frequency) = match rest.strip_suffix("Hz") {
        Some(rest) => (rest, true),
        None => (rest.strip_suffix('m')?, false),
    };
    let prefixes = PREFIXES.chars().zip(EXPONENTS);
    let (number, exponent) = prefixes.filter_map(|(p, e)| Some((rest.strip_suffix(p)?, e))).next().unwrap_or((rest, 0));
    if number.is_empty() || !number.chars().all(|c| c.is_ascii_digit() || matches!(c, ',' | 'e' | 'E' | '+' | '-')) {
        return None;
    }
    let value: f64 = number.replace(',', ".").parse().ok()?;
    // A division by the exact power keeps 390,000000nm at 390 exactly.
    let nm = match (is_frequency, exponent) {
        (false, -9) => value,
        (false, e) => value * 10f64.powi(e + 9),
        (true, e) => 299_792_458e9 / (value * 10f64.powi(e)),
    };
    (nm.is_finite() && nm > 0.0).then_some(nm)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(all: &[&str]) -> Vec<String> {
        all.iter().map(|name| name.to_string()).collect()
    }

    fn layout(channel: &str) -> Option<f64> {
        Some(Selection::of_layout(&names(&[channel]))?.expect("one channel").wavelengths_nm[0])
    }

    #[test]
    fn channel_names_of_the_layout_are_understood_and_others_are_not() {
        for (name, nm) in [("S0.390,000000nm", 390.0), ("S0.5,5e2nm", 550.0), ("S0.0,55um", 550.0), ("T.5,5E-7m", 550.0)] {
            assert!((layout(name).expect(name) - nm).abs() < 1e-9, "{name}");
        }
        assert!((layout("S0.500THz").expect("THz") - 599.584_916).abs() < 1e-9);
        for name in [
            "S0.390.000000nm",
            "s0.390,000000nm",
            "a.S0.390,000000nm",
            "S1.390,000000nm",
            "S0.nm",
            "S0.-1nm",
            "S0.0nm",
            "S0.infm",
            "T.450nm.500nm",
            "Y",
        ] {
            assert_eq!(layout(name), None, "{name}");
        }
    }

    #[test]
    fn bins_of_the_layout_reach_half_way_to_their_neighbours() {
        let s = Selection::of_layout(&names(&["B", "S0.600nm", "S0.450nm", "S0.500nm", "T.1nm"])).expect("bins").expect("bins");
        assert_eq!(
            (s.quantity, s.wavelengths_nm, s.edges_nm),
            (Quantity::Emissive, vec![450.0, 500.0, 600.0], vec![425.0, 475.0, 550.0, 650.0])
        );
        assert_eq!(s.channels, [(2, 1.0), (3, 1.0), (1, 1.0)]);
        assert!(Selection::of_layout(&names(&["S0.500nm", "S0.5e2nm"])).expect("bins").is_err());
    }

    #[test]
    fn band_tables_say_what_channels_are() {
        let table = "# a sensor\nred 600 700 2\ngreen 500 600 # flat\nblue 400 500 mean\n";
        let s =
            Bands::parse(table).expect("a table").select(&names(&["green", "W", "blue", "red"])).expect("bands").expect("bands");
        assert_eq!(s.edges_nm, [400.0, 500.0, 600.0, 700.0]);
        assert_eq!(s.channels, [(2, 1.0), (0, 0.01), (3, 0.005)]);
        assert!(Bands::parse(table).expect("a table").select(&names(&["green", "red"])).expect("bands").is_err());
        assert!(Bands::parse(table).expect("a table").select(&names(&["S0.R"])).is_none());
        for wrong in [
            "",
            "red 600",
            "red 700 600",
            "red 600 700 0",
            "red a b",
            "a 400 500\nb 510 600",
            "a 0.4 0.5\nb 0.5 0.6",
            "a 400 500\nb 450 600",
            "a 1 2 3 4",
        ] {
            assert!(Bands::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbered_channels_are_bands_in_the_order_of_their_numbers() {
        let bands = Bands::Range(400.0, 700.0);
        let s = bands.select(&names(&["band10", "band2", "R", "band9"])).expect("bands").expect("bands");
        assert_eq!((s.channels, s.edges_nm), (vec![(1, 0.01), (3, 0.01), (0, 0.01)], vec![400.0, 500.0, 600.0, 700.0]));
        assert!(bands.select(&names(&["R", "G"])).is_none());
        assert!(bands.select(&names(&["a1", "b1"])).expect("bands").is_err());
    }
}
