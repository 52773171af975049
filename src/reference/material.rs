//! What a path meets at a surface: which material, and with which parameters at the wavelengths of the path.

use super::Stage;
use super::bsdf::Bsdf;
use super::interiors::{Crossing, cross, ruling};
use super::rng::Rng;
use super::surface::Over;
use super::walk::{Path, WavelengthSample};
use crate::bsdf::coat::Coat;
use crate::bsdf::energy::Facets;
use crate::bsdf::fresnel;
use crate::bsdf::sheen::Sheen;
use crate::geometry::world::Hit;
use crate::scene::roughness::level_at;
use crate::scene::texture::ImageTexture;
use crate::scene::{CoatNormals, Geometry, Grain, Material, Scene, Texture, ThinFilm, direction_of_grain};
use crate::spectrum::{Ior, Spectrum};
use glam::{DVec3, DVec4};
use std::collections::BTreeMap;

/// A coat on it.
#[derive(Clone, Copy)]
pub(super) struct MetCoat<'a> {
    pub ior: &'a Ior,
    alpha: f64,
    /// Is the colour under it the one that is seen?
    seen: bool,
    /// Its shading normal.
    normal: DVec3,
}

/// A surface that a path meets, mixtures decided.
pub(super) struct Met<'a> {
    pub hit: Hit,
    /// The index of its material.
    index: usize,
    pub material: &'a Material,
    pub coat: Option<MetCoat<'a>>,
    sheen: Option<(&'a Sheen, &'a Spectrum)>,
    pub film: Option<&'a ThinFilm>,
    pub grain: Option<Grain>,
}

/// What scatters light there: where, how, and through what.
pub(super) type Scatterer<'a> = (Hit, Bsdf<'a>, Over<'a>);

