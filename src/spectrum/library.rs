//! The measured data of `spectra/`, compiled into the program: glasses, metals, illuminants, reflectances and observers by name.
//!
//! Every file opens with `#` lines that say its source, licence, units and range. Below stand blocks, each begun by `name NAME`: lines that
//! start with a number are rows of a table; in glasses, `also NAME` is another name, `range LO HI` nm, `formula WORD NUMBERS...` as
//! [`Formula`] has them or by their number at refractiveindex.info, `n NM N` and `k NM K` table rows, `source` what the head says of all else. Names are
//! looked up without regard to case. Glasses and metals that the shelves do not have are looked for in refractiveindex.info's database, which is
//! compressed, and there named MAKER/GLASS or SUBSTANCE/AUTHOR.

use super::Spectrum;
use super::{Formula, Ior};
use crate::error::{quoted, suggest};
use flate2::read::GzDecoder;
use include_dir::{Dir, DirEntry, include_dir};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::io::Read;
use std::sync::OnceLock;

/// Words of people for kinds of glass, and what to write in their place.
const GLASS_KINDS: &[(&str, &str)] = &[
    ("crown", "crowns are glasses of low dispersion (V_d above 50): write \"N-BK7\", the usual one, or \"N-K5\""),
    ("flint", "flints are glasses of high dispersion (V_d below 50): write \"F2\", or denser \"SF10\" or \"N-SF11\""),
    ("crystal glass", "lead crystal is a flint: write \"F2\" or \"SF10\""),
    ("glass", "write the name of a kind: \"N-BK7\" is the usual optical glass, \"B270\" is window glass"),
];

/// Extinction coefficients of what can be called transparent: 1/e behind 0.1 mm.
const MOST_TRANSPARENT: f64 = 5e-4;

/// Kinds of [`glass_kinds`].
pub const KINDS: [&str; 7] = ["glass", "crystal", "gem", "liquid", "plastic", "gas", "other"];

static FILES: Dir = include_dir!("$CARGO_MANIFEST_DIR/spectra");

/// A standard observer of the CIE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observer {
    /// 1931, 2 degrees.
    Cie1931,
    /// 1964, 10 degrees.
    Cie1964,
}

impl Observer {
    /// Both by their years.
    pub const NAMED: [(&str, Observer); 2] = [("1931", Observer::Cie1931), ("1964", Observer::Cie1964)];
}

/// Colour-matching functions, linear between points.
#[derive(Debug, Clone, PartialEq)]
pub struct Cmf {
    /// Wavelengths, nm: 360 to 830 in steps of 1.
    pub nm: Vec<f64>,
    /// x, y and z bar at each.
    pub xyz: Vec<[f64; 3]>,
}

impl Cmf {
    /// x, y and z bar at `nm`; 0 outside the table.
    pub fn eval(&self, nm: f64) -> [f64; 3] {
        let hi = self.nm.partition_point(|&a| a <= nm);
        if hi == 0 {
            return [0.0; 3];
        }
        let a = self.xyz[hi - 1];
        let Some(b) = self.xyz.get(hi) else {
            return if nm == self.nm[hi - 1] { a } else { [0.0; 3] };
        };
        let t = (nm - self.nm[hi - 1]) / (self.nm[hi] - self.nm[hi - 1]);
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
    }
}

/// The colour-matching functions of `observer`.
pub fn observer(observer: Observer) -> &'static Cmf {
    static TABLES: OnceLock<[Cmf; 2]> = OnceLock::new();
    let tables = TABLES.get_or_init(|| {
        ["cie1931", "cie1964"].map(|name| {
            let rows = SHELVES[0].get(name).map_or(&[][..], |entry| &entry.rows);
            Cmf { nm: rows.iter().map(|r| r[0]).collect(), xyz: rows.iter().map(|r| [r[1], r[2], r[3]]).collect() }
        })
    });
    match observer {
        Observer::Cie1931 => &tables[0],
        Observer::Cie1964 => &tables[1],
    }
}

/// The components of CIE daylight: nm, then S0, S1 and S2, relative (CIE 15:2004, table T.2).
pub fn daylight_components() -> Vec<[f64; 4]> {
    let rows = SHELVES[0].get("daylight").map_or(&[][..], |entry| &entry.rows);
    rows.iter().map(|r| [r[0], r[1], r[2], r[3]]).collect()
}

