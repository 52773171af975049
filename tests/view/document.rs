//! What a document keeps of its file, and what edits, undo and saving do to it.

use super::{Folder, SCENE};
use abbe::scene::{LoadOptions, Scene, Sensor};
use abbe::view::document::{Document, Edit};
use serde_json::{Value, json};

fn open(folder: &Folder) -> (Document, Scene) {
    let path = folder.file("small.json", SCENE);
    Document::open(&path, LoadOptions::default()).expect("a scene")
}

fn edit(path: &[&str], value: Value) -> Edit {
    Edit { path: path.iter().map(|key| key.to_string()).collect(), value }
}

fn index_of_glass(scene: &Scene) -> f64 {
    scene.interiors.last().expect("the ball").ior.eval(587.56)
}

#[test]
fn edits_are_made_taken_back_and_made_again() {
    let folder = Folder::new("edits");
    let (mut document, scene) = open(&folder);
    assert!((index_of_glass(&scene) - 1.5168).abs() < 1e-4);
    let ior = ["materials", "glass", "dielectric", "ior"];
    let flint = document.edit(edit(&ior, json!("N-SF11")), false).expect("flint");
    assert!((index_of_glass(&flint) - 1.7847).abs() < 1e-4, "{}", index_of_glass(&flint));
    // What a slider passes on its way is one step.
    for (i, n) in [1.6, 1.7, 1.8].into_iter().enumerate() {
        document.edit(edit(&ior, json!(n)), i > 0).expect("an index");
    }
    assert_eq!(document.edits(), (2, 0));
    assert!((index_of_glass(&document.undo(false).expect("one").expect("flint")) - 1.7847).abs() < 1e-4);
    assert!((index_of_glass(&document.undo(false).expect("one").expect("crown")) - 1.5168).abs() < 1e-4);
    assert!(document.undo(false).is_none() && !document.is_changed());
    assert!((index_of_glass(&document.undo(true).expect("one").expect("flint")) - 1.7847).abs() < 1e-4);
}

#[test]
fn an_edit_that_makes_no_scene_changes_nothing() {
    let folder = Folder::new("refused");
    let (mut document, _) = open(&folder);
    let before = document.json();
    for (path, value) in [
        (&["materials", "glass", "dielectric", "ior"][..], json!("N-BK77")),
        (&["materials", "glass", "dielectric", "ior"], json!({"file": "/etc/passwd"})),
        (&["materials", "floor", "diffuse", "reflectance"], json!(7)),
        (&["shapes", "9", "emission"], json!({})),
        (&["shapes", "0", "mesh", "file"], json!("../other.obj")),
        (&["$schema"], json!("x")),
        (&[], json!({})),
    ] {
        let done = document.edit(edit(path, value.clone()), false);
        assert!(done.is_err() || document.json() == before, "{path:?} {value}");
        assert_eq!(document.json(), before, "{path:?} {value}");
    }
    assert_eq!(document.edits().0, 0);
}

#[test]
fn a_saved_scene_is_beside_its_file_loads_the_same_and_writes_over_nothing() {
    let folder = Folder::new("saved");
    let (mut document, _) = open(&folder);
    document.edit(edit(&["lights"], json!([{"constant": {"radiance": 0.1}}])), false).expect("a light");
    let camera = json!({"perspective": {"eye": [1.5, 1.25, 3.75], "target": [0, 0.5, 0], "vfov_deg": 33.3}});
    let Sensor::Perspective { eye, .. } = document.look(Some(camera)).expect("a camera") else { panic!("no camera") };
    assert_eq!(eye.to_array(), [1.5, 1.25, 3.75]);
    let name = document.free_name();
    let path = document.save(&name).expect("saved");
    assert_eq!(path, folder.0.join("small-edited.json"));
    let text = std::fs::read_to_string(&path).expect("a file");
    assert!(text.contains("kept as it is"), "comments stay");
    let again = Document::open(&path, LoadOptions::default()).expect("a scene");
    assert_eq!(again.0.json(), document.json());
    assert_eq!(format!("{:?}", again.1.sensor), format!("{:?}", document.scene().expect("a scene").sensor));
    for name in ["small-edited", "small", "../up", "a/b", "", ".hidden", "c:\\x", "x\0y", "/elsewhere/x"] {
        assert!(document.save(name).is_err(), "{name:?}");
    }
    assert_eq!(document.free_name(), "small-edited-2");
    assert_eq!(std::fs::read_to_string(folder.0.join("small.json")).expect("the file"), SCENE);
}

