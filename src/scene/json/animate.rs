//! `"animate"`: keys of a scene file that change from frame to frame. They are set before the scene is read, as by `--set`, so that a frame is the scene
//! whose keys have the values of that frame, with all errors of the file.
//!
//! ```json
//! "animate": [{"key": "shapes[0].transform.rotate_deg", "frames": [0, 120], "values": [0, 360], "interpolation": "linear"}]
//! ```
//!
//! Before its first keyframe a key has the first value, after the last one the last. Between them it is
//! - `linear` (unless told): on the straight line from value to value;
//! - `smooth`: on a cubic Hermite spline, each number by itself, whose slopes are 0 at both ends and, within, those of Fritsch & Butland (1984), "A method for
//!   constructing local monotone piecewise cubic interpolants": it begins and ends at rest and never leaves the range of the two values around it, which what
//!   must stay within bounds (an angle, an index) needs;
//! - `step`: the value of the keyframe before it, which need not be a number.

use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::settings::KeyPath;
use serde_json::{Number, Value};
use std::path::Path;

/// Frames that are rendered, and keyframes, at most.
pub const LAST_FRAME: u32 = 1 << 24;
/// Greatest number of a keyframe: what is between two of them is finite.
const LARGEST: f64 = 1e100;

/// How a key goes from one value to the next.
#[derive(Clone, Copy, PartialEq)]
enum Interpolation {
    Linear,
    Smooth,
    Step,
}

/// A key that changes.
struct Track<'a> {
    node: Node<'a>,
    path: KeyPath,
    frames: Vec<f64>,
    values: Vec<&'a Value>,
    interpolation: Interpolation,
}

/// Sets the keys that `document` animates to their values at `frame`; without one they stay as they stand, but are checked.
pub(super) fn apply(document: &mut Value, file: &Path, frame: Option<u32>) -> Result<()> {
    let root = Node::root(document, file);
    let Some(node) = root.get("animate") else { return Ok(()) };
    let tracks = node.array(0)?.into_iter().map(Track::read).collect::<Result<Vec<_>>>()?;
    let mut moved = (*document).clone();
    for (i, track) in tracks.iter().enumerate() {
        if tracks[..i].iter().any(|earlier| earlier.path == track.path) {
            return Err(track.node.need("key")?.fail("this key is animated twice", "write all its keyframes into one"));
        }
        let value = track.at(frame.map_or(track.frames[0], f64::from));
        let place = track.path.set(&mut moved, value);
        place.map_err(|(problem, remedy)| track.node.child("key", track.node.value).fail(problem, remedy))?;
    }
    if frame.is_some() {
        *document = moved;
    }
    Ok(())
}

impl<'a> Track<'a> {
    fn read(node: Node<'a>) -> Result<Self> {
        node.object("animation")?;
        let key = node.need("key")?;
        let path = KeyPath::parse(key.string()?);
        let path = path.ok_or_else(|| key.fail("this is no key", "write it as errors do, as in shapes[0].sphere.radius"))?;
        if path.root() == "animate" {
            return Err(key.fail("an animation of animations", "animate another key"));
        }
        let interpolation = match node.get("interpolation").map(|n| n.choice(&["linear", "smooth", "step"])).transpose()? {
            Some("step") => Interpolation::Step,
            Some("smooth") => Interpolation::Smooth,
            _ => Interpolation::Linear,
        };
        let most = f64::from(LAST_FRAME);
        let frames = node.need("frames")?;
        let times = frames.array(1)?.iter().map(|n| n.within(-most, most)).collect::<Result<Vec<_>>>()?;
        if let Some(i) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
            let late = &frames.array(1)?[i + 1];
            return Err(late.fail(format!("frame {} does not come after {}", times[i + 1], times[i]), "write frames that rise"));
        }
        let values = node.need("values")?;
        let list = values.array(1)?;
        if list.len() != times.len() {
            return Err(values.fail(format!("{} values for {} frames", list.len(), times.len()), "give a value for each"));
        }
        if interpolation != Interpolation::Step {
            for value in &list {
                check_numbers(value)?;
                if shape(value.value) != shape(list[0].value) {
                    return Err(value.fail("this has not as many numbers as the first value", "give as many in each"));
                }
            }
        }
        let values = list.iter().map(|n| n.value).collect();
        Ok(Track { node, path, frames: times, values, interpolation })
    }

    /// The value at `frame`.
    fn at(&self, frame: f64) -> Value {
        let last = self.frames.len() - 1;
        let i = self.frames.iter().rposition(|at| *at <= frame).unwrap_or(0);
        let is_held = i == last || frame <= self.frames[i] || self.interpolation == Interpolation::Step;
        if is_held {
            return self.values[i].clone();
        }
        // As many numbers in each, in the same order.
        let mut columns = self.values.iter().map(|value| numbers(value)).collect::<Vec<_>>().into_iter();
        let first = columns.next().unwrap_or_default();
        let mut series: Vec<Vec<f64>> = first.into_iter().map(|v| vec![v]).collect();
        columns.for_each(|column| series.iter_mut().zip(column).for_each(|(series, v)| series.push(v)));
        let mut between = series.iter().map(|series| match self.interpolation {
            Interpolation::Smooth => smooth(&self.frames, series, i, frame),
            _ => {
                let t = (frame - self.frames[i]) / (self.frames[i + 1] - self.frames[i]);
                series[i] + t * (series[i + 1] - series[i])
            }
        });
        filled(self.values[0], &mut between)
    }
}