/// Numbers of the model of the clear sky: parameters, radiances, the Sun's radiances and the darkening of its limb (scene/lamp/sky.rs).
pub fn sky_model() -> &'static [Vec<f64>; 4] {
    static MODEL: OnceLock<[Vec<f64>; 4]> = OnceLock::new();
    MODEL.get_or_init(|| {
        let text = FILES.get_file("sky/hosek-wilkie.txt.gz").map(|file| unpacked(file.contents())).unwrap_or_default();
        let line = |word: &str| text.lines().find_map(|line| numbers(line.strip_prefix(word)?)).unwrap_or_default();
        ["parameters", "radiance", "sun", "darkening"].map(line)
    })
}

/// Index of refraction of a glass, crystal or liquid, relative to air, over the range its source gives.
pub fn glass(name: &str) -> Option<Ior> {
    glass_entry(name).and_then(Entry::ior)
}

/// The name of [`glass_names`] that a name stands for.
pub fn glass_name(name: &str) -> Option<&'static str> {
    glass_entry(name)?.names.iter().find(|known| fold(known) == fold(name)).map(String::as_str)
}

/// What the head of a glass's file says: pairs of a word (`title`, `source`, `licence`, `units`, `comment`, ...) and a text, in the file's
/// order; a word may come twice.
pub fn glass_head(name: &str) -> Option<&'static [(String, String)]> {
    glass_entry(name).map(|entry| entry.head.as_slice())
}

/// What kind of material a glass is, some of [`KINDS`]; a gem is a crystal too.
pub fn glass_kinds(name: &str) -> Vec<&'static str> {
    static RULES: OnceLock<Vec<(&str, &str)>> = OnceLock::new();
    let rules = RULES.get_or_init(|| {
        let text = FILES.get_file("kinds.txt").and_then(|file| file.contents_utf8()).unwrap_or_default();
        text.lines().filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once(" = ")).collect()
    });
    // A source ends with its path in refractiveindex.info's database.
    let sources = glass_head(name).unwrap_or_default().iter().filter(|(word, _)| word == "source");
    let paths = sources.filter_map(|(_, text)| text.rsplit("; ").next()?.rsplit(", ").next());
    let fitting = paths.flat_map(|path| rules.iter().filter(move |(_, start)| path.starts_with(start)));
    let best = fitting.max_by_key(|(_, start)| start.len());
    best.map_or(vec!["other"], |(kinds, _)| kinds.split(' ').collect())
}

/// Absorption coefficient 4 pi k / lambda of a material that [`glass`] knows, m^-1; `None` too where its file has no k. Schott's and most other
/// tables are of samples centimetres thick and coarse; end values are held outside.
pub fn glass_absorption(name: &str) -> Option<Spectrum> {
    let points = glass_entry(name)?.points("k");
    let (nm, values): (Vec<f64>, Vec<f64>) = points.into_iter().map(|[nm, k]| (nm, 4.0 * PI * k / (nm * 1e-9))).unzip();
    (!nm.is_empty()).then_some(Spectrum::Table { nm, values, extend: true })
}

/// Real and imaginary part (n, k) of the index of a metal; end values are held outside the measured range.
pub fn metal(name: &str) -> Option<(Spectrum, Spectrum)> {
    if let Some(entry) = SHELVES[2].get(name) {
        return Some((entry.column(1, true), entry.column(2, true)));
    }
    let entry = SHELVES[5].get(name)?;
    let [n, k] = ["n", "k"].map(|word| {
        let (nm, values): (Vec<f64>, Vec<f64>) = entry.points(word).into_iter().map(|[nm, v]| (nm, v)).unzip();
        (!nm.is_empty()).then_some(Spectrum::Table { nm, values, extend: true })
    });
    n.zip(k)
}

/// Relative spectral power of a CIE illuminant, as the CIE prints it (A and the D series are 100 at 560 nm, the others are not); 0 outside
/// its table.
pub fn illuminant(name: &str) -> Option<Spectrum> {
    SHELVES[3].get(name).map(|entry| entry.column(1, false))
}

/// A measured reflectance, such as "ColorChecker/dark skin"; end values are held outside.
pub fn reflectance(name: &str) -> Option<Spectrum> {
    SHELVES[4].get(name).map(|entry| entry.column(1, true))
}

