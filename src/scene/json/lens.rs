//! Lenses: a prescription, of which come the faces of its pieces of glass, and its stop.

use crate::error::Result;
use crate::lens::faces::{Finish, faces};
use crate::lens::{Glass, MOST_SURFACES, Prescription, Surface};
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::json::materials::{absorption_of, note_extrapolation};
use crate::scene::json::shapes::name_of;
use crate::scene::{Geometry, Interior, Lens, Material, Shape};
use crate::spectrum::Spectrum;
use glam::{DMat4, DVec3};
use std::collections::HashMap;

/// How edges are finished.
const EDGES: &[&str] = &["black", "ground", "polished"];
/// GGX width of ground glass.
const GROUND: f64 = 0.5;

impl Loader {
    /// Reads a lens and adds its faces.
    pub(in crate::scene) fn lens(&mut self, node: &Node, inner: &Node, world: &DMat4) -> Result<()> {
        inner.object("lens")?;
        let name = name_of(node)?;
        let diameter = inner.get("diameter").map(|n| n.length()).transpose()?;
        let lens = self.prescription(inner, &name, diameter)?;
        let edge = inner.get("edge").map_or(Ok("black"), |n| n.choice(EDGES))?;
        let faces = faces(&lens, diameter);
        for ([a, b], r) in &faces.crossings {
            let text = format!(
                "the surfaces {a} and {b} cross {r:.6} from the axis, and the glass ends there; use a greater thickness or a smaller diameter"
            );
            self.reader.remarks.warn(inner, &text);
        }
        let mut interiors: HashMap<usize, usize> = HashMap::new();
        let mut materials: HashMap<(Option<usize>, bool), usize> = HashMap::new();
        for piece in &faces.pieces {
            let interior = piece.glass.map(|i| *interiors.entry(i).or_insert_with(|| self.glass(&lens, i)));
            let is_black = match piece.finish {
                Finish::Polished => false,
                Finish::Edge => edge == "black",
                Finish::Stop => true,
            };
            let is_ground = piece.finish == Finish::Edge && edge == "ground";
            let material = match interior {
                Some(interior) if !is_black => *materials.entry((Some(interior), is_ground)).or_insert_with(|| {
                    let alpha = if is_ground { GROUND } else { 0.0 };
                    self.scene.materials.push(Material::Dielectric { interior, alpha, tint: None });
                    self.scene.materials.len() - 1
                }),
                _ => self.black(),
            };
            let (geometry, _) = self.place(inner, world, &Geometry::LensFace(piece.face.clone()))?;
            let interior = interior.filter(|_| is_black);
            self.push(node, Shape { name: name.clone(), geometry, material, interior, emission: None })?;
        }
        let scale = world.transform_vector3(DVec3::Z).length();
        self.scene.lenses.push(Lens { name, prescription: lens, scale });
        Ok(())
    }

    /// The interior behind surface `i`.
    fn glass(&mut self, lens: &Prescription, i: usize) -> usize {
        let Some(glass) = &lens.surfaces[i].glass else { return 0 };
        let mut interior = Interior::vacuum(&glass.name);
        interior.ior = glass.ior.clone();
        interior.sigma_a = glass.absorption.clone().unwrap_or(Spectrum::Constant(0.0));
        interior.priority = 1;
        self.volume(interior)
    }

    /// A prescription as a scene file writes it down.
    pub(in crate::scene) fn prescription(&mut self, node: &Node, name: &str, diameter: Option<f64>) -> Result<Prescription> {
        let list = node.need("surfaces")?;
        let nodes = list.array(1)?;
        if nodes.len() > MOST_SURFACES {
            return Err(list.fail(format!("{} surfaces", nodes.len()), format!("use at most {MOST_SURFACES}")));
        }
        let mut surfaces = Vec::new();
        for surface in &nodes {
            surfaces.push(self.lens_surface(surface, diameter)?);
        }
        let lens = Prescription { name: name.to_string(), surfaces };
        lens.check().map_err(|fault| {
            let at = fault.surface.and_then(|i| nodes.get(i)).unwrap_or(&list);
            at.fail(&fault.problem, &fault.remedy)
        })?;
        Ok(lens)
    }

    fn lens_surface(&mut self, node: &Node, diameter: Option<f64>) -> Result<Surface> {
        node.object("lens_surface")?;
        let number = |key| node.get(key).map_or(Ok(0.0), |n: Node| n.number());
        let glass = match node.get("glass") {
            Some(at) => {
                let name = at.get("glass").unwrap_or_else(|| at.clone());
                let name = name.value.as_str().unwrap_or("glass").to_string();
                let ior = self.reader.ior(&at)?;
                note_extrapolation(self, &name, &ior);
                let absorption = node.get("absorption").map(|n| absorption_of(self, &n, Some(&at))).transpose()?;
                Some(Glass { name, ior, absorption })
            }
            None => {
                if let Some(surplus) = node.get("absorption") {
                    return Err(surplus.fail("there is no glass that absorbs", "add \"glass\""));
                }
                None
            }
        };
        let semi_diameter = match (node.get("semi_diameter"), diameter) {
            (Some(own), _) => own.length()?,
            (None, Some(diameter)) => 0.5 * diameter,
            (None, None) => {
                return Err(node.fail("the surface has no size", "add \"semi_diameter\" here or \"diameter\" to the lens"));
            }
        };
        Ok(Surface {
            radius: node.get("radius").map_or(Ok(f64::INFINITY), |n| n.number())?,
            conic: number("conic")?,
            aspheric: match node.get("aspheric") {
                Some(list) => list.array(0)?.iter().map(|n| n.number()).collect::<Result<_>>()?,
                None => Vec::new(),
            },
            thickness: number("thickness")?,
            glass,
            semi_diameter,
            stop: node.get("stop").map_or(Ok(false), |n| n.boolean())?,
        })
    }
}