/// The spline through `values` at `times` (both of as many), at a time after that of number `i` and before the next.
fn smooth(times: &[f64], values: &[f64], i: usize, at: f64) -> f64 {
    let width = |k: usize| times[k + 1] - times[k];
    let secant = |k: usize| (values[k + 1] - values[k]) / width(k);
    let slope = |k: usize| {
        if k == 0 || k + 1 == times.len() || secant(k - 1) * secant(k) <= 0.0 {
            return 0.0;
        }
        let (before, after) = (secant(k - 1), secant(k));
        let alpha = (1.0 + width(k) / (width(k - 1) + width(k))) / 3.0;
        before * after / (alpha * after + (1.0 - alpha) * before)
    };
    let h = width(i);
    let t = (at - times[i]) / h;
    let rise = t * t * (3.0 - 2.0 * t);
    let (out, into) = (t * (1.0 - t) * (1.0 - t), t * t * (t - 1.0));
    values[i] + rise * (values[i + 1] - values[i]) + h * (out * slope(i) + into * slope(i + 1))
}

/// A number, or an array of such, of any depth.
fn check_numbers(node: &Node) -> Result<()> {
    match node.value {
        Value::Array(_) => node.array(1)?.iter().try_for_each(check_numbers),
        _ => node.within(-LARGEST, LARGEST).map(|_| ()),
    }
}

/// The value with all its numbers 0.
fn shape(value: &Value) -> Value {
    filled(value, &mut std::iter::repeat(0.0))
}

/// The numbers in a value, in order.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        _ => value.as_f64().into_iter().collect(),
    }
}

