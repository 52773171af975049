//! The live view: who is let in, what a document keeps, that what it shows settled is what `render` makes, and the page in a real browser.
#![cfg(feature = "view")]

mod access;
mod browser;
mod denoise;
mod document;
mod engine;
mod http;
mod page;

use std::path::PathBuf;

/// A folder of its own that is removed at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    /// By this name.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("abbe-view-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder");
        Folder(path)
    }

    /// Writes a file in it.
    pub fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("a file");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A prism between a lamp and a floor, small: dispersion, light paths and merging.
pub const SCENE: &str = r#"{
    "//": "kept as it is",
    "name": "small",
    "film": {"width": 48, "height": 32, "range_nm": [400, 700], "bins": 8},
    "camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 0.5, 0], "vfov_deg": 30}},
    "materials": {
        "floor": {"diffuse": {"reflectance": 0.6}},
        "glass": {"dielectric": {"ior": "N-BK7"}}
    },
    "shapes": [
        {"name": "floor", "quad": {"corner": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4]}, "material": "floor"},
        {"name": "ball", "sphere": {"center": [0, 0.6, 0], "radius": 0.5}, "material": "glass"},
        {"name": "lamp", "disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.2}, "emission": {"radiance": {"spectrum": {"blackbody": 5000}, "luminous_flux_lm": 100}}}
    ]
}"#;
