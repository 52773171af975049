//! What the engine shows: settled it is what `render` makes of the saved scene, and edits within one plan compile nothing.

use super::{Folder, SCENE};
use abbe::film::Film;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::render::{Integrator, Rendering, Stop};
use abbe::scene::LoadOptions;
use abbe::view::document::{Document, Edit};
use abbe::view::engine::{Command, Engine, Live, Published, Request};
use abbe::view::picture::{Content, Picture};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

const SPP: u32 = 24;

struct Running {
    live: Live,
    published: Arc<Published>,
    thread: Option<std::thread::JoinHandle<(Option<Film>, abbe::output::Provenance)>>,
}

impl Running {
    fn start(document: Document, scene: abbe::scene::Scene) -> Self {
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
    fn settled(&self, seen: Option<&Arc<Picture>>) -> Arc<Picture> {
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

fn film(picture: &Picture) -> &Film {
    let Content::Film(film) = &picture.content else { panic!("a file") };
    film
}

fn bits(film: &Film) -> Vec<u64> {
    (0..film.pixels()).flat_map(|p| film.pixel(p).iter().map(|v| v.to_bits()).collect::<Vec<_>>()).collect()
}

fn edit(path: &[&str], value: Value) -> Command {
    Command::Edit(Edit { path: path.iter().map(|key| key.to_string()).collect(), value }, false)
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
            looks.then(|| integrator.preview(&scene, 300.0, 2, number, &mut guide).expect("a preview"))
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
