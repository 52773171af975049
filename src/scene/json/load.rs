//! From a scene file to a [`Scene`]: the order of reading, the film and what measures it. Every error names its place in the file.

use crate::error::{Error, Result, quoted};
use crate::scene::gltf;
use crate::scene::json::animate;
use crate::scene::json::files::{Files, read_scene_file};
use crate::scene::json::keys::SENSORS;
use crate::scene::json::lens;
use crate::scene::json::materials::Materials;
use crate::scene::json::remarks::Remarks;
use crate::scene::json::settings::Setting;
use crate::scene::json::spectra::SpectrumReader;
use crate::scene::json::{Node, parse};
use crate::scene::mesh::instance::SharedMeshes;
use crate::scene::texture::Image;
use crate::scene::texture::image;
use crate::scene::texture::picture::Picture;
use crate::scene::volumes::Volumes;
use crate::scene::{Bins, Estimator, FilmSettings, Filter, Light, Mesh, Scene, Sensor, Shape, Tile, WavelengthSampling};
use crate::spectrum::unit_problem;
use crate::stage::{self, Stage};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The greatest number of pixels: 64 Mi.
const MOST_PIXELS: u64 = 1 << 26;
/// The greatest number of pixels times bins.
const MOST_VALUES: u64 = 1 << 31;

/// What the command line says over the scene file's head.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Let the scene name files outside its folder.
    pub allow_outside: bool,
    /// Pixels across instead of the scene's.
    pub width: Option<u32>,
    /// Pixels down instead of the scene's.
    pub height: Option<u32>,
    /// The part of the picture that is rendered; all of it unless given.
    pub crop: Option<Tile>,
    /// Number of bins instead of the scene's.
    pub channels: Option<u32>,
    /// Greatest depth instead of the scene's.
    pub max_depth: Option<u32>,
    /// Keys of the scene file that are set, in this order.
    pub settings: Vec<Setting>,
    /// The scene as it stands at this frame; where there is none, as its keys and files stand at rest.
    pub frame: Option<u32>,
    /// Frames per second instead of the scene's, for what moves by seconds.
    pub frames_per_second: Option<f64>,
    /// Take closed meshes of glass without a thickness, as glTF files of Blender have them, as solid.
    pub solid_glass: bool,
    /// Light a glTF file that has no light by a soft studio instead of even daylight.
    pub studio: bool,
}

impl LoadOptions {
    /// Frames per second where neither the command nor the scene says.
    const FRAMES_PER_SECOND: f64 = 24.0;

    /// Seconds from frame 0 to the frame asked for, at these frames per second unless the command says otherwise.
    pub(in crate::scene) fn seconds(&self, frames_per_second: Option<f64>) -> Option<f64> {
        let rate = self.frames_per_second.or(frames_per_second).unwrap_or(Self::FRAMES_PER_SECOND);
        self.frame.map(|frame| f64::from(frame) / rate)
    }
}

/// Loads a scene file (JSON), or a glTF file as a scene by itself.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene> {
    stage::enter(Stage::Reading);
    let (canonical, bytes) = read_scene_file(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let files = Files::new(folder, options.allow_outside);
    files.add_source(canonical, &bytes);
    let mut loader = if extension == "glb" || extension == "gltf" {
        if let Some(setting) = options.settings.first() {
            let problem = format!("--set {}: a glTF file has none of these keys", quoted(setting.text()));
            return Err(Error::usage(problem, "include it in a scene file by \"gltf\", whose keys can be set"));
        }
        gltf::scene(path, bytes, files, options)?
    } else {
        let text = std::str::from_utf8(&bytes)
            .map_err(|_| Error::file(path, "the scene is not UTF-8 text", "write JSON, or name a .glb or .gltf file"))?;
        read(text, path, files, options)?
    };
    if loader.scene.name.is_empty() {
        loader.scene.name = name;
    }
    Ok(loader.finish())
}

/// Loads a scene from JSON text, for which `file` stands in messages and in whose folder `base` its files lie.
pub fn load_str(json: &str, file: &Path, base: &Path, options: &LoadOptions) -> Result<Scene> {
    let files = Files::new(base, options.allow_outside);
    files.add_to_hash(json.as_bytes());
    Ok(read(json, file, files, options)?.finish())
}

