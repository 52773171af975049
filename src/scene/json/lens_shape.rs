//! Lenses as shapes: of a prescription come the faces of its pieces of glass, and its stop.

use crate::error::Result;
use crate::lens::Prescription;
use crate::lens::faces::{Finish, faces};
use crate::scene::json::Node;
use crate::scene::json::lens::prescription;
use crate::scene::json::load::Loader;
use crate::scene::json::materials::note_extrapolation;
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
        let lens = prescription(inner, &self.reader)?;
        let edge = inner.get("edge").map_or(Ok("black"), |n| n.choice(EDGES))?;
        lens.crossings().iter().for_each(|warning| self.reader.remarks.warn(inner, warning));
        let mut interiors: HashMap<usize, usize> = HashMap::new();
        let mut materials: HashMap<(usize, bool), usize> = HashMap::new();
        for piece in faces(&lens, diameter) {
            let interior = piece.glass.map(|i| *interiors.entry(i).or_insert_with(|| self.glass(&lens, i)));
            let finish = match (piece.finish, edge) {
                (Finish::Edge, "black") => Finish::Black,
                (Finish::Edge, "polished") => Finish::Polished,
                (finish, _) => finish,
            };
            let material = match interior {
                Some(interior) if finish != Finish::Black => {
                    let is_ground = finish == Finish::Edge;
                    *materials.entry((interior, is_ground)).or_insert_with(|| {
                        let alpha = if is_ground { GROUND } else { 0.0 };
                        self.scene.materials.push(Material::Dielectric { interior, alpha, tint: None, antireflective: false });
                        self.scene.materials.len() - 1
                    })
                }
                _ => self.black(),
            };
            let (geometry, _) = self.place(inner, world, &Geometry::LensFace(piece.face))?;
            let interior = interior.filter(|_| finish == Finish::Black);
            self.push(node, Shape { name: name.clone(), geometry, material, interior, emission: None })?;
        }
        let scale = world.transform_vector3(DVec3::Z).length();
        self.scene.lenses.push(Lens { name, prescription: lens, scale });
        Ok(())
    }

    /// The interior behind surface `i`.
    fn glass(&mut self, lens: &Prescription, i: usize) -> usize {
        let Some(glass) = &lens.surfaces[i].glass else { return 0 };
        note_extrapolation(self, &glass.name, &glass.ior);
        let mut interior = Interior::vacuum(&glass.name);
        interior.ior = glass.ior.clone();
        interior.sigma_a = glass.absorption.clone().unwrap_or(Spectrum::Constant(0.0));
        interior.priority = 1;
        self.volume(interior)
    }
}
