//! Spectra and indices of refraction as a scene writes them: a number, `[[nm, value], ...]`, or an object with one kind of source.

use crate::color::{lamp, upsample};
use crate::error::{Result, quoted, suggest};
use crate::scene::Texture;
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::keys::SPECTRA;
use crate::scene::json::remarks::Remarks;
use crate::spectrum::catalogue::{self, Glass};
use crate::spectrum::measured::{self, Series};
use crate::spectrum::{Formula, Ior, LINE_C_NM, LINE_F_NM, Spectrum, library, unit_problem};
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

/// Abbe numbers of materials: rutile has 9.2, magnesium fluoride 106, gases more. Of formulas of glass whose `c_um2` are not squared it is below 6.
const DISPERSIONS: std::ops::RangeInclusive<f64> = 9.0..=1000.0;

/// What formulas are given in.
const SELLMEIER: &str =
    "c_um2 are the squares of wavelengths in um: square a C that is given in um, and divide one in nm^2 by 1e6";
const CAUCHY: &str = "n = A + B/um^2 + C/um^4: divide a B that is given in nm^2 by 1e6, and C by 1e12";

/// Measured data are thought to go on as they end for so many nm.
const FAR: f64 = 50.0;

/// Reads spectra over the film's range.
#[derive(Debug, Clone)]
pub struct SpectrumReader {
    /// Files that spectra may name.
    pub files: Files,
    /// The film's range, nm.
    pub range: (f64, f64),
    /// What there is to say of them.
    pub remarks: Remarks,
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
        match place {
            Place::Light => self.remark_dark(node, &spectrum),
            Place::Share | Place::Coefficient => self.note_held(node, &spectrum),
        }
        Ok(spectrum)
    }

    /// Notes where light is dark only because its table has ended, and warns where all of it lies outside the film's range.
    fn remark_dark(&self, node: &Node, spectrum: &Spectrum) {
        let (lo, hi) = self.range;
        if !spectrum.is_zero() && spectrum.integral(lo, hi) == 0.0 {
            let text =
                format!("the light has nothing within the film's {lo} to {hi} nm; widen film.range_nm, or use another spectrum");
            return self.remarks.warn(node, &text);
        }
        let (from, to) = spectrum.known_within(lo, hi, false);
        if (from, to) != (lo, hi) {
            let text = format!(
                "the light is known from {from} to {to} nm; in the rest of the film's {lo} to {hi} nm it is taken to be dark"
            );
            self.remarks.note(node, &text);
        }
    }

    /// Notes where the end values of a table are taken far outside it: of numbers that the scene writes itself, only where the film sees nothing else.
    pub(in crate::scene) fn note_held(&self, node: &Node, spectrum: &Spectrum) {
        let (lo, hi) = self.range;
        let (from, to) = spectrum.known_within(lo, hi, true);
        if (from - lo).max(hi - to) > FAR && (from >= to || !node.value.is_array()) {
            let text = if from < to {
                format!(
                    "the spectrum is known from {from} to {to} nm; in the rest of the film's {lo} to {hi} nm its end values are taken"
                )
            } else {
                format!("the spectrum is known outside the film's {lo} to {hi} nm only, where its end value is taken")
            };
            self.remarks.note(node, &text);
        }
    }

    /// Checks what a surface emits: of a picture, what is brightest in it.
    pub(in crate::scene) fn check_light(&self, node: &Node, radiance: &Texture) -> Result<()> {
        match radiance {
            Texture::Uniform(spectrum) => self.check(node, spectrum, Place::Light),
            Texture::Image(texture) => self.check(node, &texture.factor.clone().scaled(texture.image.range()[1]), Place::Light),
        }
    }

    fn named(&self, node: &Node, place: Place) -> Result<Spectrum> {
        node.object("spectrum")?;
        let (kind, inner) = node.one_of(SPECTRA)?;
        if let Some(column) = node.get("column").filter(|_| kind != "file") {
            return Err(column.fail("\"column\" belongs to \"file\"", "remove it"));
        }
        let spectrum = match kind {
            "file" => {
                let series = self.measured(&inner, node.get("column"))?;
                series.spectrum(place != Place::Light)
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
            "daylight" | "white_led" | "chromaticity" if place != Place::Light => {
                return Err(inner.fail(format!("\"{kind}\" is light"), "use it in a lamp, and {\"srgb\": [r, g, b]} here"));
            }
            "daylight" => lamp::daylight(inner.within(lamp::DAYLIGHT_K[0], lamp::DAYLIGHT_K[1])?),
            "white_led" => lamp::white_led(inner.within(lamp::WHITE_LED_K[0], lamp::WHITE_LED_K[1])?),
            "chromaticity" => {
                let remedy = "use a less saturated x, y, or a \"line\" or \"band\"";
                lamp::of_chromaticity(inner.numbers()?).map_err(|problem| inner.fail(problem, remedy))?
            }
            "line" => {
                inner.object("line")?;
                let width_nm = inner.get("width").map_or(Ok(0.1), |n| n.within(1e-3, 1000.0))?;
                let power = inner.get("power").map_or(Ok(1.0), |n| n.non_negative())?;
                Spectrum::Band { center_nm: inner.need("nm")?.wavelength()?, width_nm, height: power / width_nm }
            }
            "band" => {
                inner.object("band")?;
                Spectrum::Band {
                    center_nm: inner.need("nm")?.wavelength()?,
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

    /// The series of this name, or the only one, of the file that a node names; small noise below 0 is taken as 0.
    fn measured(&self, file: &Node, column: Option<Node>) -> Result<Series> {
        let (_, bytes) = self.files.read(file)?;
        let name = column.as_ref().map(Node::string).transpose()?;
        let chosen = measured::read(&bytes).map_err(|problem| {
            let remedy = "write one \"nm value\" per line, or use a file of a spectrometer, CGATS or IES TM-27";
            file.fail(format!("{}: {problem}", quoted(file.string().unwrap_or_default())), remedy)
        })?;
        let mut series = measured::choose(chosen, name).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "mend the file"));
            column.as_ref().unwrap_or(file).fail(problem, remedy)
        })?;
        match series.without_noise() {
            0 => {}
            count => self.remarks.note(file, &format!("{count} values a little below 0 are taken as noise, and as 0")),
        }
        Ok(series)
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
                format!("the light is {greatest:.3e} at most, too dark for single precision"),
                "use brighter lights and a smaller exposure, or 0",
            )),
            None => Ok(()),
            Some((nm, v)) if place == Place::Light && v.is_finite() && v > most => Err(node.fail(
                format!("the light of {v:.3e} at {nm} nm is too bright for single precision"),
                format!("use at most {most:e}, and a greater exposure"),
            )),
            Some((nm, v)) if place == Place::Share => Err(node.fail(
                format!("the value {v} at {nm} nm is not within 0 to 1"),
                "a reflectance or weight lies between 0 and 1 (80 % is 0.8)",
            )),
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
            Value::Object(_) => self.ior_object(node)?,
            _ => {
                return Err(node.fail(
                    "this is no index of refraction",
                    "write a number, the name of a glass, or an object such as {\"nd\": 1.5168, \"abbe\": 64.17}",
                ));
            }
        };
        let (lo, hi) = self.range;
        let formula = |key| node.get(key).is_some();
        ior.check_range(lo, hi).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "correct the index"));
            let remedy = if node.value.is_string() && remedy.contains("extrapolate") {
                format!("narrow film.range_nm, or write {{\"glass\": {}, \"extrapolate\": true}}", node.value)
            } else if formula("sellmeier") && problem.contains("the dispersion formula") {
                format!("{remedy}; {SELLMEIER}")
            } else {
                remedy.to_string()
            };
            node.fail(problem, remedy)
        })?;
        let units = match node.get("sellmeier") {
            Some(_) => SELLMEIER,
            None if formula("cauchy") => CAUCHY,
            None => "check the numbers",
        };
        if let Some(nm) = [lo, hi].into_iter().find(|&nm| !(0.1..=10.0).contains(&ior.eval(nm))) {
            return Err(node.fail(format!("the index {:.4} at {nm} nm is not within 0.1 to 10", ior.eval(nm)), units));
        }
        // Of a formula that somebody typed in, or a table: what has a name was looked at, and an Abbe number is meant as it is.
        if formula("sellmeier") || formula("cauchy") || formula("table") {
            self.warn_of_dispersion(node, &ior, units);
        }
        Ok(ior)
    }

    /// Warns of an index that falls with wavelength as in no material.
    fn warn_of_dispersion(&self, node: &Node, ior: &Ior, units: &str) {
        let known = Ior { extrapolate: false, ..ior.clone() };
        let (lo, hi) = known.range_nm;
        if lo > LINE_F_NM || hi < LINE_C_NM || known.is_constant_over(LINE_F_NM, LINE_C_NM) {
            return;
        }
        let abbe = known.vd();
        if !DISPERSIONS.contains(&abbe) {
            let [least, most] = [DISPERSIONS.start(), DISPERSIONS.end()];
            let text = format!(
                "this is an index of {:.4} with an Abbe number of {abbe:.2}, and materials have {least} to {most}; {units}",
                known.nd()
            );
            self.remarks.warn(node, &text);
        }
    }
}

