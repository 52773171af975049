//! `abbe new`: a scene to start from, with comments.

use super::{Done, Outcome, print::out};
use crate::error::Error;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  abbe new rainbow && abbe render rainbow.json
  abbe new fan --from lens            five rays through a lens, in smoke
  abbe new photograph --from gauss    what a lens makes of a table
  abbe new tests/prism.json";

/// Scenes to start from, which ship: their words, and their names.
const SCENES: [(&str, &str, &str); 9] = [
    ("starter", "starter", include_str!("../../scenes/starter.json")),
    ("prism", "prism_dark", include_str!("../../scenes/prism_dark.json")),
    ("coffee", "coffee", include_str!("../../scenes/coffee.json")),
    ("lens", "lens", include_str!("../../scenes/lens.json")),
    ("rainbow", "rainbow", include_str!("../../scenes/rainbow.json")),
    ("singlet", "photograph", PHOTOGRAPH),
    ("achromat", "photograph", PHOTOGRAPH),
    ("triplet", "photograph", PHOTOGRAPH),
    ("gauss", "photograph", PHOTOGRAPH),
];
/// Of which the lens is the one of the word.
const PHOTOGRAPH: &str = include_str!("../../scenes/photograph.json");
const LENS: &str = "\"prescription\": \"achromat\"";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Name of the scene, or its file; .json is added where it is missing
    #[arg(value_name = "NAME")]
    name: PathBuf,
    /// The scene to start from: a prism's rainbow with comments, the prism of the textbooks, the caustic in a cup, rays through a lens, Descartes' globe of water, or a photograph through a lens of this kind
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
    let failed = |e: std::io::Error| match e.kind() {
        ErrorKind::AlreadyExists => {
            Error::file(&path, "the file is there already", "choose another name; nothing was overwritten")
        }
        _ => Error::file(&path, format!("cannot be written: {e}"), "choose a folder that you may write to"),
    };
    let named = |name: &str| format!("\"name\": {}", serde_json::Value::from(name));
    let (_, own, text) = SCENES.iter().find(|(word, ..)| *word == args.from).unwrap_or(&SCENES[0]);
    let text = text.replacen(&named(own), &named(&name), 1).replace(LENS, &format!("\"prescription\": \"{}\"", args.from));
    let mut file = std::fs::File::create_new(&path).map_err(failed)?;
    file.write_all(text.as_bytes()).map_err(failed)?;
    out(&format!("wrote {0}; abbe render {0}", path.display()));
    Ok(Done::Completely)
}
