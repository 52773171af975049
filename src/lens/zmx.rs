//! Prescriptions of Zemax (`.zmx`), sequential: spheres, conics and even aspheres, glasses by name or as models.

use super::{Fault, Glass, Prescription, Surface};
use crate::error::quoted;
use crate::spectrum::{Ior, library};

/// Aspheric parameters of a surface.
const PARAMETERS: usize = 8;

/// Whether text is of such a file.
pub fn is_zmx(text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("SURF "))
}

/// A surface as the file has it, lengths in the file's unit.
#[derive(Default)]
struct Raw {
    kind: String,
    curvature: f64,
    conic: f64,
    parameters: [f64; PARAMETERS],
    thickness: f64,
    glass: Option<Vec<String>>,
    semi_diameter: f64,
    stop: bool,
}

/// What the file says of the whole.
struct Head {
    name: String,
    /// m.
    unit: f64,
    catalogues: Vec<String>,
    entrance_diameter: Option<f64>,
    f_number: Option<f64>,
    /// Tangent of the greatest angle of the field.
    field: f64,
}

fn fault(surface: Option<usize>, problem: impl Into<String>, remedy: &str) -> Fault {
    Fault { surface, problem: problem.into(), remedy: remedy.into() }
}

/// Reads the text of a file. Surfaces are counted from 0 as the lens has them: the object, the image and planes that do nothing are left out.
pub fn read(text: &str) -> Result<Prescription, Fault> {
    let (head, raw) = parse(text)?;
    let Some((_, lens)) = raw.split_last().filter(|(_, rest)| rest.len() > 1) else {
        return Err(fault(None, "the file has no surfaces", "use a sequential .zmx file"));
    };
    let mut surfaces: Vec<Surface> = Vec::new();
    for (i, raw) in lens.iter().enumerate().skip(1) {
        let surface = surface(i, raw, &head)?;
        let before_is_air = surfaces.last().is_none_or(|s| s.glass.is_none());
        if surface.is_plane() && surface.glass.is_none() && before_is_air && !surface.stop {
            // A plane that is not there; its distance belongs to the one before.
            if let Some(last) = surfaces.last_mut() {
                last.thickness += surface.thickness;
            }
            continue;
        }
        surfaces.push(surface);
    }
    let mut lens = Prescription { name: head.name.clone(), surfaces };
    fill_diameters(&mut lens, &head);
    lens.check()?;
    Ok(lens)
}

fn parse(text: &str) -> Result<(Head, Vec<Raw>), Fault> {
    let mut head =
        Head { name: String::new(), unit: 1e-3, catalogues: vec![], entrance_diameter: None, f_number: None, field: 0.0 };
    let mut raw: Vec<Raw> = Vec::new();
    let mut is_angle = true;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        let rest: Vec<&str> = words.collect();
        let at = raw.len().checked_sub(1);
        let number = |i: usize| -> Result<f64, Fault> {
            let text = rest.get(i).copied().unwrap_or_default();
            let value = match text.to_ascii_uppercase().as_str() {
                "INFINITY" => Some(f64::INFINITY),
                _ => text.parse().ok().filter(|v: &f64| v.is_finite()),
            };
            value.ok_or_else(|| fault(at, format!("{} of {word} is no number", quoted(text)), "mend the file"))
        };
        match (word, raw.last_mut()) {
            ("SURF", _) => {
                if raw.len() > 1000 {
                    return Err(fault(None, "the file has more than 1000 surfaces", "use a lens of fewer"));
                }
                raw.push(Raw { kind: "STANDARD".into(), ..Raw::default() });
            }
            ("NAME", None) => head.name = rest.join(" ").chars().filter(|c| !c.is_control()).take(200).collect(),
            ("UNIT", None) => {
                head.unit = match rest.first().copied() {
                    Some("MM") | None => 1e-3,
                    Some("CM") => 1e-2,
                    Some("IN") => 0.0254,
                    Some("METER" | "M") => 1.0,
                    Some(unit) => {
                        let problem = format!("{} is no unit of length", quoted(unit));
                        return Err(fault(None, problem, "use MM, CM, IN or METER"));
                    }
                }
            }
            ("GCAT", None) => head.catalogues = rest.iter().map(|c| c.to_lowercase()).collect(),
            ("ENPD", None) => head.entrance_diameter = Some(number(0)?),
            ("FNUM", None) => head.f_number = Some(number(0)?),
            ("FTYP", None) => is_angle = number(0)? == 0.0,
            ("XFLN" | "YFLN", None) if is_angle => {
                let angles = (0..rest.len()).filter_map(|i| number(i).ok());
                let greatest = angles.map(f64::abs).filter(|a| *a < 89.0).fold(0.0, f64::max);
                head.field = head.field.max(greatest.to_radians().tan());
            }
            ("MODE", None) if rest.first() == Some(&"NSC") => {
                return Err(fault(None, "the file is not sequential", "use a sequential one"));
            }
            ("TYPE", Some(s)) => s.kind = rest.first().copied().unwrap_or_default().to_string(),
            ("CURV", Some(s)) => s.curvature = number(0)?,
            ("CONI", Some(s)) => s.conic = number(0)?,
            ("DISZ", Some(s)) => s.thickness = number(0)?,
            ("DIAM", Some(s)) => s.semi_diameter = number(0)?,
            ("STOP", Some(s)) => s.stop = true,
            ("GLAS", Some(s)) => s.glass = Some(rest.iter().map(|w| w.to_string()).collect()),
            ("PARM", Some(s)) => {
                let (which, value) = (number(0)?, number(1)?);
                if value != 0.0 {
                    let slot = (1..=PARAMETERS).find(|&i| i as f64 == which).map(|i| &mut s.parameters[i - 1]);
                    *slot.ok_or_else(|| fault(at, format!("parameter {which} is not known"), "use an even asphere"))? = value;
                }
            }
            _ => {}
        }
    }
    Ok((head, raw))
}

