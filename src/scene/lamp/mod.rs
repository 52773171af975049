//! Lamps and skies as they were measured: photometric files, and latitude-longitude pictures.

pub(in crate::scene) mod environment;
mod eulumdat;
mod ies;
pub(in crate::scene) mod profile;
pub(in crate::scene) mod sky;

use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::spectra::SpectrumReader;
use glam::DVec3;
use profile::Profile;
use std::sync::Arc;

/// Reads the photometric file that `node` names, of a luminaire that looks along `direction` (unit).
pub(in crate::scene) fn read(reader: &SpectrumReader, node: &Node, direction: DVec3) -> Result<Arc<Profile>> {
    let (_, bytes) = reader.files.read(node)?;
    let text = String::from_utf8_lossy(&bytes);
    let parsed = if eulumdat::is_eulumdat(&text) {
        eulumdat::parse(&text)
    } else {
        ies::parse(&text, direction.angle_between(DVec3::NEG_Y).to_degrees())
    };
    let name = quoted(node.string()?);
    parsed.map(Arc::new).map_err(|(problem, remedy)| node.fail(format!("{name}: {problem}"), remedy))
}
