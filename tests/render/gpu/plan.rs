//! Only what a scene needs is compiled, and whatever it needs compiles.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::gpu::{Gpu, STORAGE_TEXTURES, kernel_source};
use abbe::integrator::{Feature, GpuIntegrator, Plan, Techniques};
use abbe::render::{Batch, Integrator};
use abbe::scene::{Geometry, Instance, Scene};
use glam::DAffine3;
use serde_json::{Value, json};
use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;
use wgpu::naga::{self, Function, Handle, ImageClass, Module, Statement, TypeInner};

/// Names and texts of all kernels of a scene. The length of the traversal's stack, which upload finds, is stood in for.
pub fn kernels(scene: &Scene) -> Vec<(&'static str, String)> {
    let plan = Plan::new(scene, Techniques::default());
    let constants = plan.constants()
        + "const BVH_STACK = 32u;\nconst TARGETS = 2u;\nconst TARGETS_NESTED = true;\nconst LENS_SURFACES = 8u;\nconst LENS_BOUNDS = 8u;\nconst LENS_AIR = 0u;\n";
    let mut roots = vec![("camera_paths.wgsl", plan.camera), ("update_film.wgsl", plan.camera), ("aov.wgsl", plan.aovs)];
    roots.extend(plan.light.map(|features| ("light_paths.wgsl", features)));
    roots.into_iter().map(|(root, features)| (root, kernel_source(root, &constants, &features.switches()).unwrap())).collect()
}

