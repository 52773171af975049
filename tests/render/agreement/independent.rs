//! The GPU against renders by another program, which shares no code with ours; their source is in the files' heads.
//!
//! Compared is what the camera sees of diffuse surfaces, and of the pool all of it, seen through water. Where the Sun glitters on the water both errors
//! are too large to count.

use super::compare::{BLOCKS, Batches, Figure, Pair, agree, gpu};
use super::shipped::shipped;
use abbe::film::Film;
use abbe::reference::ReferenceIntegrator;
use abbe::render::Integrator;
use abbe::scene::{Emission, Estimator, Material, Scene};
use abbe::spectrum::Spectrum;
use serde_json::Value;
use std::path::Path;

/// A pixel of ours is 64 of theirs, of which each has one difference of two halves.
const DOF: f64 = 64.0;
const BINS: usize = 20;

/// `[pixel][bin]`, of 16 x 16 pixels.
fn read(name: &str) -> Vec<Vec<Figure>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/independent").join(format!("{name}.json"));
    let value: Value = serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON");
    let numbers = |v: &Value| v.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect::<Vec<_>>();
    let rows = |key: &str| value[key].as_array().expect("a list").iter().map(numbers).collect::<Vec<_>>();
    let figure = |(&mean, &error): (&f64, &f64)| Figure { mean, error, dof: DOF };
    rows("mean").iter().zip(rows("error")).map(|(m, e)| m.iter().zip(&e).map(figure).collect()).collect()
}

/// Pixels that see nothing smooth: the scene with everything smooth shining and all else dark shows them black.
fn sees_only_diffuse(scene: &Scene) -> Vec<usize> {
    let mut s = scene.clone();
    (s.max_depth, s.reference) = (1, Estimator::Backward);
    s.materials.push(Material::Diffuse { reflectance: Spectrum::Constant(0.0).into() });
    for shape in &mut s.shapes {
        let smooth = match &s.materials[shape.material] {
            Material::Dielectric { alpha, .. } | Material::Conductor { alpha, .. } => *alpha == 0.0,
            _ => false,
        };
        shape.emission = smooth.then_some(Emission { radiance: Spectrum::Constant(1.0).into(), two_sided: true });
        shape.material = s.materials.len() - 1;
    }
    let mut film = Film::new(&s.film);
    let mut integrator = ReferenceIntegrator::new(&s, Estimator::Backward, 0).expect("a scene");
    integrator.render_batch(abbe::render::Batch::even(0, 1024), &mut film).expect("a batch");
    (0..film.pixels()).filter(|&p| film.bin(p, 0) == 0.0).collect()
}

/// Mean of independent figures.
fn mean(figures: &[Figure]) -> Figure {
    let n = figures.len() as f64;
    let error = figures.iter().map(|f| f.error.powi(2)).sum::<f64>().sqrt() / n;
    Figure { mean: figures.iter().map(|f| f.mean).sum::<f64>() / n, error, dof: DOF * n }
}

/// Every bin over the chosen pixels, and every bin of each block of them; half of the comparisons must count, by errors of up to `coarseness` times the
/// usual ones.
fn compare(name: &str, chosen: fn(&Scene) -> Vec<usize>, spp: u32, coarseness: f64) {
    let theirs = read(name);
    let scene = shipped(&format!("compare/{name}.json"), BINS as u32);
    let chosen = chosen(&scene);
    println!("{name}: {} of {} pixels are compared", chosen.len(), theirs.len());
    let ours: Batches = gpu(&scene, 2, spp);
    let (width, size) = (scene.film.width as usize, (scene.film.width / BLOCKS) as usize);
    let blocks = (0..(BLOCKS * BLOCKS) as usize).map(|block| {
        let of = |p: &&usize| **p % width / size + **p / width / size * BLOCKS as usize == block;
        (format!("block {block}"), chosen.iter().filter(of).copied().collect::<Vec<usize>>(), 0.01 * coarseness)
    });
    let regions = std::iter::once(("image".to_string(), chosen.clone(), 0.003 * coarseness)).chain(blocks);
    let mut pairs = Vec::new();
    for (region, pixels, small) in regions.filter(|(_, pixels, _)| pixels.len() >= 4) {
        for bin in 0..BINS {
            let theirs = mean(&pixels.iter().map(|&p| theirs[p][bin]).collect::<Vec<_>>());
            pairs.push(Pair { what: format!("{region} bin {bin}"), ours: ours.over_pixels(&pixels, bin), theirs, small });
        }
    }
    agree(name, &pairs, 0.5);
}

#[test]
fn cornell_spheres_is_as_mitsuba_shows_it() {
    compare("cornell_spheres", sees_only_diffuse, 60, 1.0);
}

#[test]
fn nephroid_is_as_mitsuba_shows_it() {
    compare("nephroid", sees_only_diffuse, 20, 1.0);
}

#[test]
fn pool_is_as_mitsuba_shows_it() {
    // Not where the Sun's mirror image glitters, which both find by chance: there the bins of these pixels differ by factors (by a fifth at most elsewhere),
    // and errors from the scatter of a few bright dots say nothing.
    let steady = |_: &Scene| {
        let is_steady = |bins: &[Figure]| {
            let mut means: Vec<f64> = bins.iter().map(|f| f.mean).collect();
            means.sort_by(f64::total_cmp);
            means[means.len() - 1] <= 1.5 * means[means.len() / 2]
        };
        let theirs = read("pool");
        (0..theirs.len()).filter(|&p| is_steady(&theirs[p])).collect()
    };
    compare("pool", steady, 64, 10.0);
}
