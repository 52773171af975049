//! What a feature costs: a scene that has it, and one that has not, with the feature's code in its pipeline and without.

use super::Args;
use super::cases::{Case, measure};
use super::report::Report;
use super::scenes::cornell_box;
use crate::error::Result;
use crate::integrator::{Plan, Techniques};
use crate::scene::LoadOptions;
use serde_json::{Value, json};

/// The camera pass alone: what light paths cost is a question of methods.
const CAMERA: Techniques = Techniques {
    bsdf_sampling: true,
    next_event_estimation: true,
    light_paths: false,
    merging: false,
    guiding: false,
    adaptive_sampling: false,
    wavelength_sharing: true,
};

/// Measures all features.
pub fn run(args: &Args, report: &mut Report) -> Result<()> {
    let size = args.overrides.size.unwrap_or((256, 256));
    let options = LoadOptions { width: Some(size.0), height: Some(size.1), ..args.overrides.options() };
    let plain = cornell_box(&Value::Null, &options)?;
    let plan = Plan::new(&plain, CAMERA);
    let base = |limit| Case { name: "cornell_box".to_string(), scene: plain.clone(), plan: plan.clone(), base: 0, limit };
    // The first list's second case is the first one again: by so much ratios are off by chance.
    let (mut unused, mut used) = (vec![base(None), base(None)], vec![base(None)]);
    for (name, more) in features() {
        let scene = cornell_box(&more, &options)?;
        let plan = Plan::new(&scene, CAMERA);
        unused.push(Case { name: name.to_string(), scene: plain.clone(), plan: plan.clone(), base: 0, limit: None });
        used.push(Case { name: name.to_string(), scene, plan, base: 0, limit: None });
    }
    measure(args, "a plain scene with the code of a feature that it does not have", &unused, report)?;
    measure(args, "a scene with the feature", &used, report)
}

/// Features, and what brings each into the box.
fn features() -> Vec<(&'static str, Value)> {
    let ball = |material: Value| {
        json!({
            "materials": {"m": material, "mirror": {"conductor": {"metal": "Al"}}},
            "shapes": [{"sphere": {"center": [0.4, 0.36, 0.3], "radius": 0.35}, "material": "m"}],
        })
    };
    let fog = |medium: Value| json!({"media": {"fog": medium}, "surroundings": {"medium": "fog"}});
    let light = |light: Value| json!({"lights": [light]});
    vec![
        ("analytic shape", ball(json!({"diffuse": {"reflectance": 0.75}}))),
        ("smooth glass", ball(json!({"dielectric": {"ior": 1.7}}))),
        ("smooth glass with dispersion", ball(json!({"dielectric": {"ior": "N-SF11"}}))),
        ("smooth glass with absorption", ball(json!({"dielectric": {"ior": 1.7, "absorption": 1}}))),
        ("rough glass", ball(json!({"dielectric": {"ior": 1.7, "alpha": 0.2}}))),
        ("thin pane", ball(json!({"thin_dielectric": {"ior": 1.7}}))),
        ("mirror", ball(json!({"conductor": {"metal": "Al"}}))),
        ("rough metal", ball(json!({"conductor": {"metal": "Al", "alpha": 0.2}}))),
        ("mixture", ball(json!({"mix": {"a": "white", "b": "mirror", "weight": 0.5}}))),
        ("absorbing fog", fog(json!({"sigma_a": 0.1}))),
        ("scattering fog", fog(json!({"sigma_s": 0.1}))),
        ("point light", light(json!({"point": {"position": [0, 1.8, 0], "intensity": 1}}))),
        ("beam", light(json!({"beam": {"origin": [0, 1.8, 0], "direction": [0, -1, 0], "radius": 0.1, "irradiance": 1}}))),
        ("sun", light(json!({"sun": {"direction": [0, -1, -1], "angle_deg": 0.53, "irradiance": 1}}))),
        ("sky", light(json!({"constant": {"radiance": 1}}))),
        ("lens", json!({"camera": {"perspective": {"aperture_radius": 0.02, "focus_distance": 4.3}}})),
        ("Gaussian filter", json!({"film": {"filter": {"gaussian": {"sigma": 0.5}}}})),
    ]
}
