//! The scene that is looked at, as one JSON document: what the file says, then edits one after the other, then the camera. All else follows from it.

use super::files::modified;
use crate::error::{Error, Result};
use crate::output::write_text;
use crate::scene::{LoadOptions, Scene, Sensor, load, load_str};
use glam::DVec3;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A change of one value of the document.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    /// Keys, and places in lists as numbers, from the root.
    pub path: Vec<String>,
    /// What stands there from now on.
    pub value: Value,
}

/// Whether something may be edited: materials and light, and no names of files that shapes come from.
fn is_editable(path: &[String]) -> bool {
    if path.len() > MOST_KEYS {
        return false;
    }
    let keys: Vec<&str> = path.iter().map(String::as_str).collect();
    matches!(keys[..], ["lights" | "materials", ..] | ["shapes", _, "emission", ..] | ["shapes", _, "gltf", "override", _, ..])
}

/// Keys of a path to what is edited: each one more nests the document deeper.
const MOST_KEYS: usize = 32;

/// Edits that can be undone.
const MOST_EDITS: usize = 500;

/// A scene file with what was changed about it.
#[derive(Debug, Clone)]
pub struct Document {
    path: PathBuf,
    options: LoadOptions,
    base: Value,
    edits: Vec<Edit>,
    undone: Vec<Edit>,
    camera: Option<Value>,
    files: Vec<(PathBuf, Option<SystemTime>)>,
}

impl Document {
    /// Opens a scene file, JSON or glTF, and loads it.
    ///
    /// # Errors
    /// Those of [`load`].
    pub fn open(path: &Path, options: LoadOptions) -> Result<(Self, Scene)> {
        let (path, nothing) = (path.to_path_buf(), Value::Null);
        let mut document =
            Document { path, options, base: nothing, edits: Vec::new(), undone: Vec::new(), camera: None, files: Vec::new() };
        document.read()?;
        let scene = document.scene()?;
        document.watch(&scene, true);
        Ok((document, scene))
    }

    fn read(&mut self) -> Result<()> {
        let options = &self.options;
        let extension = self.path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let mut base = if extension == "glb" || extension == "gltf" {
            if options.studio {
                return Err(Error::usage(
                    "--studio is no light that a scene file can have, and what is seen here can be saved as one",
                    "leave it out, or include the file in a scene with lights of its own",
                ));
            }
            wrapped(&self.path, &load(&self.path, options)?)
        } else {
            // Its errors are those of a scene file that is loaded.
            load(&self.path, options)?;
            let text = std::fs::read_to_string(&self.path).map_err(|e| Error::file(&self.path, e, "check the path"))?;
            crate::scene::parse(&text, &self.path)?
        };
        for setting in &options.settings {
            setting.apply(&mut base)?;
        }
        let film = [("width", options.width), ("height", options.height), ("bins", options.channels)];
        for (key, value) in film.into_iter().filter_map(|(key, value)| Some((key, value?))) {
            set(&mut base, &["film".to_string(), key.to_string()], json!(value));
        }
        if let Some(depth) = options.max_depth {
            set(&mut base, &["max_depth".to_string()], json!(depth));
        }
        self.base = base;
        Ok(())
    }

    /// The document as a scene file has it.
    pub fn json(&self) -> Value {
        let mut value = self.base.clone();
        self.edits.iter().for_each(|edit| set(&mut value, &edit.path, edit.value.clone()));
        if let Some(camera) = &self.camera {
            set(&mut value, &["camera".to_string()], camera.clone());
        }
        value
    }

    /// The scene that it describes.
    ///
    /// # Errors
    /// Those of [`load_str`].
    pub fn scene(&self) -> Result<Scene> {
        let mut scene = self.load(&self.json())?;
        if scene.name.is_empty() {
            scene.name = self.stem();
        }
        Ok(scene)
    }

