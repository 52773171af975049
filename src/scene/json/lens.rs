//! Lenses: prescriptions as JSON, from files and by name, and cameras made of them.

use crate::error::{Error, Result, quoted, suggest};
use crate::lens::camera::{Focus, Setting};
use crate::lens::{Fault, Glass, LensCamera, Prescription, Surface, library, zmx};
use crate::scene::json::Node;
use crate::scene::json::files::{Files, read_scene_file};
use crate::scene::json::load::view;
use crate::scene::json::parse;
use crate::scene::json::remarks::Remarks;
use crate::scene::json::shapes::metres;
use crate::scene::json::spectra::SpectrumReader;
use crate::scene::{FilmSettings, Sensor};
use crate::spectrum::measured::decode;
use crate::spectrum::{Ior, library as spectra};
use glam::DVec2;
use std::path::Path;
use std::sync::Arc;

/// Where a prescription may stand.
const SOURCES: &[&str] = &["file", "prescription", "surfaces"];
/// How far the sides of a pixel may differ.
const SQUARE: f64 = 1e-3;
/// The range over which a lens by itself must have its indices, nm: from F to C.
const RANGE_NM: (f64, f64) = (486.0, 656.5);

/// The lens that `node` describes by one of `file`, `prescription` (a name) and `surfaces`.
pub(in crate::scene) fn prescription(node: &Node, reader: &SpectrumReader) -> Result<Prescription> {
    let (kind, inner) = node.one_of(SOURCES)?;
    match kind {
        "file" => {
            let (path, bytes) = reader.files.read(&inner)?;
            // Files that it names lie beside it.
            let beside = SpectrumReader { files: reader.files.within(path.parent().unwrap_or(Path::new("."))), ..reader.clone() };
            read(&bytes, &path, Some(&inner), &beside)
        }
        "prescription" => {
            let name = inner.string()?;
            let text = library::text(name).ok_or_else(|| {
                inner.fail(format!("unknown lens {}", quoted(name)), suggest(name, library::LENSES.map(|(name, _)| name)))
            })?;
            read(text.as_bytes(), Path::new(name), None, reader)
        }
        _ => surfaces(node, reader),
    }
}

/// The lens of the library of this name, or of a file: Zemax or JSON. Indices must be known over the range in nm, or from F to C.
///
/// # Errors
/// [`Error::File`] where it cannot be read, [`Error::Scene`] for what is wrong in it.
pub fn load_lens(name: &str, range_nm: Option<(f64, f64)>) -> Result<Prescription> {
    let path = Path::new(name);
    let folder = path.parent().unwrap_or(Path::new("."));
    let reader =
        SpectrumReader { files: Files::new(folder, true), range: range_nm.unwrap_or(RANGE_NM), remarks: Remarks::default() };
    if let Some(text) = library::text(name) {
        return read(text.as_bytes(), path, None, &reader);
    }
    if path.extension().is_none() && !path.exists() {
        let known = library::LENSES.map(|(name, _)| name);
        let remedy = format!("{}, or name a .zmx or .json file", suggest(name, known));
        return Err(Error::usage(format!("unknown lens {}", quoted(name)), remedy));
    }
    let (_, bytes) = read_scene_file(path)?;
    read(&bytes, path, None, &reader)
}

/// A prescription of a file that `from` names, if something does.
fn read(bytes: &[u8], path: &Path, from: Option<&Node>, reader: &SpectrumReader) -> Result<Prescription> {
    let text = decode(bytes);
    if !zmx::is_zmx(&text) {
        let value = parse(&text, path)?;
        let root = Node::root(&value, path);
        root.object("prescription")?;
        return surfaces(&root, reader);
    }
    let failed = |problem: String, remedy: String| match from {
        Some(node) => node.fail(format!("{}: {problem}", quoted(node.string().unwrap_or_default())), remedy),
        None => Error::file(path, problem, remedy),
    };
    let lens = zmx::read(&text).map_err(|Fault { surface, problem, remedy }| match surface {
        Some(i) => failed(format!("surface {i}: {problem}"), remedy),
        None => failed(problem, remedy),
    })?;
    for glass in lens.surfaces.iter().filter_map(|s| s.glass.as_ref()) {
        let (lo, hi) = reader.range;
        glass.ior.check_range(lo, hi).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "use another glass"));
            failed(format!("glass {}: {problem}", quoted(&glass.name)), remedy.to_string())
        })?;
    }
    Ok(lens)
}