#[test]
fn a_file_that_changes_is_read_anew_with_camera_and_edits_kept() {
    let folder = Folder::new("reload");
    let (mut document, _) = open(&folder);
    assert!(!document.is_outdated());
    let camera = json!({"perspective": {"eye": [0, 2, 4], "target": [0, 0, 0], "vfov_deg": 20}});
    document.look(Some(camera.clone())).expect("a camera");
    document.edit(edit(&["materials", "glass", "dielectric", "ior"], json!("SF10")), false).expect("flint");
    std::thread::sleep(std::time::Duration::from_millis(20));
    folder.file("small.json", &SCENE.replace("0.6}}", "0.3}}"));
    assert!(document.is_outdated());
    let scene = document.reload().expect("a scene");
    let json = document.json();
    assert_eq!(json["materials"]["floor"]["diffuse"]["reflectance"], 0.3);
    assert_eq!((&json["camera"], &json["materials"]["glass"]["dielectric"]["ior"]), (&camera, &json!("SF10")));
    assert_eq!(scene.film.width, 48);
    // Half written, it changes nothing until it is whole.
    folder.file("small.json", "{\"film\":");
    assert!(document.is_outdated() && document.reload().is_err() && document.json() == json);
    assert!(!document.is_outdated());
    // What is edited may be gone.
    folder.file(
        "small.json",
        &SCENE
            .replace("\"ior\": \"N-BK7\"", "\"volume\": \"x\"")
            .replace("\"materials\"", "\"volumes\": {\"x\": {\"ior\": 1.5}}, \"materials\""),
    );
    document.reload().expect("a scene without the edit");
    assert_eq!(document.edits().0, 0);
}

#[test]
fn a_gltf_file_is_a_scene_that_includes_it() {
    let folder = Folder::new("gltf");
    let bunny = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bunny.glb");
    std::fs::copy(bunny, folder.0.join("bunny.glb")).expect("a copy");
    let path = folder.0.join("bunny.glb");
    let (document, scene) =
        Document::open(&path, LoadOptions { width: Some(64), height: Some(64), ..LoadOptions::default() }).expect("a scene");
    let own =
        abbe::scene::load(&path, &LoadOptions { width: Some(64), height: Some(64), ..LoadOptions::default() }).expect("the file");
    assert_eq!(
        (scene.shapes.len(), scene.materials.len(), scene.lights.len()),
        (own.shapes.len(), own.materials.len(), own.lights.len())
    );
    let light = |scene: &Scene| match &scene.lights[0] {
        abbe::scene::Light::Constant { radiance } => [450.0, 550.0, 650.0].map(|nm| radiance.eval(nm)),
        other => panic!("{other:?}"),
    };
    for (a, b) in light(&scene).into_iter().zip(light(&own)) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
    let (Sensor::Perspective { eye: a, tan_half_vfov: ta, .. }, Sensor::Perspective { eye: b, tan_half_vfov: tb, .. }) =
        (&scene.sensor, &own.sensor)
    else {
        panic!("cameras")
    };
    assert!(a.distance(*b) < 1e-9 && (ta - tb).abs() < 1e-9);
    let saved = document.save("lit bunny").expect("saved");
    assert!(Document::open(&saved, LoadOptions::default()).is_ok());
}

#[test]
fn a_camera_of_a_lens_is_moved_with_the_film_that_it_was_made_for() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/photograph.json");
    let (mut document, scene) = Document::open(&path, LoadOptions::default()).expect("a scene");
    let mut camera = document.camera(&scene);
    camera["lens"]["eye"] = json!([0.1, 0.3, 1.2]);
    let Sensor::Perspective { eye, optics, .. } = document.look(Some(camera)).expect("a camera") else { panic!("no camera") };
    assert!(eye.to_array() == [0.1, 0.3, 1.2] && optics.is_some());
    document.look(None).expect("the file's own");
}

#[test]
fn files_of_a_change_that_is_taken_back_are_no_longer_watched() {
    let folder = Folder::new("unwatched");
    let (mut document, _) = open(&folder);
    let paint = folder.file("paint.csv", "400 0.1\n700 0.9\n");
    let touch = |seconds| {
        let later = std::time::SystemTime::now() + std::time::Duration::from_secs(seconds);
        std::fs::File::options().write(true).open(&paint).and_then(|f| f.set_modified(later)).expect("a file");
    };
    document.edit(edit(&["materials", "floor", "diffuse", "reflectance"], json!({"file": "paint.csv"})), false).expect("paint");
    touch(60);
    assert!(document.is_outdated());
    document.undo(false).expect("one").expect("no paint");
    assert!(!document.is_outdated(), "the file is not in the scene");
    document.undo(true).expect("one").expect("paint");
    assert!(!document.is_outdated(), "it was read just now");
    touch(120);
    assert!(document.is_outdated());
}

#[test]
fn paths_without_end_are_refused() {
    let folder = Folder::new("deep");
    let (mut document, _) = open(&folder);
    let path: Vec<&str> = std::iter::once("materials").chain(std::iter::repeat_n("a", 10_000)).collect();
    let refused = document.edit(edit(&path, json!(1)), false).expect_err("too deep").to_string();
    assert!(refused.contains("cannot be edited"), "{refused}");
}

#[test]
fn a_file_that_is_saved_while_an_edit_is_made_is_read_anew() {
    let folder = Folder::new("meanwhile");
    let (mut document, _) = open(&folder);
    assert!(!document.is_outdated());
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(60);
    std::fs::File::options().write(true).open(folder.0.join("small.json")).and_then(|f| f.set_modified(later)).expect("a file");
    document.edit(edit(&["materials", "glass", "dielectric", "ior"], json!("N-SF11")), false).expect("flint");
    assert!(document.is_outdated());
}
