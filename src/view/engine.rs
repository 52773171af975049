//! What renders: one thread that owns the document and all that follows from it, takes commands and publishes what it comes to.

use super::document::{Document, Edit};
use super::pick::Picker;
use super::picture::{Content, Picture};
use super::summary;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{AovBuffers, albedos};
use crate::gpu::Gpu;
use crate::integrator::{GpuIntegrator, Plan, Techniques};
use crate::output::Provenance;
use crate::render::{Ended, Halt, Integrator, Progress, Renderer, Rendering, Stop};
use crate::scene::{Scene, Sensor};
use serde_json::{Value, json};
use std::collections::HashSet;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// Answers a page that asked.
pub type Reply = Box<dyn FnOnce(Value) + Send>;

/// What pages ask for. All pages share one scene.
pub enum Command {
    /// Look from another camera (`None`: the file's), more of which are to come or not.
    Camera(Option<Value>, bool),
    /// Change a value; the flag says that it goes on changing.
    Edit(Edit, bool),
    /// Take the last change back, or make it again.
    Undo(bool),
    /// Render no more for now, or go on.
    Pause(bool),
    /// Find depth, normals and albedos.
    Aovs,
    /// Say what lies at this place of the picture, from 0 to 1 across and down.
    Pick([f64; 2], Reply),
    /// Write the scene by this name.
    Save(String, Reply),
    /// Say the whole scene file.
    Json(Reply),
    /// Somebody looks.
    Show,
    /// End.
    End,
}

/// What pages see.
#[derive(Debug)]
pub struct Published {
    /// What there is to look at and to change.
    pub document: watch::Sender<Arc<Value>>,
    /// How far it is.
    pub status: watch::Sender<Arc<Value>>,
    /// The picture, and that of a second file.
    pub pictures: [watch::Sender<Option<Arc<Picture>>>; 2],
    /// Nanoseconds that were spent on showing it.
    pub spent: AtomicU64,
}

impl Default for Published {
    /// Nothing yet.
    fn default() -> Self {
        Published {
            document: watch::Sender::new(Arc::new(json!({}))),
            status: watch::Sender::new(Arc::new(json!({"phase": "loading"}))),
            pictures: [watch::Sender::new(None), watch::Sender::new(None)],
            spent: AtomicU64::new(0),
        }
    }
}

/// The engine, from outside.
#[derive(Clone)]
pub struct Live {
    commands: Sender<Command>,
    waiting: Arc<AtomicUsize>,
    halt: Arc<Mutex<Option<Halt>>>,
}

impl Live {
    /// Hands a command over. One that moves the camera ends the batch under way; others may come to nothing, and wait for it.
    pub fn send(&self, command: Command) {
        let is_urgent = matches!(command, Command::Camera(Some(_), _) | Command::End);
        self.waiting.fetch_add(1, SeqCst);
        // An engine that has ended takes none.
        let _ = self.commands.send(command);
        if is_urgent && let Some(halt) = &*self.halt.lock().unwrap_or_else(PoisonError::into_inner) {
            halt.request();
        }
    }
}

/// How a scene is rendered.
pub struct Request {
    /// The device, as `--device` has it.
    pub device: Option<String>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// When it is good enough.
    pub stop: Stop,
}

/// Pixels of the first preview, and of any; they then follow the time that they take.
const FIRST_PREVIEW: f64 = 6144.0;
const PREVIEW: (f64, f64) = (768.0, 65536.0);
/// Time for a preview.
const PREVIEW_TIME: Duration = Duration::from_millis(110);
/// Samples of the preview of a picture that stands still.
const STILL_PASSES: u32 = 2;
/// So long after the last move a camera stands still.
const SETTLED: Duration = Duration::from_millis(250);
/// Files are looked at so often.
const WATCH: Duration = Duration::from_millis(500);
/// What may go into showing a render: so much at once, and this share of its time.
const SHOWING: (Duration, f64) = (Duration::from_millis(400), 0.04);