impl Stage {
    /// What the path meets at `hits`: the interiors beyond, and the scattering surface unless it goes straight through. Mixes are decided by
    /// chance; of surfaces that coincide an opaque one counts before dielectrics.
    pub(super) fn meet<'a>(&'a self, path: &mut Path, hits: &[Hit], rng: &mut Rng) -> (Vec<usize>, Option<Scatterer<'a>>) {
        let met: Vec<Met> = hits.iter().map(|h| self.choose(*h, path, rng)).collect();
        let values = |f: &dyn Fn(f64) -> f64| path.wavelengths.iter().map(|l| f(l.nm)).collect::<Vec<f64>>();
        let outside = values(&|nm| self.scene.interiors[ruling(&self.scene, &path.inside)].ior.eval(nm));
        // A sheet in the boundary of a volume is not there: past it light would go straight on into the volume, and come out refracted.
        let is_in_boundary = met.iter().any(|m| self.scene.materials[m.index].interior().is_some());
        for surface @ &Met { hit, material, coat, sheen, grain, .. } in &met {
            let Some(bsdf) = self.bsdf(surface, &path.wavelengths, &outside, is_in_boundary) else { continue };
            let of_wavelength = |coat: MetCoat, nm: f64, outside: f64| Coat {
                eta: coat.ior.eval(nm) / outside,
                rough: self.energy(Facets::Coat { alpha: coat.alpha }).map(|table| (coat.alpha, table)),
                seen: coat.seen,
            };
            let coats = |coat| path.wavelengths.iter().zip(&outside).map(|(l, &n)| of_wavelength(coat, l.nm, n)).collect();
            let over = Over {
                coat: coat.map_or(vec![], coats),
                coat_normal: coat.map_or(hit.ns, |coat| coat.normal),
                sheen: sheen.map(|(sheen, color)| (sheen, values(&|nm| color.eval(nm)))),
                along: grain.map(|grain| self.along(&grain, &hit)),
                tint: tint(material, &hit, path),
            };
            return (path.inside.clone(), Some((hit, bsdf, over)));
        }
        let crossed: Vec<(&Hit, usize)> = met.iter().map(|m| (&m.hit, m.index)).collect();
        match cross(&self.scene, &path.inside, path.ray.dir, &crossed) {
            (beyond, Crossing::Interface { hit, near, far, alpha }) => {
                let interiors = &self.scene.interiors;
                let eta = values(&|nm| interiors[far].ior.eval(nm) / interiors[near].ior.eval(nm));
                let surface = met.iter().find(|m| std::ptr::eq(&m.hit, hit));
                let film = surface.and_then(|m| m.film);
                let index = |i: usize, nm: f64| interiors[i].ior.eval(nm);
                let stack =
                    |l: &WavelengthSample, film: &ThinFilm| film.between(index(near, l.nm), (index(far, l.nm), 0.0), l.nm);
                let film = film.map_or(vec![], |film| path.wavelengths.iter().map(|l| stack(l, film)).collect());
                let coated = surface.is_some_and(|m| matches!(m.material, Material::Dielectric { antireflective: true, .. }));
                let reflectance = if coated { fresnel::antireflective } else { fresnel::dielectric };
                let energy = self.energy(Facets::Glass { alpha, coated });
                let over = Over { tint: surface.map_or(vec![], |m| tint(m.material, hit, path)), ..Over::default() };
                (beyond, Some((*hit, Bsdf::Dielectric { eta, film, reflectance, alpha, energy }, over)))
            }
            (beyond, Crossing::Straight) => (beyond, None),
        }
    }

    /// Where this grain points at a hit.
    fn along(&self, grain: &Grain, hit: &Hit) -> DVec3 {
        let tangent = match &self.scene.shapes[hit.shape].geometry {
            Geometry::Mesh(mesh) => mesh.tangent((hit.prim - self.world.first_prim(hit.shape)) as usize, hit.p),
            _ => DVec4::W,
        };
        direction_of_grain(grain, hit.ns, tangent)
    }

    /// The material of a hit, the coat on it, and the hit with its normal as maps turn it; mixes decided with the mean of their weight over the carried
    /// wavelengths.
    fn choose(&self, hit: Hit, path: &mut Path, rng: &mut Rng) -> Met<'_> {
        let (mut coat, mut sheen) = (None, None);
        let shape = &self.scene.shapes[hit.shape];
        let (mut index, of_shape) = (shape.material, hit.ns);
        let mapped = |normals: &ImageTexture| match &shape.geometry {
            Geometry::Mesh(mesh) => {
                let triangle = (hit.prim - self.world.first_prim(hit.shape)) as usize;
                mesh.mapped_normal(triangle, hit.p, hit.uv, hit.ng, of_shape, normals)
            }
            _ => of_shape,
        };
        let mut ns = of_shape;
        loop {
            let material = &self.scene.materials[index];
            let (a, b, weight) = match material {
                Material::Mix { a, b, weight } => (a, b, weight),
                Material::Graded { materials, levels, roughness } => {
                    let (level, share) = level_at(roughness.eval(path.wavelengths[0].nm, hit.uv), levels);
                    index = materials[level - levels.start + usize::from(rng.next() < share)];
                    continue;
                }
                Material::NormalMapped { base, normals } => {
                    ns = mapped(normals);
                    index = *base;
                    continue;
                }
                Material::Sheen { base, color, .. } => {
                    sheen = Some((&self.sheens[&index], color));
                    index = *base;
                    continue;
                }
                Material::Coated { base, ior, alpha, seen, normals } => {
                    let normal = match normals {
                        CoatNormals::OfBase => ns,
                        CoatNormals::OfShape => of_shape,
                        CoatNormals::Mapped(normals) => mapped(normals),
                    };
                    coat = Some(MetCoat { ior, alpha: *alpha, seen: *seen, normal });
                    index = *base;
                    continue;
                }
                _ => {
                    let (film, grain) = (self.scene.thin_films.get(&index), self.scene.grains.get(&index).copied());
                    return Met { hit: Hit { ns, ..hit }, index, material, coat, sheen, film, grain };
                }
            };
            let w: Vec<f64> = path.wavelengths.iter().map(|l| weight.eval(l.nm, hit.uv)).collect();
            let q = w.iter().sum::<f64>() / w.len() as f64;
            let first = rng.next() < q;
            for (wavelength, w) in path.wavelengths.iter_mut().zip(w) {
                wavelength.beta *= if first { w / q } else { (1.0 - w) / (1.0 - q) };
            }
            index = if first { *a } else { *b };
        }
    }
}

/// The factors on what tinted glass lets through.
fn tint(material: &Material, hit: &Hit, path: &Path) -> Vec<f64> {
    let of = |tint: &Texture| path.wavelengths.iter().map(|l| tint.eval(l.nm, hit.uv)).collect();
    material.tint().map_or(vec![], of)
}

/// The sheens of a scene, by the index of their material.
pub(super) fn sheens(scene: &Scene) -> BTreeMap<usize, Sheen> {
    let of = |(i, material): (usize, &Material)| match material {
        Material::Sheen { color, alpha, .. } => Some((i, scene.sheen(color, *alpha))),
        _ => None,
    };
    scene.materials.iter().enumerate().filter_map(of).collect()
}