/// The value with other numbers, in order.
fn filled(value: &Value, numbers: &mut dyn Iterator<Item = f64>) -> Value {
    match value {
        Value::Array(items) => Value::Array(items.iter().map(|item| filled(item, numbers)).collect()),
        _ => numbers.next().and_then(Number::from_f64).map_or(Value::Null, Value::Number),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn at(frame: Option<u32>, track: &str) -> std::result::Result<Value, String> {
        let track: Value = serde_json::from_str(track).unwrap();
        let mut document = json!({"key": 7, "list": [{"at": [1, 2, 3]}], "animate": [track]});
        apply(&mut document, Path::new("test.json"), frame).map_err(|e| e.to_string())?;
        document.as_object_mut().unwrap().remove("animate");
        Ok(document)
    }

    fn number(frame: u32, track: &str) -> f64 {
        at(Some(frame), track).unwrap()["key"].as_f64().unwrap()
    }

    #[test]
    fn keys_are_on_the_line_the_spline_or_the_step_between_keyframes() {
        let linear = r#"{"key": "key", "frames": [10, 20, 40], "values": [1, 2, 10]}"#;
        for (frame, value) in [(0, 1.0), (10, 1.0), (15, 1.5), (20, 2.0), (25, 4.0), (40, 10.0), (99, 10.0)] {
            assert_eq!(number(frame, linear), value, "frame {frame}");
        }
        let step = r#"{"key": "$.key", "frames": [10, 20], "values": ["N-BK7", "N-SF11"], "interpolation": "step"}"#;
        let held = |frame| at(Some(frame), step).unwrap()["key"].clone();
        assert_eq!([0, 19, 20, 99].map(held), [json!("N-BK7"), json!("N-BK7"), json!("N-SF11"), json!("N-SF11")]);
        let vector = r#"{"key": "list[0].at", "frames": [0, 4], "values": [[0, 1, 2], [4, 1, 0]]}"#;
        assert_eq!(at(Some(1), vector).unwrap(), json!({"key": 7, "list": [{"at": [1.0, 1.0, 1.5]}]}));
        // Without a frame all stands as it is written.
        assert_eq!(at(None, vector).unwrap(), json!({"key": 7, "list": [{"at": [1, 2, 3]}]}));
    }

    #[test]
    fn the_spline_is_that_of_fritsch_and_butland_from_rest_to_rest() {
        // Two keyframes: the smooth step.
        let ease = r#"{"key": "key", "frames": [0, 4], "values": [0, 1], "interpolation": "smooth"}"#;
        for (frame, value) in [(1, 5.0 / 32.0), (2, 0.5), (3, 27.0 / 32.0)] {
            assert!((number(frame, ease) - value).abs() < 1e-15, "frame {frame}");
        }
        // Within, `scipy.interpolate.PchipInterpolator([0, 6, 8, 12, 20], [0, 1, 4, 5, 6])`, which differs at the ends alone.
        let climb = r#"{"key": "key", "frames": [0, 6, 8, 12, 20], "values": [0, 1, 4, 5, 6], "interpolation": "smooth"}"#;
        for (frame, value) in [(7, 2.4701591511936343), (9, 4.38565152519894), (10, 4.646220159151194), (11, 4.833678713527851)] {
            assert!((number(frame, climb) - value).abs() < 1e-12, "frame {frame}: {}", number(frame, climb));
        }
        // It never overshoots, and turns where the values do.
        let hill = r#"{"key": "key", "frames": [0, 10, 20], "values": [0, 1, 0], "interpolation": "smooth"}"#;
        let heights: Vec<f64> = (0..=20).map(|frame| number(frame, hill)).collect();
        assert!(heights[..11].is_sorted() && heights[10..].is_sorted_by(|a, b| a >= b), "{heights:?}");
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        for (track, place, word) in [
            (r#"{"frames": [0], "values": [0]}"#, "$.animate[0]", "\"key\" is missing"),
            (r#"{"key": "a..b", "frames": [0], "values": [0]}"#, "$.animate[0].key", "no key"),
            (r#"{"key": "key.more", "frames": [0], "values": [0]}"#, "$.animate[0].key", "has no keys"),
            (r#"{"key": "list[1].at", "frames": [0], "values": [0]}"#, "$.animate[0].key", "no element 1"),
            (r#"{"key": "animate[0].frames", "frames": [0], "values": [0]}"#, "$.animate[0].key", "of animations"),
            (r#"{"key": "key", "frames": [0, 0], "values": [0, 1]}"#, "$.animate[0].frames[1]", "does not come after"),
            (r#"{"key": "key", "frames": [0, 1], "values": [0]}"#, "$.animate[0].values", "1 values for 2 frames"),
            (r#"{"key": "key", "frames": [0, 1], "values": [[0, 1], [0]]}"#, "$.animate[0].values[1]", "as many numbers"),
            (r#"{"key": "key", "frames": [0, 1], "values": ["a", "b"]}"#, "$.animate[0].values[0]", "expected a number"),
            (r#"{"key": "key", "frames": [], "values": []}"#, "$.animate[0].frames", "0 elements"),
            (r#"{"key": "key", "frames": [0], "values": [0], "interpolation": "cubic"}"#, "interpolation", "not known"),
            (r#"{"key": "key", "frames": [0], "values": [0], "ease": true}"#, "$.animate[0].ease", "unknown key"),
        ] {
            for frame in [None, Some(3)] {
                let line = at(frame, track).expect_err(track);
                assert!(line.contains(&format!("{place}:")) || line.contains(place), "{track}: {line}");
                assert!(line.contains(word) && line.contains("; "), "{track}: {line}");
            }
        }
        let twice: Value = serde_json::from_str(
            r#"[{"key": "key", "frames": [0], "values": [0]}, {"key": "$.key", "frames": [0], "values": [0]}]"#,
        )
        .unwrap();
        let mut document = json!({"key": 7, "animate": twice});
        let line = apply(&mut document, Path::new("test.json"), None).unwrap_err().to_string();
        assert!(line.contains("$.animate[1].key") && line.contains("twice"), "{line}");
    }
}