/// Choices of which a scene makes one each: (what it is called, what it adds to the scene).
fn axes() -> [Vec<Value>; 5] {
    let ball = |material: Value| json!({"materials": {"m": material}, "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"}]});
    let quad = json!({"corner": [-0.5, 3.9, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]});
    let lamp = |shape: &str, geometry: Value| json!({"shapes": [{shape: geometry, "emission": {"radiance": 1}}]});
    let materials = vec![
        json!({}),
        ball(json!({"diffuse": {"reflectance": 0.2}})),
        ball(json!({"dielectric": {"ior": 1.5}})),
        ball(json!({"dielectric": {"ior": "N-SF11"}})),
        ball(json!({"dielectric": {"ior": "N-SF11", "absorption": 1}})),
        ball(json!({"dielectric": {"ior": 1.5, "alpha": 0.2}})),
        ball(json!({"dielectric": {"ior": "N-SF11", "alpha": 0.2}})),
        ball(json!({"thin_dielectric": {"ior": 1.5}})),
        ball(json!({"thin_dielectric": {"ior": 1.5, "tint": 0.5, "roughness": 0.5, "anisotropy": {"strength": 0.5}}})),
        ball(json!({"thin_dielectric": {"ior": 1.5, "roughness": 0.5, "thin_film": {"thickness": 120, "ior": 1.3}}})),
        ball(json!({"thin_dielectric": {"ior": 1.5, "absorption": 100, "thickness": 0.01}})),
        ball(json!({"dielectric": {"ior": 1.5, "tint": [[400, 0.2], [700, 0.8]]}})),
        ball(json!({"diffuse_transmission": {"transmittance": 0.5}})),
        json!({"materials": {"m": {"dielectric": {"ior": 1.5, "tint": {"texture": "sky.png"}}}},
               "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]}),
        ball(json!({"conductor": {"metal": "Al"}})),
        ball(json!({"conductor": {"metal": "Al", "alpha": 0.3}})),
        ball(json!({"conductor": {"reflectance": 0.5, "alpha": 0.3}})),
        ball(json!({"sheen": {"of": "wall", "color": 0.5, "roughness": 0.5}})),
        json!({"materials": {"m": {"sheen": {"of": "n", "color": 0.5}}, "n": {"coated": {"of": "steel", "ior": 1.5, "alpha": 0.1}}, "steel": {"conductor": {"metal": "Fe"}}},
               "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"}]}),
        json!({"materials": {"m": {"conductor": {"metal": "Al", "alpha": 0.3, "anisotropy": {"strength": 0.5}}}},
               "shapes": [{"mesh": {"file": "square.obj", "smooth": true}, "material": "m"}]}),
        ball(json!({"thin_dielectric": {"ior": 1.33, "thickness": 400}})),
        ball(json!({"dielectric": {"ior": 1.5, "thin_film": {"thickness": 120, "ior": 1.3}}})),
        ball(json!({"conductor": {"metal": "Ti", "alpha": 0.3, "thin_film": {"thickness": 120, "ior": 2.5}}})),
        json!({"materials": {"m": {"coated": {"of": "wall", "ior": 1.5}}, "n": {"coated": {"of": "steel", "ior": "N-SF11", "alpha": 0.1}}, "steel": {"conductor": {"metal": "Fe"}}},
               "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"}, {"sphere": {"center": [0, 2, 0], "radius": 0.4}, "material": "n"}]}),
        json!({"materials": {"m": {"coated": {"of": "wall", "ior": 1.5, "roughness": {"texture": "sky.png"}}}},
               "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]}),
        json!({"materials": {"m": {"mix": {"a": "wall", "b": "n", "weight": 0.5}}, "n": {"conductor": {"metal": "Al"}}},
               "shapes": [{"mesh": {"file": "square.obj", "smooth": true}, "material": "m"}]}),
        json!({"materials": {"m": {"diffuse": {"reflectance": {"texture": "sky.png"}}}},
               "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]}),
        json!({"materials": {"m": {"diffuse": {"reflectance": {"texture": "pictures/acescg.exr"}}}, "n": {"diffuse": {"reflectance": {"texture": "pictures/reflectance.exr"}}}},
               "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"},
                          {"quad": {"corner": [0, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "n"}]}),
        json!({"shapes": [{"gltf": {"file": "bumpy.gltf"}}]}),
        json!({"materials": {"m": {"mix": {"a": "wall", "b": "n", "weight": {"texture": "sky.png"}}}, "n": {"boundary": {}}},
               "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]}),
        json!({"media": {"cloud": {"sigma_s": 1}}, "materials": {"m": {"boundary": {"medium": "cloud"}}},
               "shapes": [{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "m"}]}),
        ball(json!({"mix": {"a": "wall", "b": "n", "weight": 0.5}}))
            .as_object()
            .map(|o| {
                let mut v = Value::Object(o.clone());
                merge(&mut v, json!({"materials": {"n": {"boundary": {}}}}));
                v
            })
            .unwrap(),
        json!({"materials": {"m": {"dielectric": {"ior": 1.33}}, "n": {"dielectric": {"ior": "N-BK7", "priority": 2}}},
               "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"},
                          {"box": {"min": [0, 0.5, 0], "max": [1, 1.5, 1]}, "material": "n"}]}),
        many_volumes(),
    ];
    let lights = vec![
        lamp("quad", quad.clone()),
        json!({"shapes": [{"quad": quad, "emission": {"radiance": {"texture": "sky.png"}}}]}),
        lamp("sphere", json!({"center": [0, 3, 0], "radius": 0.2})),
        lamp("disc", json!({"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.2})),
        lamp("cylinder", json!({"base": [0, 3, 0], "top": [1, 3, 0], "radius": 0.1})),
        // Across the boundary of a volume, and in a wall.
        json!({"shapes": [{"quad": {"corner": [-1, 1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 0, 1]}, "emission": {"radiance": 1, "two_sided": true}},
                          {"quad": {"corner": [-1, 4, 0], "edge_u": [2, 0, 0], "edge_v": [0, 0, 1]}, "emission": {"radiance": 1}},
                          {"sphere": {"center": [0, 1, 0], "radius": 0.5}, "emission": {"radiance": 1}}]}),
        json!({"lights": [{"point": {"position": [0, 3, 0], "intensity": 1}}]}),
        json!({"lights": [{"spot": {"position": [0, 3, 0], "direction": [0, -1, 0], "intensity": 1, "inner_deg": 10, "outer_deg": 20}}]}),
        json!({"lights": [{"spot": {"position": [0, 3, 0], "direction": [0, -1, 0], "profile": "lamp.ies"}}]}),
        json!({"lights": [{"beam": {"origin": [0, 3, 0], "direction": [0, -1, 0], "radius": 0.1, "irradiance": 1}}]}),
        json!({"lights": [{"sun": {"direction": [1, -1, 0], "angle_deg": 0.53, "irradiance": 1}}]}),
        json!({"lights": [{"constant": {"radiance": 1}}]}),
        json!({"lights": [{"image": {"file": "sky.png"}}]}),
        json!({"lights": [{"image": {"file": "pictures/light.exr"}}]}),
        many_points(),
        json!({"lights": []}),
    ];
    let sensors = vec![
        json!({}),
        json!({"camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 1, 0], "vfov_deg": 40, "aperture_radius": 0.01, "focus_distance": 4}}}),
        json!({"camera": {"orthographic": {"eye": [0, 1, 4], "target": [0, 1, 0], "height": 2}}}),
        json!({"camera": {"irradiance_plane": {"origin": [-1, 0.1, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}}}),
        json!({"camera": {"irradiance_sphere": {"center": [0, 1, 0], "radius": 0.9}}}),
        json!({"camera": {"orthographic": {"eye": [0, 1, 0], "target": [0, 1, -1], "height": 2}}}),
        json!({"camera": {"irradiance_plane": {"origin": [-1, 1, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}}}),
    ];
    let media = vec![
        json!({}),
        json!({"media": {"fog": {"sigma_a": 0.1}}, "surroundings": {"medium": "fog"}}),
        json!({"media": {"fog": {"sigma_s": [[400, 0.1], [700, 0.2]], "g": 0.3}}, "surroundings": {"medium": "fog"}}),
    ];
    let films = vec![
        json!({"film": {"bins": 20}}),
        json!({"film": {"bins": 40, "filter": {"tent": {"radius": 1}}}}),
        json!({"film": {"bins": 1, "filter": {"gaussian": {"sigma": 0.5}}}}),
        json!({"film": {"bins": 6, "filter": "box"}}),
    ];
    [materials, lights, sensors, media, films]
}

/// More volumes within each other than a path has room for without need.
fn many_volumes() -> Value {
    let materials: serde_json::Map<String, Value> =
        (0..5).map(|i| (format!("m{i}"), json!({"dielectric": {"ior": 1.3, "priority": i}}))).collect();
    let ball =
        |i: u32| json!({"sphere": {"center": [0, 1, 0], "radius": 0.5 - 0.05 * f64::from(i)}, "material": format!("m{i}")});
    json!({"materials": materials, "shapes": (0..5).map(ball).collect::<Vec<_>>()})
}

/// So many lights near what they light that a grid pays.
fn many_points() -> Value {
    let at = |i: u32| [f64::from(i % 10) * 0.5 - 2.0, 0.2, f64::from(i / 10) * 0.5 - 2.0];
    json!({"lights": (0..100).map(|i| json!({"point": {"position": at(i), "intensity": 1}})).collect::<Vec<_>>()})
}

/// The scene with an instance for every mesh that is no lamp.
fn with_instances(mut scene: Scene) -> Scene {
    for shape in scene.shapes.iter_mut().filter(|s| s.emission.is_none()) {
        if let Geometry::Mesh(mesh) = &shape.geometry {
            shape.geometry = Geometry::Instance(Instance::new(mesh.clone(), DAffine3::IDENTITY));
        }
    }
    scene
}

/// Scenes such that each two choices of different axes meet in one of them.
fn pairwise() -> Vec<Scene> {
    let axes = axes();
    let mut met: HashSet<(usize, usize, usize, usize)> = HashSet::new();
    let mut scenes = Vec::new();
    let total = axes.iter().map(Vec::len).product::<usize>();
    let pairs: usize = (0..5).flat_map(|a| (a + 1..5).map(move |b| (a, b))).map(|(a, b)| axes[a].len() * axes[b].len()).sum();
    // All combinations in a scattered order (the stride is prime, so each comes up once), first those that bring much that is new.
    for (least, i) in [6, 3, 1].into_iter().flat_map(|least| (0..total).map(move |i| (least, i))) {
        let mut number = i * 7919 % total;
        let choice = axes.each_ref().map(|axis| {
            let c = number % axis.len();
            number /= axis.len();
            c
        });
        let new: Vec<_> = (0..5)
            .flat_map(|a| (a + 1..5).map(move |b| (a, b)))
            .map(|(a, b)| (a, b, choice[a], choice[b]))
            .filter(|p| !met.contains(p))
            .collect();
        if new.len() >= least {
            met.extend(new);
            let mut scene = json!({});
            axes.iter().zip(&choice).for_each(|(axis, &c)| merge(&mut scene, axis[c].clone()));
            scenes.push(scene_of(scene));
        }
    }
    assert_eq!(met.len(), pairs, "two choices never met");
    scenes
}

#[test]
fn kernels_of_all_combinations_are_valid_without_any_capability_and_bind_nothing_unused() {
    let mut scenes = pairwise();
    let shared: Vec<_> = scenes.iter().step_by(12).cloned().map(with_instances).collect();
    scenes.extend(shared);
    let has = |feature| scenes.iter().any(|s| Plan::new(s, Techniques::default()).has(feature));
    assert!(has(Feature::LightGrid) && has(Feature::Instances) && has(Feature::StartVolumes) && has(Feature::TouchedLights));
    scenes.extend(shipped_scenes().into_iter().map(|(_, scene)| scene));
    let (mut seen, mut idle) = (BTreeSet::new(), BTreeSet::new());
    for scene in &scenes {
        for (root, source) in kernels(scene) {
            if seen.insert(source.clone()) {
                let module = validate(root, &source);
                assert!(storage_textures(&module) <= STORAGE_TEXTURES, "{root} binds {}", storage_textures(&module));
                idle.extend(unused(&module).into_iter().map(|name| (root, name)));
            }
        }
    }
    assert!(idle.is_empty(), "bound for nothing: {idle:?}");
    assert!(seen.len() > 100, "{} different kernels", seen.len());
}

fn storage_textures(module: &Module) -> u32 {
    let is_one = |ty| matches!(module.types[ty].inner, TypeInner::Image { class: ImageClass::Storage { .. }, .. });
    module.global_variables.iter().filter(|(_, g)| is_one(g.ty)).count() as u32
}

/// A glass ball, a sun and lamps enough for a grid: the plan is one, whatever the numbers are.
fn of_one_plan(size: u32, balls: u32, lamps: u32) -> Scene {
    let at = |i: u32| [f64::from(i % 10) * 0.5 - 2.0, 0.2, f64::from(i / 10) * 0.5 - 2.0];
    let ball = |i: u32| json!({"sphere": {"center": [i, 1, 0], "radius": 0.3}, "material": "m"});
    scene_of(json!({
        "film": {"width": size, "height": size},
        "materials": {"m": {"dielectric": {"ior": 1.5}}},
        "shapes": (0..balls).map(ball).collect::<Vec<_>>(),
        "lights": (0..lamps)
            .map(|i| json!({"point": {"position": at(i), "intensity": 1}}))
            .chain([json!({"sun": {"direction": [1, -1, 0], "angle_deg": 0.53, "irradiance": 1}})])
            .collect::<Vec<_>>(),
    }))
}

#[test]
fn scenes_of_one_plan_share_compiled_kernels_and_each_has_its_own_picture() {
    let (first, second) = (of_one_plan(8, 3, 100), of_one_plan(16, 3, 130));
    let plan = |scene: &Scene| Plan::new(scene, Techniques::default());
    assert!(plan(&first).has(Feature::LightGrid) && plan(&first).has(Feature::Merging));
    let gpu = Arc::new(Gpu::open(None).unwrap());
    let picture = |gpu: &Arc<Gpu>, scene: &Scene| {
        let mut film = Film::new(&scene.film);
        let mut integrator = GpuIntegrator::on(gpu.clone(), scene, 1, plan(scene)).unwrap();
        integrator.render_batch(abbe::render::Batch::even(0, 2), &mut film).unwrap();
        film.xyz_image()
    };
    picture(&gpu, &first);
    // camera_paths, update_film and light_paths.
    assert_eq!(gpu.compilations(), 3);
    let shared = picture(&gpu, &second);
    assert_eq!(gpu.compilations(), 3, "compiled again");
    assert!(shared.iter().all(|xyz| xyz[1] > 0.0));
    assert_eq!(shared, picture(&Arc::new(Gpu::open(None).unwrap()), &second));
}

/// Resources that nothing `main` reaches names: a kernel's bindings are made from all that its text declares.
fn unused(module: &Module) -> Vec<String> {
    let mut reached: HashSet<Handle<Function>> = HashSet::new();
    let mut globals: HashSet<Handle<naga::GlobalVariable>> = HashSet::new();
    let mut todo = vec![&module.entry_points[0].function];
    while let Some(function) = todo.pop() {
        globals.extend(function.expressions.iter().filter_map(|(_, e)| match e {
            naga::Expression::GlobalVariable(g) => Some(*g),
            _ => None,
        }));
        calls(&function.body, &mut |callee| {
            if reached.insert(callee) {
                todo.push(&module.functions[callee]);
            }
        });
    }
    let resources = module.global_variables.iter().filter(|(handle, g)| g.binding.is_some() && !globals.contains(handle));
    resources.filter_map(|(_, g)| g.name.clone()).collect()
}

fn calls(block: &naga::Block, visit: &mut dyn FnMut(Handle<Function>)) {
    for statement in block.iter() {
        match statement {
            Statement::Call { function, .. } => visit(*function),
            Statement::Block(inner) => calls(inner, visit),
            Statement::If { accept, reject, .. } => [accept, reject].into_iter().for_each(|b| calls(b, visit)),
            Statement::Switch { cases, .. } => cases.iter().for_each(|c| calls(&c.body, visit)),
            Statement::Loop { body, continuing, .. } => [body, continuing].into_iter().for_each(|b| calls(b, visit)),
            _ => {}
        }
    }
}

fn shader_text(path: &str) -> String {
    std::fs::read_to_string(project().join("shaders").join(path)).unwrap()
}

/// Functions declared in these files of `shaders/`.
fn functions_of(files: &[&str]) -> Vec<String> {
    let text: String = files.iter().map(|f| shader_text(f)).collect();
    let names: Vec<String> =
        text.lines().filter_map(|l| l.strip_prefix("fn ")).map(|l| l[..l.find('(').unwrap()].to_string()).collect();
    assert!(!names.is_empty(), "{files:?}");
    names
}

/// Names of functions and resources in all kernels of the scene.
fn names(scene: &Scene) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for (root, source) in kernels(scene) {
        let module = validate(root, &source);
        all.extend(module.functions.iter().filter_map(|(_, f)| f.name.clone()));
        all.extend(module.global_variables.iter().filter(|(_, g)| g.binding.is_some()).filter_map(|(_, g)| g.name.clone()));
    }
    all
}

#[test]
fn shaders_ask_for_declared_features_and_each_is_asked_for() {
    let mut declared: BTreeSet<&str> = Feature::ALL.iter().map(|f| f.wgsl()).collect();
    assert_eq!(declared.len(), Feature::ALL.len(), "two features have one name");
    declared.extend(abbe::develop::gpu::FEATURES);
    let asked = abbe::gpu::shader::features_asked_for();
    let unknown: Vec<_> = asked.iter().filter(|(name, _)| !declared.contains(*name)).collect();
    assert!(unknown.is_empty(), "not declared: {unknown:?}");
    let idle: Vec<_> = declared.iter().filter(|name| !asked.contains_key(*name)).collect();
    assert!(idle.is_empty(), "no shader asks for {idle:?}");
}

#[test]
fn there_is_no_term_or_buffer_for_what_a_scene_does_not_contain() {
    let lamp = json!({"shapes": [{"quad": {"corner": [-0.5, 3.9, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}, "emission": {"radiance": 1}}]});
    let with = |more: Value| {
        let mut scene = lamp.clone();
        merge(&mut scene, more);
        names(&scene_of(scene))
    };
    let ball = |material: Value| json!({"materials": {"m": material}, "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"}]});
    let plain = with(json!({}));
    // What brings it in, files of which nothing is there without it, and resources likewise.
    let cases: &[(Value, &[&str], &[&str])] = &[
        (ball(json!({"diffuse": {"reflectance": 0.2}})), &["geometry/intersect_quadric.wgsl"], &[]),
        (
            ball(json!({"dielectric": {"ior": "N-SF11"}})),
            &["medium/interiors.wgsl", "bsdf/fresnel.wgsl", "bsdf/dielectric.wgsl"],
            &["interiors", "splats"],
        ),
        (
            json!({"media": {"fog": {"sigma_s": 1}}, "surroundings": {"medium": "fog"}}),
            &["medium/homogeneous.wgsl"],
            &["interiors"],
        ),
        (ball(json!({"conductor": {"metal": "Al", "alpha": 0.3}})), &["bsdf/ggx.wgsl", "bsdf/conductor.wgsl"], &["tables"]),
        (
            json!({"materials": {"m": {"coated": {"of": "wall", "ior": 1.5}}}, "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "m"}]}),
            &["bsdf/coat.wgsl"],
            &["tables"],
        ),
        (ball(json!({"thin_dielectric": {"ior": 1.33, "thickness": 400}})), &["bsdf/thin_film.wgsl"], &[]),
        (json!({"lights": [{"image": {"file": "sky.png"}}]}), &["light/environment.wgsl"], &["environment"]),
        (
            ball(json!({"conductor": {"metal": "Al"}})),
            &["light/emit.wgsl", "light/aim.wgsl", "light/guide.wgsl", "sensor/connect.wgsl", "path/merge.wgsl"],
            &["splats", "points", "heads", "guide", "guiding_samples"],
        ),
        (
            json!({"materials": {"m": {"dielectric": {"ior": 1.5}}}, "shapes": [{"sphere": {"center": [0, 1, 4], "radius": 0.5}, "material": "m"}],
                   "camera": {"orthographic": {"eye": [0, 1, 4], "target": [0, 1, 0], "height": 2}}}),
            &["medium/start.wgsl"],
            &["interiors"],
        ),
        (json!({"film": {"bins": 40}}), &[], &["wavelength_bins"]),
        (
            json!({"materials": {"m": {"diffuse": {"reflectance": {"texture": "sky.png"}}}},
                   "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]}),
            &["geometry/texture.wgsl"],
            &["textures"],
        ),
        (json!({"shapes": [{"mesh": {"file": "square.obj", "smooth": true}, "material": "wall"}]}), &[], &["normals"]),
    ];
    for (more, files, resources) in cases {
        let there = with(more.clone());
        for resource in *resources {
            assert!(!plain.contains(*resource), "{resource} without need");
            assert!(there.contains(*resource), "{resource} is missing with {more}");
        }
        for file in *files {
            let functions = functions_of(&[file]);
            let early: Vec<_> = functions.iter().filter(|f| plain.contains(*f)).collect();
            assert!(early.is_empty(), "{early:?} of {file} without need");
            assert!(functions.iter().any(|f| there.contains(f)), "nothing of {file} with {more}");
        }
    }
    // One of a kind leaves out its neighbours.
    let glass = with(ball(json!({"dielectric": {"ior": 1.5}})));
    assert!(!glass.contains("choose_hero"), "dispersion of glass that has none");
    assert!(!glass.contains("sample_rough_dielectric") && glass.contains("sample_smooth_dielectric"));
    assert!(!glass.contains("sample_free_flight") && !glass.contains("sample_hg"), "fog where there is none");
    assert!(with(ball(json!({"dielectric": {"ior": "N-SF11"}}))).contains("choose_hero"));
    assert!(!glass.contains("count_path") && !glass.contains("report_counts"), "counting that nobody asked for");
    let dark = names(&scene_of(json!({})));
    assert!(!dark.contains("lights") && !dark.contains("sample_light"), "lights where there are none");
    assert!(plain.contains("lights") && plain.contains("sample_light"));
}

#[test]
fn surfaces_without_number_in_one_place_are_an_error_and_not_for_ever() {
    let mut scene = scene_of(
        json!({"shapes": [{"quad": {"corner": [0, 1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "wall"}]}),
    );
    let square = scene.shapes.last().expect("a square").clone();
    scene.shapes.extend(std::iter::repeat_n(square, 8192));
    let error = adapter::integrator(&scene, 0).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("surfaces lie in one place") && error.contains("remove the copies"), "{error}");
}

#[test]
fn copies_of_a_surface_change_no_bit() {
    let pixels = |copies: usize| -> Vec<Vec<f64>> {
        let mut scene = scene_of(json!({
            "materials": {"glass": {"dielectric": {"ior": 1.5}}},
            "shapes": [{"quad": {"corner": [-1, 0.5, 1], "edge_u": [2, 0, 0], "edge_v": [0, 1.5, 0]}, "material": "glass"}],
        }));
        let Some(Geometry::Mesh(mesh)) = scene.shapes.last_mut().map(|shape| &mut shape.geometry) else { panic!("a mesh") };
        let mesh = Arc::make_mut(mesh);
        mesh.uvs.clear();
        mesh.triangles = mesh.triangles.repeat(copies);
        let mut film = Film::new(&scene.film);
        let stats = adapter::integrator(&scene, 0).unwrap().render_batch(Batch::even(0, 2), &mut film).unwrap();
        assert_eq!(stats.dropped(), 0, "{copies} copies: {stats:?}");
        (0..film.pixels()).map(|pixel| film.pixel(pixel).to_vec()).collect()
    };
    assert!(pixels(1) == pixels(6000));
}

#[test]
fn shadow_rays_look_at_volumes_only_where_light_goes_through_one_unbent() {
    let looks = |around: &str, first: &str, second: &str, x: f64| {
        let ior = |text: &str| serde_json::from_str::<Value>(text).unwrap();
        let ball = |x: f64, material: &str| json!({"sphere": {"center": [x, 1, 0], "radius": 0.5}, "material": material});
        let scene = scene_of(json!({
            "surroundings": {"ior": ior(around)},
            "materials": {"first": {"dielectric": {"ior": ior(first)}}, "second": {"dielectric": {"ior": ior(second)}}},
            "shapes": [ball(-0.75, "first"), ball(x, "second")],
        }));
        Plan::new(&scene, Techniques::default()).has(Feature::PassThrough)
    };
    // Neither of the index around it nor near each other.
    assert!(!looks("1", "1.5", "1.33", 0.75));
    assert!(!looks("1", "1.5", "1.5", 0.75));
    assert!(!looks("1", "1.5", "1.00001", 0.75));
    assert!(!looks("1.33", "1", "1.5", 0.75));
    // Indices are alike whatever formula they come from.
    assert!(looks("1", "1.5", "1", 0.75));
    assert!(looks("1", "1.5", "1.0000001", 0.75));
    assert!(looks("1.33", r#"{"cauchy": [1.33, 0]}"#, "1.5", 0.75));
    assert!(looks(r#"{"table": [[300, 1.33], [900, 1.33]]}"#, "1.33", "1.5", 0.75));
    assert!(looks(r#""N-BK7""#, "1.5", r#""N-BK7""#, 0.75));
    // Or in contact, at one point.
    assert!(looks("1", "1.5", r#"{"cauchy": [1.5, 0]}"#, 0.25));
    assert!(!looks("1", "1.5", "1.33", 0.2500001));
}
