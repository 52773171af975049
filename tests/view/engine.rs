//! What the engine shows: settled it is what `render` makes of the saved scene, and edits within one plan compile nothing.

use super::{Folder, SCENE};
use abbe::film::Film;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Preview, Techniques};
use abbe::output::Provenance;
use abbe::render::{Integrator, Rendering, Stop};
use abbe::scene::LoadOptions;
use abbe::view::document::{Document, Edit};
use abbe::view::engine::{Engine, Request};
use abbe::view::live::{Command, Live, Published};
use abbe::view::look::{Look, draw};
use abbe::view::picture::{Content, Picture};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Samples per pixel.
pub const SPP: u32 = 24;

/// An engine at work.
pub struct Running {
    pub live: Live,
    pub published: Arc<Published>,
    thread: Option<std::thread::JoinHandle<(Option<Film>, Provenance)>>,
}

impl Running {
    /// Renders it, [`SPP`] samples per pixel.
    pub fn start(document: Document, scene: abbe::scene::Scene) -> Self {
        let published = Arc::new(Published::default());
        let stop = Stop { spp: Some(SPP), ..Stop::default() };
        let request = Request { device: None, seed: 0, stop };
        let (engine, live) = Engine::new(document, scene, request, published.clone()).expect("an adapter");
        Running { live, published, thread: Some(std::thread::spawn(move || engine.run())) }
    }

    fn status(&self) -> Value {
        (**self.published.status.borrow()).clone()
    }

