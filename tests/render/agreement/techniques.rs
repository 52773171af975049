//! Whatever technique is left out, the others still sum up to the truth: each subset is held to the same stored reference.

use super::compare::techniques_agree_with_reference;
use super::{features, shipped};
use abbe::integrator::Techniques;
use abbe::scene::Scene;

/// The name of a stored reference, with its scene.
fn of(name: &str) -> Scene {
    let mut all = shipped::all().into_iter().chain(features::all());
    all.find(|(n, _)| *n == name).expect("a scene of this name").1()
}

macro_rules! subsets {
    ($($test:ident, $name:expr, $spp:expr, $coarseness:expr, $without:ident $(, $more:ident)*;)*) => {
        $(#[test]
        fn $test() {
            let techniques = Techniques { $without: false, $($more: false,)* ..Techniques::default() };
            techniques_agree_with_reference($name, &of($name), $spp, $coarseness, techniques);
        })*
    };
}

// Test, scene, samples per pixel in each batch, coarseness of the errors that count, techniques left out.
subsets! {
    glass_without_gathering, "cornell_spheres", 128, 1.0, gathering;
    glass_without_joints, "cornell_spheres", 128, 1.0, light_paths;
    glass_without_light_paths_of_any_kind, "cornell_spheres", 128, 1.0, light_paths, gathering;
    glass_without_guiding, "cornell_spheres", 128, 1.6, guiding;
    glass_without_light_samples, "cornell_spheres", 128, 1.6, light_samples;
    glass_without_adaptive_sampling, "cornell_spheres", 128, 1.0, adaptive_sampling;
    brushed_metal_without_light_paths, "brushed_metals", 96, 1.0, light_paths, gathering;
    brushed_metal_without_light_samples, "brushed_metals", 96, 1.6, light_samples;
    sheen_without_light_paths, "sheens_over_all_kinds", 96, 1.0, light_paths, gathering;
    sheen_without_light_samples, "sheens_over_all_kinds", 96, 1.6, light_samples;
    gathering_alone, "floor_seen_through_glass", 320, 6.0, chance_hits, light_samples;
    rough_glass_without_gathering, "rough_glass_little", 160, 1.0, gathering;
    rough_glass_without_joints, "rough_glass_little", 160, 1.0, light_paths;
    rough_glass_without_light_paths_of_any_kind, "rough_glass_little", 160, 1.0, light_paths, gathering;
}
