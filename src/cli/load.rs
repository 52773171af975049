//! The options that say which scene, shared by the commands that take one.

use super::values;
use crate::error::{Error, Result};
use crate::memory;
use crate::scene::{LoadOptions, Scene, Setting, Tile, load};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct SceneArgs {
    /// Scene file (.json), or a glTF file (.gltf, .glb)
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Which part of the picture.
#[derive(clap::Args, Clone)]
pub struct CropArgs {
    /// Only this part of the picture, in pixels from the upper left; the EXR says where it lies
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = values::part)]
    pub crop: Option<Tile>,
}

/// How much memory a scene may take.
#[derive(clap::Args, Clone)]
pub struct MemoryArgs {
    /// End if loading and set-up need more memory than this, as in 500M or 2G (what the adapter holds counts, too) [default: nine tenths of what the machine, or the container, has]
    #[arg(long, value_name = "SIZE", value_parser = values::memory)]
    max_memory: Option<u64>,
}

impl MemoryArgs {
    /// From here on.
    pub fn limit(&self) {
        memory::limit(self.max_memory.or_else(|| Some(memory::of_machine()? / 10 * 9)));
    }
}

/// What the command line changes about a scene.
#[derive(clap::Args, Clone, Default)]
pub struct Overrides {
    /// Resolution instead of the scene's, as in 640x480
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// The part of the picture that is rendered
    #[arg(skip)]
    pub crop: Option<Tile>,
    /// Number of wavelength bins instead of the scene's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=400))]
    pub channels: Option<u32>,
    /// Greatest number of scattering events on a path instead of the scene's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub max_depth: Option<u32>,
    /// Set a key of the scene file, by its path as errors print it: camera.perspective.vfov_deg=30; may stand several times
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    pub settings: Vec<Setting>,
    /// The frame of a sequence that is rendered
    #[arg(skip)]
    pub frame: Option<u32>,
    /// Frames per second instead of the scene's
    #[arg(skip)]
    pub frames_per_second: Option<f64>,
    /// Let the scene name files outside its own folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Take closed meshes of glass without a thickness as solid, as Blender's exporter writes them
    #[arg(long)]
    pub solid_glass: bool,
    /// Light a glTF file that has no light by a soft studio, which shows gloss, instead of even daylight
    #[arg(long)]
    pub studio: bool,
}

impl Overrides {
    /// Loads `path` with these changes.
    pub fn load(&self, path: &std::path::Path) -> Result<Scene> {
        load(path, &self.options()).map_err(|error| match (error, self.frame) {
            (Error::Scene { file, path, problem, remedy }, Some(frame)) => {
                Error::Scene { file, path, problem: format!("{problem} (in frame {frame})"), remedy }
            }
            (error, _) => error,
        })
    }

    /// The changes as the loader takes them.
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            width: self.size.map(|s| s.0),
            height: self.size.map(|s| s.1),
            crop: self.crop,
            channels: self.channels,
            max_depth: self.max_depth,
            settings: self.settings.clone(),
            frame: self.frame,
            frames_per_second: self.frames_per_second,
            solid_glass: self.solid_glass,
            studio: self.studio,
        }
    }
}