fn unknown(node: &Node, what: &str, name: &str, known: &[&str]) -> crate::Error {
    node.fail(format!("unknown {what} {}", quoted(name)), suggest(name, known.iter().copied()))
}

/// `[[nm, value], ...]`, at least two, with strictly increasing wavelengths.
fn points(node: &Node) -> Result<Vec<(f64, f64)>> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for item in node.array(2)? {
        if item.value.is_number() {
            let remedy = "write [[nm, value], ...], or for a colour {\"linear_rgb\": [1, 1, 1]}";
            return Err(node.fail("these numbers are no spectrum", remedy));
        }
        let [nm, value] = item.numbers()?;
        if nm <= 0.0 || points.last().is_some_and(|last| nm <= last.0) {
            return Err(
                item.fail(format!("the wavelength {nm} nm does not increase"), "sort by wavelength, each positive and once")
            );
        }
        points.push((nm, value));
    }
    match unit_problem(points[0].0, points[points.len() - 1].0) {
        Some(problem) => Err(node.fail(problem, "write them in nm, as in [[400, 0.1], [700, 0.2]]")),
        None => Ok(points),
    }
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
        let range = if limited { "from 0 to 1, those of 8 bits over 255" } else { "of 0 or more" };
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
    library::glass(name).ok_or_else(|| {
        let (problem, remedy) = library::unknown_glass(name);
        node.fail(problem, remedy)
    })
}

