//! Spectra and indices of refraction as a scene writes them: a number, `[[nm, value], ...]`, or an object with one kind of source.

use crate::color::upsample;
use crate::error::{Result, quoted, suggest};
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::keys::SPECTRA;
use crate::spectrum::{Ior, Spectrum, library};
use serde_json::Value;

/// What a spectrum stands for, which decides the values it may have and how RGB is turned into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A share in [0, 1]; tables hold their end values outside.
    Share,
    /// A coefficient >= 0 (absorption, scattering, eta, k); tables hold their end values outside.
    Coefficient,
    /// Emitted light >= 0; tables are 0 outside.
    Light,
}

/// Amounts of light, in W and SI units per nm, that single precision carries through a scene: more is refused, and what is nowhere so much, but not 0.
pub(crate) const LIGHT: std::ops::RangeInclusive<f64> = 1e-20..=1e20;

/// Reads spectra over the film's range.
#[derive(Debug, Clone)]
pub struct SpectrumReader {
    /// Files that spectra may name.
    pub files: Files,
    /// The film's range, nm.
    pub range: (f64, f64),
}

impl SpectrumReader {
    /// A spectrum, checked to be finite and within what `place` allows over the film's range.
    pub fn spectrum(&self, node: &Node, place: Place) -> Result<Spectrum> {
        let spectrum = match node.value {
            Value::Number(_) => Spectrum::Constant(node.number()?),
            Value::Array(_) => table(node, place)?,
            Value::Object(_) => self.named(node, place)?,
            _ => {
                return Err(node.fail(
                    format!("{} is not a spectrum", node.value.to_string().chars().take(60).collect::<String>()),
                    "write a number, [[nm, value], ...] or an object such as {\"blackbody\": 6500} or {\"srgb\": [1, 1, 1]}",
                ));
            }
        };
        self.check(node, &spectrum, place)?;
        Ok(spectrum)
    }

    fn named(&self, node: &Node, place: Place) -> Result<Spectrum> {
        node.object("spectrum")?;
        let (kind, inner) = node.one_of(SPECTRA)?;
        let spectrum = match kind {
            "file" => {
                let (_, bytes) = self.files.read(&inner)?;
                let parsed = library::parse_spectrum_text(&String::from_utf8_lossy(&bytes));
                let spectrum = parsed.map_err(|problem| {
                    let name = inner.string().unwrap_or_default();
                    inner.fail(format!("{}: {problem}", quoted(name)), "write one \"nm value\" per line, wavelengths increasing")
                })?;
                held_outside(spectrum, place)
            }
            "illuminant" => {
                let name = inner.string()?;
                let found = library::illuminant(name);
                let spectrum = found.ok_or_else(|| unknown(&inner, "illuminant", name, &library::illuminant_names()))?;
                // CIE's tables are relative; 1 at 560 nm makes `scale` the radiance there.
                let at_560 = spectrum.eval(560.0);
                if at_560 > 0.0 { spectrum.scaled(1.0 / at_560) } else { spectrum }
            }
            "blackbody" => Spectrum::Blackbody { kelvin: inner.within(1.0, 1e6)?, scale: 1.0 },
            "line" => {
                inner.object("line")?;
                let width_nm = inner.get("width").map_or(Ok(0.1), |n| n.within(1e-3, 1000.0))?;
                let power = inner.get("power").map_or(Ok(1.0), |n| n.non_negative())?;
                Spectrum::Band { center_nm: inner.need("nm")?.within(1.0, 1e5)?, width_nm, height: power / width_nm }
            }
            "band" => {
                inner.object("band")?;
                Spectrum::Band {
                    center_nm: inner.need("nm")?.within(1.0, 1e5)?,
                    width_nm: inner.need("width")?.within(1e-3, 1e5)?,
                    height: inner.get("value").map_or(Ok(1.0), |n| n.non_negative())?,
                }
            }
            "srgb" | "linear_rgb" => rgb(&inner, kind == "srgb", place)?,
            _ => {
                let name = inner.string()?;
                library::reflectance(name).ok_or_else(|| unknown(&inner, "reflectance", name, &library::reflectance_names()))?
            }
        };
        Ok(match node.get("scale") {
            Some(scale) => spectrum.scaled(scale.non_negative()?),
            None => spectrum,
        })
    }

