//! STL meshes ("StereoLithography Interface Specification", 3D Systems 1989): binary, or text with any number of solids. Corners at the same place are one
//! vertex, so that solids are closed; facets' normals and colours are passed over, those of the corners' order count.

use crate::error::quoted;
use crate::scene::Mesh;
use crate::scene::json::transform::Flaw;
use glam::DVec3;
use std::collections::HashMap;

/// Bytes before the number of triangles.
const HEADER: usize = 80;
/// Bytes of a triangle: normal, corners, two bytes of attributes.
const TRIANGLE: usize = 50;

/// Reads an STL file. It is text where it begins with "solid" and is not exactly as long as a binary file of as many triangles as it promises.
pub fn read(bytes: &[u8]) -> Result<Mesh, Flaw> {
    let promised = bytes.get(HEADER..HEADER + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let needed = promised.map(|n| HEADER as u64 + 4 + TRIANGLE as u64 * u64::from(n));
    let begins_solid = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    match needed {
        Some(needed) if needed == bytes.len() as u64 || (!begins_solid && needed <= bytes.len() as u64) => {
            Ok(binary(bytes, needed))
        }
        _ if begins_solid => text(bytes),
        Some(_) => Err(flaw(format!("the header promises {} triangles, the file is too short", promised.unwrap_or(0)))),
        None => Err(flaw("not an STL file")),
    }
}

fn flaw(problem: impl Into<String>) -> Flaw {
    (problem.into(), "export the STL file again".into())
}

/// Vertices by their place.
#[derive(Default)]
struct Vertices {
    mesh: Mesh,
    known: HashMap<[u64; 3], u32>,
}

impl Vertices {
    fn add(&mut self, corner: [f64; 3]) -> u32 {
        // -0 is 0.
        let key = corner.map(|v| (v + 0.0).to_bits());
        *self.known.entry(key).or_insert_with(|| {
            self.mesh.positions.push(DVec3::from_array(corner));
            self.mesh.positions.len() as u32 - 1
        })
    }
}

fn binary(bytes: &[u8], end: u64) -> Mesh {
    let mut vertices = Vertices::default();
    for triangle in bytes[HEADER + 4..end as usize].chunks_exact(TRIANGLE) {
        let number = |i: usize| {
            let at = 12 + 4 * i;
            f64::from(f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]]))
        };
        let corners = [0, 3, 6].map(|i| vertices.add([number(i), number(i + 1), number(i + 2)]));
        vertices.mesh.triangles.push(corners);
    }
    vertices.mesh
}

fn text(bytes: &[u8]) -> Result<Mesh, Flaw> {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices = Vertices::default();
    let mut corners = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let at = |problem: String| flaw(format!("line {}: {problem}", number + 1));
        let mut words = line.split_ascii_whitespace();
        let first = words.next().unwrap_or_default().to_ascii_lowercase();
        match first.as_str() {
            "vertex" => {
                let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
                let corner = numbers.try_into().map_err(|_| at(format!("{} is no vertex", quoted(line.trim()))))?;
                corners.push(vertices.add(corner));
            }
            "endloop" => {
                let triangle = std::mem::take(&mut corners).try_into();
                vertices.mesh.triangles.push(triangle.map_err(|c: Vec<u32>| at(format!("a facet of {} corners", c.len())))?);
            }
            "" | "solid" | "endsolid" | "facet" | "outer" | "endfacet" => {}
            // Names and comments of exporters may stand on lines of their own before the first facet.
            _ if vertices.mesh.positions.is_empty() => {}
            _ => return Err(at(format!("cannot read {}", quoted(line.trim())))),
        }
    }
    if corners.is_empty() { Ok(vertices.mesh) } else { Err(flaw("the file ends within a facet")) }
}
