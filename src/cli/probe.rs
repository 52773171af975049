//! `abbe probe`: the spectrum under a pixel or a region of a spectral EXR.

use super::bands::BandsArgs;
use super::print::out;
use super::quantity::Quantity;
use super::{Done, Outcome, values};
use crate::cli::plot::{Axis, Curve, Plot};
use crate::color::bins::emission_weights;
use crate::color::chromaticity::{color_of_wavelength, correlated_color_temperature, dominant_wavelength};
use crate::color::cie::xy;
use crate::error::{Error, Result};
use crate::output::{SpectralImage, Window, check_writable, write_text};
use crate::spectrum::library::Observer;
use serde_json::{Value, json};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  abbe probe newton.exr 320,200
  abbe probe newton.exr 100,50,8,8 200,50,8,8 -o spectra.svg
  abbe probe newton.exr 320,200 --json

Pixels are counted from 0, to the right and downwards from the upper left corner; 'x,y,w,h' is the mean over w x h pixels from x,y on.
Errors are standard errors, where the file has them ('abbe render --aov error'); for a region the pixels' are
taken as independent, and so come out too small where a lamp with lines gives all pixels the same error.
XYZ (CIE 1931) come from the file's XYZ channels or, without them, from the bins. The dominant wavelength is towards equal-energy white, and a
colour temperature is given within |Duv| = 0.05 of a blackbody's colour; where neither means anything, neither is printed.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Spectral EXR
    #[arg(value_name = "IN.exr")]
    image: PathBuf,
    /// Pixels x,y or regions x,y,w,h
    #[arg(value_name = "REGION", required = true, value_parser = values::region)]
    regions: Vec<values::Region>,
    /// Plot of the spectra, as SVG
    #[arg(short, long, value_name = "OUT.svg", value_parser = values::svg)]
    output: Option<PathBuf>,
    #[command(flatten)]
    bands: BandsArgs,
    /// Print a JSON array instead of lines
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let image = args.bands.read(&args.image)?;
    let probes = args.regions.iter().map(|region| Probe::of(&image, region, args)).collect::<Result<Vec<_>>>()?;
    let quantity = Quantity::of(&image);
    if let Some(path) = &args.output {
        check_writable(path, args.bands.table().into_iter().chain([args.image.as_path()]))?;
        write_text(path, &plot(&image, &quantity, &probes, args).svg())?;
    }
    if args.json {
        out(&Value::Array(probes.iter().map(|p| p.json(&image, &quantity)).collect()).to_string());
    } else {
        probes.iter().for_each(|p| out(&p.text(&quantity)));
        out(&table(&image, &quantity, &probes));
    }
    Ok(Done::Completely)
}

/// What is under one region.
struct Probe {
    /// The region as it was given.
    name: String,
    pixels: usize,
    /// Mean of every bin, and its standard error where the file has it.
    values: Vec<f64>,
    errors: Option<Vec<f64>>,
    xyz: [f64; 3],
}

impl Probe {
    fn of(image: &SpectralImage, region: &values::Region, args: &Args) -> Result<Self> {
        let values::Region { x, y, width, height } = *region;
        let own = image.window;
        let asked = Window { x: x as i64, y: y as i64, size: [width as usize, height as usize], ..own };
        if own.common(&asked) != Some(asked) {
            let problem = format!("{region} is not inside {}", args.image.display());
            let [w, h] = own.size.map(|n| n as i64 - 1);
            let ends = format!("{},{} to {},{}", own.x, own.y, own.x + w, own.y + h);
            return Err(Error::usage(problem, format!("it has {}x{} pixels: {ends}", own.size[0], own.size[1])));
        }
        let row = |y: i64| {
            let first = ((y - own.y) * own.size[0] as i64 + asked.x - own.x) as usize;
            first..first + width as usize
        };
        let pixels: Vec<usize> = (asked.y..asked.y + height as i64).flat_map(row).collect();
        let mean = |value: &dyn Fn(usize) -> f64| pixels.iter().map(|&p| value(p)).sum::<f64>() / pixels.len() as f64;

        let bins = image.bins();
        let values: Vec<f64> = (0..bins).map(|b| mean(&|p| f64::from(image.pixel(p)[b]))).collect();
        let errors = image.errors().map(|e| {
            let variance = |b: usize| mean(&|p| f64::from(e[p * bins + b]).powi(2)) / pixels.len() as f64;
            (0..bins).map(|b| variance(b).sqrt()).collect()
        });
        let channels = ["XYZ.X", "XYZ.Y", "XYZ.Z"].map(|name| image.other(name));
        let xyz = match channels {
            [Some(_), Some(_), Some(_)] => channels.map(|c| mean(&|p| c.map_or(0.0, |c| f64::from(c[p])))),
            _ => {
                let weights = emission_weights(image.edges_nm(), Observer::Cie1931);
                std::array::from_fn(|i| values.iter().zip(&weights).map(|(v, w)| v * w[i]).sum())
            }
        };
        Ok(Probe { name: region.to_string(), pixels: pixels.len(), values, errors, xyz })
    }

