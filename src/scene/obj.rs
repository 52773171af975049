//! Wavefront OBJ meshes: `v`, `vn` and `f`; everything else (groups, texture coordinates, materials) is passed over.

use super::transform::Flaw;
use super::{Mesh, json::quoted};
use glam::DVec3;
use std::collections::HashMap;

/// Reads an OBJ file. It is smooth if every corner of every face has a normal, else faceted.
pub fn read(bytes: &[u8]) -> Result<Mesh, Flaw> {
    let text = String::from_utf8_lossy(bytes);
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let mut faces: Vec<[Corner; 3]> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let at = |problem: String| (format!("line {}: {problem}", number + 1), "export the OBJ file again".to_string());
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => points.push(vector(words).map_err(at)?),
            Some("vn") => normals.push(vector(words).map_err(at)?),
            Some("f") => {
                let corners: Vec<Corner> =
                    words.map(|w| corner(w, points.len(), normals.len())).collect::<Result<_, _>>().map_err(at)?;
                if corners.len() < 3 {
                    return Err(at(format!("a face of {} corners", corners.len())));
                }
                faces.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    if !faces.iter().flatten().all(|c| c.normal.is_some()) {
        let triangles = faces.iter().map(|f| f.map(|c| c.point)).collect();
        return Ok(Mesh { positions: points, normals: Vec::new(), triangles });
    }
    // A vertex for each pair of point and normal that occurs.
    let mut mesh = Mesh::default();
    let mut known: HashMap<Corner, u32> = HashMap::new();
    for face in faces {
        let triangle = face.map(|c| {
            *known.entry(c).or_insert_with(|| {
                mesh.positions.push(points[c.point as usize]);
                mesh.normals.push(c.normal.map_or(DVec3::Y, |n| normals[n as usize]));
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.push(triangle);
    }
    Ok(mesh)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    point: u32,
    normal: Option<u32>,
}

fn vector<'a>(words: impl Iterator<Item = &'a str>) -> Result<DVec3, String> {
    let mut out = [0.0; 3];
    let mut filled = 0;
    for (slot, word) in out.iter_mut().zip(words) {
        *slot = word.parse().map_err(|_| format!("{} is not a number", quoted(word)))?;
        filled += 1;
    }
    if filled < 3 { Err(format!("{filled} coordinates instead of 3")) } else { Ok(DVec3::from_array(out)) }
}

/// `point`, `point/texture`, `point//normal` or `point/texture/normal`; counted from 1, or backwards from -1.
fn corner(word: &str, points: usize, normals: usize) -> Result<Corner, String> {
    let mut parts = word.split('/');
    let index = |part: &str, count: usize| -> Result<u32, String> {
        let i: i64 = part.parse().map_err(|_| format!("{} is no index", quoted(part)))?;
        let from_0 = if i < 0 { i.checked_add(count as i64).unwrap_or(-1) } else { i - 1 };
        if (0..count as i64).contains(&from_0) && from_0 <= i64::from(u32::MAX) {
            Ok(from_0 as u32)
        } else {
            Err(format!("the index {i} is not among the {count} so far"))
        }
    };
    let point = index(parts.next().unwrap_or_default(), points)?;
    let normal = match parts.nth(1) {
        Some(part) if !part.is_empty() => Some(index(part, normals)?),
        _ => None,
    };
    Ok(Corner { point, normal })
}