/// Every name that [`glass`] knows, other names included, those of the database last.
pub fn glass_names() -> Vec<&'static str> {
    let database = SHELVES[5].content().0.iter().filter(|entry| entry.is_transparent());
    let more = database.flat_map(|entry| entry.names.iter().map(String::as_str));
    SHELVES[1].names().into_iter().chain(more).collect()
}

/// The full names of all glasses of the database that their makers call so: a name that several have is nobody's.
fn glasses_called(name: &str) -> Vec<&'static str> {
    let called = |full: &&str| full.split_once('/').is_some_and(|(_, own)| fold(own) == fold(name));
    SHELVES[5].names().into_iter().filter(called).collect()
}

/// Problem and remedy of a name that no glass has, or several.
pub fn unknown_glass(name: &str) -> (String, String) {
    let makers = glasses_called(name);
    if !makers.is_empty() {
        let written: Vec<String> = makers.iter().map(|full| quoted(full)).collect();
        return (format!("several makers have a glass {}", quoted(name)), format!("write {}", written.join(" or ")));
    }
    let lower = name.to_lowercase();
    let kind = GLASS_KINDS.iter().find(|(word, _)| lower.contains(word));
    let remedy = kind.map_or_else(|| suggest(name, glass_names()), |(_, remedy)| remedy.to_string());
    (format!("unknown glass {}", quoted(name)), remedy)
}

fn glass_entry(name: &str) -> Option<&'static Entry> {
    SHELVES[1].get(name).or_else(|| SHELVES[5].get(name).filter(|entry| entry.is_transparent()))
}

/// Every name that [`metal`] knows, other names included.
pub fn metal_names() -> Vec<&'static str> {
    SHELVES[2].names()
}

/// Every name that [`illuminant`] knows.
pub fn illuminant_names() -> Vec<&'static str> {
    SHELVES[3].names()
}

/// Every name that [`reflectance`] knows.
pub fn reflectance_names() -> Vec<&'static str> {
    SHELVES[4].names()
}

/// A folder of `spectra/`, read at first use.
struct Shelf {
    folder: &'static str,
    content: OnceLock<(Vec<Entry>, HashMap<String, usize>)>,
}

static SHELVES: [Shelf; 6] = [
    Shelf::new("observer"),
    Shelf::new("glass"),
    Shelf::new("metal"),
    Shelf::new("illuminant"),
    Shelf::new("reflectance"),
    Shelf::new("database"),
];

impl Shelf {
    const fn new(folder: &'static str) -> Self {
        Shelf { folder, content: OnceLock::new() }
    }

    fn content(&self) -> &(Vec<Entry>, HashMap<String, usize>) {
        self.content.get_or_init(|| {
            let mut entries = Vec::new();
            if let Some(dir) = FILES.get_dir(self.folder) {
                read_folder(dir, &mut entries);
            }
            let mut by_name = HashMap::new();
            for (i, entry) in entries.iter().enumerate() {
                for name in &entry.names {
                    by_name.entry(fold(name)).or_insert(i);
                }
            }
            (entries, by_name)
        })
    }

