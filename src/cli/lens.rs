//! `abbe lens`: what an optician asks of a lens.

use super::{Done, Outcome, print::out, values};
use crate::error::Result;
use crate::lens::Prescription;
use crate::lens::figures::{Field, Figures};
use crate::output::{check_writable, write_text};
use crate::scene::load_lens;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  abbe lens achromat
  abbe lens gauss.zmx --field 20 -o gauss.svg
  abbe lens triplet --json

Objects are at infinity. The film is where light of the d line makes its smallest spot on the axis (root mean square). Spots have the
light of F, d and C (486.13, 587.56, 656.27 nm) alike. Lateral colour is how much higher F arrives than C. Transmission is what is neither
reflected by bare surfaces nor absorbed. The lenses singlet, achromat, triplet and gauss come along; a scene looks through one by
\"camera\": {\"lens\": {\"prescription\": \"gauss\", \"film\": [0.036, 0.024], ...}}.";

/// Letters of the lines, and their colours in pictures.
const LINES: [(&str, &str); 3] = [("F", "#0072b2"), ("d", "#009e73"), ("C", "#d55e00")];

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A lens that comes along (singlet, achromat, triplet, gauss), or a file: Zemax, sequential (.zmx), or JSON
    #[arg(value_name = "NAME|FILE")]
    lens: String,
    /// Greatest angle of the field; else where half of the pencil is stopped
    #[arg(long, value_name = "DEGREES", value_parser = values::field)]
    field: Option<f64>,
    /// Spot diagram and focal shift, as SVG
    #[arg(short, long, value_name = "OUT.svg", value_parser = values::svg)]
    output: Option<PathBuf>,
    /// Print JSON instead of lines
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let lens = load_lens(&args.lens, None)?;
    let figures = lens.figures(args.field.map(f64::to_radians));
    if let Some(path) = &args.output {
        check_writable(path, None::<&PathBuf>)?;
        write_text(path, &svg(&lens, &figures))?;
    }
    out(&if args.json { json_of(&lens, &figures).to_string() } else { text(&lens, &figures)? });
    Ok(Done::Completely)
}

fn mm(metres: f64) -> String {
    format!("{:.4}", 1e3 * metres)
}

fn text(lens: &Prescription, figures: &Figures) -> Result<String> {
    let d = &figures.paraxial[1];
    let (front, rear) = d.principal_planes();
    let of_lines = |f: &dyn Fn(usize) -> f64| [0, 1, 2].map(|i| format!("{} {} mm", LINES[i].0, mm(f(i)))).join("  ");
    let name = if lens.name.is_empty() { "lens" } else { &lens.name };
    let glasses: Vec<&str> = lens.surfaces.iter().filter_map(|s| s.glass.as_ref().map(|g| g.name.as_str())).collect();
    let mut lines = vec![
        format!("{name}: {} surfaces; {}", lens.surfaces.len(), glasses.join(", ")),
        format!("  focal length      {}", of_lines(&|i| figures.paraxial[i].focal_length)),
        format!("  back focus        {}", of_lines(&|i| figures.paraxial[i].back_focus())),
        format!("  principal planes  front {} mm, rear {} mm behind the first vertex", mm(front), mm(rear)),
        format!("  f-number          {:.3}; the stop is surface {}", d.f_number(), d.stop),
        format!(
            "  entrance pupil    {} mm behind the first vertex, {} mm wide",
            mm(d.entrance_pupil.0),
            mm(2.0 * d.entrance_pupil.1.abs())
        ),
        format!(
            "  exit pupil        {} mm behind the last vertex, {} mm wide",
            mm(d.exit_pupil.0 - d.last_vertex),
            mm(2.0 * d.exit_pupil.1.abs())
        ),
        format!("  longitudinal colour  F - C {} mm", mm(figures.paraxial[0].rear_focus - figures.paraxial[2].rear_focus)),
        format!(
            "  film              {} mm behind the last vertex: the smallest spot on the axis at d",
            mm(figures.film_z - d.last_vertex)
        ),
        "  field    height mm   spot um rms   lateral colour um   distortion   vignetting   transmission".to_string(),
    ];
    lines.extend(figures.fields.iter().map(|f| {
        format!(
            "  {:5.2} deg {:9.4} {:13.2} {:19.3} {:>12} {:11.1} % {:12.1} %",
            f.angle.to_degrees(),
            1e3 * f.height,
            1e6 * f.rms,
            1e6 * f.lateral_color,
            distortion(f, d.focal_length).map_or("-".into(), |v| format!("{:.3} %", 100.0 * v)),
            100.0 * (1.0 - f.unvignetted),
            100.0 * f.transmission
        )
    }));
    lines.extend(lens.crossings().iter().map(|warning| format!("warning: {warning}")));
    Ok(lines.join("\n"))
}

/// How much further out the field is than f tan(angle), relatively; none on the axis.
fn distortion(field: &Field, focal_length: f64) -> Option<f64> {
    let ideal = focal_length * field.angle.tan();
    (ideal != 0.0).then(|| field.height / ideal - 1.0)
}

