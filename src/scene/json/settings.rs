//! `--set KEY=VALUE`: changes of a scene file's keys before it is read, so that what they may be, and every error, is as if they stood in the file.

use crate::error::{Error, Result, quoted, suggest};
use crate::scene::json::transform::Flaw;
use serde_json::{Map, Value};

/// A step of a key's path.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

/// Where a key stands in a scene file, as errors print it: keys with dots between and places of lists in brackets (`shapes[0].sphere.radius`; a leading
/// `$.` may stand, and quotation marks around a key that has dots).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct KeyPath(Vec<Step>);

impl KeyPath {
    /// `None` if the text is no such path.
    pub(super) fn parse(text: &str) -> Option<Self> {
        steps(text.trim()).map(KeyPath)
    }

    /// The key of the document itself that it begins with.
    pub(super) fn root(&self) -> &str {
        if let Some(Step::Key(key)) = self.0.first() { key } else { "" }
    }

    /// Sets the key in a document; objects on the way to it are made where they are missing. Errors, as what is wrong and what to do, if the path leads
    /// through what has no such place.
    pub(super) fn set(&self, document: &mut Value, value: Value) -> std::result::Result<(), Flaw> {
        let mut place = document;
        for step in &self.0 {
            if place.is_null() && matches!(step, Step::Key(_)) {
                *place = Value::Object(Map::new());
            }
            place = match (step, place) {
                (Step::Key(key), Value::Object(members)) => members.entry(key).or_insert(Value::Null),
                (Step::Index(i), Value::Array(elements)) => {
                    let count = elements.len();
                    let found = elements.get_mut(*i);
                    found.ok_or_else(|| (format!("there is no element {i} among {count}"), "count from 0".to_string()))?
                }
                (Step::Index(_), Value::Object(members)) => {
                    return Err(("this is no list".into(), suggest("", members.keys().map(String::as_str))));
                }
                (Step::Key(_), Value::Array(elements)) => {
                    return Err((format!("this is a list of {}", elements.len()), "name an element, as in shapes[0]".into()));
                }
                (_, other) => return Err((format!("{other} has no keys"), "set all of it".into())),
            };
        }
        *place = value;
        Ok(())
    }
}

/// A key's path and the value that it is set to.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    path: KeyPath,
    value: Value,
    text: String,
}

impl Setting {
    /// From `PATH=VALUE`, the path as errors print it. A value that is no JSON is text: `N-SF11`.
    ///
    /// Errors if there is no `=`, or the path is none.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let (path, value) = split(text).ok_or("this sets nothing; write a key and a value, as camera.perspective.vfov_deg=30")?;
        let path = KeyPath::parse(path).ok_or("this is no key; write it as errors do, as in shapes[0].sphere.radius=0.1")?;
        let value = super::parse(value, std::path::Path::new("")).unwrap_or_else(|_| Value::String(value.trim().to_string()));
        Ok(Setting { path, value, text: text.to_string() })
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Sets the key in a document; objects on the way to it are made where they are missing.
    ///
    /// # Errors
    /// [`Error::Usage`] if the path leads through what has no such place.
    pub fn apply(&self, document: &mut Value) -> Result<()> {
        let place = self.path.set(document, self.value.clone());
        place.map_err(|(problem, remedy)| Error::usage(format!("--set {}: {problem}", quoted(&self.text)), remedy))
    }
}

/// Before and after the first `=` that is not within quotation marks.
fn split(text: &str) -> Option<(&str, &str)> {
    let mut quoted = false;
    let at = text.char_indices().find(|&(_, c)| {
        quoted ^= c == '"';
        c == '=' && !quoted
    })?;
    Some((&text[..at.0], &text[at.0 + 1..]))
}

fn steps(path: &str) -> Option<Vec<Step>> {
    let mut rest = path.strip_prefix("$.").unwrap_or(path);
    let mut steps = Vec::new();
    loop {
        if let Some(more) = rest.strip_prefix('[') {
            let (index, after) = more.split_once(']')?;
            steps.push(Step::Index(index.trim().parse().ok()?));
            rest = after;
        } else if let Some(more) = rest.strip_prefix('"') {
            let (key, after) = more.split_once('"')?;
            steps.push(Step::Key(key.to_string()));
            rest = after;
        } else {
            let end = rest.find(['.', '[']).unwrap_or(rest.len());
            steps.push(Step::Key(rest[..end].to_string()).filled()?);
            rest = &rest[end..];
        }
        match rest.strip_prefix('.') {
            Some(after) => rest = after,
            None if rest.is_empty() => return Some(steps),
            None if rest.starts_with('[') => {}
            None => return None,
        }
    }
}

impl Step {
    /// `None` for a key without a name.
    fn filled(self) -> Option<Self> {
        Some(self).filter(|step| !matches!(step, Step::Key(key) if key.is_empty()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn set(document: &Value, text: &str) -> std::result::Result<Value, String> {
        let mut document = document.clone();
        Setting::parse(text)?.apply(&mut document).map_err(|e| e.to_string())?;
        Ok(document)
    }

    #[test]
    fn a_key_is_set_wherever_it_stands() {
        let scene = json!({"film": {"width": 8}, "shapes": [{"sphere": {"radius": 1}}, {}], "materials": {"a.b": {"dielectric": {"ior": 1.5}}}});
        for (text, pointer, value) in [
            ("film.width=16", "/film/width", json!(16)),
            ("$.shapes[0].sphere.radius = 2.5", "/shapes/0/sphere/radius", json!(2.5)),
            ("shapes[1].disc.normal=[0, 1, 0]", "/shapes/1/disc/normal", json!([0, 1, 0])),
            ("materials.\"a.b\".dielectric.ior=N-SF11", "/materials/a.b/dielectric/ior", json!("N-SF11")),
            ("name=\"1=1\"", "/name", json!("1=1")),
            ("camera.perspective.vfov_deg=30", "/camera/perspective/vfov_deg", json!(30)),
        ] {
            let changed = set(&scene, text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert_eq!(changed.pointer(pointer), Some(&value), "{text}");
        }
        for (text, word) in [
            ("film.width", "sets nothing"),
            ("film..width=1", "no key"),
            ("=1", "no key"),
            ("shapes[2].sphere=1", "among 2"),
            ("shapes[-1]=1", "no key"),
            ("shapes.sphere=1", "a list of 2"),
            ("film[0]=1", "no list"),
            ("film.width.more=1", "8 has no keys"),
        ] {
            let line = set(&scene, text).expect_err(text);
            assert!(line.contains(word) && line.contains("; "), "{text}: {line}");
        }
    }
}
