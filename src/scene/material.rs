//! Materials, and what the rest of the program asks them: where a stage does not handle every kind by itself, it asks here and knows no kinds.

use super::roughness::level_at;
use super::texture::{ImageTexture, Texture};
use super::{Geometry, Scene, Shape};
use crate::bsdf::fresnel;
use crate::spectrum::{Ior, Spectrum};
use std::collections::HashSet;
use std::sync::Arc;

/// What a surface does to light.
#[derive(Debug, Clone)]
pub enum Material {
    /// Lambertian, on both sides.
    Diffuse {
        /// Reflectance in [0, 1].
        reflectance: Texture,
    },
    /// The boundary of a transparent solid; smooth for `alpha = 0`, else GGX with energy compensation ([`crate::bsdf`]).
    Dielectric {
        /// What is behind the surface (on the side its normal points away from): an index into `Scene::interiors`.
        interior: usize,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
        /// Factor in [0, 1] on what gets through, the same both ways.
        tint: Option<Texture>,
        /// Does an ideal coating let all through that is not reflected totally?
        antireflective: bool,
    },
    /// A thin pane seen as one surface, with all inner bounces ([`crate::bsdf::pane`]): some is reflected, the rest goes straight through, or if it is rough
    /// is spread around that direction as what is reflected is around its.
    ThinDielectric {
        /// Index of the pane relative to the surroundings.
        ior: Ior,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
        /// Factor in [0, 1] on what gets through.
        tint: Option<Texture>,
        /// Optical depth of the pane at normal incidence; at others light has a longer way through it.
        depth: Spectrum,
    },
    /// Lambertian, of light that comes from behind, on both sides.
    DiffuseTransmission {
        /// Transmittance in [0, 1].
        transmittance: Texture,
    },
    /// Metal with complex index `eta + i k`; smooth for `alpha = 0`, else GGX with energy compensation. Reflects on both sides.
    Conductor {
        /// Real part.
        eta: Spectrum,
        /// Imaginary part.
        k: Spectrum,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// Metal of which no index is known, only what it reflects at normal incidence; towards grazing incidence all (Schlick 1994).
    ColoredConductor {
        /// Reflectance in [0, 1].
        reflectance: Texture,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// A material whose roughness varies, or what else there are levels of: of the two next to what the picture says, each in proportion
    /// ([`super::roughness`]).
    Graded {
        /// Indices of the materials of the levels, the smoothest first.
        materials: Vec<usize>,
        /// Which levels these are, two at least.
        levels: std::ops::Range<usize>,
        /// Roughness in [0, 1], the root of the GGX width; or 1/16 for each level.
        roughness: Texture,
    },
    /// A clear coat on another material; smooth for `alpha = 0`, else GGX ([`crate::bsdf::coat`]).
    Coated {
        /// Index of what is under it: diffuse, a conductor, or mixtures of such.
        base: usize,
        /// Index of the coat.
        ior: Ior,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
        /// Is the colour of paint under it the one that is seen, as in glTF, so that what the coat sends down again is a part of it?
        seen: bool,
        /// Which way it points. Under sheen as what it lies on.
        normals: CoatNormals,
    },
    /// Sheen over another material ([`crate::bsdf::sheen`]).
    Sheen {
        /// Index of what is under it: diffuse, a conductor, a coated material, or mixtures of such.
        base: usize,
        /// Its colour, in [0, 1].
        color: Spectrum,
        /// Width, in [`LEAST`](crate::bsdf::sheen::LEAST) to 1.
        alpha: f64,
    },
    /// `weight` of `a` and `1 - weight` of `b`.
    Mix {
        /// Index of the first material.
        a: usize,
        /// Index of the second material.
        b: usize,
        /// Share of `a`, in [0, 1].
        weight: Texture,
    },
    /// Another material on a surface that looks finer than it is.
    NormalMapped {
        /// Index of that material.
        base: usize,
        /// Normals in tangent space as the first three numbers of texels: x along the picture's width, y up the picture, z outwards.
        normals: Arc<ImageTexture>,
    },
    /// No surface at all: light goes straight through, into or out of the interior where there is one.
    Boundary {
        /// Index into `Scene::interiors`, if crossing it changes the medium.
        interior: Option<usize>,
    },
}

/// Which way the surface of a clear coat points.
#[derive(Debug, Clone, Default)]
pub enum CoatNormals {
    /// As what it lies on.
    #[default]
    OfBase,
    /// As the shape does, whatever maps say of what it lies on.
    OfShape,
    /// As a map of its own says, likewise ([`Material::NormalMapped`]).
    Mapped(Arc<ImageTexture>),
}

/// How light gets through a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Passage {
    /// Not at all.
    None,
    /// Straight through a pane, or where there is nothing.
    Straight,
    /// Straight into this interior, or out of it.
    Into(usize),
    /// Likewise, refracted.
    Refracted(usize),
}

impl Material {
    /// No surface, with nothing behind it.
    pub const NOTHING: Material = Material::Boundary { interior: None };

