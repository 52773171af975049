//! What renders: one thread that owns the document and all that follows from it, takes commands and publishes what it comes to.

use super::denoiser::Halves;
use super::document::Document;
use super::live::{Command, Live, Published, lock};
use super::pick::Picker;
use super::picture::{Content, Picture};
use super::summary;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{AovBuffers, albedos};
use crate::gpu::Gpu;
use crate::integrator::{GpuIntegrator, Plan, Preview, Techniques};
use crate::output::Provenance;
use crate::render::{Ended, Halt, Integrator, Progress, Renderer, Rendering, Stop};
use crate::scene::{Scene, Sensor};
use serde_json::{Value, json};
use std::collections::HashSet;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

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
    /// The camera or a value is being moved; when it was last.
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
    document: Arc<Mutex<Document>>,
    scene: Scene,
    gpu: Arc<Gpu>,
    integrator: Option<GpuIntegrator>,
    rendering: Rendering,
    /// Number of that render.
    number: u64,
    halves: Halves,
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
    /// Whether that merges light paths.
    merging: bool,
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
        let (waiting, halt, document) =
            (Arc::new(AtomicUsize::new(0)), Arc::new(Mutex::new(None)), Arc::new(Mutex::new(document)));
        let live = Live { commands: sender, waiting: waiting.clone(), halt: halt.clone(), document: document.clone() };
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
            number: 0,
            halves: Halves::default(),
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
            merging: false,
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
        let (provenance, film) = (self.provenance(&self.rendering), self.rendering.film);
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
                (Some(Command::Edit { edit: before, goes_on, .. }), Command::Edit { edit, goes_on: true, is_final })
                    if before.path == edit.path =>
                {
                    self.waiting.fetch_sub(1, SeqCst);
                    Some(Command::Edit { edit, goes_on, is_final })
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
            Command::Camera(None, _) if self.document().is_seen_from(&None) => {}
            Command::Camera(camera, is_final) => {
                let seen = self.document().look(camera);
                match seen {
                    Ok(sensor) => self.look(sensor, is_final),
                    Err(e) => self.refuse(&e),
                }
            }
            Command::Edit { edit, goes_on, is_final } => {
                let edited = self.document().edit(edit, goes_on);
                self.show_scene(edited, is_final);
            }
            Command::Undo(again) => {
                let undone = self.document().undo(again);
                undone.into_iter().for_each(|scene| self.show_scene(scene, true));
            }
            Command::Pause(is_paused) => {
                self.is_paused = is_paused;
                let is_done = matches!(self.phase, Phase::Done);
                self.publish_status(if is_done { "done" } else { "rendering" });
                if is_paused {
                    self.show_rendered();
                }
            }
            Command::Aovs => self.wants_aovs = self.aovs.is_none(),
            Command::Pick(place, reply) => reply(self.pick(place)),
            Command::Save(name, reply) => {
                let saved = self.document().save(&name);
                reply(match saved {
                    Ok(path) => json!({"saved": path.file_name().unwrap_or_default().to_string_lossy()}),
                    Err(e) => json!({"error": e.to_string()}),
                });
                self.publish_document();
            }
            Command::Json(reply) => reply(self.document().json()),
            Command::Show => self.show_rendered(),
            Command::End => self.is_over = true,
        }
    }

    fn reload_if_outdated(&mut self) {
        if self.watched.elapsed() < WATCH {
            return;
        }
        self.watched = Instant::now();
        if self.document().is_outdated() {
            // An editor may be at it still.
            std::thread::sleep(Duration::from_millis(50));
            let scene = self.document().reload();
            self.show_scene(scene, true);
        }
    }

    /// A request that cannot be met changes nothing; what was being rendered begins again if a batch was cut for it.
    fn refuse(&mut self, e: &Error) {
        self.message = Some(e.to_string());
        self.publish_document();
    }

    fn show_scene(&mut self, scene: Result<Scene>, is_final: bool) {
        match scene {
            Ok(scene) => {
                if !matches!(self.phase, Phase::Moving(_)) {
                    self.remember_guide();
                }
                self.scene = scene;
                self.message = None;
                (self.integrator, self.aovs, self.picker) = (None, None, None);
                self.phase = if is_final { Phase::Begin } else { Phase::Moving(Instant::now()) };
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
        self.phase = if is_final { Phase::Begin } else { Phase::Moving(Instant::now()) };
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

    fn document(&self) -> MutexGuard<'_, Document> {
        lock(&self.document)
    }

    /// A new film for the scene as it is, looked at from where it is now.
    fn begin(&mut self) -> Result<()> {
        self.integrator = None;
        self.phase = Phase::Render;
        self.show_preview(STILL_PASSES)
    }

    /// A new integrator, film and guide for the scene as it is: what `render` begins with.
    fn build(&mut self) -> Result<GpuIntegrator> {
        if self.gpu.faults.check().is_err() {
            // What has failed does not work again.
            self.gpu = Arc::new(Gpu::open(self.request.device.as_deref())?);
        }
        // What the last one had on the device is given back before there is more.
        self.gpu.wait()?;
        let plan = Plan::new(&self.scene, Techniques::default());
        let needs = format!("{:?} {:?} {}", plan.camera, plan.light, plan.constants());
        if needs != self.plan {
            // That of another plan has other axes.
            self.guide.clear();
        }
        self.plan.clone_from(&needs);
        self.merging = plan.is_blurred();
        let is_new = self.plans.insert(needs);
        self.publish_status(if is_new { "compiling" } else { "preparing" });
        self.progress = None;
        self.rendering = Rendering::new(Film::try_new(&self.scene.film)?);
        (self.number, self.halves) = (self.number + 1, Halves::default());
        GpuIntegrator::on(self.gpu.clone(), &self.scene, self.request.seed, plan)
    }

    fn show_preview(&mut self, passes: u32) -> Result<()> {
        let integrator = match self.integrator.take() {
            Some(integrator) => integrator,
            None => self.build()?,
        };
        let integrator = self.integrator.insert(integrator);
        let full = f64::from(self.scene.film.width) * f64::from(self.scene.film.height);
        let pixels = self.preview.0.min(0.5 * full);
        integrator.heed(&Halt::default());
        let preview = Preview { pixels, passes, number: self.preview.1, has_light_paths: true };
        if self.published.pictures[0].borrow().is_none() {
            // Something to see while the kernel of light paths is compiled.
            let film = integrator.preview(&self.scene, Preview { has_light_paths: false, ..preview }, &mut self.guide)?;
            self.show(film, &self.rendering, true);
        }
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        let begun = Instant::now();
        let film = integrator.preview(&self.scene, preview, &mut self.guide)?;
        let took = begun.elapsed().as_secs_f64() / f64::from(passes);
        self.preview.1 += 1;
        // What was compiled on the way says nothing about the next one.
        let change = (PREVIEW_TIME.as_secs_f64() / took.max(1e-4)).clamp(0.3, 1.4);
        self.preview.0 = (self.preview.0 * change).clamp(PREVIEW.0, PREVIEW.1);
        self.show(film, &self.rendering, true);
        self.publish_status(if matches!(self.phase, Phase::Moving(_)) { "moving" } else { "rendering" });
        Ok(())
    }

    fn render(&mut self) -> Result<()> {
        let Some(mut integrator) = self.integrator.take() else { return Ok(()) };
        let halt = Halt::default();
        *lock(&self.halt) = Some(halt.clone());
        integrator.heed(&halt);
        let mut rendering = std::mem::replace(&mut self.rendering, Rendering::new(Film::new(&nothing(&self.scene))));
        let stop = self.request.stop;
        let begun = (Instant::now(), self.published.spent.load(SeqCst));
        let summary = rendering.render(&mut integrator, &stop, &mut |progress, state| {
            self.progress = Some(*progress);
            self.publish_status("rendering");
            if self.halves.is_due(progress.spp) {
                self.halves.keep(&state.settled().0.film, progress.spp);
            }
            if self.shows(begun, progress) {
                let rendering = state.settled().0;
                self.show(rendering.film.clone(), rendering, false);
            }
            let looks_at_files = self.watched.elapsed() >= WATCH && lock(&self.document).is_outdated();
            let is_wanted = self.waiting.load(SeqCst) > 0 || looks_at_files || self.wants_aovs;
            if is_wanted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        *lock(&self.halt) = None;
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
        self.show(self.rendering.film.clone(), &self.rendering, false);
    }

    fn show(&self, film: Film, rendering: &Rendering, is_preview: bool) {
        let begun = Instant::now();
        let (aovs, provenance) = (self.aovs.clone(), self.provenance(rendering));
        let earlier = self.halves.half().filter(|_| !is_preview);
        let picture = Picture::new(self.scene.name.clone(), Content::Film(Box::new(film)));
        let picture = Picture { is_preview, render: self.number, aovs, earlier, provenance, ..picture };
        self.published.pictures[0].send_replace(Some(Arc::new(picture)));
        self.published.spent.fetch_add(begun.elapsed().as_nanos() as u64, SeqCst);
    }

    fn find_aovs(&mut self) -> Result<()> {
        if !self.wants_aovs {
            return Ok(());
        }
        self.wants_aovs = false;
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        const SAMPLES: u32 = 16;
        integrator.heed(&Halt::default());
        let mut half = |index| integrator.aovs(&albedos(&self.scene), index, SAMPLES);
        self.aovs = Some(Arc::new(AovBuffers::of_halves(half(0)?, half(1)?)));
        self.show_rendered();
        Ok(())
    }

    fn pick(&mut self, place: [f64; 2]) -> Value {
        let picker = self.picker.get_or_insert_with(|| Picker::new(&self.scene));
        match picker.pick(&self.scene.sensor, place) {
            Some(met) => summary::met(&self.document().json(), &self.scene, &met),
            None => json!({"nothing": true}),
        }
    }

    fn provenance(&self, rendering: &Rendering) -> Provenance {
        let device = self.gpu.info.to_string();
        Provenance::of(&self.scene, rendering, device, self.merging, self.request.seed, "all".into())
    }

    fn publish_document(&self) {
        let mut document = summary::of_scene(&self.document(), &self.scene);
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