    fn get(&'static self, name: &str) -> Option<&'static Entry> {
        let (entries, by_name) = self.content();
        by_name.get(&fold(name)).map(|&i| &entries[i])
    }

    fn names(&'static self) -> Vec<&'static str> {
        self.content().0.iter().flat_map(|entry| entry.names.iter().map(String::as_str)).collect()
    }
}

/// Lower case, single spaces.
fn fold(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase()
}

/// Appends the entries of all files below `dir`, in the order of their paths.
fn read_folder(dir: &Dir, entries: &mut Vec<Entry>) {
    for item in dir.entries() {
        match item {
            DirEntry::Dir(sub) => read_folder(sub, entries),
            DirEntry::File(file) => {
                let text = file.contents_utf8().map_or_else(|| unpacked(file.contents()), str::to_string);
                let read = parse_entries(&text).unwrap_or_else(|problem| panic!("spectra/{}: {problem}", file.path().display()));
                entries.extend(read);
            }
        }
    }
}

/// One block of a data file.
struct Entry {
    names: Vec<String>,
    /// The `#` lines before the first entry of the file: a word and the rest.
    head: Vec<(String, String)>,
    /// Lines that begin with a word: the word and the rest.
    lines: Vec<(String, String)>,
    rows: Vec<Vec<f64>>,
}

/// The text of a compressed file.
fn unpacked(bytes: &[u8]) -> String {
    let mut text = String::new();
    match GzDecoder::new(bytes).read_to_string(&mut text) {
        Ok(_) => text,
        Err(e) => panic!("spectra/: {e}"),
    }
}

fn parse_entries(text: &str) -> Result<Vec<Entry>, String> {
    let comments = text.lines().map_while(|line| line.trim().strip_prefix('#')).map(str::trim);
    let pair = |line: &str| {
        let (word, rest) = line.split_once(": ").unwrap_or(("title", line));
        (word.to_string(), rest.to_string())
    };
    let head: Vec<(String, String)> = comments.filter(|line| !line.is_empty()).map(pair).collect();
    let mut entries: Vec<Entry> = Vec::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        if word == "name" {
            entries.push(Entry { names: vec![rest.to_string()], head: head.clone(), lines: Vec::new(), rows: Vec::new() });
            continue;
        }
        let entry = entries.last_mut().ok_or("a file begins with a name")?;
        if word == "also" {
            entry.names.push(rest.to_string());
        } else if word == "source" {
            entry.head.push((word.to_string(), rest.to_string()));
        } else if word.starts_with(|c: char| c.is_ascii_digit()) {
            entry.rows.push(numbers(line).ok_or_else(|| format!("\"{line}\" is no row of numbers"))?);
        } else {
            entry.lines.push((word.to_string(), rest.to_string()));
        }
    }
    let even = |entry: &Entry| entry.rows.windows(2).all(|w| w[0].len() == w[1].len() && w[0][0] < w[1][0]);
    match entries.iter().find(|entry| !even(entry)) {
        Some(entry) => Err(format!("the table of {} is ragged or not sorted", entry.names[0])),
        None => Ok(entries),
    }
}

/// All the numbers of a line, if it holds nothing else.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|t| t.parse().ok()).collect()
}

impl Entry {
    /// False for metals and what else the visible cannot pass through.
    fn is_transparent(&self) -> bool {
        self.points("k").iter().all(|[nm, k]| !(400.0..=700.0).contains(nm) || *k < MOST_TRANSPARENT)
    }

    /// The rest of the first line that begins with `word`.
    fn line(&self, word: &str) -> Option<&str> {
        self.lines.iter().find(|(w, _)| w == word).map(|(_, rest)| rest.as_str())
    }

    /// The two numbers of every line that begins with `word`.
    fn points(&self, word: &str) -> Vec<[f64; 2]> {
        let rows = self.lines.iter().filter(|(w, _)| w == word);
        rows.filter_map(|(_, rest)| numbers(rest)?.try_into().ok()).collect()
    }

    /// Column `i` of the rows over the first.
    fn column(&self, i: usize, extend: bool) -> Spectrum {
        Spectrum::Table {
            nm: self.rows.iter().map(|r| r[0]).collect(),
            values: self.rows.iter().filter_map(|r| r.get(i)).copied().collect(),
            extend,
        }
    }

    fn ior(&self) -> Option<Ior> {
        let [min, max] = numbers(self.line("range")?)?.try_into().ok()?;
        let (word, rest) = self.line("formula")?.split_once(' ').unwrap_or(("table", ""));
        let c = numbers(rest)?;
        let first = c.first().copied();
        let pairs = || -> (Vec<f64>, Vec<f64>) { c[1..].chunks_exact(2).map(|p| (p[0], p[1])).unzip() };
        let formula = match (word, first) {
            (number, Some(_)) if number.starts_with(|c: char| c.is_ascii_digit()) => {
                Formula::numbered(number.parse().ok()?, &c).ok()?
            }
            ("constant", Some(n)) => Formula::Constant(n),
            ("sellmeier", Some(a0)) => {
                let (b, c_um2) = pairs();
                Formula::Sellmeier { a0, b, c_um2 }
            }
            ("polynomial", Some(_)) => Formula::numbered(3, &c).ok()?,
            ("cauchy", Some(_)) => Formula::Cauchy { coef_um: c },
            ("gas", Some(a0)) => {
                let (b, c) = pairs();
                Formula::Gas { a0, b, c }
            }
            ("table", None) => {
                let (nm, n) = self.points("n").into_iter().map(|[nm, n]| (nm, n)).unzip();
                Formula::Table { nm, n }
            }
            _ => return None,
        };
        Some(Ior { formula, range_nm: (min, max), extrapolate: false })
    }
}