    /// Where the scene's file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn folder(&self) -> &Path {
        self.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    fn stem(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Edits so far, and those that can be done again.
    pub fn edits(&self) -> (usize, usize) {
        (self.edits.len(), self.undone.len())
    }

    /// Whether anything is not as the file has it.
    pub fn is_changed(&self) -> bool {
        self.camera.is_some() || !self.edits.is_empty()
    }

    /// Makes a change, and loads the scene with it. Changes of the same value one after the other, as a slider makes them, are one where `goes_on`.
    ///
    /// # Errors
    /// [`Error::Usage`] for what cannot be edited, and those of [`load_str`]; the document then stays as it was.
    pub fn edit(&mut self, edit: Edit, goes_on: bool) -> Result<Scene> {
        if !is_editable(&edit.path) {
            return Err(Error::usage("this part of the scene cannot be edited here", "edit the scene's file"));
        }
        let (before, path, value) = (self.edits.clone(), edit.path.clone(), edit.value.clone());
        match self.edits.last_mut() {
            Some(last) if goes_on && last.path == edit.path => *last = edit,
            _ => self.edits.push(edit),
        }
        if self.edits.len() > MOST_EDITS {
            // The oldest becomes what the scene begins with.
            let oldest = self.edits.remove(0);
            set(&mut self.base, &oldest.path, oldest.value);
        }
        let is_there = get(&self.json(), &path).unwrap_or(&Value::Null) == &value;
        let nowhere = || Error::usage("there is no such place in the scene", "look at the scene again");
        match if is_there { self.scene() } else { Err(nowhere()) } {
            Ok(scene) => {
                self.undone.clear();
                self.watch(&scene, false);
                Ok(scene)
            }
            Err(e) => {
                self.edits = before;
                Err(e)
            }
        }
    }

    /// Takes the last change back, or with `again` makes the last one that was taken back. `None` if there is none.
    ///
    /// # Errors
    /// Those of [`load_str`].
    pub fn undo(&mut self, again: bool) -> Option<Result<Scene>> {
        let (from, to) = if again { (&mut self.undone, &mut self.edits) } else { (&mut self.edits, &mut self.undone) };
        to.push(from.pop()?);
        Some(self.scene().inspect(|scene| self.watch(scene, false)))
    }

    /// Whether it is looked at from there already.
    pub fn is_seen_from(&self, camera: &Option<Value>) -> bool {
        self.camera == *camera
    }

    fn load(&self, scene: &Value) -> Result<Scene> {
        let options = LoadOptions {
            allow_outside: self.options.allow_outside,
            solid_glass: self.options.solid_glass,
            ..LoadOptions::default()
        };
        load_str(&scene.to_string(), &self.path, self.folder(), &options)
    }

    /// Looks from another camera, as a scene file has it; `None`: from the file's own.
    ///
    /// # Errors
    /// Those of [`load_str`], for a camera that is none.
    pub fn look(&mut self, camera: Option<Value>) -> Result<Sensor> {
        // The camera alone, in an empty room: a scene takes time to load.
        let own = camera.is_none().then(|| self.base.get("camera").cloned()).flatten();
        let Some(seen) = camera.clone().or(own) else {
            // That of an included file.
            let before = self.camera.take();
            return self.scene().map(|scene| scene.sensor).inspect_err(|_| self.camera = before);
        };
        // A lens is made for the film and its wavelengths.
        let mut room = json!({"camera": seen, "lights": [{"constant": {"radiance": 1}}]});
        if let Some(film) = self.base.get("film") {
            room["film"] = film.clone();
        }
        let sensor = self.load(&room)?.sensor;
        self.camera = camera;
        Ok(sensor)
    }

    /// The camera as a scene file has it: what the document says, or else what the `scene` has.
    pub fn camera(&self, scene: &Scene) -> Value {
        let said = self.camera.clone().or_else(|| self.base.get("camera").cloned());
        said.unwrap_or_else(|| camera_json(scene))
    }

    /// Whether a file that the scene was read from is another one by now.
    pub fn is_outdated(&self) -> bool {
        self.files.iter().any(|(path, time)| modified(path) != *time)
    }

    /// Reads the files anew, with the same camera and the same edits.
    ///
    /// # Errors
    /// Those of [`load`]; the document then stays as it was, and is tried again when a file changes.
    pub fn reload(&mut self) -> Result<Scene> {
        let (base, edits) = (self.base.clone(), self.edits.clone());
        self.files.iter_mut().for_each(|(path, time)| *time = modified(path));
        // Edits of what is no longer there are lost.
        let read = self.read().and_then(|()| {
            self.scene().or_else(|e| {
                self.edits.clear();
                self.scene().map_err(|_| e)
            })
        });
        match read {
            Ok(scene) => {
                self.watch(&scene, true);
                Ok(scene)
            }
            Err(e) => {
                (self.base, self.edits) = (base, edits);
                Err(e)
            }
        }
    }

    /// Watches the files of a scene: from now on where all was read anew, else those that it has read before since then.
    fn watch(&mut self, scene: &Scene, is_read_anew: bool) {
        let known = std::mem::take(&mut self.files);
        let since = |path: &PathBuf| known.iter().find(|(old, _)| !is_read_anew && old == path).map(|(_, time)| *time);
        let paths = std::iter::once(self.path.clone()).chain(scene.sources.iter().cloned());
        self.files = paths.map(|path| (path.clone(), since(&path).unwrap_or_else(|| modified(&path)))).collect();
    }

    /// Writes the document beside the scene's file, by a name of its own.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name that is none, or taken by another file; [`Error::File`] where it cannot be written.
    pub fn save(&self, name: &str) -> Result<PathBuf> {
        let stem = name.trim().strip_suffix(".json").unwrap_or(name.trim());
        let is_plain = |c: char| c.is_alphanumeric() || " -_.".contains(c);
        if stem.is_empty() || stem.starts_with('.') || stem.len() > 100 || !stem.chars().all(is_plain) {
            return Err(Error::usage("this is no name for a scene", "use letters, digits, blanks, - and _"));
        }
        let path = self.folder().join(format!("{stem}.json"));
        if path.exists() {
            return Err(Error::usage(format!("{stem}.json is there already"), "choose another name: nothing is written over"));
        }
        let text = serde_json::to_string_pretty(&self.json()).map_err(|e| Error::usage(e, "report this"))?;
        write_text(&path, &(text + "\n"))?;
        Ok(path)
    }

    /// A name to save by that is not taken.
    pub fn free_name(&self) -> String {
        let names =
            (1..1000).map(|i| if i == 1 { format!("{}-edited", self.stem()) } else { format!("{}-edited-{i}", self.stem()) });
        let free = names.into_iter().find(|name| !self.folder().join(format!("{name}.json")).exists());
        free.unwrap_or_else(|| "scene".into())
    }
}

/// A glTF file as a scene file that includes it.
fn wrapped(path: &Path, scene: &Scene) -> Value {
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut base = json!({
        "name": scene.name,
        "film": {"width": scene.film.width, "height": scene.film.height},
        "camera": camera_json(scene),
        "shapes": [{"gltf": {"file": file}}],
    });
    if scene.notes.iter().any(|note| note.starts_with("the glTF file has no light")) {
        base["lights"] = json!([{"constant": {"radiance": {"spectrum": {"linear_rgb": [1, 1, 1]}, "luminance_cd_m2": 1}}}]);
    }
    base
}

/// The camera of a scene as a scene file has it. It looks at the middle of what is there, as far as that lies before it.
fn camera_json(scene: &Scene) -> Value {
    let bounds = crate::scene::bounds_of_all(&scene.shapes);
    let middle = 0.5 * (bounds.min + bounds.max);
    let point = |p: DVec3| json!([p.x, p.y, p.z]);
    let target = |eye: &DVec3, backward: DVec3, else_by: f64| {
        let along = (*eye - middle).dot(backward);
        point(*eye - backward * if along.is_finite() && along > 1e-6 { along } else { else_by })
    };
    match &scene.sensor {
        Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius, focus_distance, .. } => {
            let mut camera = json!({
                "eye": point(*eye),
                "target": target(eye, frame.z_axis, *focus_distance),
                "up": point(frame.y_axis),
                "vfov_deg": 2.0 * tan_half_vfov.atan().to_degrees(),
            });
            if *lens_radius > 0.0 {
                camera["aperture_radius"] = json!(lens_radius);
                camera["focus_distance"] = json!(focus_distance);
            }
            json!({"perspective": camera})
        }
        Sensor::Orthographic { eye, frame, height } => json!({"orthographic": {
            "eye": point(*eye),
            "target": target(eye, frame.z_axis, *height),
            "up": point(frame.y_axis),
            "height": height,
        }}),
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            json!({"irradiance_plane": {"origin": point(*origin), "edge_u": point(*edge_u), "edge_v": point(*edge_v)}})
        }
        Sensor::IrradianceSphere { center, radius } => json!({"irradiance_sphere": {"center": point(*center), "radius": radius}}),
    }
}

