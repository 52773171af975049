//! CGATS.17 text files, and those of ArgyllCMS, which are such: lamps (`.sp`) and measured patches (`.ti3`), each row a spectrum.

use super::Series;

/// Fields that name a sample, the best first.
const NAMES: &[&str] = &["SAMPLE_NAME", "SAMPLE_LOC", "SAMPLE_ID"];
/// What field names of spectral values begin with, before the wavelength in nm.
const BANDS: &[&str] = &["SPECTRAL_NM_", "SPECTRAL_NM", "SPECTRAL_", "SPEC_", "NM_", "NM", "R_"];

/// Whether the text has such a table.
pub(super) fn is_cgats(text: &str) -> bool {
    text.lines().any(|line| line.trim() == "BEGIN_DATA_FORMAT")
}

/// Every row of every table that has spectral fields; values are over `SPECTRAL_NORM` where that stands.
pub(super) fn read(text: &str) -> Result<Vec<Series>, String> {
    let mut series = Vec::new();
    let mut head = Head::default();
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, words(line)));
    while let Some((_, line)) = lines.next() {
        match line.first().map(String::as_str) {
            Some("BEGIN_DATA_FORMAT") => {
                let format =
                    lines.by_ref().map(|(_, line)| line).take_while(|line| line.first().is_none_or(|w| w != "END_DATA_FORMAT"));
                head.fields = format.flatten().collect();
            }
            Some("BEGIN_DATA") => {
                let rows = lines.by_ref().take_while(|(_, line)| line.first().is_none_or(|w| w != "END_DATA"));
                // A row may go on in the next line.
                let words: Vec<(usize, String)> = rows.flat_map(|(i, line)| line.into_iter().map(move |w| (i, w))).collect();
                head.rows(&words, &mut series)?;
                head = Head::default();
            }
            Some(key) => head.keys.push((key.to_string(), line.get(1).cloned().unwrap_or_default())),
            None => {}
        }
    }
    Ok(series)
}

/// What stands before a table.
#[derive(Default)]
struct Head {
    keys: Vec<(String, String)>,
    fields: Vec<String>,
}

impl Head {
    fn number(&self, key: &str) -> Option<f64> {
        self.keys.iter().find(|(k, _)| k == key).and_then(|(_, v)| v.parse().ok())
    }

    /// Column and wavelength (nm) of every band. Names of fields are rounded to whole nm: the head is exact where it counts as many.
    fn bands(&self) -> Vec<(usize, f64)> {
        let wavelength = |field: &str| {
            let upper = field.to_uppercase();
            BANDS.iter().find_map(|prefix| upper.strip_prefix(prefix)?.parse::<f64>().ok())
        };
        let mut bands: Vec<(usize, f64)> =
            self.fields.iter().enumerate().filter_map(|(i, f)| Some((i, wavelength(f)?))).collect();
        let ends = [self.number("SPECTRAL_START_NM"), self.number("SPECTRAL_END_NM"), self.number("SPECTRAL_BANDS")];
        if let [Some(start), Some(end), Some(count)] = ends
            && count == bands.len() as f64
            && count > 1.0
        {
            bands.iter_mut().enumerate().for_each(|(i, band)| band.1 = start + (end - start) * i as f64 / (count - 1.0));
        }
        bands
    }

    fn rows(&self, words: &[(usize, String)], series: &mut Vec<Series>) -> Result<(), String> {
        let bands = self.bands();
        if bands.is_empty() {
            return Ok(());
        }
        let norm = self.number("SPECTRAL_NORM").filter(|n| *n > 0.0).unwrap_or(1.0);
        let name = NAMES.iter().find_map(|name| self.fields.iter().position(|f| f == name));
        for row in words.chunks(self.fields.len()) {
            if row.len() < self.fields.len() {
                return Err(format!("line {}: the last row has {} of {} fields", row[0].0, row.len(), self.fields.len()));
            }
            let point = |&(i, nm): &(usize, f64)| {
                let (line, word) = &row[i];
                let value: f64 = word.parse().map_err(|_| format!("line {line}: {word:?} is not a number"))?;
                Ok::<_, String>((*line, nm, value / norm))
            };
            let number = (series.len() + 1).to_string();
            let points = bands.iter().map(point).collect::<Result<_, _>>()?;
            series.push(Series::new(name.map_or(&number, |i| &row[i].1), points)?);
        }
        Ok(())
    }
}

/// The words of a line, up to a comment; quotation marks hold blanks together.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = line.trim_start();
    while !rest.is_empty() && !rest.starts_with('#') {
        let (word, end) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => rest.split_at(rest.find(char::is_whitespace).unwrap_or(rest.len())),
        };
        words.push(word.to_string());
        rest = end.trim_start();
    }
    words
}