/// A scene in the making.
pub(in crate::scene) struct Loader {
    pub(in crate::scene) reader: SpectrumReader,
    pub(in crate::scene) scene: Scene,
    /// Material indices by name.
    pub(in crate::scene) names: HashMap<String, usize>,
    /// What materials are made with.
    pub(in crate::scene) kit: Materials,
    /// Meshes that were read already, by file and whether they are smoothed.
    pub(in crate::scene) meshes: HashMap<(PathBuf, Option<bool>), Arc<Mesh>>,
    /// Meshes that may be worth sharing.
    pub(in crate::scene) shared: SharedMeshes,
    /// Pictures on surfaces that were read already.
    pub(in crate::scene) images: HashMap<image::Key, (Arc<Picture>, Arc<Image>)>,
    /// The camera of an included glTF file, for a scene that has none of its own.
    pub(in crate::scene) camera: Option<Sensor>,
    /// Width over height of what that camera is meant for.
    pub(in crate::scene) aspect: Option<f64>,
    /// Shapes and instances visited, against instances of instances of instances.
    pub(in crate::scene) visits: u32,
    /// Triangles so far, those of shared meshes once.
    pub(in crate::scene) triangles: usize,
    /// What volumes there are.
    pub(in crate::scene) volumes: Volumes,
    /// The material of lamps that name none, once it is needed.
    pub(in crate::scene) black: Option<usize>,
    /// Are closed meshes of glass without a thickness solid ([`LoadOptions`])?
    pub(in crate::scene) solid_glass: bool,
    /// Seconds since frame 0 at which animations of glTF files are taken; without, all stands at rest.
    pub(in crate::scene) time: Option<f64>,
}

impl Loader {
    pub(in crate::scene) fn new(files: Files, film: FilmSettings) -> Self {
        let range = (film.bins.min_nm, film.bins.max_nm);
        let sensor = Sensor::IrradianceSphere { center: DVec3::ZERO, radius: 1.0 };
        let scene = Scene {
            name: String::new(),
            film,
            sensor,
            materials: Vec::new(),
            thin_films: BTreeMap::new(),
            grains: BTreeMap::new(),
            included: Vec::new(),
            interiors: Vec::new(),
            shapes: Vec::<Shape>::new(),
            lenses: Vec::new(),
            lights: Vec::<Light>::new(),
            max_depth: 64,
            reference: Estimator::Backward,
            notes: Vec::new(),
            warnings: Vec::new(),
            source_hash: 0,
            sources: Vec::new(),
        };
        Loader {
            reader: SpectrumReader { files, range, remarks: Remarks::default() },
            scene,
            names: HashMap::new(),
            kit: Materials::default(),
            meshes: HashMap::new(),
            shared: SharedMeshes::default(),
            images: HashMap::new(),
            camera: None,
            aspect: None,
            visits: 0,
            triangles: 0,
            volumes: Volumes::default(),
            black: None,
            solid_glass: false,
            time: None,
        }
    }
}

fn read(text: &str, file: &Path, files: Files, options: &LoadOptions) -> Result<Loader> {
    let mut value = parse(text, file)?;
    for setting in &options.settings {
        setting.apply(&mut value)?;
        files.add_to_hash(setting.text().as_bytes());
    }
    animate::apply(&mut value, file, options.frame)?;
    let root = Node::root(&value, file);
    root.object("scene")?;
    if let Some(text) = root.get("description") {
        text.string()?;
    }
    if let Some(schema) = root.get("$schema") {
        schema.string()?;
    }
    let mut film = film(root.get("film"), &root, options)?;
    crop(&mut film, options)?;
    let mut loader = Loader::new(files, film);
    loader.solid_glass = options.solid_glass;
    let rate = root.get("frames_per_second").map(|n| n.within(1e-3, 1e6)).transpose()?;
    loader.time = options.seconds(rate);
    suspect_radians(&root, &loader.reader.remarks);
    if let Some(name) = root.get("name") {
        // One line, whatever it says: the name goes into file headers and messages.
        loader.scene.name = name.string()?.chars().filter(|c| !c.is_control()).take(200).collect();
    }
    if let Some(depth) = root.get("max_depth") {
        loader.scene.max_depth = depth.integer(1, 100_000)?;
    }
    if let Some(depth) = options.max_depth {
        loader.scene.max_depth = depth.clamp(1, 100_000);
    }
    if let Some(estimator) = root.get("reference") {
        let word = estimator.choice(&["backward", "forward"])?;
        loader.scene.reference = if word == "forward" { Estimator::Forward } else { Estimator::Backward };
    }
    let camera = root.get("camera").map(|node| sensor(&node, &loader)).transpose()?;
    Materials::read(&mut loader, &root)?;
    loader.shapes(&root)?;
    loader.lights(&root)?;
    loader.scene.sensor = camera
        .or(loader.camera.take())
        .ok_or_else(|| root.fail("\"camera\" is missing", "add \"camera\", or include a glTF file that has one"))?;
    if loader.scene.shapes.is_empty() && loader.scene.lights.is_empty() {
        return Err(root.fail("the scene is empty", "add \"shapes\" or \"lights\""));
    }
    Ok(loader)
}

