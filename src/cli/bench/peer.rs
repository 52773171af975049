//! Mitsuba 3 beside Abbe, where `python3` has it: the same scene on the same machine, in turns. `tools/mitsuba_peer.py` does the rendering.

use super::clock::Spent;
use crate::error::{Error, Result};
use crate::output::write_text;
use crate::render::Progress;
use crate::scene::{Geometry, Material, Mesh, Scene, Sensor, Shape, Texture};
use crate::spectrum::{Ior, Spectrum};
use crate::stats::BatchStats;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

const DRIVER: &str = include_str!("../../../tools/mitsuba_peer.py");

/// Another renderer.
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum PeerKind {
    /// Mitsuba 3 of `python3`: path tracing, and where there is no fog light tracing
    Mitsuba,
}

/// One of its integrators at work on a scene.
pub struct Peer {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// Where meshes and images go.
    folder: PathBuf,
    /// Name and version.
    pub name: String,
    /// Until its kernels were compiled, s.
    pub setup: f64,
}

/// What it has rendered so far.
pub struct PeerImage {
    pub spp: u32,
    pub spent: Spent,
    /// Mean radiance `[pixel][bin]`.
    pub data: Vec<f32>,
}

impl PeerImage {
    /// The same for a row, of an image of so many pixels.
    pub fn progress(&self, pixels: usize) -> Progress {
        let paths = u64::from(self.spp) * pixels as u64;
        Progress {
            spp: self.spp.into(),
            fraction: 0.0,
            stats: BatchStats { paths, ..BatchStats::default() },
            rays_per_second: f64::NAN,
            relative_error: f64::NAN,
            elapsed: Duration::from_secs_f64(self.spent.wall),
            remaining: None,
        }
    }
}

/// The integrators for `scene`: from the camera and from the lights; or why there is none.
pub fn integrators(scene: &Scene) -> [(&'static str, std::result::Result<(), String>); 2] {
    if fog(scene).is_some() {
        [("volpath", Ok(())), ("ptracer", Err("Mitsuba's light tracer knows no fog".to_string()))]
    } else {
        [("path", Ok(())), ("ptracer", Ok(()))]
    }
}

impl Peer {
    /// Starts one on `scene`; the error says why there is none.
    pub fn start(scene: &Scene, integrator: &str) -> std::result::Result<Self, String> {
        let folder = std::env::temp_dir().join(format!("abbe-peer-{integrator}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let started = Self::run(scene, integrator, &folder);
        if started.is_err() {
            remove(&folder);
        }
        started
    }

    fn run(scene: &Scene, integrator: &str, folder: &Path) -> std::result::Result<Self, String> {
        let described = describe(scene, integrator, folder)?;
        let errors = folder.join("errors");
        let mut process = Command::new("python3")
            .args(["-c", DRIVER])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(&errors).map_err(|e| format!("{}: {e}", errors.display()))?)
            .spawn()
            .map_err(|e| format!("python3: {e}"))?;
        let (Some(mut input), Some(output)) = (process.stdin.take(), process.stdout.take()) else {
            return Err("python3 cannot be spoken with".to_string());
        };
        // If it ended already, what it says is more to the point than that it does not listen.
        let _ = writeln!(input, "{described}");
        let mut output = BufReader::new(output);
        let Some(first) = answer(&mut output) else {
            end(&mut process);
            let said = std::fs::read_to_string(errors).unwrap_or_default();
            // LLVM ends the process with a page after its complaint.
            let complaint = said.lines().find(|line| line.contains("ERROR")).or(said.lines().last());
            return Err(complaint.unwrap_or("python3 ended").to_string());
        };
        let (name, setup) = (first["name"].as_str().unwrap_or_default().to_string(), first["setup"].as_f64().unwrap_or(f64::NAN));
        Ok(Peer { process, input, output, folder: folder.to_path_buf(), name, setup })
    }

    /// Lets it render until it has had `seconds` of processor time in all.
    ///
    /// # Errors
    /// [`Error::Device`] if it ends.
    pub fn catch_up(&mut self, seconds: f64) -> Result<PeerImage> {
        let lost = || Error::device(format!("{} stopped answering", self.name), "run it without --peer");
        let told = writeln!(self.input, "{seconds}").and_then(|()| self.input.flush());
        let answer = told.ok().and_then(|()| answer(&mut self.output)).ok_or_else(lost)?;
        let bytes = std::fs::read(self.folder.join("image")).map_err(|_| lost())?;
        let number = |name: &str| answer[name].as_f64().unwrap_or(f64::NAN);
        Ok(PeerImage {
            spp: number("spp") as u32,
            spent: Spent { wall: number("wall"), cpu: Some(number("cpu")) },
            data: bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        })
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        end(&mut self.process);
        remove(&self.folder);
    }
}

/// Ends it, if it has not ended already.
fn end(process: &mut Child) {
    let _ = process.kill();
    let _ = process.wait();
}

/// A folder of its own under the system's, which cleans up what is left.
fn remove(folder: &Path) {
    let _ = std::fs::remove_dir_all(folder);
}

/// The next line that it says, `None` if it has ended.
fn answer(output: &mut impl BufRead) -> Option<Value> {
    let mut line = String::new();
    output.read_line(&mut line).ok()?;
    serde_json::from_str(&line).ok()
}

/// The one fog of a scene: its interior, and no other scatters.
fn fog(scene: &Scene) -> Option<usize> {
    (0..scene.interiors.len()).find(|&i| !scene.interiors[i].sigma_s.is_zero())
}

/// The scene as the driver reads it, meshes written into `folder`; the error says what of it the driver does not know.
fn describe(scene: &Scene, integrator: &str, folder: &Path) -> std::result::Result<Value, String> {
    let Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius: 0.0, optics: None, .. } = &scene.sensor else {
        return Err("only pinhole cameras are handed over".to_string());
    };
    if !scene.lights.is_empty() {
        return Err("only shapes that shine are handed over".to_string());
    }
    let bins = &scene.film.bins;
    let fog = fog(scene).map(|i| {
        let interior = &scene.interiors[i];
        let (s, a) = (interior.sigma_s.eval(550.0), interior.sigma_a.eval(550.0));
        json!({"sigma_t": s + a, "albedo": s / (s + a), "g": interior.g})
    });
    let shapes: std::result::Result<Vec<Value>, String> = scene
        .shapes
        .iter()
        .enumerate()
        .map(|(i, shape)| describe_shape(scene, shape, &folder.join(format!("{i}.ply"))))
        .collect();
    Ok(json!({
        "integrator": integrator,
        "max_depth": scene.max_depth,
        "size": [scene.film.width, scene.film.height],
        "min_nm": bins.min_nm,
        "max_nm": bins.max_nm,
        "bins": bins.count,
        "camera": {
            "eye": eye.to_array(),
            "target": (*eye - frame.z_axis).to_array(),
            "up": frame.y_axis.to_array(),
            "vfov_deg": 2.0 * tan_half_vfov.atan().to_degrees(),
        },
        "fog": fog,
        "shapes": shapes?,
        "image": folder.join("image"),
    }))
}

fn describe_shape(scene: &Scene, shape: &Shape, file: &Path) -> std::result::Result<Value, String> {
    let table = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
        (0..=(hi - lo).ceil() as u32).map(|i| f(lo + f64::from(i))).collect()
    };
    let spectrum = |s: &Spectrum| table(&|nm| s.eval(nm));
    let ior = |ior: &Ior| table(&|nm| ior.eval(nm));
    let uniform = |texture: &Texture| match texture {
        Texture::Uniform(s) => Ok(spectrum(s)),
        Texture::Image(_) => Err(format!("{}: pictures are not handed over", shape.name)),
    };
    let mut described = match &scene.materials[shape.material] {
        Material::Diffuse { reflectance } => json!({"kind": "diffuse", "reflectance": uniform(reflectance)?}),
        Material::Conductor { eta, k, alpha: 0.0 } => json!({"kind": "conductor", "eta": spectrum(eta), "k": spectrum(k)}),
        Material::Dielectric { interior, alpha: 0.0, tint: None, antireflective: false } => {
            json!({"kind": "dielectric", "ior": ior(&scene.interiors[*interior].ior)})
        }
        Material::Boundary { interior: Some(_) } => json!({"kind": "fog"}),
        _ => return Err(format!("{}: its material is not handed over", shape.name)),
    };
    match &shape.geometry {
        Geometry::Sphere { center, radius } => described["sphere"] = json!([center.x, center.y, center.z, radius]),
        Geometry::Mesh(mesh) => {
            write_text(file, &ply(mesh)).map_err(|e| e.to_string())?;
            described["ply"] = json!(file);
            described["smooth"] = json!(!mesh.normals.is_empty());
        }
        _ => return Err(format!("{}: only spheres and meshes are handed over", shape.name)),
    }
    described["radiance"] = shape.emission.as_ref().map(|e| uniform(&e.radiance)).transpose()?.into();
    Ok(described)
}

