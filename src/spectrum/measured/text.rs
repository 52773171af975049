//! Columns of text: a wavelength and one or more values to a line.

use super::Series;

/// What a spectrometer's program writes before and after its columns (Ocean Optics, Ocean Insight).
const BEGIN: &str = ">>>>>begin";
const END: &str = ">>>>>end";

/// Reads columns that are separated by blanks, tabs, commas or semicolons. Empty lines and what follows `#` or `//` are
/// passed over. Headings name the columns and the unit of the wavelengths, nm without one; a further heading begins further columns, as in the files of
/// refractiveindex.info, whose `wl` is in um. What stands before a spectrometer's mark of its data's beginning is passed over.
pub(super) fn read(text: &str) -> Result<Vec<Series>, String> {
    let lower = text.to_lowercase();
    let mut waits = lower.lines().any(|line| line.trim().starts_with(BEGIN));
    let mut series = Vec::new();
    let mut block = Block::default();
    for (i, line) in text.replace("\r\n", "\n").split(['\n', '\r']).enumerate() {
        let marked = line.trim().to_lowercase();
        if waits {
            waits = !marked.starts_with(BEGIN);
            continue;
        }
        if marked.starts_with(END) {
            break;
        }
        let line = line.split('#').next().unwrap_or_default().split("//").next().unwrap_or_default();
        if line.trim().is_empty() {
            continue;
        }
        let fields = fields(line);
        let numbers: Vec<Option<f64>> = fields.iter().map(|f| number(f)).collect();
        if numbers.iter().all(Option::is_none) && block.takes_heading() {
            block.end(&mut series)?;
            block.heading = heading(line);
            continue;
        }
        let row: Option<Vec<f64>> = numbers.into_iter().collect();
        let shown = || line.trim().chars().take(40).collect::<String>();
        let row = row
            .filter(|r| r.len() > 1)
            .ok_or_else(|| format!("line {}: \"{}\" is not a wavelength and a value", i + 1, shown()))?;
        if let Some((_, first)) = block.rows.first().filter(|(_, first)| first.len() != row.len()) {
            return Err(format!("line {}: \"{}\" has {} numbers, the line before {}", i + 1, shown(), row.len(), first.len()));
        }
        block.rows.push((i + 1, row));
    }
    block.end(&mut series)?;
    Ok(series)
}

/// Lines of numbers under one heading, with their numbers in the file.
#[derive(Default)]
struct Block {
    heading: Vec<String>,
    rows: Vec<(usize, Vec<f64>)>,
}

impl Block {
    /// One line of words is a heading; another that follows it at once, or stands among the data of one without, is a mistake.
    fn takes_heading(&self) -> bool {
        self.rows.is_empty() == self.heading.is_empty()
    }

    fn end(&mut self, series: &mut Vec<Series>) -> Result<(), String> {
        let Block { heading, rows } = std::mem::take(self);
        let Some((_, first)) = rows.first() else { return Ok(()) };
        let scale = unit(&heading)?;
        for column in 1..first.len() {
            let points = rows.iter().map(|(line, row)| (*line, row[0] * scale, row[column])).collect();
            let number = (series.len() + 1).to_string();
            series.push(Series::new(heading.get(column).unwrap_or(&number), points)?);
        }
        Ok(())
    }
}

/// What separates the columns of a line: a semicolon or tab, else a comma, else blanks. Where commas separate nothing they are decimal, as spreadsheets
/// write in half of the world.
fn fields(line: &str) -> Vec<&str> {
    let separator = [';', '\t', ','].into_iter().find(|c| line.contains(*c)).unwrap_or(' ');
    line.split(separator).map(|f| f.trim().trim_matches('"').trim()).filter(|f| !f.is_empty()).collect()
}

fn number(field: &str) -> Option<f64> {
    let field = field.trim_end_matches(',');
    if field.contains('.') { field.parse().ok() } else { field.replacen(',', ".", 1).parse().ok() }
}

/// The names of the columns; where blanks separate, a bracket belongs to the word before it.
fn heading(line: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for word in fields(line) {
        match names.last_mut() {
            Some(last) if word.starts_with(['(', '[', '/']) || last.ends_with(['(', '[', '/']) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => names.push(word.to_string()),
        }
    }
    names
}

/// nm in the unit of the wavelengths that a heading speaks of.
fn unit(heading: &[String]) -> Result<f64, String> {
    let Some(first) = heading.first().map(|h| h.to_lowercase()) else { return Ok(1.0) };
    // A letter mu of an old code page is lost.
    let words: Vec<&str> = first.split(|c: char| !(c.is_alphanumeric() || c == '\u{fffd}' || c == '-' || c == '^')).collect();
    let has = |units: &[&str]| words.iter().any(|w| units.contains(w));
    let begins = |unit: &str| words.iter().any(|w| w.starts_with(unit));
    if has(&["cm-1", "cm^-1"]) || begins("wavenumber") {
        return Err("the columns are over wave numbers; convert them to nm, 1e7 over the number".into());
    }
    Ok(if has(&["nm"]) || begins("nanomet") {
        1.0
    } else if has(&["um", "\u{b5}m", "\u{3bc}m", "\u{fffd}m", "microns", "micron"]) || begins("micromet") || first == "wl" {
        1e3
    } else if has(&["a", "\u{e5}", "\u{212b}", "\u{fffd}"]) || begins("angstrom") || begins("\u{e5}ngstr") {
        0.1
    } else if has(&["m"]) || begins("metre") || begins("meter") {
        1e9
    } else {
        1.0
    })
}