/// What it is at.
enum Phase {
    /// The camera moves; when it did so last.
    Moving(Instant),
    /// A new picture is to be begun.
    Begin,
    /// A picture is rendered.
    Render,
    /// It is as good as was asked for, or has failed.
    Done,
}

/// The engine.
pub struct Engine {
    commands: Receiver<Command>,
    waiting: Arc<AtomicUsize>,
    halt: Arc<Mutex<Option<Halt>>>,
    published: Arc<Published>,
    request: Request,
    document: Document,
    scene: Scene,
    gpu: Arc<Gpu>,
    integrator: Option<GpuIntegrator>,
    rendering: Rendering,
    aovs: Option<Arc<AovBuffers>>,
    wants_aovs: bool,
    picker: Option<Picker>,
    phase: Phase,
    is_paused: bool,
    is_over: bool,
    message: Option<String>,
    /// Of the last picture that settled.
    guide: Vec<u8>,
    /// Pixels and number of the next preview.
    preview: (f64, u32),
    /// Plans whose kernels were compiled, and the one at hand.
    plans: HashSet<String>,
    plan: String,
    progress: Option<Progress>,
    watched: Instant,
}

impl Engine {
    /// Opens the device for a scene that is loaded.
    ///
    /// # Errors
    /// Those of [`Gpu::open`].
    pub fn new(document: Document, scene: Scene, request: Request, published: Arc<Published>) -> Result<(Self, Live)> {
        let gpu = Arc::new(Gpu::open(request.device.as_deref())?);
        let (sender, commands) = channel();
        let (waiting, halt) = (Arc::new(AtomicUsize::new(0)), Arc::new(Mutex::new(None)));
        let live = Live { commands: sender, waiting: waiting.clone(), halt: halt.clone() };
        let rendering = Rendering::new(Film::try_new(&scene.film)?);
        let engine = Engine {
            commands,
            waiting,
            halt,
            published,
            request,
            document,
            scene,
            gpu,
            integrator: None,
            rendering,
            aovs: None,
            wants_aovs: false,
            picker: None,
            phase: Phase::Begin,
            is_paused: false,
            is_over: false,
            message: None,
            guide: Vec::new(),
            preview: (FIRST_PREVIEW, 0),
            plans: HashSet::new(),
            plan: String::new(),
            progress: None,
            watched: Instant::now(),
        };
        engine.publish_document();
        Ok((engine, live))
    }

    /// Works until it is told to end; what it has come to then: a film, unless nothing was rendered, and how it was made.
    pub fn run(mut self) -> (Option<Film>, Provenance) {
        while !self.is_over {
            self.take_commands();
            self.reload_if_outdated();
            if self.is_over {
                break;
            }
            let done = match self.phase {
                Phase::Moving(last) if last.elapsed() < SETTLED => self.show_preview(1),
                Phase::Moving(_) | Phase::Begin => self.begin(),
                Phase::Render if !self.is_paused => self.render(),
                Phase::Render | Phase::Done => self.find_aovs(),
            };
            match done {
                Ok(()) | Err(Error::Interrupted) => {}
                Err(e) => self.fail(&e),
            }
        }
        let provenance = self.provenance();
        let film = self.rendering.film;
        ((film.batches() > 0).then_some(film), provenance)
    }

    fn fail(&mut self, e: &Error) {
        self.message = Some(e.to_string());
        self.integrator = None;
        self.phase = Phase::Done;
        self.publish_status("failed");
    }

    /// Whether there is nothing to do but to wait.
    fn is_idle(&self) -> bool {
        matches!(self.phase, Phase::Done) || self.is_paused && matches!(self.phase, Phase::Render)
    }

