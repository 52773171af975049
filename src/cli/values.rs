//! Parsers of option values. Each error says what would have been right.

use crate::scene::Tile;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// `1920x1080`.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let pair = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)));
    match pair {
        Some((w, h)) if w > 0 && h > 0 => Ok((w, h)),
        _ => Err("write width and height in pixels, as in 640x480".to_string()),
    }
}

/// `30`, `30s`, `2m`, `1.5h`: more than nothing, and a year at most.
pub fn time(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.char_indices().next_back() {
        Some((at, 's')) => (&text[..at], 1.0),
        Some((at, 'm')) => (&text[..at], 60.0),
        Some((at, 'h')) => (&text[..at], 3600.0),
        _ => (text, 1.0),
    };
    match number.parse::<f64>().map(|n| n * unit) {
        Ok(seconds) if seconds > 0.0 && seconds <= 366.0 * 86400.0 => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("write seconds, minutes or hours, as in 30s, 2m or 1.5h".to_string()),
    }
}

/// Frames per second.
pub fn rate(text: &str) -> Result<f64, String> {
    let rate = finite(text).ok().filter(|v| (1e-3..=1e6).contains(v));
    rate.ok_or_else(|| "write frames per second, as in 24 or 29.97".to_string())
}

/// `500M`, `2G`, `2GiB`: bytes, by powers of 1024.
pub fn memory(text: &str) -> Result<u64, String> {
    let number = text.trim_end_matches("iB").trim_end_matches('B');
    let (number, unit) = match number.char_indices().next_back() {
        Some((at, 'K')) => (&number[..at], 10),
        Some((at, 'M')) => (&number[..at], 20),
        Some((at, 'G')) => (&number[..at], 30),
        _ => (number, 0),
    };
    match number.trim_end().parse::<f64>().map(|n| n * f64::from(1u32 << unit)) {
        Ok(bytes) if (1.0..1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err("write a size, as in 500M or 2G".to_string()),
    }
}

/// `2%` or `0.02`, as a fraction.
pub fn error(text: &str) -> Result<f64, String> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().map(|v| v / 100.0),
        None => text.parse::<f64>(),
    };
    match value {
        Ok(v) if v > 0.0 && v < 1.0 => Ok(v),
        _ => Err("write a relative error between 0 and 100 %, as in 2% or 0.02".to_string()),
    }
}

/// `0.1,2,-3`: a point, in metres.
pub fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("write a point in metres as x,y,z".to_string()),
    }
}

/// A rectangle of pixels; x to the right and y downwards from the upper left corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    pub x: u64,
    pub y: u64,
    pub width: u64,
    pub height: u64,
}

impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{},{}", self.x, self.y)?;
        if (self.width, self.height) == (1, 1) { Ok(()) } else { write!(f, ",{},{}", self.width, self.height) }
    }
}

/// `12,34`, or `12,34,5,6`.
pub fn region(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<u64>> = text.split(',').map(|t| t.trim().parse::<u32>().ok().map(u64::from)).collect();
    match numbers.as_deref() {
        Some(&[x, y]) => Ok(Region { x, y, width: 1, height: 1 }),
        Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Region { x, y, width, height }),
        _ => Err("write a pixel as x,y or a region as x,y,width,height".to_string()),
    }
}

/// `12,34,5,6`.
pub fn part(text: &str) -> Result<Tile, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Tile { x, y, width, height }),
        _ => Err("write a part of the picture in pixels, as x,y,width,height".to_string()),
    }
}

/// Two numbers, as 1.5..1.9.
pub fn range(text: &str) -> Result<(f64, f64), String> {
    let ends = text.split_once("..").and_then(|(lo, hi)| Some((lo.trim().parse().ok()?, hi.trim().parse().ok()?)));
    ends.filter(|(lo, hi): &(f64, f64)| lo <= hi)
        .ok_or_else(|| "this is no range; write two numbers, the smaller first, as 1.5..1.9".into())
}

/// A path of an SVG file.
pub fn svg(text: &str) -> Result<PathBuf, String> {
    with_ending(text, "svg")
}

/// A path of a JSON file.
pub fn json(text: &str) -> Result<PathBuf, String> {
    with_ending(text, "json")
}

/// A path of a PNG file.
pub fn png(text: &str) -> Result<PathBuf, String> {
    with_ending(text, "png")
}

/// A number from 0 on.
pub fn limit(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|v| *v >= 0.0).ok_or_else(|| "write a number from 0 on, as in 0.5 or 1e-3".to_string())
}

/// A number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "write a number, as in 1.5 or -2".to_string())
}

/// Half a field of view: degrees from 0 to below 90.
pub fn field(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|v| (0.0..89.0).contains(v)).ok_or_else(|| "write degrees from 0 to 89, as in 20".to_string())
}

fn with_ending(text: &str, ending: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
        Ok(path.to_path_buf())
    } else {
        Err(format!("name a file that ends in .{ending}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_they_are_written() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(time("30s"), Ok(Duration::from_secs(30)));
        assert_eq!(time("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(time("2"), Ok(Duration::from_secs(2)));
        assert_eq!(region("3,4"), Ok(Region { x: 3, y: 4, width: 1, height: 1 }));
        assert_eq!(region("3, 4, 5,6").map(|r| r.to_string()), Ok("3,4,5,6".to_string()));
        assert_eq!(error("2%"), Ok(0.02));
        assert_eq!(error("0.5"), Ok(0.5));
    }

    #[test]
    fn senseless_values_are_refused() {
        for text in ["", "x", "640", "0x5", "5x0", "-1x5", "640x480x3", "1e3x2", "99999999999x1"] {
            assert!(size(text).is_err(), "{text}");
        }
        for text in ["", "s", "0s", "-1s", "nan", "inf", "1e400h", "1d", "1e300h", "\u{e9}"] {
            assert!(time(text).is_err(), "{text}");
        }
        for text in ["", "3", "3,4,5", "3,4,0,1", "3,4,1,0", "-1,0", "1.5,2", "3,4,5,6,7", "99999999999,0"] {
            assert!(region(text).is_err(), "{text}");
        }
        for text in ["", "%", "0", "-1%", "100%", "nan", "inf", "2%%"] {
            assert!(error(text).is_err(), "{text}");
        }
    }
}