    /// A clear and smooth pane.
    pub fn thin_pane(ior: Ior) -> Self {
        Material::ThinDielectric { ior, alpha: 0.0, tint: None, depth: Spectrum::Constant(0.0) }
    }

    /// Indices of the materials that it is made of: what it mixes, covers or varies.
    pub fn parts(&self) -> Vec<usize> {
        match self {
            Material::Mix { a, b, .. } => vec![*a, *b],
            Material::NormalMapped { base, .. } | Material::Coated { base, .. } | Material::Sheen { base, .. } => vec![*base],
            Material::Graded { materials, .. } => materials.clone(),
            _ => Vec::new(),
        }
    }

    /// The factor on what it lets through, if it is tinted glass.
    pub fn tint(&self) -> Option<&Texture> {
        match self {
            Material::Dielectric { tint, .. } | Material::ThinDielectric { tint, .. } => tint.as_ref(),
            _ => None,
        }
    }

    /// Its picture, if it has one: of a colour, a weight, a roughness or normals.
    pub fn image(&self) -> Option<&Arc<ImageTexture>> {
        match self {
            Material::Dielectric { .. } | Material::ThinDielectric { .. } => self.tint()?.image(),
            Material::Diffuse { reflectance: texture }
            | Material::DiffuseTransmission { transmittance: texture }
            | Material::ColoredConductor { reflectance: texture, .. }
            | Material::Graded { roughness: texture, .. }
            | Material::Mix { weight: texture, .. } => texture.image(),
            _ => self.normals(),
        }
    }

    /// Its map of normals, if it has one.
    pub fn normals(&self) -> Option<&Arc<ImageTexture>> {
        match self {
            Material::NormalMapped { normals, .. } | Material::Coated { normals: CoatNormals::Mapped(normals), .. } => {
                Some(normals)
            }
            _ => None,
        }
    }

    /// The interior behind it, an index into `Scene::interiors`.
    pub fn interior(&self) -> Option<usize> {
        match self {
            Material::Dielectric { interior, .. } => Some(*interior),
            Material::Boundary { interior } => *interior,
            _ => None,
        }
    }

    /// Its interior, to be changed.
    pub(super) fn interior_mut(&mut self) -> Option<&mut usize> {
        match self {
            Material::Dielectric { interior, .. } => Some(interior),
            Material::Boundary { interior } => interior.as_mut(),
            _ => None,
        }
    }

    /// The interior behind it and its GGX width, if light is refracted into that.
    pub fn interface(&self) -> Option<(usize, f64)> {
        match self {
            Material::Dielectric { interior, alpha, .. } => Some((*interior, *alpha)),
            _ => None,
        }
    }

    /// Index relative to the surroundings, if it is a thin pane.
    pub fn pane(&self) -> Option<&Ior> {
        match self {
            Material::ThinDielectric { ior, .. } => Some(ior),
            _ => None,
        }
    }

    /// GGX width of its facets, 0 if it is smooth; `None` if it has no such facets of its own.
    pub fn alpha(&self) -> Option<f64> {
        match self {
            Material::Dielectric { alpha, .. }
            | Material::ThinDielectric { alpha, .. }
            | Material::Conductor { alpha, .. }
            | Material::ColoredConductor { alpha, .. }
            | Material::Coated { alpha, .. } => Some(*alpha),
            _ => None,
        }
    }

    /// True for polished glass, panes and metal, which are seen through or mirror.
    pub fn is_smooth(&self) -> bool {
        !matches!(self, Material::Coated { .. }) && self.alpha() == Some(0.0)
    }

    /// GGX width of what may have a grain, to be changed.
    pub(super) fn grained_alpha_mut(&mut self) -> Option<&mut f64> {
        match self {
            Material::ThinDielectric { alpha, .. }
            | Material::Conductor { alpha, .. }
            | Material::ColoredConductor { alpha, .. } => Some(alpha),
            _ => None,
        }
    }

    /// True if it makes caustics worth aiming at, by itself: a coat bends but little of the light that meets it.
    pub fn bends(&self) -> bool {
        match self {
            Material::Dielectric { .. }
            | Material::ThinDielectric { .. }
            | Material::Conductor { .. }
            | Material::ColoredConductor { .. } => true,
            Material::Diffuse { .. }
            | Material::DiffuseTransmission { .. }
            | Material::Boundary { .. }
            | Material::Coated { .. }
            | Material::Sheen { .. }
            | Material::Mix { .. }
            | Material::NormalMapped { .. }
            | Material::Graded { .. } => false,
        }
    }