    fn take_commands(&mut self) {
        if self.is_idle() {
            match self.commands.recv_timeout(WATCH) {
                Ok(command) => self.take_one(command),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => self.is_over = true,
            }
        }
        let mut last = None;
        while let Ok(next) = self.commands.try_recv() {
            last = match (last, next) {
                // Of those that replace each other only the last is done.
                (Some(Command::Camera(..)), next @ Command::Camera(..)) => {
                    self.waiting.fetch_sub(1, SeqCst);
                    Some(next)
                }
                (Some(Command::Edit(before, goes_on)), Command::Edit(edit, true)) if before.path == edit.path => {
                    self.waiting.fetch_sub(1, SeqCst);
                    Some(Command::Edit(edit, goes_on))
                }
                (last, next) => {
                    last.into_iter().for_each(|command| self.take_one(command));
                    Some(next)
                }
            };
        }
        last.into_iter().for_each(|command| self.take_one(command));
    }

    fn take_one(&mut self, command: Command) {
        self.waiting.fetch_sub(1, SeqCst);
        match command {
            Command::Camera(None, _) if self.document.is_seen_from(&None) => {}
            Command::Camera(camera, is_final) => match self.document.look(camera) {
                Ok(sensor) => self.look(sensor, is_final),
                Err(e) => self.refuse(&e),
            },
            Command::Edit(edit, goes_on) => {
                let edited = self.document.edit(edit, goes_on);
                self.show_scene(edited);
            }
            Command::Undo(again) => {
                if let Some(undone) = self.document.undo(again) {
                    self.show_scene(undone);
                }
            }
            Command::Pause(is_paused) => {
                self.is_paused = is_paused;
                let is_done = matches!(self.phase, Phase::Done);
                self.publish_status(if is_done { "done" } else { "rendering" });
                if is_paused {
                    self.show_rendered();
                }
            }
            Command::Aovs => self.wants_aovs = true,
            Command::Pick(place, reply) => reply(self.pick(place)),
            Command::Save(name, reply) => {
                let saved = self.document.save(&name);
                reply(match saved {
                    Ok(path) => json!({"saved": path.file_name().unwrap_or_default().to_string_lossy()}),
                    Err(e) => json!({"error": e.to_string()}),
                });
                self.publish_document();
            }
            Command::Json(reply) => reply(self.document.json()),
            Command::Show => self.show_rendered(),
            Command::End => self.is_over = true,
        }
    }

    fn reload_if_outdated(&mut self) {
        if self.watched.elapsed() < WATCH {
            return;
        }
        self.watched = Instant::now();
        if self.document.is_outdated() {
            // An editor may be at it still.
            std::thread::sleep(Duration::from_millis(50));
            let scene = self.document.reload();
            self.show_scene(scene);
        }
    }

    /// A request that cannot be met changes nothing; what was being rendered begins again if a batch was cut for it.
    fn refuse(&mut self, e: &Error) {
        self.message = Some(e.to_string());
        self.publish_document();
    }

    fn show_scene(&mut self, scene: Result<Scene>) {
        match scene {
            Ok(scene) => {
                self.remember_guide();
                self.scene = scene;
                self.message = None;
                (self.integrator, self.aovs, self.picker) = (None, None, None);
                self.phase = Phase::Begin;
                self.publish_document();
            }
            Err(e) => self.refuse(&e),
        }
    }

    fn look(&mut self, sensor: Sensor, is_final: bool) {
        if !matches!(self.phase, Phase::Moving(_)) {
            self.remember_guide();
        }
        self.scene.sensor = sensor;
        self.message = None;
        self.aovs = None;
        self.phase = if is_final || self.integrator.is_none() { Phase::Begin } else { Phase::Moving(Instant::now()) };
        if is_final {
            self.publish_document();
        }
    }

    /// Keeps what a picture has learned, for previews of the next one.
    fn remember_guide(&mut self) {
        if self.rendering.batches > 0
            && let Some(guide) = self.integrator.as_mut().and_then(|integrator| integrator.guide().ok())
        {
            self.guide = guide;
        }
    }