    /// Values between all points where a spectrum may turn are bounded by those at the points: only they and a 1 nm grid are looked at.
    pub(in crate::scene) fn check(&self, node: &Node, spectrum: &Spectrum, place: Place) -> Result<()> {
        let (lo, hi) = self.range;
        let mut at = vec![lo, hi];
        spectrum.breakpoints(lo, hi, &mut at);
        at.sort_by(f64::total_cmp);
        let between: Vec<f64> = at.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        at.extend(between);
        at.extend((0..(hi - lo) as u32).map(|i| lo + f64::from(i)));
        let most = match place {
            Place::Share => 1.0,
            Place::Coefficient => f64::MAX,
            Place::Light => *LIGHT.end(),
        };
        let values: Vec<(f64, f64)> = at.into_iter().map(|nm| (nm, spectrum.eval(nm))).collect();
        let greatest = values.iter().map(|v| v.1).fold(0.0, f64::max);
        let bad = values.into_iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0 && *v <= most));
        match bad {
            None if place == Place::Light && greatest > 0.0 && greatest < *LIGHT.start() => Err(node.fail(
                format!("the light is {greatest:e} at most, too dark for single precision"),
                "use brighter lights and a smaller exposure, or 0",
            )),
            None => Ok(()),
            Some((nm, v)) if place == Place::Light && v.is_finite() && v > most => Err(node.fail(
                format!("the light of {v:e} at {nm} nm is too bright for single precision"),
                format!("use at most {most:e}, and a greater exposure"),
            )),
            Some((nm, v)) if place == Place::Share => Err(node
                .fail(format!("the value {v} at {nm} nm is not within 0 to 1"), "a reflectance or weight lies between 0 and 1")),
            Some((nm, v)) if v < 0.0 => {
                Err(node.fail(format!("the value {v} at {nm} nm is negative"), "use values of 0 or more"))
            }
            Some((nm, v)) => Err(node.fail(format!("the value {v} at {nm} nm is not finite"), "use smaller values")),
        }
    }

    /// An index of refraction, checked over the film's range.
    pub fn ior(&self, node: &Node) -> Result<Ior> {
        let ior = match node.value {
            Value::Number(_) => Ior::constant(node.within(0.1, 10.0)?),
            Value::String(_) => glass(node)?,
            Value::Object(_) => ior_object(node)?,
            _ => {
                return Err(node.fail(
                    "this is no index of refraction",
                    "write a number, the name of a glass, or an object such as {\"nd\": 1.5168, \"abbe\": 64.17}",
                ));
            }
        };
        let (lo, hi) = self.range;
        ior.check_range(lo, hi).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "correct the index"));
            let remedy = if node.value.is_string() && remedy.contains("extrapolate") {
                format!("narrow film.range_nm, or write {{\"glass\": {}, \"extrapolate\": true}}", node.value)
            } else {
                remedy.to_string()
            };
            node.fail(problem, remedy)
        })?;
        if !(0.1..=10.0).contains(&ior.eval(lo)) || !(0.1..=10.0).contains(&ior.eval(hi)) {
            return Err(node.fail("the index is not within 0.1 to 10", "check the coefficients (wavelengths in um)"));
        }
        Ok(ior)
    }
}

fn unknown(node: &Node, what: &str, name: &str, known: &[&str]) -> crate::Error {
    node.fail(format!("unknown {what} {}", quoted(name)), suggest(name, known.iter().copied()))
}

fn held_outside(spectrum: Spectrum, place: Place) -> Spectrum {
    match spectrum {
        Spectrum::Table { nm, values, .. } => Spectrum::Table { nm, values, extend: place != Place::Light },
        other => other,
    }
}

/// `[[nm, value], ...]`, at least two, with strictly increasing wavelengths.
fn points(node: &Node) -> Result<Vec<(f64, f64)>> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for item in node.array(2)? {
        let [nm, value] = item.numbers()?;
        if nm <= 0.0 || points.last().is_some_and(|last| nm <= last.0) {
            return Err(
                item.fail(format!("the wavelength {nm} nm does not increase"), "sort by wavelength, each positive and once")
            );
        }
        points.push((nm, value));
    }
    Ok(points)
}

