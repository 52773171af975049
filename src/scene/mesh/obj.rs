//! Wavefront OBJ meshes: `v`, `vt`, `vn` and `f`; everything else (groups, materials) is passed over.

use crate::error::quoted;
use crate::scene::Mesh;
use crate::scene::json::transform::Flaw;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Reads an OBJ file. It is smooth if every corner of every face has a normal, else faceted.
pub fn read(bytes: &[u8]) -> Result<Mesh, Flaw> {
    let text = String::from_utf8_lossy(bytes);
    let (mut points, mut uvs, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let mut faces: Vec<[Corner; 3]> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let at = |problem: String| (format!("line {}: {problem}", number + 1), "export the OBJ file again".to_string());
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => points.push(DVec3::from_array(numbers(words).map_err(at)?)),
            Some("vn") => normals.push(DVec3::from_array(numbers(words).map_err(at)?)),
            Some("vt") => {
                let [u, v] = numbers(words).map_err(at)?;
                // OBJ counts v from the lower edge of the picture.
                uvs.push(DVec2::new(u, 1.0 - v));
            }
            Some("f") => {
                let corners: Vec<Corner> =
                    words.map(|w| corner(w, points.len(), uvs.len(), normals.len())).collect::<Result<_, _>>().map_err(at)?;
                if corners.len() < 3 {
                    return Err(at(format!("a face of {} corners", corners.len())));
                }
                faces.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    let all_have = |what: fn(&Corner) -> Option<u32>| faces.iter().flatten().all(|c| what(c).is_some());
    let (smooth, textured) = (all_have(|c| c.normal), all_have(|c| c.uv));
    if !smooth && !textured {
        let triangles = faces.iter().map(|f| f.map(|c| c.point)).collect();
        return Ok(Mesh { positions: points, triangles, ..Mesh::default() });
    }
    // A vertex for each combination of point, texture coordinates and normal that occurs.
    let mut mesh = Mesh::default();
    let mut known: HashMap<Corner, u32> = HashMap::new();
    for face in faces {
        let triangle = face.map(|c| {
            let c = Corner { point: c.point, uv: c.uv.filter(|_| textured), normal: c.normal.filter(|_| smooth) };
            *known.entry(c).or_insert_with(|| {
                mesh.positions.push(points[c.point as usize]);
                mesh.normals.extend(c.normal.map(|n| normals[n as usize]));
                mesh.uvs.extend(c.uv.map(|uv| uvs[uv as usize]));
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
    uv: Option<u32>,
    normal: Option<u32>,
}

fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    let mut filled = 0;
    for (slot, word) in out.iter_mut().zip(words) {
        *slot = word.parse().map_err(|_| format!("{} is not a number", quoted(word)))?;
        filled += 1;
    }
    if filled < N { Err(format!("{filled} coordinates instead of {N}")) } else { Ok(out) }
}

/// `point`, `point/texture`, `point//normal` or `point/texture/normal`; counted from 1, or backwards from -1.
fn corner(word: &str, points: usize, uvs: usize, normals: usize) -> Result<Corner, String> {
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
    let mut optional = |count| parts.next().filter(|part| !part.is_empty()).map(|part| index(part, count)).transpose();
    Ok(Corner { point, uv: optional(uvs)?, normal: optional(normals)? })
}
