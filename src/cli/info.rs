//! `abbe info`: what is in a file.

use super::bands::BandsArgs;
use super::load::{MemoryArgs, Overrides};
use super::print::{out, percent};
use super::quantity::Quantity;
use super::{Done, Outcome};
use crate::error::{Error, Result};
use crate::output::{Checkpoint, SpectralImage, open_plain};
use crate::scene::{Light, Scene, Sensor};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};

const INFO_EXAMPLES: &str = "Examples:
  abbe info scenes/newton.json
  abbe info model.glb
  abbe info newton.exr --json
  abbe info mitsuba.exr --bands 400-700";

#[derive(clap::Args)]
#[command(after_help = INFO_EXAMPLES)]
pub struct Args {
    /// Scene (.json), glTF (.gltf, .glb), spectral EXR or checkpoint
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Let a scene name files outside its own folder
    #[arg(long)]
    allow_outside: bool,
    #[command(flatten)]
    bands: BandsArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Print one JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Characters of a value that a line shows.
const LONGEST: usize = 240;

/// `abbe info`.
pub fn run(args: &Args) -> Outcome {
    args.memory.limit();
    let facts = if Checkpoint::is_one(&args.file) {
        describe_checkpoint(&args.file)?
    } else if is_exr(&args.file)? {
        describe_image(&args.bands.read(&args.file)?)
    } else {
        let overrides = Overrides { allow_outside: args.allow_outside, ..Overrides::default() };
        describe_scene(&overrides.load(&args.file)?)
    };
    if args.json {
        out(&Value::Object(facts.into_iter().map(|(name, value)| (name.to_string(), value)).collect()).to_string());
    } else {
        let width = facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, value) in facts {
            let values = match value {
                Value::Array(list) => list,
                one => vec![one],
            };
            for (i, value) in values.iter().enumerate() {
                let mut text = value.as_str().map_or_else(|| value.to_string(), str::to_string);
                if let Some((at, _)) = text.char_indices().nth(LONGEST) {
                    text.replace_range(at.., " ...");
                }
                out(&format!("{:width$}  {text}", if i == 0 { &name } else { "" }));
            }
        }
    }
    Ok(Done::Completely)
}

fn is_exr(path: &Path) -> Result<bool> {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let mut magic = [0; 4];
    let read = open_plain(path).and_then(|(mut file, _)| file.read_exact(&mut magic));
    match read {
        Ok(()) => Ok(named || magic == [0x76, 0x2f, 0x31, 0x01]),
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Ok(named),
        Err(e) => Err(Error::file(path, format!("cannot read: {e}"), "check the path")),
    }
}

type Facts = Vec<(String, Value)>;

fn describe_image(image: &SpectralImage) -> Facts {
    let (nm, edges, quantity) = (&image.wavelengths_nm, image.edges_nm(), Quantity::of(image));
    let bins = format!("{} over {:.2} to {:.2} nm", nm.len(), edges[0], edges[nm.len()]);
    let mut facts = vec![
        ("kind".to_string(), json!("spectral EXR")),
        ("size".to_string(), json!(image.window.to_string())),
        ("quantity".to_string(), json!(format!("{}, {}", quantity.name, quantity.unit))),
        ("bins".to_string(), json!(bins)),
        ("wavelengths".to_string(), json!(format!("{} from {} to {} nm", nm.len(), nm[0], nm[nm.len() - 1]))),
    ];
    let mean = image.data.iter().map(|&v| f64::from(v)).sum::<f64>() / image.data.len().max(1) as f64;
    let bad = image.data.iter().filter(|v| !v.is_finite() || **v < 0.0).count();
    facts.push(("mean".to_string(), json!(format!("{mean:.6e}"))));
    facts.push(("not finite or negative".to_string(), json!(bad)));
    if let Some(y) = image.other("XYZ.Y") {
        let mean = y.iter().map(|&v| f64::from(v)).sum::<f64>() / y.len().max(1) as f64;
        facts.push(("mean of Y".to_string(), json!(format!("{mean:.6e} {}", quantity.photometric_unit))));
    }
    let of_bin = |name: &str| name.strip_prefix("error.").is_some_and(|bin| bin.ends_with("nm"));
    let (errors, others): (Vec<&str>, Vec<&str>) =
        image.others.iter().map(|(name, _)| name.as_str()).partition(|name| of_bin(name));
    facts.push(("other channels".to_string(), json!(others.join(" "))));
    if !errors.is_empty() {
        facts.push(("error channels".to_string(), json!(format!("{}, as {}", errors.len(), errors[0]))));
    }
    facts.extend(image.attributes.iter().map(|(name, value)| (name.clone(), json!(value))));
    facts
}

