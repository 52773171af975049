//! Photometric files of lamps, ANSI/IES LM-63 (1986 to 2019): type C photometry of every symmetry, with what tilt changes if the file has it.

use super::profile::Profile;
use crate::error::quoted;
use std::f64::consts::PI;

/// Angles that a file may have of a kind: ten to a degree.
const MOST_ANGLES: usize = 3601;

/// What is wrong with a file, and the remedy.
pub(super) type Problem = (String, &'static str);

const DAMAGED: &str = "name an LM-63 file, as lamp makers offer it for download (.ies)";

/// The numbers after the line of the tilt, in order.
struct Numbers<'a> {
    words: std::vec::IntoIter<&'a str>,
}

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<f64, Problem> {
        let word = self.words.next().ok_or_else(|| (format!("it ends before its {what}"), DAMAGED))?;
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| (format!("{} is no number ({what})", quoted(word)), DAMAGED))
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Problem> {
        if count > self.words.len() {
            return Err((format!("it ends before its {what}"), DAMAGED));
        }
        (0..count).map(|_| self.next(what)).collect()
    }

    fn count(&mut self, what: &str, least: usize) -> Result<usize, Problem> {
        let n = self.next(what)?;
        if n.fract() != 0.0 || n < least as f64 || n > MOST_ANGLES as f64 {
            return Err((format!("{n} is no {what} ({least} to {MOST_ANGLES})"), DAMAGED));
        }
        Ok(n as usize)
    }

    /// The factor on all light at this tilt: linear between the angles of the file, whose ends hold beyond.
    fn factor_of_tilt(&mut self, tilt: f64) -> Result<f64, Problem> {
        self.next("geometry of lamp and luminaire")?;
        let count = self.count("number of tilts", 1)?;
        let angles = rising(self.list(count, "tilts")?, 360.0, "tilt")?;
        let factors = self.list(count, "factors of tilts")?;
        Ok(interpolate(&angles, &factors, tilt))
    }
}

/// A file's distribution, of a luminaire that is turned away from straight down by `tilt` degrees. Keyword lines and the lamp's size are passed over: it
/// shines from a point.
pub(super) fn parse(text: &str, tilt: f64) -> Result<Profile, Problem> {
    let mut lines = text.lines();
    let kind =
        lines.find_map(|line| line.trim().strip_prefix("TILT=")).ok_or_else(|| ("it has no line TILT=".into(), DAMAGED))?.trim();
    let separator = |c: char| c.is_whitespace() || c == ',';
    let words: Vec<&str> = lines.flat_map(|line| line.split(separator)).filter(|w| !w.is_empty()).collect();
    let mut numbers = Numbers { words: words.into_iter() };
    let by_tilt = match kind {
        "NONE" => 1.0,
        "INCLUDE" => numbers.factor_of_tilt(tilt)?,
        file => {
            let problem = format!("what tilt changes stands in a file of its own (TILT={})", quoted(file));
            return Err((
                problem,
                "put its numbers in after TILT=INCLUDE, or write TILT=NONE if the lamp burns as it was measured",
            ));
        }
    };
    numbers.list(2, "number of lamps and lumens")?;
    let mut factor = by_tilt * numbers.next("candela multiplier")?;
    let polar_count = numbers.count("number of vertical angles", 2)?;
    let azimuth_count = numbers.count("number of horizontal angles", 1)?;
    let kind = numbers.next("photometric type")?;
    if kind != 1.0 {
        let name = if kind == 2.0 {
            "B"
        } else if kind == 3.0 {
            "A"
        } else {
            "unknown"
        };
        return Err((format!("its photometry is of type {name}, not C"), "convert it to type C (goniometry about the vertical)"));
    }
    numbers.list(4, "units and size")?;
    factor *= numbers.next("ballast factor")?;
    // Before 1995 a factor, then always 1; since 2019 it says by its digits how the file was made.
    let ballast_lamp = numbers.next("ballast-lamp factor")?;
    if !text.trim_start().starts_with("IES:LM-63-") {
        factor *= ballast_lamp;
    }
    numbers.next("input watts")?;
    let polar = rising(numbers.list(polar_count, "vertical angles")?, 180.0, "vertical")?;
    let azimuth = rising(numbers.list(azimuth_count, "horizontal angles")?, 360.0, "horizontal")?;
    let candela = numbers.list(polar_count * azimuth_count, "candela values")?;
    let planes: Vec<(f64, &[f64])> = azimuth.into_iter().zip(candela.chunks_exact(polar_count)).collect();
    let planes = all_around(&planes)?;
    let candela: Vec<f64> = planes.iter().flat_map(|(_, plane)| plane.iter().map(|c| c * factor)).collect();
    if candela.iter().any(|c| !(0.0..=1e12).contains(c)) {
        return Err(("it has negative intensities, or more than 1e12 cd".into(), DAMAGED));
    }
    let azimuth = planes.iter().map(|(degrees, _)| if *degrees == 360.0 { 2.0 * PI } else { degrees.to_radians() }).collect();
    let polar = polar.into_iter().map(f64::to_radians).collect();
    Profile::new(polar, azimuth, &candela).ok_or_else(|| ("it is dark in every direction".into(), DAMAGED))
}

