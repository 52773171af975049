//! Photometric files of lamps, EULUMDAT (A. Stockmar, 1990; .ldt): one value a line, of every symmetry.

use super::ies::{Plane, Problem, rising};
use super::profile::Profile;
use std::f64::consts::PI;

const DAMAGED: &str = "name an EULUMDAT file, as lamp makers offer it for download (.ldt)";

/// Angles of a kind, and sets of lamps, that the format has room for.
const MOST_PLANES: f64 = 721.0;
const MOST_ANGLES: f64 = 361.0;
const MOST_SETS: f64 = 20.0;

/// Whether a file is of this kind: its second and third line are the numbers of a type and a symmetry.
pub(super) fn is_eulumdat(text: &str) -> bool {
    let digit = |line: Option<&str>, most: u8| {
        line.is_some_and(|line| matches!(line.trim().as_bytes(), [digit] if (b'0'..=b'0' + most).contains(digit)))
    };
    let mut lines = text.lines().skip(1);
    digit(lines.next(), 3) && digit(lines.next(), 4)
}

/// A file's distribution: its candela for 1,000 lm, times the flux of its first set of lamps.
pub(super) fn parse(text: &str) -> Result<Profile, Problem> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let number = |i: usize, what: &str| -> Result<f64, Problem> {
        let line = lines.get(i).ok_or_else(|| (format!("it ends before its {what}"), DAMAGED))?;
        // Some programs write decimal commas.
        let number = line.replace(',', ".").parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| (format!("line {} is no number ({what})", i + 1), DAMAGED))
    };
    let count = |i: usize, what: &str, least: f64, most: f64| -> Result<usize, Problem> {
        let n = number(i, what)?;
        if n.fract() != 0.0 || !(least..=most).contains(&n) {
            return Err((format!("{n} is no {what} ({least} to {most})"), DAMAGED));
        }
        Ok(n as usize)
    };
    let symmetry = number(2, "symmetry")?;
    let planes = count(3, "number of C-planes", 1.0, MOST_PLANES)?;
    let angles = count(5, "number of angles in a plane", 2.0, MOST_ANGLES)?;
    let factor = number(23, "conversion factor")?;
    let sets = count(25, "number of sets of lamps", 1.0, MOST_SETS)?;
    // Six lines a set: how many, type, flux, colour, rendering, watts; or, in some files, the first of all sets, then the second of all.
    let is_text = |i: usize| number(i, "").is_err();
    let flux_at = if sets > 1 && !is_text(27) && is_text(26 + sets) { 26 + 2 * sets } else { 28 };
    let flux = number(flux_at, "luminous flux of the lamps")?;
    // Ten direct ratios lie between the lamps and the angles.
    let first = 26 + 6 * sets + 10;
    let list =
        |from: usize, count: usize, what: &str| (from..from + count).map(|i| number(i, what)).collect::<Result<Vec<f64>, _>>();
    let azimuth = rising(list(first, planes, "C-planes")?, 360.0, "horizontal")?;
    let polar = rising(list(first + planes, angles, "angles")?, 180.0, "vertical")?;
    // The planes that are written: all, one, or those on one side of a plane of symmetry.
    let uneven = || (format!("{planes} planes have no such symmetry"), DAMAGED);
    let of = |divisor: usize| if planes % divisor == 0 { Ok(planes / divisor) } else { Err(uneven()) };
    let written: Vec<usize> = match symmetry {
        0.0 => (0..planes).collect(),
        1.0 => vec![0],
        2.0 => (0..=of(2)?).collect(),
        3.0 => (3 * of(4)?..=3 * of(4)? + of(2)?).collect(),
        4.0 => (0..=of(4)?).collect(),
        _ => return Err((format!("{symmetry} is no symmetry (0 to 4)"), DAMAGED)),
    };
    let values = list(first + planes + angles, written.len() * angles, "luminous intensities")?;
    let candela: Vec<f64> = values.iter().map(|v| v * factor * flux / 1000.0).collect();
    if candela.iter().any(|c| !(0.0..=1e12).contains(c)) {
        return Err(("it has negative intensities, or more than 1e12 cd".into(), DAMAGED));
    }
    let mut around: Vec<Plane> = Vec::new();
    for (number, plane) in written.iter().zip(candela.chunks_exact(angles)) {
        let degrees = azimuth[number % planes];
        let images: &[f64] = match symmetry {
            2.0 => &[degrees, 360.0 - degrees],
            3.0 => &[degrees, 180.0 - degrees],
            4.0 => &[degrees, 360.0 - degrees, 180.0 - degrees, 180.0 + degrees],
            _ => &[degrees],
        };
        around.extend(
            images
                .iter()
                .map(|degrees| (if degrees.rem_euclid(360.0) > 360.0 - 1e-6 { 0.0 } else { degrees.rem_euclid(360.0) }, plane)),
        );
    }
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    around.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
    if around[0].0 != 0.0 {
        return Err(("its C-planes do not go round from 0 to 360 degrees".into(), DAMAGED));
    }
    around.push((360.0, around[0].1));
    let candela: Vec<f64> = around.iter().flat_map(|(_, plane)| plane.iter().copied()).collect();
    let azimuth = around.iter().map(|(degrees, _)| if *degrees == 360.0 { 2.0 * PI } else { degrees.to_radians() }).collect();
    let polar = polar.into_iter().map(f64::to_radians).collect();
    Profile::new(polar, azimuth, &candela).ok_or_else(|| ("it is dark in every direction".into(), DAMAGED))
}