fn surface(at: usize, raw: &Raw, head: &Head) -> Result<Surface, Fault> {
    let aspheric = match raw.kind.as_str() {
        "STANDARD" => Vec::new(),
        "EVENASPH" => {
            // Of r^2, r^4, ...: each in the unit to the power of 1 - 2 i.
            let in_metres = |(i, a): (usize, &f64)| a * head.unit.powi(1 - 2 * (i as i32 + 1));
            let mut all: Vec<f64> = raw.parameters.iter().enumerate().map(in_metres).collect();
            let used = all.iter().rposition(|a| *a != 0.0).map_or(0, |i| i + 1);
            all.truncate(used);
            all
        }
        kind => {
            let problem = format!("a surface of the kind {} is not read", quoted(kind));
            return Err(fault(Some(at), problem, "use STANDARD and EVENASPH surfaces"));
        }
    };
    Ok(Surface {
        radius: if raw.curvature == 0.0 { f64::INFINITY } else { head.unit / raw.curvature },
        conic: raw.conic,
        aspheric,
        thickness: head.unit * raw.thickness,
        glass: raw.glass.as_deref().map(|words| glass(at, words, head)).transpose()?,
        semi_diameter: head.unit * raw.semi_diameter,
        stop: raw.stop,
    })
}

/// `NAME model pickup nd Vd ...`: by name, of the file's catalogues first, or a model glass by its index and Abbe number.
fn glass(at: usize, words: &[String], head: &Head) -> Result<Glass, Fault> {
    let name = words.first().map(String::as_str).unwrap_or_default();
    if name.eq_ignore_ascii_case("MIRROR") {
        return Err(fault(Some(at), "the lens has a mirror", "use a lens that only refracts"));
    }
    let number = |i: usize| words.get(i).and_then(|w| w.parse::<f64>().ok()).filter(|v| v.is_finite());
    if name == "___BLANK" || words.get(1).is_some_and(|w| w == "1") {
        return match (number(3), number(4)) {
            (Some(nd), vd) if (1.0..4.0).contains(&nd) => {
                let vd = vd.filter(|v| *v >= 1.0).unwrap_or(0.0);
                Ok(Glass { name: format!("{nd}, {vd}"), ior: Ior::from_abbe_number(nd, vd), absorption: None })
            }
            _ => Err(fault(Some(at), "the model glass has no index", "give its n_d and V_d")),
        };
    }
    Glass::named(name, &head.catalogues).map_err(|(problem, remedy)| fault(Some(at), problem, &remedy))
}

impl Glass {
    /// The glass of the library of this name, of one of `catalogues` first. Old names stand for the same glass without lead or arsenic, as BK7 for N-BK7.
    ///
    /// Errors with a problem and a remedy where there is none.
    pub fn named(name: &str, catalogues: &[String]) -> Result<Glass, (String, String)> {
        let of_maker = catalogues.iter().map(|maker| format!("{maker}/{name}"));
        let candidates = [name.to_string()].into_iter().chain(of_maker).chain([format!("N-{name}")]);
        for full in candidates {
            if let Some(ior) = library::glass(&full) {
                return Ok(Glass { absorption: library::glass_absorption(&full), name: full, ior });
            }
        }
        Err(library::unknown_glass(name))
    }
}

/// Semi-diameters that the file leaves to the program: as wide as the field's light needs, by paraxial rays.
fn fill_diameters(lens: &mut Prescription, head: &Head) {
    const D: f64 = crate::spectrum::LINE_D_NM;
    if lens.surfaces.iter().all(|s| s.semi_diameter > 0.0) {
        return;
    }
    // A stop of some size gives the pupil's place and magnification.
    let stop = lens.stop(D);
    let known = lens.surfaces[stop].semi_diameter > 0.0;
    if !known {
        lens.surfaces[stop].semi_diameter = head.unit;
    }
    let paraxial = lens.paraxial(D);
    let wanted = head.entrance_diameter.map(|d| d * head.unit).or(head.f_number.map(|n| paraxial.focal_length.abs() / n));
    if let (false, Some(diameter)) = (known, wanted) {
        lens.surfaces[stop].semi_diameter *= 0.5 * diameter / paraxial.entrance_pupil.1.abs();
    }
    let paraxial = lens.paraxial(D);
    let (z, radius) = paraxial.entrance_pupil;
    let marginal = lens.heights(radius, 0.0, D);
    let chief = lens.heights(-z * head.field, head.field, D);
    for (i, surface) in lens.surfaces.iter_mut().enumerate() {
        if surface.semi_diameter == 0.0 {
            surface.semi_diameter = marginal[i].abs() + chief[i].abs();
        }
    }
}