/// `values` at `x`, linear between `at`.
fn interpolate(at: &[f64], values: &[f64], x: f64) -> f64 {
    let above = at.partition_point(|&a| a <= x);
    if above == 0 || above == at.len() {
        return values[above.saturating_sub(1)];
    }
    let t = (x - at[above - 1]) / (at[above] - at[above - 1]);
    values[above - 1] + t * (values[above] - values[above - 1])
}

/// Angles in degrees that rise from 0 or more to `most` or less.
pub(super) fn rising(angles: Vec<f64>, most: f64, what: &str) -> Result<Vec<f64>, Problem> {
    let apart = angles.windows(2).all(|w| w[1] - w[0] > 1e-6);
    let within = angles.iter().all(|a| (0.0..=most).contains(a));
    if apart && within { Ok(angles) } else { Err((format!("its {what} angles do not rise within 0 to {most} degrees"), DAMAGED)) }
}

/// The azimuth of a plane in degrees, and the values in it.
pub(super) type Plane<'a> = (f64, &'a [f64]);

/// The planes of the whole circle, from 0 to 360 degrees, out of those that a symmetry leaves: one; 0 to 90; 0 to 180; 90 to 270; all.
fn all_around<'a>(planes: &[Plane<'a>]) -> Result<Vec<Plane<'a>>, Problem> {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
    let mirrored = |planes: &[Plane<'a>], about: f64| -> Vec<Plane<'a>> {
        let images = planes.iter().rev().filter(|p| p.0 < about).map(|p| (2.0 * about - p.0, p.1));
        planes.iter().copied().chain(images).collect()
    };
    Ok(match (first.0, last.0) {
        (_, _) if planes.len() == 1 => vec![(0.0, first.1), (360.0, first.1)],
        (0.0, 90.0) => mirrored(&mirrored(planes, 90.0), 180.0),
        (0.0, 180.0) => mirrored(planes, 180.0),
        (90.0, 270.0) => {
            // Symmetric about the plane of 90 and 270: what lies beyond 180 degrees comes again below 90 and above 270.
            let before = planes.iter().rev().filter(|p| (90.0..=180.0).contains(&p.0)).map(|p| (180.0 - p.0, p.1));
            let after = planes.iter().rev().filter(|p| (180.0..270.0).contains(&p.0)).map(|p| (540.0 - p.0, p.1));
            let mut around: Vec<Plane> = before.chain(planes.iter().copied().filter(|p| p.0 > 90.0)).chain(after).collect();
            around.dedup_by(|a, b| a.0 == b.0);
            if around[0].0 != 0.0 {
                return Err(("it has no plane of 180 degrees".into(), DAMAGED));
            }
            around
        }
        (0.0, 360.0) => planes.to_vec(),
        // Some leave out the last plane, which is the first.
        (0.0, end) if end > 180.0 => planes.iter().copied().chain([(360.0, first.1)]).collect(),
        (from, to) => {
            return Err((
                format!("its planes from {from} to {to} degrees are of no known symmetry"),
                "give planes from 0 to 90, 180 or 360 degrees, or 90 to 270",
            ));
        }
    })
}