fn describe_checkpoint(path: &Path) -> Result<Facts> {
    let checkpoint = Checkpoint::open(path)?;
    let header = checkpoint.header.clone();
    let (rendering, ..) = checkpoint.rendering()?;
    let mut facts = vec![("kind".to_string(), json!("checkpoint"))];
    facts.extend(header["identity"].as_object().into_iter().flatten().map(|(name, value)| (name.clone(), value.clone())));
    facts.extend([
        ("share".to_string(), json!(format!("{}/{}", rendering.share.number + 1, rendering.share.of))),
        ("done".to_string(), header["done"].clone()),
        ("samples per pixel".to_string(), json!(rendering.spp)),
        ("batches".to_string(), json!(rendering.batches)),
        ("seconds".to_string(), json!(rendering.elapsed.as_secs_f64())),
        ("relative error".to_string(), json!(percent(rendering.film.relative_error()))),
        ("scene file".to_string(), header["request"]["scene"].clone()),
    ]);
    Ok(facts)
}

fn describe_scene(scene: &Scene) -> Facts {
    let (film, bins) = (&scene.film, &scene.film.bins);
    let mut facts: Facts = vec![
        ("kind".to_string(), json!("scene")),
        ("name".to_string(), json!(scene.name)),
        ("size".to_string(), json!(format!("{}x{}", film.width, film.height))),
        ("bins".to_string(), json!(format!("{} over {} to {} nm", bins.count, bins.min_nm, bins.max_nm))),
        ("sensor".to_string(), json!(sensor_name(&scene.sensor))),
        ("contents".to_string(), json!(summary(scene))),
        ("max depth".to_string(), json!(scene.max_depth)),
    ];
    let lights: Vec<Value> = scene.lights.iter().map(|light| json!(light_name(light))).collect();
    let emitters = scene.shapes.iter().filter(|s| s.emission.is_some()).map(|s| json!(format!("{} (shape)", s.name)));
    facts.push(("lights".to_string(), Value::Array(lights.into_iter().chain(emitters).collect())));
    let media = scene.interiors.iter().skip(1).map(|i| json!(i.name)).collect();
    facts.push(("volumes".to_string(), Value::Array(media)));
    facts.push(("notes".to_string(), json!(scene.notes)));
    facts
}

/// The numbers of a scene's parts.
pub fn summary(scene: &Scene) -> String {
    let emitters = scene.shapes.iter().filter(|s| s.emission.is_some()).count();
    format!(
        "{} shapes with {} triangles, {} materials, {} lights, {} volumes",
        scene.shapes.len(),
        scene.triangles(),
        scene.materials.len(),
        emitters + scene.lights.len(),
        scene.interiors.len().saturating_sub(1)
    )
}

/// What measures the light, in words.
pub fn sensor_name(sensor: &Sensor) -> &'static str {
    match sensor {
        Sensor::Perspective { optics: Some(_), .. } => "camera through the surfaces of a lens",
        Sensor::Perspective { lens_radius, .. } if *lens_radius > 0.0 => "thin lens camera",
        Sensor::Perspective { .. } => "pinhole camera",
        Sensor::Orthographic { .. } => "orthographic camera",
        Sensor::IrradiancePlane { .. } => "irradiance on a plane",
        Sensor::IrradianceSphere { .. } => "irradiance on a sphere",
    }
}

/// A light, in words, with its flux where it has a place.
pub fn light_name(light: &Light) -> String {
    let kind = light.name();
    light.luminous_flux_lm().map_or_else(|| kind.into(), |lm| format!("{kind} of {lm:.1} lm"))
}
