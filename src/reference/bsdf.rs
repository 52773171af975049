//! The materials that scatter, in double precision: which [`Bsdf`] each is, what it scatters and where to. Coats, sheen, tints and shading
//! normals are over all of them alike ([`super::surface`]).

use super::Stage;
use super::material::Met;
use super::rng::Rng;
use super::surface::{Outgoing, Over, mean};
use super::walk::WavelengthSample;
use crate::bsdf::coat::Coat;
use crate::bsdf::conductor::RoughConductor;
use crate::bsdf::dielectric::RoughDielectric;
use crate::bsdf::energy::{EnergyTable, Facets};
use crate::bsdf::fresnel::{self, Metal};
use crate::bsdf::ggx::Width;
use crate::bsdf::pane::{Pane, PaneFilm, RoughPane};
use crate::bsdf::sample_cosine;
use crate::bsdf::thin_film::Stack;
use crate::geometry::Coordinates;
use crate::scene::roughness::level_at;
use crate::scene::{Grain, Material, Scene, ThinFilm};
use crate::spectrum::{Ior, Spectrum};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// A surface's material with its parameters at the wavelengths of a path.
pub(super) enum Bsdf<'a> {
    /// Reflectance.
    Diffuse(Vec<f64>),
    /// Metal.
    Conductor { metal: Vec<Metal>, width: Width, energy: Option<&'a EnergyTable> },
    /// Far index over near index, the film between, if there is one, and else the reflectance.
    Dielectric { eta: Vec<f64>, film: Vec<Stack>, reflectance: fn(f64, f64) -> f64, alpha: f64, energy: Option<&'a EnergyTable> },
    /// Transmittance.
    DiffuseTransmission(Vec<f64>),
    /// What a coat itself reflects.
    Coat(Vec<Coat<'a>>),
    /// A pane, and the facets of a rough one.
    Thin { panes: Vec<Pane>, facets: Option<RoughConductor<'a>> },
}

impl Stage {
    /// What a surface scatters with at the wavelengths of a path, in a medium of indices `outside`: nothing where light goes straight on, or where
    /// the interiors decide. A sheet in the boundary of a volume is not there.
    pub(super) fn bsdf<'a>(
        &'a self,
        met: &Met<'a>,
        wavelengths: &[WavelengthSample],
        outside: &[f64],
        is_in_boundary: bool,
    ) -> Option<Bsdf<'a>> {
        let &Met { hit, material, coat, film, grain, .. } = met;
        let values = |f: &dyn Fn(f64) -> f64| wavelengths.iter().map(|l| f(l.nm)).collect::<Vec<f64>>();
        Some(match material {
            Material::Diffuse { reflectance } => Bsdf::Diffuse(values(&|nm| reflectance.eval(nm, hit.uv))),
            Material::DiffuseTransmission { transmittance } if !is_in_boundary => {
                Bsdf::DiffuseTransmission(values(&|nm| transmittance.eval(nm, hit.uv)))
            }
            Material::ThinDielectric { ior, alpha, depth, .. } if !is_in_boundary => {
                let pane = |(l, &n): (&WavelengthSample, &f64)| pane(ior, depth, film, l.nm, n);
                let width = grain.map_or((*alpha).into(), |grain: Grain| grain.width(*alpha));
                Bsdf::Thin {
                    panes: wavelengths.iter().zip(outside).map(pane).collect(),
                    facets: self
                        .energy(Facets::of_mirror(*alpha, grain.map(|_| width)))
                        .map(|energy| RoughConductor { alpha: width, energy }),
                }
            }
            Material::Conductor { eta, k, alpha } => {
                let around = coat.map_or(outside.to_vec(), |coat| values(&|nm| coat.ior.eval(nm)));
                let of = |(l, n): (&WavelengthSample, &f64)| match film {
                    Some(film) => Metal::Filmed(film.between(*n, (eta.eval(l.nm), k.eval(l.nm)), l.nm)),
                    None => Metal::Index(eta.eval(l.nm) / n, k.eval(l.nm) / n),
                };
                self.metal(wavelengths.iter().zip(&around).map(of).collect(), *alpha, grain)
            }
            Material::ColoredConductor { reflectance, alpha } => {
                let of = |l: &WavelengthSample| Metal::Reflectance(reflectance.eval(l.nm, hit.uv));
                self.metal(wavelengths.iter().map(of).collect(), *alpha, grain)
            }
            _ => return None,
        })
    }

    fn metal(&self, metal: Vec<Metal>, alpha: f64, grain: Option<Grain>) -> Bsdf<'_> {
        let width = grain.map_or(alpha.into(), |grain| grain.width(alpha));
        Bsdf::Conductor { metal, width, energy: self.energy(Facets::of_mirror(alpha, grain.map(|_| width))) }
    }
}