fn json_of(lens: &Prescription, figures: &Figures) -> Value {
    let line = |i: usize| {
        let p = &figures.paraxial[i];
        let (front, rear) = p.principal_planes();
        json!({
            "line": LINES[i].0,
            "focal_length_m": p.focal_length,
            "back_focus_m": p.back_focus(),
            "front_focus_m": p.front_focus,
            "principal_planes_m": [front, rear],
            "f_number": p.f_number(),
            "entrance_pupil_m": {"z": p.entrance_pupil.0, "radius": p.entrance_pupil.1.abs()},
            "exit_pupil_m": {"z": p.exit_pupil.0, "radius": p.exit_pupil.1.abs()},
        })
    };
    let field = |f: &Field| {
        json!({
            "angle_deg": f.angle.to_degrees(),
            "height_m": f.height,
            "spot_rms_m": f.rms,
            "lateral_color_m": f.lateral_color,
            "distortion": distortion(f, figures.paraxial[1].focal_length),
            "vignetting": 1.0 - f.unvignetted,
            "transmission": f.transmission,
        })
    };
    json!({
        "name": lens.name,
        "surfaces": lens.surfaces.len(),
        "stop": figures.paraxial[1].stop,
        "lines": [line(0), line(1), line(2)],
        "longitudinal_color_m": figures.paraxial[0].rear_focus - figures.paraxial[2].rear_focus,
        "film_z_m": figures.film_z,
        "fields": figures.fields.iter().map(field).collect::<Vec<_>>(),
        "focus_shift_m": figures.focus_shift.iter().map(|(nm, shift)| json!([nm, shift])).collect::<Vec<_>>(),
        "warnings": lens.crossings(),
    })
}

/// Spots of all fields in one scale, and the focal shift over wavelength below them.
fn svg(lens: &Prescription, figures: &Figures) -> String {
    const SIDE: f64 = 190.0;
    const PLOT: (f64, f64, f64, f64) = (80.0, 290.0, 700.0, 170.0);
    let mut svg = String::new();
    let centroid = |f: &Field| f.spots.iter().flatten().sum::<glam::DVec2>() / f.spots.iter().map(Vec::len).sum::<usize>() as f64;
    let extent = |f: &Field| f.spots.iter().flatten().map(|p| (*p - centroid(f)).abs().max_element()).fold(0.0, f64::max);
    let reach = figures.fields.iter().map(extent).fold(1e-7, f64::max);
    let name: String = lens.name.replace('&', "&amp;").replace('<', "&lt;");
    // Writing to a string cannot fail.
    let _ = writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="820" height="510" viewBox="0 0 820 510" font-family="sans-serif" font-size="13"><rect width="820" height="510" fill="white"/>"#
    );
    let _ = writeln!(
        svg,
        r#"<text x="20" y="24" font-size="16">{name}</text><text x="800" y="24" text-anchor="end">boxes {:.1} um wide</text>"#,
        2e6 * reach
    );
    for (i, field) in figures.fields.iter().enumerate() {
        let (x, y) = (10.0 + 202.0 * i as f64, 36.0);
        let _ = writeln!(svg, r##"<rect x="{x}" y="{y}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#888"/>"##);
        let _ = writeln!(
            svg,
            r#"<text x="{}" y="{}" text-anchor="middle">{:.2} deg, {:.1} um rms</text>"#,
            x + 0.5 * SIDE,
            y + SIDE + 18.0,
            field.angle.to_degrees(),
            1e6 * field.rms
        );
        for ((_, color), spot) in LINES.iter().zip(&field.spots) {
            let _ = write!(svg, r#"<g fill="{color}">"#);
            for p in spot {
                let q = (*p - centroid(field)) / reach * 0.5 * SIDE;
                let _ = write!(svg, r#"<circle cx="{:.1}" cy="{:.1}" r="1"/>"#, x + 0.5 * SIDE + q.x, y + 0.5 * SIDE - q.y);
            }
            let _ = writeln!(svg, "</g>");
        }
    }
    let (left, top, width, height) = PLOT;
    let (lo, hi) = figures.focus_shift.iter().fold((0.0f64, 0.0f64), |(lo, hi), (_, s)| (lo.min(*s), hi.max(*s)));
    let span = (hi - lo).max(1e-9);
    let _ = writeln!(svg, r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>"##);
    let place = |&(nm, shift): &(f64, f64)| {
        format!("{:.1},{:.1}", left + width * (nm - 400.0) / 300.0, top + height * (hi - shift) / span)
    };
    let points: Vec<String> = figures.focus_shift.iter().map(place).collect();
    let _ = writeln!(svg, r#"<polyline points="{}" fill="none" stroke="black" stroke-width="1.5"/>"#, points.join(" "));
    for nm in [400.0, 500.0, 600.0, 700.0] {
        let _ = writeln!(
            svg,
            r#"<text x="{}" y="{}" text-anchor="middle">{nm}</text>"#,
            left + width * (nm - 400.0) / 300.0,
            top + height + 18.0
        );
    }
    for shift in [hi, lo] {
        let _ = writeln!(
            svg,
            r#"<text x="{}" y="{}" text-anchor="end">{}</text>"#,
            left - 6.0,
            top + height * (hi - shift) / span + 4.0,
            mm(shift)
        );
    }
    let _ = writeln!(
        svg,
        r#"<text x="{}" y="{}" text-anchor="middle">focal shift from d in mm over the wavelength in nm</text></svg>"#,
        left + 0.5 * width,
        top + height + 38.0
    );
    svg
}
