//! `abbe glass`: what the library knows about glasses, crystals, liquids and plastics.

use super::print::out;
use super::{Done, Outcome, values};
use crate::cli::plot::{Axis, Curve, Plot};
use crate::color::cie::VISIBLE_NM;
use crate::error::{Error, Result, quoted, suggest};
use crate::output::{check_writable, write_text};
use crate::spectrum::catalogue;
use crate::spectrum::library::{self, glass, glass_head, glass_names};
use crate::spectrum::{Ior, LINE_C_NM, LINE_D_NM, LINE_F_NM};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  abbe glass N-BK7
  abbe glass N-BK7 SF10 diamond -o indices.svg
  abbe glass --list SF
  abbe glass --list ohara/ --nd 1.8..1.9 --vd 25..40
  abbe glass --list --kind gem
  abbe glass water --step 5 --json
  abbe glass schott.agf

Indices are relative to air, at wavelengths in air. V_d is (n_d - 1) / (n_F - n_C), with the lines d 587.56, F 486.13, C 656.27 nm.
The Cauchy formulas are least-squares fits over the visible, wavelengths in um. A renderer or a table that knows only A + B/l^2 is off
by the error printed beside it: for a dense flint such as SF10 4e-3 with two terms and 6e-4 with three. Abbe uses the formula of the
source. A scene names a glass by \"ior\": \"N-BK7\".";

/// Tables print the lines that they begin and end at with fewer digits: 656.27 nm is C.
const ROUNDING_NM: f64 = 0.01;
/// The visible range, nm.
const VISIBLE: (f64, f64) = (VISIBLE_NM[0], VISIBLE_NM[1]);

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Names, in capitals or not, or files: of refractiveindex.info (.yml), Zemax catalogues (.agf), tables (.csv, .txt); without any, all are listed
    #[arg(value_name = "NAME|FILE")]
    names: Vec<String>,
    /// List the names that contain FILTER, such as a maker, or all, each with n_d, V_d, kind and range
    #[arg(long, value_name = "FILTER", num_args = 0..=1, default_missing_value = "", conflicts_with = "names")]
    list: Option<String>,
    /// Of these, only with an index n_d within this range
    #[arg(long, value_name = "MIN..MAX", requires = "list", value_parser = values::range)]
    nd: Option<(f64, f64)>,
    /// Of these, only with an Abbe number V_d within this range
    #[arg(long, value_name = "MIN..MAX", requires = "list", value_parser = values::range)]
    vd: Option<(f64, f64)>,
    /// Of these, only of a kind
    #[arg(long, value_name = "KIND", requires = "list", value_parser = library::KINDS)]
    kind: Option<String>,
    /// Step of the table of indices, nm
    #[arg(long, value_name = "NM", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=400))]
    step: u32,
    /// Plot of the indices of all that are named, as SVG
    #[arg(short, long, value_name = "OUT.svg", value_parser = values::svg, requires = "names")]
    output: Option<PathBuf>,
    /// Print a JSON array instead of lines
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    if args.names.is_empty() {
        return list(args);
    }
    let mut glasses = Vec::new();
    for name in &args.names {
        if is_file(name) { glasses.extend(Glass::of_file(name)?) } else { glasses.push(Glass::find(name)?) }
    }
    if let Some(path) = &args.output {
        check_writable(path, None::<&PathBuf>)?;
        write_text(path, &plot(&glasses).svg())?;
    }
    let steps = ((VISIBLE.1 - VISIBLE.0) as u32).div_ceil(args.step);
    let grid: Vec<f64> = (0..=steps).map(|i| (VISIBLE.0 + f64::from(i * args.step)).min(VISIBLE.1)).collect();
    if args.json {
        out(&Value::Array(glasses.iter().map(|g| g.json(&grid)).collect()).to_string());
    } else {
        glasses.iter().for_each(|g| out(&g.text()));
        out(&table(&glasses, &grid));
    }
    Ok(Done::Completely)
}

/// Endings of the files that indices are read from.
const ENDINGS: &[&str] = &["yml", "yaml", "agf", "csv", "txt"];

/// Names of glasses have no such ending.
fn is_file(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| ENDINGS.iter().any(|e| e.eq_ignore_ascii_case(ending)))
}

/// Something transparent of the library, or of a file.
struct Glass {
    name: String,
    ior: Ior,
    /// What its file says of it.
    head: Vec<(String, String)>,
}