impl Bsdf<'_> {
    /// The BSDF times the cosine at the wavelength number `wavelength`, between local directions; 0 for mirror-like surfaces.
    pub(super) fn eval(&self, over: &Over, wo: DVec3, local: DVec3, wavelength: usize) -> f64 {
        match self {
            Bsdf::Diffuse(rho) => over.paint(rho[wavelength], wavelength, wo, local) * local.z.max(0.0) / PI,
            Bsdf::DiffuseTransmission(tau) => over.paint(tau[wavelength], wavelength, wo, local) * (-local.z).max(0.0) / PI,
            Bsdf::Coat(coats) => coats[wavelength].eval(wo, local),
            Bsdf::Thin { panes, facets: Some(facets) } => RoughPane { facets: *facets }.eval(wo, local, &panes[wavelength]),
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                facets.eval(wo, local, |lobe| over.mirror(facets.reflectance(lobe, metal[wavelength]), wavelength, wo, local))
            }
            Bsdf::Dielectric { eta, reflectance, alpha, energy: Some(energy), .. } => {
                RoughDielectric { alpha: *alpha, eta: eta[wavelength], reflectance: *reflectance, energy }.eval(wo, local)
            }
            _ => 0.0,
        }
    }

    /// Scatters light that came from the local direction `wo`: nothing if absorbed, several where dispersion parts the wavelengths.
    pub(super) fn sample(&self, over: &Over, wo: DVec3, wavelengths: &[WavelengthSample], rng: &mut Rng) -> Vec<Outgoing> {
        let one = |wi, transmitted, weight: &dyn Fn(usize) -> f64| {
            let wavelengths = wavelengths.iter().enumerate().map(|(i, l)| l.times(weight(i))).collect();
            vec![Outgoing { wi, wavelengths, transmitted }]
        };
        match self {
            Bsdf::Diffuse(rho) => {
                let wi = sample_cosine(rng.next2());
                one(wi, false, &|i| over.paint(rho[i], i, wo, wi))
            }
            Bsdf::DiffuseTransmission(tau) => {
                let mut wi = sample_cosine(rng.next2());
                wi.z = -wi.z;
                one(wi, true, &|i| over.paint(tau[i], i, wo, wi))
            }
            Bsdf::Conductor { metal, energy: None, .. } => {
                let wi = fresnel::reflect(wo, DVec3::Z);
                one(wi, false, &|i| over.mirror(metal[i].at(wo.z), i, wo, wi))
            }
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                let [u0, u1] = rng.next2();
                let Some(s) = facets.sample(wo, [u0, u1, rng.next()]) else { return vec![] };
                one(s.wi, false, &|i| s.weight * over.mirror(facets.reflectance(s.lobe, metal[i]), i, wo, s.wi))
            }
            Bsdf::Coat(coats) => {
                let Some((wi, weight, cos)) = coats[0].sample(wo, rng.next2()) else { return vec![] };
                one(wi, false, &|i| weight * fresnel::dielectric(cos, coats[i].eta))
            }
            Bsdf::Thin { panes, facets } => {
                let q = |cos: f64| panes.iter().map(|pane| pane.shares(cos)[0]).sum::<f64>() / panes.len() as f64;
                let side = |cos: f64, reflects: bool, i: usize| {
                    if reflects { panes[i].shares(cos)[0] / q(cos) } else { panes[i].shares(cos)[1] / (1.0 - q(cos)) }
                };
                if let Some(facets) = facets {
                    let ([u0, u1], [u2, u3]) = (rng.next2(), rng.next2());
                    let sampled = RoughPane { facets: *facets }.sample(wo, q, [u0, u1, u2, u3]);
                    return sampled
                        .map_or(vec![], |(wi, weight, cos)| one(wi, wi.z < 0.0, &|i| weight * side(cos, wi.z > 0.0, i)));
                }
                let reflects = rng.next() < q(wo.z);
                let wi = if reflects { fresnel::reflect(wo, DVec3::Z) } else { -wo };
                one(wi, !reflects, &|i| side(wo.z, reflects, i))
            }
            Bsdf::Dielectric { eta, film, reflectance, energy: None, .. } => {
                let f: Vec<f64> = match film.is_empty() {
                    true => eta.iter().map(|&n| reflectance(wo.z, n)).collect(),
                    false => film.iter().map(|s| s.reflectance(wo.z)).collect(),
                };
                let q = mean(&f);
                if rng.next() < q {
                    return one(fresnel::reflect(wo, DVec3::Z), false, &|i| f[i] / q);
                }
                let through = |i: usize| fresnel::refract_flat(wo, eta[i]).unwrap_or(dvec3(wo.x, wo.y, 0.0));
                if eta.iter().all(|&n| n == eta[0]) {
                    return one(through(0), true, &|i| (1.0 - f[i]) / (1.0 - q));
                }
                let parted = wavelengths.iter().enumerate().map(|(i, wavelength)| Outgoing {
                    wi: through(i),
                    wavelengths: vec![wavelength.times((1.0 - f[i]) / (1.0 - q))],
                    transmitted: true,
                });
                parted.collect()
            }
            Bsdf::Dielectric { eta, reflectance, alpha, energy: Some(energy), .. } => {
                let mut scatter = |eta: f64| {
                    let [u0, u1] = rng.next2();
                    let [u2, u3] = rng.next2();
                    RoughDielectric { alpha: *alpha, eta, reflectance: *reflectance, energy }.sample(wo, [u0, u1, u2, u3])
                };
                if eta.iter().all(|&n| n == eta[0]) {
                    return scatter(eta[0]).map_or(vec![], |(wi, weight)| one(wi, wi.z < 0.0, &|_| weight));
                }
                let parted = wavelengths.iter().zip(eta).filter_map(|(wavelength, &eta)| {
                    let (wi, weight) = scatter(eta)?;
                    Some(Outgoing { wi, wavelengths: vec![wavelength.times(weight)], transmitted: wi.z < 0.0 })
                });
                parted.collect()
            }
        }
    }
}

