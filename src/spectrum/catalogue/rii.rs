//! The files of the refractiveindex.info database: YAML with a list `DATA` of formulas and tables over wavelengths in um.

use super::{Glass, check_k};
use crate::spectrum::measured::Series;
use crate::spectrum::{Formula, Ior};
use yaml_rust2::{Yaml, YamlLoader};

/// Lists within lists: the parser follows them by recursion.
const DEEPEST: usize = 32;
/// References to other parts of a file.
const MOST_ALIASES: usize = 8;

/// Whether the text is such a file.
pub(super) fn is_rii(text: &str) -> bool {
    text.lines().any(|line| line.trim_end() == "DATA:")
}

/// The index of the last formula or table, and the last extinction coefficients.
pub(super) fn read(text: &str) -> Result<Glass, String> {
    check_depth(text)?;
    let documents = YamlLoader::load_from_str(text).map_err(|e| format!("this is no YAML: {e}; mend the file"))?;
    let root = documents.first().ok_or("the file is empty; mend it")?;
    let entries = root["DATA"].as_vec().ok_or("DATA is no list; mend the file")?;
    let (mut ior, mut k) = (None, None);
    for entry in entries {
        let kind = entry["type"].as_str().unwrap_or_default();
        match kind.split_once(' ') {
            Some(("formula", number)) => ior = Some(formula(entry, number)?),
            Some(("tabulated", columns @ ("n" | "k" | "nk"))) => {
                let rows = rows(entry)?;
                if columns.starts_with('n') {
                    let points: Vec<(f64, f64)> = column(&rows, 1)?;
                    ior = Some(Ior::table(&points)?);
                }
                if columns.ends_with('k') {
                    let (nm, values) = column(&rows, columns.len())?.into_iter().unzip();
                    k = Some(check_k(Series { name: "k".into(), nm, values })?);
                }
            }
            _ => {}
        }
    }
    let ior = ior.ok_or("the file gives no index of refraction; use one with a formula, or a table of n")?;
    let said = |key: &str| root[key].as_str().map(plain).filter(|s| !s.is_empty());
    let source = [said("REFERENCES"), said("COMMENTS")].into_iter().flatten().collect::<Vec<_>>().join("; ");
    Ok(Glass { name: String::new(), ior, k, source })
}

/// Nothing in these files is nested deeply or refers to other parts of it; the parser follows both without bound.
fn check_depth(text: &str) -> Result<(), String> {
    let indent = |line: &str| line.len() - line.trim_start_matches([' ', '-', '?', ':']).len();
    let (mut depth, mut deepest, mut aliases, mut last) = (0_usize, 0, 0, ' ');
    for c in text.chars() {
        match c {
            '[' | '{' => depth += 1,
            ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
        aliases += usize::from(last == '*' && c.is_alphanumeric());
        last = c;
    }
    if deepest > DEEPEST || aliases > MOST_ALIASES || text.lines().any(|line| indent(line) > 4 * DEEPEST) {
        return Err("the file is nested too deeply; mend it".into());
    }
    Ok(())
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |word: &str| {
        let value = word.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| format!("{word:?} is not a finite number; mend the file"))
    };
    text.split_whitespace().map(number).collect()
}

/// One number alone is no text in YAML.
fn text_of(node: &Yaml) -> String {
    match node {
        Yaml::String(s) | Yaml::Real(s) => s.clone(),
        Yaml::Integer(i) => i.to_string(),
        _ => String::new(),
    }
}

fn formula(entry: &Yaml, number: &str) -> Result<Ior, String> {
    let number = number.trim().parse().map_err(|_| format!("there is no dispersion formula {number:?}; mend the file"))?;
    let formula =
        Formula::numbered(number, &numbers(&text_of(&entry["coefficients"]))?).map_err(|e| format!("{e}; mend the file"))?;
    let range_nm = match numbers(&text_of(&entry["wavelength_range"]))?[..] {
        [lo, hi] if lo < hi && lo >= 0.0 => (to_nm(lo), to_nm(hi)),
        _ => return Err("wavelength_range is not two rising numbers; mend the file".into()),
    };
    Ok(Ior { formula, range_nm, extrapolate: false })
}

/// um in nm, without the noise of the product.
fn to_nm(um: f64) -> f64 {
    (um * 1e9).round() / 1e6
}

/// Rows of numbers, rising in wavelength; of those with the same wavelength the first is kept.
fn rows(entry: &Yaml) -> Result<Vec<Vec<f64>>, String> {
    let mut rows = entry["data"].as_str().unwrap_or_default().lines().map(numbers).collect::<Result<Vec<_>, _>>()?;
    rows.retain(|row| !row.is_empty());
    rows.iter_mut().for_each(|row| row[0] = to_nm(row[0]));
    if let Some(row) = rows.iter().find(|row| row[0] <= 0.0) {
        return Err(format!("{} um is no wavelength; mend the table", row[0] * 1e-3));
    }
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    rows.dedup_by(|b, a| a[0] == b[0]);
    if rows.is_empty() { Err("a table has no rows; mend the file".into()) } else { Ok(rows) }
}

fn column(rows: &[Vec<f64>], i: usize) -> Result<Vec<(f64, f64)>, String> {
    let point = |row: &Vec<f64>| {
        row.get(i).map(|v| (row[0], *v)).ok_or_else(|| format!("the row at {} nm is too short; mend it", row[0]))
    };
    rows.iter().map(point).collect()
}

/// Text without the marks of HTML.
fn plain(html: &str) -> String {
    let mut text = String::new();
    let mut inside = false;
    for c in html.chars() {
        match c {
            '<' => inside = true,
            '>' if inside => {
                inside = false;
                text.push(' ');
            }
            _ if inside => {}
            c if c.is_control() => text.push(' '),
            c => text.push(c),
        }
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
