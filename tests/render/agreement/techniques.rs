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
    ($($(#[$soak:meta])? $test:ident, $name:expr, $spp:expr, $coarseness:expr, $without:ident $(, $more:ident)*;)*) => {
        $(#[test]
        $(#[$soak])?
        fn $test() {
            let techniques = Techniques { $without: false, $($more: false,)* ..Techniques::default() };
            techniques_agree_with_reference($name, &of($name), $spp, $coarseness, techniques);
        })*
    };
}

// Test, scene, samples per pixel in each batch, coarseness of the errors that count, techniques left out.
subsets! {
    glass_without_merging, "cornell_spheres", 48, 1.0, merging;
    #[ignore = "long: in tools/soak"] a_lens_without_connections, "through_the_surfaces_of_a_lens", 144, 1.0, light_paths;
    #[ignore = "long: in tools/soak"] a_lens_without_next_event_estimation, "through_the_surfaces_of_a_lens", 120, 1.6, next_event_estimation;
    #[ignore = "long: in tools/soak"] glass_without_connections, "cornell_spheres", 56, 1.0, light_paths;
    glass_without_light_paths_of_any_kind, "cornell_spheres", 32, 1.0, light_paths, merging;
    glass_without_guiding, "cornell_spheres", 16, 1.6, guiding;
    glass_without_next_event_estimation, "cornell_spheres", 32, 1.6, next_event_estimation;
    glass_without_adaptive_sampling, "cornell_spheres", 32, 1.0, adaptive_sampling;
    dispersed_glass_without_wavelength_sharing, "cornell_spheres_dispersed", 32, 1.0, wavelength_sharing;
    brushed_metal_without_light_paths, "brushed_metals", 40, 1.0, light_paths, merging;
    #[ignore = "long: in tools/soak"] brushed_metal_without_next_event_estimation, "brushed_metals", 24, 1.6, next_event_estimation;
    #[ignore = "long: in tools/soak"] sheen_without_light_paths, "sheens_over_all_kinds", 24, 1.0, light_paths, merging;
    #[ignore = "long: in tools/soak"] sheen_without_next_event_estimation, "sheens_over_all_kinds", 16, 1.6, next_event_estimation;
    #[ignore = "long: in tools/soak"] maps_of_normals_without_light_paths, "maps_of_normals", 48, 1.0, light_paths, merging;
    #[ignore = "long: in tools/soak"] maps_of_normals_without_next_event_estimation, "maps_of_normals", 48, 1.6, next_event_estimation;
    #[ignore = "long: in tools/soak"] merging_alone, "floor_seen_through_glass", 40, 3.0, bsdf_sampling, next_event_estimation;
    #[ignore = "long: in tools/soak"] rough_glass_without_merging, "rough_glass_little", 32, 1.0, merging;
    rough_glass_without_connections, "rough_glass_little", 32, 1.0, light_paths;
    #[ignore = "long: in tools/soak"] rough_glass_without_light_paths_of_any_kind, "rough_glass_little", 32, 1.0, light_paths, merging;
}