/// Warns of angles in degrees that are simple shares of pi, as no angle in degrees is, and of fields of view and cones that are as small as those.
fn suspect_radians(node: &Node, remarks: &Remarks) {
    use std::f64::consts::FRAC_PI_4;
    for (key, member) in node.entries().unwrap_or_default() {
        let angles = if key.ends_with("_deg") { member.array(0).unwrap_or_else(|_| vec![member.clone()]) } else { Vec::new() };
        for angle in angles.iter().filter_map(|n| n.value.as_f64()).filter(|a| *a != 0.0) {
            let eighths = (angle / FRAC_PI_4).round();
            let is_share_of_pi = (1.0..=8.0).contains(&eighths.abs()) && (angle - eighths * FRAC_PI_4).abs() < 1e-3;
            let is_narrow = ["vfov_deg", "outer_deg"].contains(&key) && angle < 2.0 * FRAC_PI_4;
            if is_share_of_pi || is_narrow {
                let text = format!("an angle of {angle} degrees; if radians were meant, write {:.4}", angle.to_degrees());
                remarks.warn(&member, &text);
            }
        }
        suspect_radians(&member, remarks);
    }
    for element in node.array(0).unwrap_or_default().iter().filter(|n| n.value.is_object() || n.value.is_array()) {
        suspect_radians(element, remarks);
    }
}

/// Film settings out of the scene's `film` (all of it optional) and the options.
pub(in crate::scene) fn film(node: Option<Node>, root: &Node, options: &LoadOptions) -> Result<FilmSettings> {
    let at = node.clone().unwrap_or_else(|| root.clone());
    if let Some(node) = &node {
        node.object("film")?;
    }
    let get = |key| node.as_ref().and_then(|n| n.get(key));
    let side = |key, over: Option<u32>| match (over, get(key)) {
        (Some(v), _) if (1..=65536).contains(&v) => Ok(v),
        (Some(v), _) => Err(Error::usage(format!("a film of {v} pixels across or down"), "use 1 to 65536")),
        (None, Some(n)) => n.integer(1, 65536),
        (None, None) => Ok(512),
    };
    let (width, height) = (side("width", options.width)?, side("height", options.height)?);
    let [min_nm, max_nm] = get("range_nm").map_or(Ok([380.0, 780.0]), |n| n.numbers())?;
    if !(min_nm >= 300.0 && max_nm <= 2500.0 && max_nm - min_nm >= 1e-3) {
        let place = get("range_nm").unwrap_or(at);
        let problem = unit_problem(min_nm, max_nm).unwrap_or_else(|| format!("{min_nm} to {max_nm} nm is no range"));
        return Err(place.fail(problem, "give [lowest, highest] within 300 to 2500 nm"));
    }
    let count = match (options.channels, get("bins")) {
        (Some(v), _) if (1..=400).contains(&v) => v,
        (Some(v), _) => return Err(Error::usage(format!("{v} channels"), "use 1 to 400")),
        (None, Some(n)) => n.integer(1, 400)?,
        (None, None) => 20,
    };
    let pixels = u64::from(width) * u64::from(height);
    let kept = options.crop.map_or(pixels, |part| part.pixels() as u64);
    if pixels > MOST_PIXELS || kept.saturating_mul(count.into()) > MOST_VALUES {
        return Err(at.fail(
            format!("{width} x {height} pixels of {count} bins are too many"),
            "render at most 64 Mi pixels and 2 Gi values",
        ));
    }
    let exposure = get("exposure").map(|n| n.within(-100.0, 100.0)).transpose()?;
    let sampling = match get("sampling").map(|n| n.choice(&["continuous", "centres"])).transpose()? {
        Some("centres") => WavelengthSampling::Centres,
        _ => WavelengthSampling::Continuous,
    };
    let filter = get("filter").map_or(Ok(Filter::Box), |n| filter(&n))?;
    Ok(FilmSettings { width, height, crop: None, bins: Bins { min_nm, max_nm, count }, filter, sampling, exposure })
}

/// Keeps that part of the film's picture that `options` ask for.
pub(in crate::scene) fn crop(film: &mut FilmSettings, options: &LoadOptions) -> Result<()> {
    let Some(part) = options.crop else { return Ok(()) };
    let is_within = |first: u32, count: u32, all: u32| count > 0 && u64::from(first) + u64::from(count) <= u64::from(all);
    if !is_within(part.x, part.width, film.width) || !is_within(part.y, part.height, film.height) {
        let Tile { x, y, width, height } = part;
        let problem = format!("--crop {x},{y},{width},{height} is no part of a picture of {}x{} pixels", film.width, film.height);
        return Err(Error::usage(problem, "count pixels from 0 at the upper left, as x,y,width,height"));
    }
    film.crop = Some(part);
    Ok(())
}