impl Glass {
    fn find(name: &str) -> Result<Self> {
        let known = library::glass_name(name);
        let found =
            known.and_then(|known| Some(Glass { name: known.into(), ior: glass(known)?, head: glass_head(known)?.to_vec() }));
        found.ok_or_else(|| {
            let (problem, remedy) = library::unknown_glass(name);
            Error::usage(problem, remedy)
        })
    }

    /// All that a file of refractiveindex.info, a Zemax catalogue or a table holds.
    fn of_file(path: &str) -> Result<Vec<Self>> {
        let bytes = std::fs::read(path).map_err(|e| Error::file(path, e.to_string(), "check the path"))?;
        let glasses = catalogue::read_all(&bytes).map_err(|message| {
            let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "mend the file"));
            Error::file(path, problem, remedy)
        })?;
        let stem = Path::new(path).file_stem().unwrap_or_default().to_string_lossy();
        let named = |g: catalogue::Glass| Glass {
            name: if g.name.is_empty() { stem.to_string() } else { g.name },
            ior: g.ior,
            head: if g.source.is_empty() { vec![] } else { vec![("source".to_string(), g.source)] },
        };
        Ok(glasses.into_iter().map(named).collect())
    }

    /// Index at `nm`, where the source gives one.
    fn n(&self, nm: f64) -> Option<f64> {
        let (lo, hi) = self.ior.range_nm;
        (lo - ROUNDING_NM..=hi + ROUNDING_NM).contains(&nm).then(|| self.ior.eval(nm))
    }

    /// V_d, where all three lines are in the range.
    fn vd(&self) -> Option<f64> {
        [LINE_F_NM, LINE_D_NM, LINE_C_NM].iter().all(|nm| self.n(*nm).is_some()).then(|| self.ior.vd())
    }

    /// The part of the visible where it is known, nm, if any.
    fn visible(&self) -> Option<(f64, f64)> {
        let (lo, hi) = (self.ior.range_nm.0.max(VISIBLE.0), self.ior.range_nm.1.min(VISIBLE.1));
        (lo < hi).then_some((lo, hi))
    }

    /// Cauchy formulas of two and three terms over [`Glass::visible`], each with its greatest error.
    fn cauchy_fits(&self) -> Vec<(Vec<f64>, f64)> {
        self.visible().map_or(Vec::new(), |(lo, hi)| [2, 3].map(|terms| self.ior.cauchy_fit(terms, lo, hi)).to_vec())
    }

    /// Every text of the file's head under `word`.
    fn said(&self, word: &'static str) -> impl Iterator<Item = &str> {
        self.head.iter().filter(move |(w, _)| w == word).map(|(_, text)| text.as_str())
    }

    fn text(&self) -> String {
        let known = |n: Option<f64>| n.map_or("-".to_string(), |n| format!("{n:.6}"));
        let title = self.said("title").collect::<Vec<_>>().join("; ");
        let mut lines = vec![if title.is_empty() { self.name.to_string() } else { format!("{}: {title}", self.name) }];
        lines.push(format!(
            "  n_d {}  n_F {}  n_C {}  V_d {}",
            known(self.n(LINE_D_NM)),
            known(self.n(LINE_F_NM)),
            known(self.n(LINE_C_NM)),
            self.vd().map_or("-".to_string(), |v| format!("{v:.2}"))
        ));
        let range = self.visible().unwrap_or(VISIBLE);
        for (coefficients, error) in self.cauchy_fits() {
            let names = ["A", "B/l^2", "C/l^4"][..coefficients.len()].join(" + ");
            let numbers = coefficients.iter().map(|c| format!("{c:.6}")).collect::<Vec<_>>().join(", ");
            lines.push(format!("  {names} over {} to {} nm: {numbers}; off by up to {error:.1e}", range.0, range.1));
        }
        lines.push(format!("  known from {} to {} nm", self.ior.range_nm.0, self.ior.range_nm.1));
        for word in ["source", "licence", "comment", "note"] {
            lines.extend(self.said(word).map(|text| format!("  {word}: {text}")));
        }
        lines.join("\n") + "\n"
    }

    fn json(&self, grid: &[f64]) -> Value {
        let said = |word| self.said(word).collect::<Vec<_>>();
        let fits = self.cauchy_fits().into_iter().map(|(c, error)| json!({"coefficients_um": c, "greatest_error": error}));
        json!({
            "name": self.name,
            "title": said("title").join("; "),
            "n_d": self.n(LINE_D_NM),
            "n_f": self.n(LINE_F_NM),
            "n_c": self.n(LINE_C_NM),
            "v_d": self.vd().filter(|v| v.is_finite()),
            "range_nm": [self.ior.range_nm.0, self.ior.range_nm.1],
            "cauchy_range_nm": self.visible().map(|r| [r.0, r.1]),
            "cauchy": fits.collect::<Vec<_>>(),
            "source": said("source"),
            "licence": said("licence").join("; "),
            "comment": said("comment").into_iter().chain(said("note")).collect::<Vec<_>>(),
            "nm": grid,
            "n": grid.iter().map(|nm| self.n(*nm)).collect::<Vec<_>>(),
        })
    }
}