    /// Waits until it is done with what is the newest, and returns the picture.
    pub fn settled(&self, seen: Option<&Arc<Picture>>) -> Arc<Picture> {
        let begun = Instant::now();
        loop {
            let picture = self.published.pictures[0].borrow().clone();
            if let Some(picture) = picture
                && self.status()["phase"] == "done"
                && !picture.is_preview
                && seen.is_none_or(|seen| !Arc::ptr_eq(seen, &picture))
            {
                return picture;
            }
            assert!(begun.elapsed() < Duration::from_secs(120), "{}", self.status());
            assert_ne!(self.status()["phase"], "failed", "{}", self.status());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn end(mut self) -> Option<Film> {
        self.live.send(Command::End);
        self.thread.take().and_then(|thread| thread.join().ok())?.0
    }
}

/// What it is of.
pub fn film(picture: &Picture) -> &Film {
    let Content::Film(film) = &picture.content else { panic!("a file") };
    film
}

/// All bits of it.
pub fn bits(film: &Film) -> Vec<u64> {
    (0..film.pixels()).flat_map(|p| film.pixel(p).iter().map(|v| v.to_bits()).collect::<Vec<_>>()).collect()
}

fn edit(path: &[&str], value: Value) -> Command {
    let path = path.iter().map(|key| key.to_string()).collect();
    Command::Edit { edit: Edit { path, value }, goes_on: false, is_final: true }
}

/// One of many that follow each other.
fn sliding(path: &[&str], value: Value) -> Command {
    let Command::Edit { edit, .. } = edit(path, value) else { panic!("no edit") };
    Command::Edit { edit, goes_on: true, is_final: false }
}

/// What `render` makes of a scene file.
fn rendered(path: &std::path::Path) -> Film {
    let scene = abbe::scene::load(path, &LoadOptions::default()).expect("a scene");
    let mut rendering = Rendering::new(Film::new(&scene.film));
    let mut integrator = GpuIntegrator::new(&scene, None, 0).expect("an adapter");
    let stop = Stop { spp: Some(SPP), ..Stop::default() };
    rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Continue(())).expect("a render");
    rendering.film
}

#[test]
fn what_is_settled_has_the_bits_of_a_render_of_the_saved_scene() {
    let folder = Folder::new("bits");
    let path = folder.file("small.json", SCENE);
    let (document, scene) = Document::open(&path, LoadOptions::default()).expect("a scene");
    let running = Running::start(document, scene);
    let first = running.settled(None);
    assert_eq!(bits(film(&first)), bits(&rendered(&path)), "as the file has it");
    let compiled = running.status()["compilations"].as_u64().expect("a count");
    assert!(compiled > 0);

    // Moved, in the middle of it, and with another glass, lamp and colour of the same plan.
    let camera = |x: f64| json!({"perspective": {"eye": [x, 1.5, 4], "target": [0, 0.5, 0], "vfov_deg": 30}});
    (1..8).for_each(|i| running.live.send(Command::Camera(Some(camera(0.1 * f64::from(i))), false)));
    running.live.send(Command::Camera(Some(camera(0.75)), true));
    // As a slider does it.
    (1..4)
        .for_each(|i| running.live.send(sliding(&["materials", "glass", "dielectric", "ior"], json!(1.5 + 0.05 * f64::from(i)))));
    running.live.send(edit(&["materials", "glass", "dielectric", "ior"], json!("N-SF11")));
    running.live.send(edit(&["shapes", "2", "emission", "radiance", "luminous_flux_lm"], json!(150)));
    running.live.send(edit(&["materials", "floor", "diffuse", "reflectance"], json!({"srgb": [0.8, 0.6, 0.5]})));
    let second = running.settled(Some(&first));
    let (sender, saved) = std::sync::mpsc::channel();
    running.live.send(Command::Save("moved".into(), Box::new(move |said| sender.send(said).expect("a listener"))));
    assert_eq!(saved.recv().expect("an answer"), json!({"saved": "moved.json"}));
    let again = rendered(&folder.0.join("moved.json"));
    assert_ne!(bits(&again), bits(film(&first)));
    assert_eq!(bits(film(&second)), bits(&again), "as the saved file has it");
    assert_eq!(running.status()["compilations"].as_u64(), Some(compiled), "nothing is compiled for that");

    // A request that cannot be met leaves the picture and says why.
    running.live.send(edit(&["materials", "glass", "dielectric", "ior"], json!("no glass")));
    let begun = Instant::now();
    while running.published.document.borrow()["message"].is_null() {
        assert!(begun.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(running.published.document.borrow()["message"].as_str().is_some_and(|m| m.contains("no glass")));
    // Another plan compiles, once; back in the first one nothing does.
    running.live.send(edit(&["materials", "glass", "dielectric", "roughness"], json!(0.3)));
    let third = running.settled(Some(&second));
    let more = running.status()["compilations"].as_u64().expect("a count");
    assert!(more > compiled);
    running.live.send(Command::Undo(false));
    let fourth = running.settled(Some(&third));
    assert_eq!(bits(film(&fourth)), bits(&again));
    assert_eq!(running.status()["compilations"].as_u64(), Some(more), "kernels of plans seen are kept");
    assert_eq!(bits(&running.end().expect("a film")), bits(&again));
}

/// A square before the camera, of a material of its own.
const SQUARE: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "materials": [{"name": "Other"}, {"name": "Paint"}],
    "meshes": [{"name": "square", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAPwAAgD8AAAAAAACAvwAAgD8AAAAAAAABAAIAAAACAAMA"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ]
}"#;

#[test]
fn a_click_on_a_gltf_file_finds_what_to_replace_its_material_by() {
    let folder = Folder::new("click");
    folder.file("square.gltf", SQUARE);
    let scene = json!({
        "camera": {"perspective": {"eye": [0, 0, 4], "target": [0, 0, 0], "vfov_deg": 20}},
        "materials": {"floor": {"diffuse": {"reflectance": 0.5}}},
        "shapes": [
            {"quad": {"corner": [-9, -9, -1], "edge_u": [18, 0, 0], "edge_v": [0, 18, 0]}, "material": "floor"},
            {"gltf": {"file": "square.gltf"}}
        ],
        "lights": [{"constant": {"radiance": 1}}]
    });
    let path = folder.file("scene.json", &scene.to_string());
    let (document, scene) = Document::open(&path, LoadOptions::default()).expect("a scene");
    let published = Arc::new(Published::default());
    let request = Request { device: None, seed: 0, stop: Stop::default() };
    let (engine, live) = Engine::new(document.clone(), scene, request, published.clone()).expect("an adapter");
    let (sender, picked) = std::sync::mpsc::channel();
    live.send(Command::Pick([0.5, 0.5], Box::new(move |found| sender.send(found).expect("a listener"))));
    live.send(Command::End);
    // It ends before it has rendered.
    engine.run();
    let found = picked.recv().expect("an answer");
    assert_eq!(found["material"], json!(["shapes", "1", "gltf", "override", "Paint"]));
    let materials = published.document.borrow()["materials"].clone();
    let paths: Vec<&Value> = materials.as_array().expect("a list").iter().map(|m| &m["path"]).collect();
    assert_eq!(paths, [&json!(["materials", "floor"]), &found["material"]], "the one that is in use");
    // It can be edited there, and is found there then.
    let steps: Vec<String> = serde_json::from_value(found["material"].clone()).expect("keys");
    let mut document = document;
    let edit = Edit { path: steps, value: json!({"dielectric": {"ior": "N-SF11"}}) };
    let scene = document.edit(edit, false).expect("another material");
    assert!(matches!(scene.materials[scene.included[0].material], abbe::scene::Material::Dielectric { .. }));
}

#[test]
fn a_picture_is_exposed_as_its_scene_says() {
    let scene = json!({
        "film": {"width": 2, "height": 2, "exposure": -3.5},
        "camera": {"perspective": {"eye": [0, 0, 4], "target": [0, 0, 0], "vfov_deg": 20}},
        "lights": [{"constant": {"radiance": 1}}]
    });
    let scene =
        abbe::scene::load_str(&scene.to_string(), "scene".as_ref(), ".".as_ref(), &LoadOptions::default()).expect("a scene");
    let content = Content::Film(Box::new(Film::new(&scene.film)));
    let provenance = Provenance { exposure: scene.film.exposure, ..Provenance::default() };
    let picture = Picture { provenance, ..Picture::new(String::new(), content) };
    let exposure = |look: Value| draw(&Look::of_json(&look), &picture, None).expect("pixels").about["exposure"].clone();
    assert_eq!(exposure(json!({})), -3.5);
    assert_eq!(exposure(json!({"exposure": "2"})), 2.0);
}

#[test]
fn a_preview_leaves_the_render_as_it_was() {
    let folder = Folder::new("preview");
    let path = folder.file("small.json", SCENE);
    let scene = abbe::scene::load(&path, &LoadOptions::default()).expect("a scene");
    let gpu = Arc::new(Gpu::open(None).expect("an adapter"));
    let film = |looks: bool| {
        let plan = Plan::new(&scene, Techniques::default());
        let mut integrator = GpuIntegrator::on(gpu.clone(), &scene, 0, plan).expect("an integrator");
        let mut film = Film::new(&scene.film);
        let mut guide = Vec::new();
        let mut preview = |integrator: &mut GpuIntegrator, number| {
            looks.then(|| {
                let wanted = Preview { pixels: 300.0, passes: 2, number, has_light_paths: number != 2 };
                integrator.preview(&scene, wanted, &mut guide).expect("a preview")
            })
        };
        let first = preview(&mut integrator, 0);
        for index in 0..3 {
            integrator.render_batch(abbe::render::Batch::nth(index, film.pixels()), &mut film).expect("a batch");
            preview(&mut integrator, 1 + index);
        }
        (film, first)
    };
    let ((plain, _), (looked_at, preview)) = (film(false), film(true));
    assert_eq!(bits(&plain), bits(&looked_at));
    let preview = preview.expect("a preview");
    let (width, height) = (preview.settings().width, preview.settings().height);
    assert!(width * height <= 330 && (f64::from(width) / f64::from(height) - 1.5).abs() < 0.1, "{width}x{height}");
    // It shows the same: mean luminance within what so few paths scatter.
    let mean = |film: &Film| film.mean_of(film.bins() + 1);
    assert!((mean(&preview) / mean(&plain) - 1.0).abs() < 0.5, "{} {}", mean(&preview), mean(&plain));
}
