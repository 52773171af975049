//! `abbe new`: a scene to start from, with comments.

use super::{Done, Outcome, print::out};
use crate::error::Error;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  abbe new rainbow && abbe render rainbow.json
  abbe new tests/lens.json
  abbe new fan --from lens            five rays through a lens, in smoke";

/// Scenes to start from, which ship, by their names.
const SCENES: [(&str, &str); 2] =
    [("starter", include_str!("../../scenes/starter.json")), ("lens", include_str!("../../scenes/lens.json"))];

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Name of the scene, or its file; .json is added where it is missing
    #[arg(value_name = "NAME")]
    name: PathBuf,
    /// The scene to start from
    #[arg(long, value_name = "SCENE", default_value = "starter", value_parser = SCENES.map(|(name, _)| name))]
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
    let text = SCENES.iter().find(|(known, _)| *known == args.from).map_or("", |(_, text)| text);
    let named = |name: &str| format!("\"name\": {}", serde_json::Value::from(name));
    let text = text.replacen(&named(&args.from), &named(&name), 1);
    let mut file = std::fs::File::create_new(&path).map_err(failed)?;
    file.write_all(text.as_bytes()).map_err(failed)?;
    out(&format!("wrote {0}; abbe render {0}", path.display()));
    Ok(Done::Completely)
}