fn table(node: &Node, place: Place) -> Result<Spectrum> {
    let (nm, values): (Vec<f64>, Vec<f64>) = points(node)?.into_iter().unzip();
    let most = if place == Place::Share { 1.0 } else { f64::MAX };
    if let Some(i) = values.iter().position(|v| !(0.0..=most).contains(v)) {
        let item = &node.array(0)?[i];
        let remedy = if place == Place::Share { "use a value between 0 and 1" } else { "use a value of 0 or more" };
        return Err(item.fail(format!("the value {} is out of range", values[i]), remedy));
    }
    Ok(Spectrum::Table { nm, values, extend: place != Place::Light })
}

fn rgb(node: &Node, encoded: bool, place: Place) -> Result<Spectrum> {
    if place == Place::Coefficient {
        return Err(node.fail("a colour cannot stand for a coefficient", "write a number or [[nm, value], ...]"));
    }
    let mut rgb: [f64; 3] = node.numbers()?;
    let limited = encoded || place == Place::Share;
    if rgb.iter().any(|v| *v < 0.0 || (limited && *v > 1.0)) {
        let range = if limited { "from 0 to 1" } else { "of 0 or more" };
        return Err(node.fail("a colour component is out of range", format!("use components {range}")));
    }
    if encoded {
        rgb = rgb.map(upsample::srgb_decode);
    }
    let spectrum = match place {
        Place::Light => upsample::emission_from_linear_srgb(rgb),
        _ => upsample::reflectance_from_linear_srgb(rgb),
    };
    spectrum.map_err(|problem| node.fail(problem, "use another colour, or a spectrum"))
}

fn glass(node: &Node) -> Result<Ior> {
    let name = node.string()?;
    library::glass(name).ok_or_else(|| unknown(node, "glass", name, &library::glass_names()))
}

fn ior_object(node: &Node) -> Result<Ior> {
    node.object("ior")?;
    let (kind, inner) = node.one_of(&["glass", "sellmeier", "cauchy", "nd", "table"])?;
    if kind != "nd" && node.get("abbe").is_some() {
        return Err(node.fail("\"abbe\" belongs to \"nd\"", "give \"nd\" and \"abbe\", or remove \"abbe\""));
    }
    let mut ior = match kind {
        "glass" => glass(&inner)?,
        "sellmeier" => {
            inner.object("sellmeier")?;
            let list = |key| inner.need(key)?.array(1)?.iter().map(|n| n.number()).collect::<Result<Vec<f64>>>();
            let (b, c) = (list("b")?, list("c_um2")?);
            if b.len() != c.len() {
                return Err(inner.fail(format!("{} b and {} c_um2", b.len(), c.len()), "give as many of one as of the other"));
            }
            Ior::sellmeier(&b, &c)
        }
        "cauchy" => {
            let coefficients = inner.array(1)?.iter().map(|n| n.number()).collect::<Result<Vec<f64>>>()?;
            if coefficients.len() > 3 {
                return Err(
                    inner.fail(format!("{} coefficients", coefficients.len()), "give one to three: n = A + B/um^2 + C/um^4")
                );
            }
            Ior::cauchy(&coefficients)
        }
        "nd" => {
            let abbe = node.get("abbe").map_or(Ok(f64::INFINITY), |n| n.within(1.0, 1e6))?;
            Ior::from_abbe_number(inner.within(0.1, 10.0)?, abbe)
        }
        _ => Ior::table(&points(&inner)?).map_err(|problem| inner.fail(problem, "mend the table"))?,
    };
    if let Some(range) = node.get("range_nm") {
        let [lo, hi] = range.numbers()?;
        if lo <= 0.0 || hi <= lo {
            return Err(range.fail(format!("{lo} to {hi} is no range"), "give [lowest, highest] in nm"));
        }
        ior.range_nm = (lo, hi);
    }
    if let Some(extrapolate) = node.get("extrapolate") {
        ior.extrapolate = extrapolate.boolean()?;
    }
    Ok(ior)
}