/// Columns of indices below their names.
fn table(glasses: &[Glass], grid: &[f64]) -> String {
    let widths: Vec<usize> = glasses.iter().map(|g| g.name.chars().count().max(8)).collect();
    let row = |first: &str, cells: Vec<String>| {
        let cells = cells.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}"));
        format!("{first:>4}{}", cells.collect::<String>())
    };
    let mut lines = vec![row("nm", glasses.iter().map(|g| g.name.to_string()).collect())];
    for nm in grid {
        let cell = |g: &Glass| g.n(*nm).map_or("-".to_string(), |n| format!("{n:.6}"));
        lines.push(row(&nm.to_string(), glasses.iter().map(cell).collect()));
    }
    lines.join("\n")
}

fn plot(glasses: &[Glass]) -> Plot {
    let curve = |g: &Glass| {
        let nm = (VISIBLE.0 as u32..=VISIBLE.1 as u32).map(f64::from);
        Curve { name: g.name.to_string(), points: nm.map(|nm| (nm, g.n(nm).unwrap_or(f64::NAN))).collect(), ..Curve::default() }
    };
    let title = match glasses {
        [one] => format!("Index of refraction of {}", one.name),
        _ => "Index of refraction".to_string(),
    };
    Plot {
        title,
        x: Axis { label: "wavelength in air / nm".to_string(), ..Axis::default() },
        y: Axis { label: "n".to_string(), ..Axis::default() },
        curves: glasses.iter().map(curve).collect(),
        fill: Vec::new(),
    }
}

fn list(args: &Args) -> Outcome {
    let (filter, as_json) = (args.list.as_deref().unwrap_or_default(), args.json);
    let names = glass_names();
    let mut found: Vec<&str> = names.iter().copied().filter(|n| n.to_lowercase().contains(&filter.to_lowercase())).collect();
    if found.is_empty() {
        return Err(Error::usage(format!("no name contains {}", quoted(filter)), suggest(filter, names)));
    }
    found.sort_by_key(|name| name.to_lowercase());
    found.dedup();
    let mut glasses = found.into_iter().map(Glass::find).collect::<Result<Vec<_>>>()?;
    let within = |value: Option<f64>, range: Option<(f64, f64)>| {
        range.is_none_or(|(lo, hi)| value.is_some_and(|v| (lo..=hi).contains(&v)))
    };
    let is_of = |g: &Glass| args.kind.as_deref().is_none_or(|kind| library::glass_kinds(&g.name).contains(&kind));
    glasses.retain(|g| is_of(g) && within(g.n(LINE_D_NM), args.nd) && within(g.vd(), args.vd));
    if glasses.is_empty() {
        return Err(Error::usage("no glass lies within what is asked for", "leave out --kind, or widen --nd or --vd"));
    }
    if as_json {
        let row = |g: &Glass| {
            let range = [g.ior.range_nm.0, g.ior.range_nm.1];
            let kinds = library::glass_kinds(&g.name);
            json!({"name": g.name, "n_d": g.n(LINE_D_NM), "v_d": g.vd().filter(|v| v.is_finite()), "range_nm": range, "kinds": kinds})
        };
        out(&Value::Array(glasses.iter().map(row).collect()).to_string());
        return Ok(Done::Completely);
    }
    let width = glasses.iter().map(|g| g.name.chars().count()).max().unwrap_or(0);
    let row = |g: &Glass| {
        let nd = g.n(LINE_D_NM).map_or("-".to_string(), |n| format!("{n:.5}"));
        let vd = g.vd().map_or("-".to_string(), |v| format!("{v:.2}"));
        let kinds = library::glass_kinds(&g.name).join(", ");
        format!("{:width$}  {nd:>8}  {vd:>7}  {kinds:12}  {} to {} nm", g.name, g.ior.range_nm.0, g.ior.range_nm.1)
    };
    let head = format!("{:width$}  {:>8}  {:>7}  {:12}  known", "name", "n_d", "V_d", "kind");
    out(&[head].into_iter().chain(glasses.iter().map(row)).collect::<Vec<_>>().join("\n"));
    Ok(Done::Completely)
}
