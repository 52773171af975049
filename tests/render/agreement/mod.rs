//! The GPU against the double-precision reference, and against renders made with other people's tools.
//!
//! References are stored in `data/reference`, one file for each scene, made by the estimator that the scene names; `tools/make-references`
//! makes them anew.

mod aov;
mod compare;
mod feature_scenes;
mod features;
mod furnace;
mod independent;
mod instances;
mod many_lights;
mod shipped;
mod techniques;
mod textures;

use std::time::Duration;

/// Not a test: what `tools/make-references` runs. `ABBE_REFERENCES` names scenes (all if empty), `ABBE_SECONDS` limits the time for each.
#[test]
#[ignore = "makes the stored references; run by tools/make-references"]
fn make_references() {
    let wanted = std::env::var("ABBE_REFERENCES").unwrap_or_default();
    let wanted: Vec<&str> = wanted.split_whitespace().collect();
    let seconds = std::env::var("ABBE_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(120);
    let all: Vec<_> = shipped::all().into_iter().chain(features::all()).collect();
    for name in &wanted {
        assert!(all.iter().any(|(n, _)| n == name), "there is no scene {name}");
    }
    for (name, scene) in all.iter().filter(|(n, _)| wanted.is_empty() || wanted.contains(n)) {
        compare::make_reference(name, &scene(), Duration::from_secs(seconds));
    }
}
