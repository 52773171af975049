//! The scene loader: what it promises of good scenes, bad scenes and hostile ones.

mod advice;
mod animation;
mod compressed;
mod geometry;
mod gltf;
mod grain;
mod instances;
mod khronos;
mod lenses;
mod looks;
mod malformed;
mod measured;
mod meshes;
mod pictures;
mod profiles;
#[path = "../support/random.rs"]
mod random;
mod sheen;
mod sky;
mod spectra;
mod textures;
mod traps;
mod units;
mod valid;
mod volumes;

use abbe::scene::{LoadOptions, Scene, keys, load, load_str};
use abbe::{Error, Result};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A folder of the project.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Every scene that ships.
fn shipped() -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = ["scenes", "scenes/compare"]
        .iter()
        .flat_map(|f| std::fs::read_dir(folder(f)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "json") && !p.ends_with("scene.schema.json"))
        .collect();
    all.sort();
    all
}

/// Loads scene text whose files lie in tests/data/scenes.
fn load_text(text: &str) -> Result<Scene> {
    load_str(text, Path::new("test.json"), &folder("tests/data/scenes"), &LoadOptions::default())
}

/// A small good scene with one key replaced.
fn scene_with(key: &str, value: &str) -> String {
    let good = [
        ("film", r#"{"width": 8, "height": 8}"#),
        ("camera", r#"{"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}}"#),
        ("materials", r#"{"m": {"diffuse": {"reflectance": 0.5}}}"#),
        ("shapes", r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#),
    ];
    let mut members: Vec<String> = good.iter().filter(|(k, _)| *k != key).map(|(k, v)| format!("\"{k}\": {v}")).collect();
    members.push(format!("\"{key}\": {value}"));
    format!("{{{}}}", members.join(", "))
}

/// The good scene with these shapes.
fn with_shapes(shapes: &str) -> Scene {
    load_text(&scene_with("shapes", shapes)).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_shipped_scene_loads_without_a_note() {
    let scenes = shipped();
    assert!(scenes.len() >= 16, "{} scenes", scenes.len());
    for path in scenes {
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.name, path.file_stem().unwrap().to_string_lossy());
        assert!(!scene.lights.is_empty() || scene.shapes.iter().any(|s| s.emission.is_some()), "{} has no lamp", scene.name);
        assert_eq!(scene.notes, Vec::<String>::new(), "{}", scene.name);
    }
}

#[test]
fn the_schema_has_exactly_the_keys_that_the_parser_accepts() {
    let text = std::fs::read_to_string(folder("scenes/scene.schema.json")).unwrap();
    let schema: Value = serde_json::from_str(&text).unwrap();
    let defs = schema["$defs"].as_object().unwrap();
    for (kind, keys) in keys::all() {
        let properties = defs.get(kind).and_then(|d| d["properties"].as_object()).unwrap_or_else(|| panic!("no $defs.{kind}"));
        let of_schema: BTreeSet<&str> = properties.keys().map(String::as_str).collect();
        assert_eq!(of_schema, keys.iter().copied().collect::<BTreeSet<&str>>(), "{kind}");
        assert_eq!(defs[kind]["additionalProperties"], Value::Bool(false), "{kind}");
    }
    for (name, def) in defs {
        if def.get("properties").is_some() {
            assert!(keys::all().any(|(kind, _)| kind == name), "the parser knows no {name}");
        }
    }
}

#[test]
fn options_override_the_file() {
    let options =
        LoadOptions { width: Some(12), height: Some(7), channels: Some(5), max_depth: Some(3), ..LoadOptions::default() };
    let scene = load(&folder("scenes/newton.json"), &options).unwrap();
    assert_eq!((scene.film.width, scene.film.height, scene.film.bins.count, scene.max_depth), (12, 7, 5, 3));
    for bad in [
        LoadOptions { width: Some(0), ..options.clone() },
        LoadOptions { channels: Some(401), ..options.clone() },
        LoadOptions { height: Some(70_000), ..options.clone() },
    ] {
        assert!(matches!(load(&folder("scenes/newton.json"), &bad), Err(Error::Usage { .. })));
    }
}

#[test]
fn missing_and_unreadable_scene_files_are_errors() {
    for path in ["scenes/none.json", "scenes", "scenes/bunny.glb/x"] {
        assert!(matches!(load(&folder(path), &LoadOptions::default()), Err(Error::File { .. })), "{path}");
    }
}

#[test]
fn the_hash_of_a_scene_covers_every_file_that_it_includes() {
    let here = std::env::temp_dir().join(format!("abbe-hash-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let hash = |text: &str, green: &str| {
        std::fs::write(here.join("scene.json"), text).unwrap();
        std::fs::write(here.join("green.txt"), green).unwrap();
        load(&here.join("scene.json"), &LoadOptions::default()).unwrap().source_hash
    };
    let text = scene_with("materials", r#"{"m": {"diffuse": {"reflectance": {"file": "green.txt"}}}}"#);
    let (a, b) = ("400 0.1\n700 0.2\n", "400 0.1\n700 0.3\n");
    let first = hash(&text, a);
    assert_eq!(first, hash(&text, a));
    assert_ne!(first, hash(&text, b), "another spectrum");
    assert_ne!(first, hash(&(text.clone() + " "), a), "another text");
    // The buffer of a glTF file counts as well.
    for file in ["scenes/bunny.glb", "scenes/newton.json"] {
        assert_ne!(load(&folder(file), &LoadOptions::default()).unwrap().source_hash, 0, "{file}");
    }
    std::fs::remove_dir_all(&here).unwrap();
}

#[test]
fn a_path_that_leaves_the_folder_is_refused_unless_allowed() {
    let here = std::env::temp_dir().join(format!("abbe-scene-{}", std::process::id()));
    let inside = here.join("inside");
    std::fs::create_dir_all(inside.join("deep")).unwrap();
    let ply = folder("scenes/compare/newton/lamp.ply");
    std::fs::copy(&ply, here.join("outside.ply")).unwrap();
    std::fs::copy(&ply, inside.join("inside.ply")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(here.join("outside.ply"), inside.join("link.ply")).unwrap();
    let attempt = |file: &str, allow_outside: bool| {
        let text = scene_with("shapes", &format!(r#"[{{"mesh": {{"file": {file:?}}}, "material": "m"}}]"#));
        load_str(&text, Path::new("test.json"), &inside, &LoadOptions { allow_outside, ..LoadOptions::default() })
    };
    let absolute = here.join("outside.ply").to_string_lossy().into_owned();
    let mut leaving = vec!["../outside.ply", "deep/../../outside.ply", absolute.as_str()];
    if cfg!(unix) {
        leaving.push("link.ply");
    }
    for file in leaving {
        let line = attempt(file, false).unwrap_err().to_string();
        assert!(line.contains("$.shapes[0].mesh.file") && line.contains("--allow-outside"), "{line}");
        attempt(file, true).unwrap_or_else(|e| panic!("{e}"));
    }
    let line = attempt("../no such.ply", false).unwrap_err().to_string();
    assert!(line.contains("--allow-outside"), "it tells what is outside: {line}");
    attempt("inside.ply", false).unwrap();
    attempt("deep/../inside.ply", false).unwrap();
    std::fs::remove_dir_all(&here).unwrap();
}
