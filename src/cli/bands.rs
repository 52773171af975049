//! The option that says what a file's bands are, shared by the commands that read spectral EXRs.

use crate::error::Result;
use crate::output::{Bands, SpectralImage};
use crate::spectrum::unit_problem;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct BandsArgs {
    /// What channels that do not name their wavelengths are: a range in nm that numbered ones share, as in 400-700, or a file of lines 'CHANNEL LOW_NM HIGH_NM [RESPONSE or mean]'
    #[arg(long, value_name = "LO-HI or FILE", value_parser = parse)]
    bands: Option<Source>,
}

#[derive(Debug, Clone, PartialEq)]
enum Source {
    Range(f64, f64),
    Table(PathBuf),
}

impl BandsArgs {
    /// The bands, where any are given.
    pub fn bands(&self) -> Result<Option<Bands>> {
        Ok(match &self.bands {
            None => None,
            Some(Source::Range(lo, hi)) => Some(Bands::Range(*lo, *hi)),
            Some(Source::Table(path)) => Some(Bands::read(path)?),
        })
    }

    /// The file that says so.
    pub fn table(&self) -> Option<&Path> {
        if let Some(Source::Table(path)) = &self.bands { Some(path) } else { None }
    }

    /// Reads an image with them.
    pub fn read(&self, path: &Path) -> Result<SpectralImage> {
        SpectralImage::read_with(path, self.bands()?.as_ref())
    }
}

fn parse(text: &str) -> std::result::Result<Source, String> {
    let range = text.split_once('-').and_then(|(lo, hi)| Some((lo.parse::<f64>().ok()?, hi.parse::<f64>().ok()?)));
    match range {
        None => Ok(Source::Table(PathBuf::from(text))),
        Some((lo, hi)) if lo > 0.0 && hi > lo && hi < 1e6 && unit_problem(lo, hi).is_none() => Ok(Source::Range(lo, hi)),
        Some(_) => Err("write the range in nm from low to high, as in 400-700".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_told_from_a_file() {
        assert_eq!(parse("400-700"), Ok(Source::Range(400.0, 700.0)));
        assert_eq!(parse("a-b.txt"), Ok(Source::Table("a-b.txt".into())));
        assert!(parse("700-400").is_err());
        assert!(parse("0.4-0.7").is_err_and(|e| e.contains("in nm")));
    }
}