/// A mesh as ASCII PLY.
fn ply(mesh: &Mesh) -> String {
    let normals = if mesh.normals.is_empty() { "" } else { "property double nx\nproperty double ny\nproperty double nz\n" };
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n{normals}element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    );
    for (i, p) in mesh.positions.iter().enumerate() {
        let n = mesh.normals.get(i).map_or(String::new(), |n| format!(" {} {} {}", n.x, n.y, n.z));
        // Writing to a string does not fail.
        let _ = writeln!(text, "{} {} {}{n}", p.x, p.y, p.z);
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, load};

    #[test]
    fn all_scenes_for_comparison_can_be_handed_over() {
        let folder = std::env::temp_dir().join(format!("abbe-peer-test-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let described = |name: &str| {
            let scene = load(Path::new(&format!("scenes/compare/{name}.json")), &LoadOptions::default()).unwrap();
            let (integrator, runs) = integrators(&scene)[0].clone();
            runs.unwrap();
            describe(&scene, integrator, &folder).unwrap()
        };
        let kinds = |scene: &Value| -> Vec<String> {
            scene["shapes"].as_array().unwrap().iter().map(|s| s["kind"].as_str().unwrap().to_string()).collect()
        };
        for name in ["barrel", "bunny_light", "cornell_prism", "cornell_spheres", "nephroid", "newton", "pool"] {
            let scene = described(name);
            assert!(scene["fog"].is_null() && scene["integrator"] == "path", "{name}");
            let shining = scene["shapes"].as_array().unwrap().iter().filter(|s| !s["radiance"].is_null()).count();
            assert_eq!(shining, 1, "{name}");
            let bends = kinds(&scene).iter().any(|kind| ["dielectric", "conductor"].contains(&kind.as_str()));
            assert!(bends, "{name}: {:?}", kinds(&scene));
        }
        let fog = described("fog");
        assert_eq!(fog["integrator"], "volpath");
        assert_eq!(fog["fog"], json!({"sigma_t": 0.15, "albedo": 1.0, "g": 0.0}));
        assert_eq!(kinds(&fog).iter().filter(|kind| *kind == "fog").count(), 1);
        // N-SF11 by its Sellmeier formula at 587.6 nm: 1.78472; the table is in steps of 1 nm from 380 on.
        let index = fog["shapes"].as_array().unwrap().iter().find_map(|s| s["ior"][208].as_f64()).unwrap();
        assert!((index - 1.78472).abs() < 1e-4, "{index}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
