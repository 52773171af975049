//! `abbe develop`: from a spectral EXR to a picture.

use super::bands::BandsArgs;
use super::device::REFERENCE;
use super::picture::{PictureArgs, choice};
use super::print::{note, out};
use super::{Done, Outcome};
use crate::color::adapt::{Method, White};
use crate::color::upsample::white as d65;
use crate::develop::gamut::Gamut;
use crate::develop::picture::{Development, Exposure, PictureSettings};
use crate::error::{self, Error};
use crate::gpu::Gpu;
use crate::output::picture::{Format, Precision};
use crate::output::{Quantity, check_writable, write_picture};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  abbe develop newton.exr -o newton.png
  abbe develop newton.exr -o newton.png --exposure 2 --tone agx --space p3 --bits 16
  abbe develop room.exr -o room.jpg --white 3200K --adaptation cat16
  abbe develop room.exr -o room_acescg.exr --space acescg
  abbe develop chart.exr -o chart.png --illuminant FL11
  abbe develop pool.checkpoint -o so_far.png
  abbe develop mitsuba.exr -o picture.png --bands 400-700
  abbe develop poster.exr -o poster.png --device reference

A file that Abbe rendered keeps the exposure of its own picture; a reflectance has 0; others are exposed automatically.";

const METHODS: [(&str, Method); 2] = [("bradford", Method::Bradford), ("cat16", Method::Cat16)];
const BITS: [(&str, u8); 2] = [("8", 8), ("16", 16)];

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Spectral EXR: Abbe's, or any of Fichet's layout, emissive (S0) or reflective (T); or a checkpoint
    #[arg(value_name = "IN.exr")]
    input: PathBuf,
    /// Picture to write: .png, .jpg, or .exr for linear RGB
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    picture: PictureArgs,
    /// Light that is to look white: a CIE illuminant, the temperature of a blackbody, or a chromaticity, as in FL11, 3200K or 0.31,0.33 [default: D65; of a reflectance, its illuminant]
    #[arg(long, value_name = "LIGHT", value_parser = white)]
    white: Option<White>,
    /// How it is made to look white
    #[arg(long, value_name = "METHOD", default_value = "bradford", value_parser = choice(METHODS))]
    adaptation: Method,
    /// CIE observer: 1931 (2 degrees) or 1964 (10 degrees)
    #[arg(long, value_name = "YEAR", default_value = "1931", value_parser = choice(Observer::NAMED))]
    observer: Observer,
    /// Bits per component of a .png
    #[arg(long, value_name = "N", default_value = "8", value_parser = choice(BITS))]
    bits: u8,
    /// Round every pixel by itself instead of spreading the error
    #[arg(long)]
    no_dither: bool,
    /// Quality of a .jpg
    #[arg(long, value_name = "PERCENT", default_value_t = 95, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: u8,
    /// Light on a reflectance (T channels): a CIE illuminant or the temperature of a blackbody [default: D65]
    #[arg(long, value_name = "LIGHT", value_parser = light)]
    illuminant: Option<Spectrum>,
    /// Adapter that makes the picture, by any part of its name, or 'reference' for double precision on the CPU [default: the best adapter for a million pixels or more, the CPU for less]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    #[command(flatten)]
    bands: BandsArgs,
}

/// From this many pixels on an adapter makes up for the time that it takes to open: of 2000x1500, Mesa's lavapipe on two cores develops saturated colours
/// in 0.55 times the CPU time of `reference`, reading and writing included, and dull ones in the same; of 1000x700, in 0.6 and 1.1 times.
const LARGE: usize = 1_000_000;

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let format = Format::of(&args.output);
    check_writable(&args.output, args.bands.table().into_iter().chain([args.input.as_path()]))?;
    let image = args.bands.read(&args.input)?;
    let illuminant = args.illuminant.clone().unwrap_or_else(d65);
    let colours = image.xyz(args.observer, &illuminant);
    let colours = colours.map_err(|problem| Error::file(&args.input, problem, "give a file of visible light"))?;
    colours.note.iter().for_each(|n| note(&format!("note: {n}")));
    let lost = colours.xyz.iter().filter(|xyz| xyz.iter().any(|v| !v.is_finite())).count();
    if lost > 0 {
        note(&format!("note: pixels with values that are not finite, shown black: {lost}"));
    }

    let reflective = image.quantity == Quantity::Reflective;
    if args.illuminant.is_some() && !reflective {
        note("note: --illuminant is for reflectances, and this file is of light; see --white");
    }
    let own = PictureSettings {
        exposure: image.own_exposure().map(Exposure::Stops),
        gamut: (format == Some(Format::Exr)).then_some(Gamut::Keep),
        ..PictureSettings::default()
    };
    let settings = args.picture.settings().or(own);
    let stops = settings.exposure.unwrap_or_default().of(&colours.xyz, args.observer);
    let development = Development {
        observer: args.observer,
        white: args.white.clone().or_else(|| reflective.then_some(White::Light(illuminant))),
        method: args.adaptation,
        ..settings.development(stops)
    };
    let precision = Precision { sixteen_bits: args.bits == 16, dither: !args.no_dither, quality: args.quality };
    let gpu = adapter(args.device.as_deref(), colours.xyz.len())?;
    let write = || write_picture(&args.output, &colours.xyz, image.width, &development, precision, gpu.as_ref());
    gpu.as_ref().map_or_else(write, |gpu| gpu.faults.guard(write))?;
    let on = gpu.map_or_else(String::new, |gpu| format!(", on {}", gpu.info.name));
    out(&format!("wrote {}: {}x{}, exposure {stops:+.3} EV{on}", args.output.display(), image.width, image.height));
    Ok(Done::Completely)
}

/// What makes the picture, unless the CPU does.
fn adapter(wanted: Option<&str>, pixels: usize) -> error::Result<Option<Gpu>> {
    match wanted {
        Some(REFERENCE) => Ok(None),
        Some(name) => Gpu::open(Some(name)).map(Some),
        None if pixels < LARGE => Ok(None),
        // Without one the CPU does it all the same.
        None => Ok(Gpu::open(None).ok()),
    }
}

fn light(text: &str) -> Result<Spectrum, String> {
    let kelvin = text.strip_suffix(['K', 'k']).and_then(|t| t.trim_end().parse().ok()).filter(|t| (1000.0..=1e5).contains(t));
    kelvin.map(|kelvin| Spectrum::Blackbody { kelvin, scale: 1.0 }).or_else(|| library::illuminant(text)).ok_or_else(|| {
        format!("no such light; write a temperature from 1000K to 100000K, or one of {}", library::illuminant_names().join(", "))
    })
}

fn white(text: &str) -> Result<White, String> {
    match text.split_once(',') {
        None => light(text).map(White::Light),
        Some((x, y)) => match (x.trim().parse::<f64>(), y.trim().parse::<f64>()) {
            (Ok(x), Ok(y)) if x > 0.0 && y > 0.0 && x + y < 1.0 => Ok(White::Chromaticity([x, y])),
            _ => Err("write a chromaticity x,y with x, y and 1 - x - y above 0, as in 0.3127,0.3290".to_string()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_they_are_written() {
        assert_eq!(white("3200K"), Ok(White::blackbody(3200.0)));
        assert_eq!(white("0.31, 0.33"), Ok(White::Chromaticity([0.31, 0.33])));
        assert_eq!(Some(white("d65").expect("D65")), White::illuminant("D65"));
        assert!(["D66", "3K", "K", "0.5,0.6", "0,0.3", "1,2,3", "x,y"].iter().all(|text| white(text).is_err()));
    }
}
