//! PLY meshes (Turk 1994): ASCII and both binary orders; vertices with x, y, z and perhaps nx, ny, nz and s, t (or u, v), and faces of any number of corners.
//! Whatever the header promises is held against the size of the file before room is made for it.

use crate::error::quoted;
use crate::scene::Mesh;
use crate::scene::json::transform::Flaw;
use glam::{DVec2, DVec3};
use std::str::SplitAsciiWhitespace;

#[derive(Debug, Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Result<Self, Flaw> {
        Ok(match word {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return Err(flaw(format!("unknown PLY type {}", quoted(word)))),
        })
    }

    fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    /// Type of the count, for a list.
    list: Option<Scalar>,
    scalar: Scalar,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

enum Body<'a> {
    Ascii(SplitAsciiWhitespace<'a>),
    Binary { bytes: &'a [u8], big_endian: bool },
}

fn flaw(problem: impl Into<String>) -> Flaw {
    (problem.into(), "export the PLY file again".into())
}

impl Body<'_> {
    fn read(&mut self, scalar: Scalar) -> Result<f64, Flaw> {
        match self {
            Body::Ascii(words) => {
                let word = words.next().ok_or_else(|| flaw("the PLY file ends early"))?;
                word.parse().map_err(|_| flaw(format!("{} is not a number", quoted(word))))
            }
            Body::Binary { bytes, big_endian } => {
                let (head, rest) = bytes.split_at_checked(scalar.size()).ok_or_else(|| flaw("the PLY file ends early"))?;
                *bytes = rest;
                let mut b = [0u8; 8];
                let n = head.len();
                b[..n].copy_from_slice(head);
                if *big_endian {
                    b[..n].reverse();
                }
                let low = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                Ok(match scalar {
                    Scalar::I8 => f64::from(b[0] as i8),
                    Scalar::U8 => f64::from(b[0]),
                    Scalar::I16 => f64::from(low as u16 as i16),
                    Scalar::U16 => f64::from(low as u16),
                    Scalar::I32 => f64::from(low as i32),
                    Scalar::U32 => f64::from(low),
                    Scalar::F32 => f64::from(f32::from_bits(low)),
                    Scalar::F64 => f64::from_le_bytes(b),
                })
            }
        }
    }
}

/// Reads a PLY file.
pub fn read(bytes: &[u8]) -> Result<Mesh, Flaw> {
    let (elements, mut body) = header(bytes)?;
    let mut mesh = Mesh::default();
    for element in &elements {
        // A row without properties takes no bytes: there may be any number and nothing to read.
        if element.properties.is_empty() {
            continue;
        }
        let (least, left) = match &body {
            Body::Ascii(_) => (2 * element.properties.len(), bytes.len() + 1),
            Body::Binary { bytes, .. } => {
                (element.properties.iter().map(|p| p.list.unwrap_or(p.scalar).size()).sum(), bytes.len())
            }
        };
        if element.count > left / least {
            return Err(flaw(format!(
                "the header promises {} of {}, the file is too short",
                element.count,
                quoted(&element.name)
            )));
        }
        match element.name.as_str() {
            "vertex" => vertices(element, &mut body, &mut mesh)?,
            "face" => faces(element, &mut body, &mut mesh)?,
            _ => {
                for _ in 0..element.count {
                    for property in &element.properties {
                        skip(property, &mut body)?;
                    }
                }
            }
        }
    }
    Ok(mesh)
}