    /// A new integrator, film and guide for the scene as it is: what `render` begins with.
    fn begin(&mut self) -> Result<()> {
        self.integrator = None;
        let plan = Plan::new(&self.scene, Techniques::default());
        let needs = format!("{:?} {:?} {}", plan.camera, plan.light, plan.constants());
        if needs != self.plan {
            // That of another plan has other axes.
            self.guide.clear();
        }
        self.plan.clone_from(&needs);
        let is_new = self.plans.insert(needs);
        self.publish_status(if is_new { "compiling" } else { "preparing" });
        self.progress = None;
        self.rendering = Rendering::new(Film::try_new(&self.scene.film)?);
        self.integrator = Some(GpuIntegrator::on(self.gpu.clone(), &self.scene, self.request.seed, plan)?);
        self.phase = Phase::Render;
        self.show_preview(STILL_PASSES)
    }

    fn show_preview(&mut self, passes: u32) -> Result<()> {
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        let full = f64::from(self.scene.film.width) * f64::from(self.scene.film.height);
        let pixels = self.preview.0.min(0.5 * full);
        let begun = Instant::now();
        integrator.heed(&Halt::default());
        let film = integrator.preview(&self.scene, pixels, passes, self.preview.1, &mut self.guide)?;
        let took = begun.elapsed().as_secs_f64() / f64::from(passes);
        self.preview.1 += 1;
        // What was compiled on the way says nothing about the next one.
        let change = (PREVIEW_TIME.as_secs_f64() / took.max(1e-4)).clamp(0.3, 1.4);
        self.preview.0 = (self.preview.0 * change).clamp(PREVIEW.0, PREVIEW.1);
        self.show(film, true);
        self.publish_status(if matches!(self.phase, Phase::Moving(_)) { "moving" } else { "rendering" });
        Ok(())
    }

