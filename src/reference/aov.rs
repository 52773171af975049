//! What rays meet first, and behind smooth glass and in mirrors, in double precision.

use super::Stage;
use super::interiors::{Crossing, cross};
use super::rng::Rng;
use super::sensor::sample_view;
use crate::bsdf::{facet, fresnel};
use crate::film::aov::{Albedo, AovBuffers, Sums};
use crate::geometry::world::{Hit, Ray};
use crate::scene::Material;
use crate::scene::inside::MAX_STRAIGHT;
use crate::spectrum::LINE_D_NM;
use glam::DVec3;
use rayon::prelude::*;

/// A surface that a ray meets.
struct Met {
    /// Where, with the shading normal on the side of the ray.
    hit: Hit,
    material: usize,
    /// Of the boundary of a volume: index beyond over index on the side of the ray.
    eta: f64,
    /// Interiors beyond.
    beyond: Vec<usize>,
    /// Primitives at this place.
    on: Vec<u32>,
}

impl Stage {
    /// `samples` rays of every pixel; `albedos` are those of the scene's materials.
    pub(super) fn aovs(&self, albedos: &[Albedo], index: u32, samples: u32) -> AovBuffers {
        let pixel = |pixel: usize| -> [Sums; 2] {
            let mut sums = [[0.0; 8]; 2];
            for sample in 0..samples {
                let mut rng = Rng::new(self.seed, index, pixel as u64 * u64::from(samples) + u64::from(sample));
                let view = sample_view(&self.scene.sensor, &self.scene.film, pixel, LINE_D_NM, &mut rng);
                let Some(view) = view else { continue };
                self.add_aovs(view.ray, albedos, &mut rng, &mut sums);
            }
            sums.map(|sums| sums.map(|v| v as f32))
        };
        let (first, behind) = self.kept_pixels().into_par_iter().map(pixel).map(|[first, behind]| (first, behind)).unzip();
        let behind = self.scene.is_seen_through().then(|| AovBuffers::new(samples, behind));
        AovBuffers::new(samples, first).with_behind(behind)
    }

    /// Adds what a ray meets first, and what it meets behind smooth glass and in mirrors.
    fn add_aovs(&self, mut ray: Ray, albedos: &[Albedo], rng: &mut Rng, [first, behind]: &mut [[f64; 8]; 2]) {
        let mut inside = self.interiors_at(ray.origin);
        let mut way = 0.0;
        for bends in 0..=self.scene.max_depth {
            let from = ray.origin;
            let Some(met) = self.first_met(&mut ray, &mut inside, albedos, rng) else { return };
            way += met.hit.p.distance(from);
            let [n, [r, g, b]] = [met.hit.ns.to_array(), albedos[met.material].rgb];
            let add = |sums: &mut [f64; 8]| {
                sums.iter_mut().zip([n[0], n[1], n[2], way, r, g, b, 1.0]).for_each(|(sum, v)| *sum += v);
            };
            if bends == 0 {
                add(first);
            }
            let Some((dir, transmitted)) = self.onward(&met, ray.dir) else { return add(behind) };
            if transmitted {
                inside = met.beyond;
            }
            ray = Ray { origin: met.hit.p, dir, t_min: 0.0, on: met.on };
        }
    }

    /// Where a ray goes on from a smooth surface, and whether that is beyond it.
    fn onward(&self, met: &Met, dir: DVec3) -> Option<(DVec3, bool)> {
        let Hit { ng, ns, .. } = met.hit;
        let ng = if dir.dot(ng) > 0.0 { -ng } else { ng };
        let wo = facet::raise(-dir, ns, 1.0);
        let mirrored = (facet::raise(fresnel::reflect(wo, ns), ng, 1.0), false);
        let is_mirror =
            |m: &Material| matches!(m, Material::Conductor { alpha: 0.0, .. } | Material::ColoredConductor { alpha: 0.0, .. });
        match &self.scene.materials[met.material] {
            Material::ThinDielectric { alpha: 0.0, .. } => Some((dir, true)),
            Material::Dielectric { alpha: 0.0, .. } => {
                let refracted = fresnel::refract(wo, ns, met.eta).map(|w| (facet::raise(w, ng, -1.0), true));
                Some(refracted.unwrap_or(mirrored))
            }
            Material::Coated { alpha: 0.0, base, .. } if is_mirror(&self.scene.materials[*base]) => Some(mirrored),
            bare if is_mirror(bare) => Some(mirrored),
            _ => None,
        }
    }

    /// The surface that a ray meets first. The ray and its interiors become those of its last stretch.
    fn first_met(&self, ray: &mut Ray, inside: &mut Vec<usize>, albedos: &[Albedo], rng: &mut Rng) -> Option<Met> {
        for _ in 0..=MAX_STRAIGHT {
            let hits = self.world.intersect(ray);
            let material_of = |hit: &Hit| self.scene.shapes[hit.shape].material;
            let met: Vec<(&Hit, usize)> = hits.iter().map(|h| (h, self.scene.bounding_part(material_of(h)))).collect();
            let on = || hits.iter().map(|h| h.prim).collect::<Vec<u32>>();
            let (beyond, crossing) = cross(&self.scene, inside, ray.dir, &met);
            let seen = |hit: &Hit, eta: f64| {
                let ns = if ray.dir.dot(hit.ng) > 0.0 { -hit.ns } else { hit.ns };
                Some(Met { hit: Hit { ns, ..*hit }, material: material_of(hit), eta, beyond: beyond.clone(), on: on() })
            };
            // Of surfaces that coincide the boundaries of volumes come last. What is there of a mixture that is no glass is seen whatever the volumes.
            let is_mixed = |hit: &Hit| {
                let parts = self.scene.made_of(material_of(hit));
                parts.into_iter().any(|m| matches!(self.scene.materials[m], Material::Mix { .. }))
            };
            let others =
                met.iter().filter(|(hit, material)| self.scene.materials[*material].interior().is_none() || is_mixed(hit));
            if let Some((hit, _)) = others.into_iter().find(|(hit, _)| rng.next() < albedos[material_of(hit)].presence) {
                return seen(hit, 1.0);
            }
            if let Crossing::Interface { hit, near, far, .. } = crossing {
                // Beyond the film's range an index need not be known.
                let nm = self.scene.film.bins.nearest_nm(LINE_D_NM);
                let index = |interior: usize| self.scene.interiors[interior].ior.eval(nm);
                return seen(hit, index(far) / index(near));
            }
            let origin = hits.first()?.p;
            let (dir, on) = (ray.dir, on());
            (*ray, *inside) = (Ray { origin, dir, t_min: 0.0, on }, beyond);
        }
        None
    }
}
