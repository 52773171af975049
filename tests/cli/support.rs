//! Running the command in a folder of its own.

use abbe::film::Film;
use abbe::output::exr::Aovs;
use abbe::output::{Provenance, write_exr};
use abbe::scene::{Bins, FilmSettings};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A lit sphere.
pub const SCENE: &str = r#"{
  "name": "ball",
  "film": {"width": 8, "height": 6, "bins": 4},
  "camera": {"perspective": {"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40}},
  "materials": {"white": {"diffuse": {"reflectance": 0.75}}},
  "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "white"}],
  "lights": [{"constant": {"radiance": 1}}]
}"#;

/// A folder of its own for a test, with the scene in it, removed at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("abbe-cli-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("ball.json"), SCENE).unwrap();
        Folder(path)
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_abbe"));
        command.args(arguments).current_dir(&self.0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The arguments fail with exit code 2 and one line on standard error that contains all of `says`.
pub fn fails(folder: &Folder, arguments: &[&str], says: &[&str]) {
    let before = folder.names();
    let output = folder.run(arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    for part in says {
        assert!(stderr.contains(part), "{arguments:?}: no '{part}' in {stderr}");
    }
    assert_eq!(folder.names(), before, "{arguments:?} left something behind");
}

/// Writes a spectral EXR of `width` x `height` pixels and `bins` over 380 to 780 nm with errors, from the values `batch(pixel, channel)` of
/// some batches, where channels are the bins and then X, Y, Z.
pub fn write_film(path: &Path, (width, height, bins): (u32, u32, u32), batches: &[&dyn Fn(usize, usize) -> f64]) {
    let bins = Bins { min_nm: 380.0, max_nm: 780.0, count: bins };
    let settings = FilmSettings::new(width, height, bins);
    let mut film = Film::new(&settings);
    let (pixels, channels) = (film.pixels(), film.channels());
    for batch in batches {
        let sums: Vec<f64> = (0..pixels * channels).map(|i| batch(i / channels, i % channels)).collect();
        film.add_batch_f64(&sums, 1);
    }
    write_exr(path, &film, &Provenance::default(), Aovs { errors: true, ..Aovs::default() }).unwrap();
}