/// The lens whose `surfaces` stand in `node`, with a `unit`, a `name` and a `diameter` for those that have none.
fn surfaces(node: &Node, reader: &SpectrumReader) -> Result<Prescription> {
    let unit = node.get("unit").map_or(Ok(1.0), |unit| metres(&unit))?;
    for text in ["name", "source"].iter().filter_map(|key| node.get(key)) {
        text.string()?;
    }
    let name = node.get("name").map_or(Ok(""), |n| n.string())?;
    let diameter = node.get("diameter").map(|n| n.positive()).transpose()?;
    let list = node.need("surfaces")?;
    let one = |at: &Node| -> Result<Surface> {
        at.object("lens_surface")?;
        let radius = at.get("radius").map_or(Ok(f64::INFINITY), |n| n.number())?;
        let aspheric = at.get("aspheric").map_or(Ok(Vec::new()), |n| n.array(0))?;
        let in_metres = |(i, a): (usize, &Node)| a.number().map(|a| a * unit.powi(1 - 2 * (i as i32 + 1)));
        let own = at.get("diameter").map(|n| n.positive()).transpose()?.or(diameter);
        let own =
            own.ok_or_else(|| at.fail("the surface has no diameter", "add \"diameter\" here, or for all beside \"surfaces\""))?;
        Ok(Surface {
            radius: unit * radius,
            conic: at.get("conic").map_or(Ok(0.0), |n| n.number())?,
            aspheric: aspheric.iter().enumerate().map(in_metres).collect::<Result<_>>()?,
            thickness: unit * at.get("thickness").map_or(Ok(0.0), |n| n.number())?,
            glass: at.get("glass").map(|n| glass(&n, reader)).transpose()?,
            semi_diameter: 0.5 * unit * own,
            stop: at.get("stop").map_or(Ok(false), |n| n.boolean())?,
        })
    };
    let items = list.array(1)?;
    if items.len() > crate::lens::MOST_SURFACES {
        let most = crate::lens::MOST_SURFACES;
        return Err(list.fail(format!("the lens has {} surfaces", items.len()), format!("use at most {most}")));
    }
    let surfaces = items.iter().map(one).collect::<Result<_>>()?;
    let lens = Prescription { name: name.chars().filter(|c| !c.is_control()).take(200).collect(), surfaces };
    lens.check().map_err(|Fault { surface, problem, remedy }| match surface {
        Some(i) => items[i].fail(problem, remedy),
        None => list.fail(problem, remedy),
    })?;
    Ok(lens)
}

/// What is behind a surface: the name of a glass, or any index.
fn glass(node: &Node, reader: &SpectrumReader) -> Result<Glass> {
    let ior: Ior = reader.ior(node)?;
    if let Ok(name) = node.string() {
        return Ok(Glass { name: name.to_string(), ior, absorption: spectra::glass_absorption(name) });
    }
    let absorption = match node.get("file") {
        Some(file) => reader.glass_file(node, &file)?.absorption(),
        None => node.get("glass").and_then(|n| n.string().ok().and_then(spectra::glass_absorption)),
    };
    let name = node.get("glass").or(node.get("name")).and_then(|n| n.string().ok().map(str::to_string));
    Ok(Glass { name: name.unwrap_or_else(|| format!("{:.5}", ior.nd())), ior, absorption })
}

/// A camera through a lens; the film's size in m is given, and its pixels are square.
pub(in crate::scene) fn camera(inner: &Node, film: &FilmSettings, reader: &SpectrumReader) -> Result<Sensor> {
    let (eye, frame, distance) = view(inner)?;
    let lens = prescription(inner, reader)?;
    if let (None, Some(idle)) = (inner.get("surfaces"), inner.get("unit").or(inner.get("diameter"))) {
        return Err(idle.fail("the prescription says its own unit and diameters", "leave this out"));
    }
    let size = inner.need("film")?;
    let [width, height] = size.numbers()?;
    if !(width > 0.0 && height > 0.0 && width <= 1e3 && height <= 1e3) {
        return Err(size.fail(format!("a film of {width} by {height} m"), "give its width and height in metres: [0.036, 0.024]"));
    }
    let pixels = f64::from(film.width) / f64::from(film.height);
    if (width / height / pixels - 1.0).abs() > SQUARE {
        return Err(size.fail(
            format!("a film of {width} by {height} m has no square pixels in a picture of {} by {}", film.width, film.height),
            format!(
                "make the picture {} by {}, or the film [{width}, {}]",
                film.width,
                (f64::from(film.width) * height / width).round(),
                width / pixels
            ),
        ));
    }
    let setting = Setting {
        film: DVec2::new(width, height),
        focus: match (inner.get("film_distance"), inner.get("focus_distance")) {
            (Some(film), None) => Focus::Film(film.length()?),
            (Some(film), Some(_)) => {
                return Err(film.fail("both \"film_distance\" and \"focus_distance\" are given", "keep one of them"));
            }
            (None, focus) => Focus::At(focus.map_or(Ok(distance), |n| n.length())?),
        },
        f_number: inner.get("f_number").map(|n| n.positive()).transpose()?,
        range_nm: reader.range,
    };
    for warning in lens.crossings() {
        reader.remarks.warn(inner, &warning);
    }
    let optics = LensCamera::new(lens, &setting).map_err(|Fault { problem, remedy, .. }| inner.fail(problem, remedy))?;
    Ok(Sensor::Perspective {
        eye,
        frame,
        tan_half_vfov: optics.tan_half_vfov,
        lens_radius: optics.paraxial.entrance_pupil.1.abs().min(optics.front.radius),
        focus_distance: match setting.focus {
            Focus::At(focus) => focus,
            Focus::Film(_) => distance,
        },
        optics: Some(Arc::new(optics)),
    })
}
