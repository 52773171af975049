//! JSON with manners: a parser that refuses duplicate keys, and a cursor that knows its place, so that every error names file, JSON path,
//! problem and remedy.

pub mod animate;
pub(in crate::scene) mod files;
pub mod keys;
pub(in crate::scene) mod lens;
pub(in crate::scene) mod lens_shape;
pub(in crate::scene) mod lights;
pub(in crate::scene) mod load;
pub(in crate::scene) mod materials;
pub(in crate::scene) mod remarks;
pub mod settings;
pub(in crate::scene) mod shapes;
pub(in crate::scene) mod spectra;
pub(in crate::scene) mod transform;
pub(in crate::scene) mod units;

use crate::error::{Error, Result, quoted, suggest};
use crate::spectrum::unit_problem;
use glam::DVec3;
use serde::de::{DeserializeSeed, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use std::fmt;
use std::path::Path;

/// Coordinates beyond this many metres are refused: single precision on the GPU has nothing left to say there.
pub const LARGEST_LENGTH: f64 = 1e9;

/// Thinnest film, nm: some atoms.
pub const THINNEST_FILM: f64 = 1.0;
/// Thickest film, nm: in thicker ones the colours of neighbouring wavelengths run into each other.
pub const THICKEST_FILM: f64 = 10_000.0;

/// Parses JSON text; nesting is limited to 128 by `serde_json`, and a key may appear once per object.
pub fn parse(text: &str, file: &Path) -> Result<Value> {
    // Editors on Windows put a byte order mark first, which readers may pass over (RFC 8259, 8.1).
    let mut deserializer = serde_json::Deserializer::from_str(text.trim_start_matches('\u{feff}'));
    let value = Strict.deserialize(&mut deserializer).and_then(|v| deserializer.end().map(|()| v));
    value.map_err(|e| Error::Scene {
        file: file.to_path_buf(),
        path: "$".into(),
        problem: format!("not valid JSON: {e}"),
        remedy: "mend the file at that line and column".into(),
    })
}

/// Builds a [`Value`] as `serde_json` would, except that duplicate keys are errors.
struct Strict;

impl<'de> DeserializeSeed<'de> for Strict {
    type Value = Value;

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> std::result::Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Strict {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> std::result::Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, v: bool) -> std::result::Result<Value, E> {
        Ok(Value::Bool(v))
    }

    fn visit_u64<E>(self, v: u64) -> std::result::Result<Value, E> {
        Ok(Value::Number(v.into()))
    }

    fn visit_i64<E>(self, v: i64) -> std::result::Result<Value, E> {
        Ok(Value::Number(v.into()))
    }

    fn visit_f64<E: serde::de::Error>(self, v: f64) -> std::result::Result<Value, E> {
        Number::from_f64(v).map(Value::Number).ok_or_else(|| E::custom("number out of range"))
    }

    fn visit_str<E>(self, v: &str) -> std::result::Result<Value, E> {
        Ok(Value::String(v.to_string()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element_seed(Strict)? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Value, A::Error> {
        let mut out = Map::new();
        while let Some(key) = map.next_key::<String>()? {
            if out.contains_key(&key) {
                return Err(A::Error::custom(format!("the key {} appears twice in one object", quoted(&key))));
            }
            out.insert(key, map.next_value_seed(Strict)?);
        }
        Ok(Value::Object(out))
    }
}

/// A value in a JSON document, with its path.
#[derive(Clone)]
pub struct Node<'a> {
    /// The document, for messages.
    pub file: &'a Path,
    /// JSON path, `$` being the root.
    pub path: String,
    /// The value.
    pub value: &'a Value,
}

impl<'a> Node<'a> {
    /// The root of a document.
    pub fn root(value: &'a Value, file: &'a Path) -> Self {
        Node { file, path: "$".into(), value }
    }

    /// An error at this place.
    pub fn fail(&self, problem: impl fmt::Display, remedy: impl fmt::Display) -> Error {
        Error::Scene {
            file: self.file.to_path_buf(),
            path: self.path.clone(),
            problem: problem.to_string(),
            remedy: remedy.to_string(),
        }
    }

    fn expected(&self, what: &str) -> Error {
        let found = match self.value {
            Value::Null => "null".into(),
            Value::Bool(b) => b.to_string(),
            Value::Number(n) => n.to_string(),
            Value::String(s) => format!("the string {}", quoted(s)),
            Value::Array(a) => format!("an array of {}", a.len()),
            Value::Object(_) => "an object".into(),
        };
        self.fail(format!("expected {what}, found {found}"), format!("write {what} here"))
    }

    fn child(&self, key: &str, value: &'a Value) -> Node<'a> {
        let plain = !key.is_empty() && key.len() <= 60 && key.chars().all(|c| c.is_ascii_alphanumeric() || "_-$".contains(c));
        let step = if plain { format!(".{key}") } else { format!("[{}]", quoted(key)) };
        Node { file: self.file, path: format!("{}{step}", self.path), value }
    }

    /// The member `key` if it is there and not null.
    pub fn get(&self, key: &str) -> Option<Node<'a>> {
        self.value.get(key).filter(|v| !v.is_null()).map(|v| self.child(key, v))
    }

    /// The member `key`, which must be there.
    pub fn need(&self, key: &str) -> Result<Node<'a>> {
        self.get(key).ok_or_else(|| self.fail(format!("{key:?} is missing"), format!("add {key:?}")))
    }

    /// The members of an object, in order; those whose keys begin with `//` are comments and passed over.
    pub fn entries(&self) -> Result<Vec<(&'a str, Node<'a>)>> {
        let map = self.value.as_object().ok_or_else(|| self.expected("an object"))?;
        let members = map.iter().filter(|(k, _)| !k.starts_with("//"));
        Ok(members.map(|(k, v)| (k.as_str(), self.child(k, v))).collect())
    }

    /// Checks that this is an object that has only keys of `kind` (see [`keys`]).
    pub fn object(&self, kind: &str) -> Result<()> {
        let known = keys::keys_of(kind);
        for (key, node) in self.entries()? {
            if !known.contains(&key) {
                return Err(node.fail(format!("unknown key {} in {kind}", quoted(key)), suggest(key, known.iter().copied())));
            }
        }
        Ok(())
    }

    /// The one member among `choices` that this object has.
    pub fn one_of(&self, choices: &[&'static str]) -> Result<(&'static str, Node<'a>)> {
        let mut found = choices.iter().filter_map(|&c| self.get(c).map(|n| (c, n)));
        match (found.next(), found.next()) {
            (Some(only), None) => Ok(only),
            (Some((a, _)), Some((b, _))) => {
                Err(self.fail(format!("both {a:?} and {b:?} are given"), format!("keep one of {}", choices.join(", "))))
            }
            (None, _) => Err(self.fail("no kind is named", format!("add one of {}", choices.join(", ")))),
        }
    }

    /// A string.
    pub fn string(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.expected("a string"))
    }

    /// A string out of `choices`.
    pub fn choice(&self, choices: &[&'static str]) -> Result<&'static str> {
        let word = self.string()?;
        let found = choices.iter().find(|&&c| c == word);
        found
            .copied()
            .ok_or_else(|| self.fail(format!("{} is not known here", quoted(word)), suggest(word, choices.iter().copied())))
    }

    /// `true` or `false`.
    pub fn boolean(&self) -> Result<bool> {
        self.value.as_bool().ok_or_else(|| self.expected("true or false"))
    }

    /// Any number (JSON has only finite ones).
    pub fn number(&self) -> Result<f64> {
        self.value.as_f64().filter(|v| v.is_finite()).ok_or_else(|| self.expected("a number"))
    }

    /// A number in `[lo, hi]`.
    pub fn within(&self, lo: f64, hi: f64) -> Result<f64> {
        let v = self.number()?;
        if v < lo || v > hi {
            return Err(self.fail(format!("{v} is out of range"), format!("use a number from {lo} to {hi}")));
        }
        Ok(v)
    }

    /// A number >= 0.
    pub fn non_negative(&self) -> Result<f64> {
        let v = self.number()?;
        if v < 0.0 {
            return Err(self.fail(format!("{v} is negative"), "use a number of 0 or more"));
        }
        Ok(v)
    }

    /// A number > 0.
    pub fn positive(&self) -> Result<f64> {
        let v = self.number()?;
        if v <= 0.0 {
            return Err(self.fail(format!("{v} is not positive"), "use a number greater than 0"));
        }
        Ok(v)
    }

    /// A length in metres > 0.
    pub fn length(&self) -> Result<f64> {
        let v = self.positive()?;
        if !(1e-12..=LARGEST_LENGTH).contains(&v) {
            return Err(self.fail(format!("{v} m is out of range"), "lengths are metres, from 1e-12 to 1e9"));
        }
        Ok(v)
    }

    /// A wavelength in nm.
    pub fn wavelength(&self) -> Result<f64> {
        let nm = self.positive()?;
        match unit_problem(nm, nm) {
            Some(problem) => Err(self.fail(problem, "write nm, as in 589.3")),
            None => Ok(nm),
        }
    }

    /// The thickness of a film in nm, 0 for none.
    pub fn thickness(&self) -> Result<f64> {
        let nm = self.number()?;
        let remedy = match nm {
            0.0 => return Ok(nm),
            nm if (THINNEST_FILM..=THICKEST_FILM).contains(&nm) => return Ok(nm),
            nm if nm > THICKEST_FILM => "leave it out where there is more than that, as in a pane: then no colours are seen",
            _ => "a film of 0.3 um is 300, and a pane of millimetres shows no colours: leave it out there",
        };
        Err(self.fail(
            format!("a film of {nm} nm is out of range"),
            format!("thickness is in nm, from {THINNEST_FILM} to {THICKEST_FILM}; {remedy}"),
        ))
    }

    /// A whole number in `[lo, hi]`.
    pub fn integer(&self, lo: u32, hi: u32) -> Result<u32> {
        let v = self.number()?;
        if v.fract() != 0.0 || v < f64::from(lo) || v > f64::from(hi) {
            return Err(self.fail(format!("{v} is out of range"), format!("use a whole number from {lo} to {hi}")));
        }
        Ok(v as u32)
    }

    /// Element `index` of an array, if there is one.
    pub fn element(&self, index: usize) -> Option<Node<'a>> {
        let value = self.value.as_array()?.get(index)?;
        Some(Node { file: self.file, path: format!("{}[{index}]", self.path), value })
    }

    /// The elements of an array of at least `least`.
    pub fn array(&self, least: usize) -> Result<Vec<Node<'a>>> {
        let items = self.value.as_array().ok_or_else(|| self.expected("an array"))?;
        if items.len() < least {
            return Err(self.fail(format!("the array has {} elements", items.len()), format!("give at least {least}")));
        }
        let at = |(i, value)| Node { file: self.file, path: format!("{}[{i}]", self.path), value };
        Ok(items.iter().enumerate().map(at).collect())
    }

    /// `N` numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let items = self.array(0)?;
        if items.len() != N {
            return Err(self.expected(&format!("an array of {N} numbers")));
        }
        let mut out = [0.0; N];
        for (o, item) in out.iter_mut().zip(&items) {
            *o = item.number()?;
        }
        Ok(out)
    }

    /// A point in metres.
    pub fn point(&self) -> Result<DVec3> {
        let v = DVec3::from_array(self.numbers()?);
        if v.abs().max_element() > LARGEST_LENGTH {
            return Err(self.fail("a coordinate lies beyond 1e9 m", "lengths are metres: use smaller ones"));
        }
        Ok(v)
    }

    /// A direction, made unit.
    pub fn direction(&self) -> Result<DVec3> {
        let v = self.point()?;
        // Scaled first, so that tiny components do not vanish when squared.
        let largest = v.abs().max_element();
        if largest == 0.0 {
            return Err(self.fail("the direction has length 0", "give a vector that is not zero"));
        }
        Ok((v / largest).normalize())
    }
}