/// The value at these keys.
pub(super) fn get<'a>(document: &'a Value, path: &[String]) -> Option<&'a Value> {
    path.iter().try_fold(document, |place, step| match place {
        Value::Array(elements) => elements.get(step.parse::<usize>().ok()?),
        _ => place.get(step.as_str()),
    })
}

/// Sets a value by its keys, or with null removes it; objects on the way are made where they are missing. What has no such place stays: loading tells.
fn set(document: &mut Value, path: &[String], value: Value) {
    let Some((last, way)) = path.split_last() else { return };
    let mut place = document;
    for step in way {
        if place.is_null() {
            *place = Value::Object(Map::new());
        }
        place = match place {
            Value::Object(members) => members.entry(step.as_str()).or_insert(Value::Null),
            Value::Array(elements) => match step.parse::<usize>().ok().and_then(|i| elements.get_mut(i)) {
                Some(element) => element,
                None => return,
            },
            _ => return,
        };
    }
    if place.is_null() && !value.is_null() {
        *place = Value::Object(Map::new());
    }
    match place {
        Value::Object(members) if value.is_null() => {
            members.shift_remove(last);
        }
        Value::Object(members) => {
            members.insert(last.clone(), value);
        }
        Value::Array(elements) => {
            if let Some(element) = last.parse::<usize>().ok().and_then(|i| elements.get_mut(i)) {
                *element = value;
            }
        }
        _ => {}
    }
}
