//! `abbe new`: a scene to start from, with comments.

use super::{Done, Outcome, print::out};
use crate::error::Error;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  abbe new rainbow && abbe render rainbow.json
  abbe new fan --from lens            five rays through a lens, in smoke
  abbe new stone --from gem           a diamond; its mesh is written beside it
  abbe new photograph --from gauss    what a lens makes of a table
  abbe new tests/prism.json";

/// Scenes to start from, which ship: their words, and their names.
const SCENES: [(&str, &str, &str); 11] = [
    ("starter", "starter", include_str!("../../scenes/starter.json")),
    ("prism", "prism_dark", include_str!("../../scenes/prism_dark.json")),
    ("coffee", "coffee", include_str!("../../scenes/coffee.json")),
    ("lens", "lens", include_str!("../../scenes/lens.json")),
    ("rainbow", "rainbow", include_str!("../../scenes/rainbow.json")),
    ("gem", "gem", include_str!("../../scenes/gem.json")),
    ("room", "cornell_spheres_dispersed", include_str!("../../scenes/cornell_spheres_dispersed.json")),
    ("singlet", "photograph", PHOTOGRAPH),
    ("achromat", "photograph", PHOTOGRAPH),
    ("triplet", "photograph", PHOTOGRAPH),
    ("gauss", "photograph", PHOTOGRAPH),
];
/// Of which the lens is the one of the word.
const PHOTOGRAPH: &str = include_str!("../../scenes/photograph.json");
const LENS: &str = "\"prescription\": \"achromat\"";
/// The mesh of the gem, which is written beside it.
const DIAMOND: (&str, &[u8]) = ("diamond.ply", include_bytes!("../../scenes/diamond.ply"));

/// What editors of the shipped scenes find beside them.
const SCHEMA: &str = "  \"$schema\": \"scene.schema.json\",\n";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Name of the scene, or its file; .json is added where it is missing
    #[arg(value_name = "NAME")]
    name: PathBuf,
    /// The scene to start from: a prism on a table, the prism of the textbooks, the caustic in a cup, rays through a lens, Descartes' globe of water, a diamond, a Cornell box with two spheres, or a photograph through a lens of this kind
    #[arg(long, value_name = "SCENE", default_value = "starter", value_parser = SCENES.map(|(word, ..)| word))]
    from: String,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let mut path = args.name.clone().into_os_string();
    if args.name.extension().is_none_or(|e| e != "json") {
        path.push(".json");
    }
    let path = PathBuf::from(path);
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let named = |name: &str| format!("\"name\": {}", serde_json::Value::from(name));
    let (_, own, text) = SCENES.iter().find(|(word, ..)| *word == args.from).unwrap_or(&SCENES[0]);
    let text = text.replacen(&named(own), &named(&name), 1).replace(LENS, &format!("\"prescription\": \"{}\"", args.from));
    let text = text.replacen(SCHEMA, "", 1);
    let mesh = text.contains(DIAMOND.0).then(|| path.with_file_name(DIAMOND.0));
    create(&path, text.as_bytes())?;
    if let Some(mesh) = mesh.filter(|mesh| std::fs::read(mesh).ok().as_deref() != Some(DIAMOND.1)) {
        // A scene without its mesh is of no use.
        create(&mesh, DIAMOND.1).inspect_err(|_| drop(std::fs::remove_file(&path)))?;
        out(&format!("wrote {}", mesh.display()));
    }
    out(&format!("wrote {0}; abbe render {0}", path.display()));
    Ok(Done::Completely)
}

/// Writes a file that is not there yet.
fn create(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |e: std::io::Error| match e.kind() {
        ErrorKind::AlreadyExists => {
            Error::file(path, "the file is there already", "choose another name; nothing was overwritten")
        }
        _ => Error::file(path, format!("cannot be written: {e}"), "choose a folder that you may write to"),
    };
    std::fs::File::create_new(path).and_then(|mut file| file.write_all(bytes)).map_err(failed)
}