fn header(bytes: &[u8]) -> Result<(Vec<Element>, Body<'_>), Flaw> {
    if !bytes.starts_with(b"ply") {
        return Err(flaw("not a PLY file"));
    }
    let mut format = "";
    let mut elements: Vec<Element> = Vec::new();
    let mut rest = bytes;
    loop {
        let end = rest.iter().take(4096).position(|&b| b == b'\n').ok_or_else(|| flaw("the PLY header does not end"))?;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| flaw("the PLY header is not text"))?;
        rest = &rest[end + 1..];
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["end_header"] => break,
            ["format", kind, _version] => format = *kind,
            ["element", name, count] => {
                let count = count.parse().map_err(|_| flaw(format!("{} is no count", quoted(count))))?;
                elements.push(Element { name: name.to_string(), count, properties: Vec::new() });
            }
            ["property", kind @ .., name] => {
                let element = elements.last_mut().ok_or_else(|| flaw("a property stands before any element"))?;
                let (list, scalar) = match kind {
                    ["list", count, scalar] => (Some(Scalar::parse(count)?), Scalar::parse(scalar)?),
                    [scalar] => (None, Scalar::parse(scalar)?),
                    _ => return Err(flaw(format!("cannot read the header line {}", quoted(line)))),
                };
                element.properties.push(Property { name: name.to_string(), list, scalar });
            }
            [] | ["ply"] | ["comment" | "obj_info", ..] => {}
            _ => return Err(flaw(format!("cannot read the header line {}", quoted(line)))),
        }
    }
    let body = match format {
        "ascii" => {
            Body::Ascii(std::str::from_utf8(rest).map_err(|_| flaw("the ASCII body is not text"))?.split_ascii_whitespace())
        }
        "binary_little_endian" => Body::Binary { bytes: rest, big_endian: false },
        "binary_big_endian" => Body::Binary { bytes: rest, big_endian: true },
        other => return Err(flaw(format!("unknown PLY format {}", quoted(other)))),
    };
    Ok((elements, body))
}

fn list_length(property: &Property, body: &mut Body) -> Result<Option<usize>, Flaw> {
    let Some(count) = property.list else { return Ok(None) };
    let n = body.read(count)?;
    if n < 0.0 || n.fract() != 0.0 || n > f64::from(u32::MAX) {
        return Err(flaw(format!("{n} is no list length")));
    }
    Ok(Some(n as usize))
}

fn skip(property: &Property, body: &mut Body) -> Result<(), Flaw> {
    // Each value is read, so a list longer than the file ends with the file.
    for _ in 0..list_length(property, body)?.unwrap_or(1) {
        body.read(property.scalar)?;
    }
    Ok(())
}

fn vertices(element: &Element, body: &mut Body, mesh: &mut Mesh) -> Result<(), Flaw> {
    let find = |name: &str| element.properties.iter().position(|p| p.name == name && p.list.is_none());
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(find) else {
        return Err(flaw("the vertices have no x, y and z"));
    };
    let normal = match ["nx", "ny", "nz"].map(find) {
        [Some(nx), Some(ny), Some(nz)] => Some([nx, ny, nz]),
        _ => None,
    };
    let pairs = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
    let uv = pairs.iter().find_map(|pair| Some([find(pair[0])?, find(pair[1])?]));
    let mut row = vec![0.0; element.properties.len()];
    for _ in 0..element.count {
        for (value, property) in row.iter_mut().zip(&element.properties) {
            match property.list {
                None => *value = body.read(property.scalar)?,
                Some(_) => skip(property, body)?,
            }
        }
        mesh.positions.push(DVec3::new(row[x], row[y], row[z]));
        if let Some([nx, ny, nz]) = normal {
            mesh.normals.push(DVec3::new(row[nx], row[ny], row[nz]));
        }
        if let Some([u, v]) = uv {
            // Counted from the lower edge of the picture.
            mesh.uvs.push(DVec2::new(row[u], 1.0 - row[v]));
        }
    }
    Ok(())
}

fn faces(element: &Element, body: &mut Body, mesh: &mut Mesh) -> Result<(), Flaw> {
    let mut corners = Vec::new();
    for _ in 0..element.count {
        for property in &element.properties {
            if property.name != "vertex_indices" && property.name != "vertex_index" {
                skip(property, body)?;
                continue;
            }
            corners.clear();
            for _ in 0..list_length(property, body)?.unwrap_or(1) {
                let index = body.read(property.scalar)?;
                if index < 0.0 || index.fract() != 0.0 || index > f64::from(u32::MAX) {
                    return Err(flaw(format!("{index} is no vertex index")));
                }
                corners.push(index as u32);
            }
            mesh.triangles.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
        }
    }
    Ok(())
}