fn filter(node: &Node) -> Result<Filter> {
    if node.value.is_string() {
        node.choice(&["box"])?;
        return Ok(Filter::Box);
    }
    node.object("filter")?;
    let (kind, inner) = node.one_of(&["tent", "gaussian"])?;
    inner.object(kind)?;
    Ok(match kind {
        "tent" => Filter::Tent { radius: inner.need("radius")?.within(0.1, 10.0)? },
        _ => Filter::Gaussian { sigma: inner.need("sigma")?.within(0.05, 5.0)? },
    })
}

fn sensor(node: &Node, loader: &Loader) -> Result<Sensor> {
    node.object("camera")?;
    let (kind, inner) = node.one_of(SENSORS)?;
    inner.object(if kind == "lens" { "camera_lens" } else { kind })?;
    Ok(match kind {
        "lens" => lens::camera(&inner, &loader.scene.film, &loader.reader)?,
        "perspective" => {
            let (eye, frame, distance) = view(&inner)?;
            let vfov = inner.need("vfov_deg")?;
            let degrees = vfov.number()?;
            if !(1e-4..=179.9).contains(&degrees) {
                return Err(vfov.fail(format!("a field of view of {degrees} degrees"), "use an angle between 0.0001 and 179.9"));
            }
            Sensor::Perspective {
                eye,
                frame,
                tan_half_vfov: (0.5 * degrees).to_radians().tan(),
                lens_radius: match inner.get("aperture_radius") {
                    Some(n) if n.non_negative()? > 0.0 => n.length()?,
                    _ => 0.0,
                },
                focus_distance: inner.get("focus_distance").map_or(Ok(distance), |n| n.length())?,
                optics: None,
            }
        }
        "orthographic" => {
            let (eye, frame, _) = view(&inner)?;
            Sensor::Orthographic { eye, frame, height: inner.need("height")?.length()? }
        }
        "irradiance_plane" => {
            let (edge_u, edge_v) = edges(&inner)?;
            Sensor::IrradiancePlane { origin: inner.need("origin")?.point()?, edge_u, edge_v }
        }
        _ => Sensor::IrradianceSphere { center: inner.need("center")?.point()?, radius: inner.need("radius")?.length()? },
    })
}

/// `edge_u` and `edge_v`, which must span an area.
pub(in crate::scene) fn edges(node: &Node) -> Result<(DVec3, DVec3)> {
    let (u, v) = (node.need("edge_u")?.point()?, node.need("edge_v")?.point()?);
    let area = u.cross(v).length();
    if !(area > 1e-12 * u.length() * v.length() && area > 0.0) {
        return Err(node.fail("edge_u and edge_v span no area", "give two edges that are neither zero nor parallel"));
    }
    Ok((u, v))
}

/// Eye, frame (right, up, backward) and distance of the target.
pub(in crate::scene) fn view(node: &Node) -> Result<(DVec3, DMat3, f64)> {
    let eye = node.need("eye")?.point()?;
    let target = node.need("target")?;
    let distance = (eye - target.point()?).length();
    if distance < 1e-12 {
        return Err(target.fail("the camera looks at its own eye", "move eye and target apart"));
    }
    let up = node.get("up").map_or(Ok(DVec3::Y), |n| n.direction())?;
    let frame = frame(eye - target.point()?, up)
        .ok_or_else(|| node.fail("up is parallel to the view", "give an \"up\" that is not along eye to target"))?;
    Ok((eye, frame, distance))
}

/// Orthonormal right, up, backward; none if `backward` or `up` is zero or they are parallel.
pub(in crate::scene) fn frame(backward: DVec3, up: DVec3) -> Option<DMat3> {
    let backward = backward.try_normalize()?;
    let right = up.try_normalize()?.cross(backward);
    if right.length() < 1e-9 {
        return None;
    }
    let right = right.normalize();
    Some(DMat3::from_cols(right, backward.cross(right), backward))
}

impl Loader {
    /// The scene, all of whose files have been read.
    fn finish(mut self) -> Scene {
        self.flatten_the_few();
        self.comb();
        self.scene.match_panes();
        self.scene.settle_volumes();
        let [notes, warnings] = self.reader.remarks.take();
        self.scene.notes.extend(notes);
        let files = &self.reader.files;
        Scene { warnings, source_hash: files.hash(), sources: files.sources(), ..self.scene }
    }

    /// Adds a note for the user, once.
    pub(in crate::scene) fn note(&mut self, note: String) {
        if !self.scene.notes.contains(&note) {
            self.scene.notes.push(note);
        }
    }
}