impl SpectrumReader {
    fn ior_object(&self, node: &Node) -> Result<Ior> {
        node.object("ior")?;
        let (kind, inner) = node.one_of(&["glass", "file", "sellmeier", "cauchy", "nd", "table"])?;
        if kind != "nd" && node.get("abbe").is_some() {
            return Err(node.fail("\"abbe\" belongs to \"nd\"", "give \"nd\" and \"abbe\", or remove \"abbe\""));
        }
        let mut ior = match kind {
            "glass" => glass(&inner)?,
            "file" => self.glass_file(node, &inner)?.ior,
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
        if let Some(name) = node.get("name").filter(|_| kind != "file") {
            return Err(name.fail("\"name\" belongs to \"file\"", "remove it"));
        }
        if let Some(range) = node.get("range_nm") {
            let [lo, hi] = range.numbers()?;
            if let Some(problem) = unit_problem(lo, hi) {
                return Err(range.fail(problem, "give [lowest, highest] in nm"));
            }
            if lo <= 0.0 || hi <= lo {
                return Err(range.fail(format!("{lo} to {hi} is no range"), "give [lowest, highest] in nm"));
            }
            ior.range_nm = (lo, hi);
        }
        if let Some(extrapolate) = node.get("extrapolate") {
            ior.extrapolate = extrapolate.boolean()?;
        }
        if let Some(of) = node.get("relative_to")
            && of.choice(&["air", "vacuum"])? == "vacuum"
        {
            ior.formula = Formula::OverAir(Box::new(ior.formula));
        }
        Ok(ior)
    }

    /// The glass that an index `{"file": FILE, "name": NAME}` speaks of.
    pub(in crate::scene) fn glass_file(&self, ior: &Node, file: &Node) -> Result<Glass> {
        let (_, bytes) = self.files.read(file)?;
        let name = ior.get("name");
        let wanted = name.as_ref().map(Node::string).transpose()?;
        catalogue::read(&bytes, wanted).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "mend the file"));
            name.as_ref().unwrap_or(file).fail(problem, remedy)
        })
    }
}