/// A pane in a medium of index `around`.
fn pane(ior: &Ior, depth: &Spectrum, film: Option<&ThinFilm>, nm: f64, around: f64) -> Pane {
    let (eta, is_film) = (ior.eval(nm), film.is_some_and(|film| film.ior == *ior));
    let film = film.map(|film| match is_film {
        true => PaneFilm::Whole(film.between(around, (around, 0.0), nm)),
        false => PaneFilm::OnFaces(film.between(around, (around * eta, 0.0), nm)),
    });
    Pane { eta, depth: depth.eval(nm), film }
}

/// How much of a straight ray passes a surface of material number `index` unscattered, per wavelength, if its
/// dielectrics do not refract there.
pub(super) fn straight_share(scene: &Scene, index: usize, cos: f64, uv: Coordinates, nm: f64) -> f64 {
    match &scene.materials[index] {
        Material::Boundary { .. } | Material::Dielectric { .. } => 1.0,
        Material::ThinDielectric { ior, alpha: 0.0, tint, depth } => {
            let pane = pane(ior, depth, scene.thin_films.get(&index), nm, 1.0);
            tint.as_ref().map_or(1.0, |tint| tint.eval(nm, uv)) * pane.shares(cos)[1]
        }
        Material::NormalMapped { base, .. } => straight_share(scene, *base, cos, uv, nm),
        Material::Graded { materials, levels, roughness } => {
            let (level, share) = level_at(roughness.eval(nm, uv), levels);
            let of = |level: usize| straight_share(scene, materials[level - levels.start], cos, uv, nm);
            (1.0 - share) * of(level) + share * of(level + 1)
        }
        Material::Mix { a, b, weight } => {
            let w = weight.eval(nm, uv);
            w * straight_share(scene, *a, cos, uv, nm) + (1.0 - w) * straight_share(scene, *b, cos, uv, nm)
        }
        Material::Diffuse { .. }
        | Material::DiffuseTransmission { .. }
        | Material::ThinDielectric { .. }
        | Material::Conductor { .. }
        | Material::ColoredConductor { .. }
        | Material::Coated { .. }
        | Material::Sheen { .. } => 0.0,
    }
}