    fn render(&mut self) -> Result<()> {
        let Some(mut integrator) = self.integrator.take() else { return Ok(()) };
        let halt = Halt::default();
        *self.halt.lock().unwrap_or_else(PoisonError::into_inner) = Some(halt.clone());
        integrator.heed(&halt);
        let mut rendering = std::mem::replace(&mut self.rendering, Rendering::new(Film::new(&nothing(&self.scene))));
        let stop = self.request.stop;
        let begun = (Instant::now(), self.published.spent.load(SeqCst));
        let summary = rendering.render(&mut integrator, &stop, &mut |progress, state| {
            self.progress = Some(*progress);
            self.publish_status("rendering");
            if self.shows(begun, progress) {
                let film = state.settled().0.film.clone();
                self.show(film, false);
            }
            let looks_at_files = self.watched.elapsed() >= WATCH && self.document.is_outdated();
            let is_wanted = self.waiting.load(SeqCst) > 0 || looks_at_files || self.wants_aovs && self.aovs.is_none();
            if is_wanted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        *self.halt.lock().unwrap_or_else(PoisonError::into_inner) = None;
        self.rendering = rendering;
        self.integrator = Some(integrator);
        match summary {
            Ok(summary) if summary.ended != Ended::Interrupted => self.progress = Some(summary.progress),
            // A batch may have been cut: nothing goes on from there.
            _ if halt.is_requested() => {
                self.phase = Phase::Begin;
                return Ok(());
            }
            Ok(_) => return self.find_aovs(),
            Err(e) => return Err(e),
        }
        self.phase = Phase::Done;
        self.show_film();
        self.publish_status("done");
        Ok(())
    }

    /// Whether there is time to show how far it is, and somebody to see it. Until samples are as many as those of the preview, that is less noisy.
    fn shows(&self, (begun, spent): (Instant, u64), progress: &Progress) -> bool {
        let is_seen = self.published.pictures[0].receiver_count() > 0;
        let spent = Duration::from_nanos(self.published.spent.load(SeqCst) - spent);
        is_seen && progress.spp >= u64::from(STILL_PASSES) && spent < SHOWING.0 + begun.elapsed().mul_f64(SHOWING.1)
    }

    /// Shows the film where something is on it that belongs to the scene as it is now; else the preview stays.
    fn show_rendered(&self) {
        if self.rendering.film.batches() > 0 && !matches!(self.phase, Phase::Moving(_) | Phase::Begin) {
            self.show_film();
        }
    }

    fn show_film(&self) {
        self.show(self.rendering.film.clone(), false);
    }

    fn show(&self, film: Film, is_preview: bool) {
        let begun = Instant::now();
        let (aovs, provenance) = (self.aovs.clone(), self.provenance());
        let (name, content) = (self.scene.name.clone(), Content::Film(Box::new(film)));
        let picture = Picture { name, content, is_preview, aovs, provenance };
        self.published.pictures[0].send_replace(Some(Arc::new(picture)));
        self.published.spent.fetch_add(begun.elapsed().as_nanos() as u64, SeqCst);
    }

    fn find_aovs(&mut self) -> Result<()> {
        if !self.wants_aovs || self.aovs.is_some() {
            return Ok(());
        }
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        const SAMPLES: u32 = 16;
        integrator.heed(&Halt::default());
        self.aovs = Some(Arc::new(integrator.aovs(&albedos(&self.scene), 0, SAMPLES)?));
        self.show_rendered();
        Ok(())
    }

    fn pick(&mut self, place: [f64; 2]) -> Value {
        let picker = self.picker.get_or_insert_with(|| Picker::new(&self.scene));
        match picker.pick(&self.scene.sensor, place) {
            Some(met) => summary::met(&self.document.json(), &self.scene, &met),
            None => json!({"nothing": true}),
        }
    }

    fn provenance(&self) -> Provenance {
        let scene = &self.scene;
        Provenance {
            scene: scene.name.clone(),
            scene_hash: format!("fnv1a64:{:016x}", scene.source_hash),
            max_depth: scene.max_depth,
            device: self.gpu.info.to_string(),
            seed: self.request.seed,
            techniques: "all".into(),
            merging: self.integrator.as_ref().is_some_and(|i| i.plan().has(crate::integrator::Feature::Merging)),
            seconds: self.rendering.elapsed.as_secs_f64(),
            stats: self.rendering.stats,
            exposure: scene.film.exposure,
            irradiance: matches!(scene.sensor, Sensor::IrradiancePlane { .. } | Sensor::IrradianceSphere { .. }),
            film_sr: scene.sensor.optics().map(|o| o.axial),
        }
    }

    fn publish_document(&self) {
        let mut document = summary::of_scene(&self.document, &self.scene);
        document["message"] = json!(self.message);
        if let Some(second) = &*self.published.pictures[1].borrow() {
            document["files"] = json!([self.scene.name, second.name]);
        }
        self.published.document.send_replace(Arc::new(document));
    }

    fn publish_status(&self, phase: &str) {
        let number = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
        let p = self.progress.as_ref();
        self.published.status.send_replace(Arc::new(json!({
            "phase": phase,
            "paused": self.is_paused,
            "spp": p.map_or(0, |p| p.spp),
            "error": p.map_or(Value::Null, |p| number(p.relative_error)),
            "target": self.request.stop.error,
            "rays_per_second": p.map_or(Value::Null, |p| number(p.rays_per_second)),
            "seconds": p.map_or(0.0, |p| p.elapsed.as_secs_f64()),
            "remaining": p.and_then(|p| p.remaining).map(|r| r.as_secs_f64()),
            "fraction": p.map_or(0.0, |p| p.fraction),
            "device": self.gpu.info.name,
            "compilations": self.gpu.compilations(),
            "message": self.message,
        })));
    }
}

/// A film that takes no room, in the place of one that is rendered.
fn nothing(scene: &Scene) -> crate::scene::FilmSettings {
    crate::scene::FilmSettings { width: 1, height: 1, ..scene.film.clone() }
}

/// The name of a file, for messages.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