    /// False if it lets light through by itself; what it is made of may.
    pub fn is_opaque(&self) -> bool {
        !matches!(
            self,
            Material::Dielectric { .. }
                | Material::ThinDielectric { .. }
                | Material::DiffuseTransmission { .. }
                | Material::Boundary { .. }
        )
    }
}

impl Scene {
    /// The material at `index` and all that it is made of, each once.
    pub fn made_of(&self, index: usize) -> Vec<usize> {
        let (mut all, mut known, mut at) = (vec![index], HashSet::from([index]), 0);
        while at < all.len() {
            all.extend(self.materials[all[at]].parts().into_iter().filter(|part| known.insert(*part)));
            at += 1;
        }
        all
    }

    /// Whether any shape is of polished glass or metal, or of what has such parts.
    pub fn is_seen_through(&self) -> bool {
        self.shapes.iter().any(|shape| self.made_of(shape.material).into_iter().any(|m| self.materials[m].is_smooth()))
    }

    /// The part of it that bounds an interior, or else itself.
    pub fn bounding_part(&self, material: usize) -> usize {
        self.made_of(material).into_iter().find(|&m| self.materials[m].interior().is_some()).unwrap_or(material)
    }

    /// The interior that a surface of this material encloses: its own, or that of what it is made of. A mixture has one, that of its parts
    /// ([`Scene::passage`]).
    pub fn interior_of(&self, material: usize) -> Option<usize> {
        let of_parts = || self.materials[material].parts().into_iter().find_map(|part| self.interior_of(part));
        self.materials[material].interior().or_else(of_parts)
    }

    /// The interior that a shape bounds.
    pub fn volume_of(&self, shape: &Shape) -> Option<usize> {
        self.interior_of(shape.material).or(shape.interior)
    }

    /// Whether these are faces of one piece of glass in a lens.
    pub(crate) fn are_one_piece(&self, a: &Shape, b: &Shape) -> bool {
        let (Geometry::LensFace(face), Geometry::LensFace(other)) = (&a.geometry, &b.geometry) else { return false };
        face.base == other.base && face.axis == other.axis && self.volume_of(a) == self.volume_of(b)
    }

    /// How light gets through a surface of this material.
    ///
    /// # Errors
    /// The two ways of a mixture through which light gets in two ways: paths that took them would differ in what they believe to be in, and radiance behind
    /// an index of n is n^2 of what it is before it, so that a mixture of refraction and straight passage would make light or lose it.
    pub fn passage(&self, material: usize) -> Result<Passage, [Passage; 2]> {
        let ways = self.made_of(material).into_iter().map(|m| match &self.materials[m] {
            Material::Dielectric { interior, .. } => Passage::Refracted(*interior),
            Material::Boundary { interior: Some(interior) } => Passage::Into(*interior),
            Material::Boundary { interior: None } | Material::ThinDielectric { .. } | Material::DiffuseTransmission { .. } => {
                Passage::Straight
            }
            _ => Passage::None,
        });
        ways.filter(|way| *way != Passage::None).try_fold(Passage::None, |so_far, way| match so_far {
            Passage::None => Ok(way),
            _ if so_far == way => Ok(way),
            _ => Err([so_far, way]),
        })
    }

    /// What a material looks like at `nm` without light and shade, pictures by their mean: what it reflects at normal incidence (of glass and what light gets through, its tint), and the
    /// share of rays that it stops.
    pub fn albedo(&self, material: usize, nm: f64) -> [f64; 2] {
        match &self.materials[material] {
            Material::Diffuse { reflectance } | Material::ColoredConductor { reflectance, .. } => [reflectance.average(nm), 1.0],
            Material::Dielectric { tint, .. } | Material::ThinDielectric { tint, .. } => {
                [tint.as_ref().map_or(1.0, |tint| tint.average(nm)), 1.0]
            }
            Material::DiffuseTransmission { transmittance } => [transmittance.average(nm), 1.0],
            Material::Conductor { eta, k, .. } => {
                let around = self.interiors[0].ior.eval(nm);
                [fresnel::conductor(1.0, eta.eval(nm) / around, k.eval(nm) / around), 1.0]
            }
            Material::Mix { a, b, weight } => {
                let (w, a, b) = (weight.average(nm), self.albedo(*a, nm), self.albedo(*b, nm));
                std::array::from_fn(|i| w * a[i] + (1.0 - w) * b[i])
            }
            Material::NormalMapped { base, .. } | Material::Coated { base, .. } | Material::Sheen { base, .. } => {
                self.albedo(*base, nm)
            }
            Material::Graded { materials, levels, roughness } => {
                let (level, share) = level_at(roughness.average(nm), levels);
                let [a, b] = [0, 1].map(|next| self.albedo(materials[level - levels.start + next], nm));
                std::array::from_fn(|i| (1.0 - share) * a[i] + share * b[i])
            }
            Material::Boundary { .. } => [0.0, 0.0],
        }
    }
}