    /// Chromaticity of what is a light: not of black, nor of what noise made negative.
    fn xy(&self) -> Option<[f64; 2]> {
        (self.xyz.iter().all(|v| v.is_finite() && *v >= 0.0) && self.xyz[1] > 0.0).then(|| xy(self.xyz))
    }

    fn text(&self, quantity: &Quantity) -> String {
        let [x, y, z] = self.xyz;
        let over = if self.pixels == 1 { String::new() } else { format!(" (mean of {} pixels)", self.pixels) };
        let mut lines =
            vec![format!("{}{over}", self.name), format!("  XYZ {x:.6e} {y:.6e} {z:.6e} {}", quantity.photometric_unit)];
        if let Some(xy) = self.xy() {
            lines.push(format!("  x {:.5}  y {:.5}", xy[0], xy[1]));
            lines.extend(dominant_wavelength(xy).map(|d| {
                let what = if d.complementary { "purple, complementary to" } else { "dominant wavelength" };
                format!("  {what} {:.1} nm, purity {:.3}", d.nm, d.purity)
            }));
            lines.extend(
                correlated_color_temperature(xy)
                    .map(|(kelvin, duv)| format!("  colour temperature {kelvin:.0} K, Duv {duv:+.4}")),
            );
        }
        lines.join("\n") + "\n"
    }

    fn json(&self, image: &SpectralImage, quantity: &Quantity) -> Value {
        let chromaticity = self.xy();
        let dominant = chromaticity.and_then(dominant_wavelength);
        let temperature = chromaticity.and_then(correlated_color_temperature);
        json!({
            "region": self.name,
            "pixels": self.pixels,
            "quantity": quantity.name,
            "unit": quantity.unit,
            "nm": image.wavelengths_nm,
            "mean": self.values,
            "error": self.errors,
            "xyz": self.xyz,
            "xy": chromaticity,
            "dominant_wavelength_nm": dominant.map(|d| d.nm),
            "complementary": dominant.map(|d| d.complementary),
            "purity": dominant.map(|d| d.purity),
            "colour_temperature_kelvin": temperature.map(|t| t.0),
            "duv": temperature.map(|t| t.1),
        })
    }
}

/// A line for every bin, a column for every region and for its error.
fn table(image: &SpectralImage, quantity: &Quantity, probes: &[Probe]) -> String {
    let line = |first: String, cell: &dyn Fn(&Probe) -> (String, String)| {
        let cells = probes.iter().map(|p| match cell(p) {
            (value, error) if p.errors.is_some() => format!("  {value:>15}  {error:>10}"),
            (value, _) => format!("  {value:>15}"),
        });
        format!("{first:>8}{}", cells.collect::<String>())
    };
    let mut lines = vec![format!("{} / {}", quantity.name, quantity.unit)];
    lines.push(line("nm".to_string(), &|p| (p.name.clone(), "+-".to_string())));
    for (b, nm) in image.wavelengths_nm.iter().enumerate() {
        let cell =
            |p: &Probe| (format!("{:.6e}", p.values[b]), p.errors.as_ref().map_or(String::new(), |e| format!("{:.2e}", e[b])));
        lines.push(line(format!("{nm:.2}"), &cell));
    }
    lines.join("\n")
}

fn plot(image: &SpectralImage, quantity: &Quantity, probes: &[Probe], args: &Args) -> Plot {
    let edges = image.edges_nm();
    let curve = |p: &Probe| {
        // A value is the mean over a bin: it stands for all of it.
        let points = edges.windows(2).zip(&p.values).flat_map(|(edge, &v)| [(edge[0], v), (edge[1], v)]).collect();
        let bars = |e: &Vec<f64>| image.wavelengths_nm.iter().zip(&p.values).zip(e).map(|((&nm, &v), &e)| (nm, v, e)).collect();
        Curve { name: p.name.clone(), points, errors: p.errors.as_ref().map_or(Vec::new(), bars) }
    };
    let file = args.image.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (title, fill) = match probes {
        [one] => (format!("{file} at {}", one.name), visible_colors(edges[0], edges[edges.len() - 1])),
        _ => (file, Vec::new()),
    };
    let unit = quantity.unit.replace("^-1", "\u{207b}\u{b9}").replace("^-2", "\u{207b}\u{b2}");
    Plot {
        title,
        x: Axis { label: "wavelength / nm".to_string(), ..Axis::default() },
        y: Axis { label: format!("{} / {unit}", quantity.name), from_zero: true, ..Axis::default() },
        curves: probes.iter().map(curve).collect(),
        fill,
    }
}

/// The hues of light of single wavelengths, dim towards the ends of the visible, as the plot's fill takes them.
fn visible_colors(from_nm: f64, to_nm: f64) -> Vec<(f64, String)> {
    const STEPS: u32 = 80;
    let color = |nm: f64| {
        let [r, g, b] = color_of_wavelength(nm);
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    let at = |i: u32| from_nm + (to_nm - from_nm) * f64::from(i) / f64::from(STEPS);
    (0..=STEPS).map(|i| (at(i), color(at(i)))).collect()
}
