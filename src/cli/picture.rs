//! The options that say how a picture is made, shared by the commands that make one.

use crate::color::space::Space;
use crate::develop::gamut::Gamut;
use crate::develop::picture::{Exposure, PictureSettings};
use crate::develop::tone::Tone;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::{Value, json};

const SPACES: [(&str, Space); 4] =
    [("srgb", Space::Srgb), ("p3", Space::DisplayP3), ("rec2020", Space::Rec2020), ("acescg", Space::AcesCg)];

/// How the picture is made.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct PictureArgs {
    /// Exposure of the picture in stops, 'auto', 'auto+1' for a stop more, or 'auto:95' for the 95th percentile instead of the 99th [default: that of the scene or file, else auto]
    #[arg(long, value_name = "EV", value_parser = Exposure::parse, allow_hyphen_values = true)]
    exposure: Option<Exposure>,
    /// Tone curve [default: none]
    #[arg(long, value_name = "CURVE", value_parser = choice(Tone::NAMED))]
    tone: Option<Tone>,
    /// Colour space of the picture; acescg only in .exr [default: srgb]
    #[arg(long, value_name = "SPACE", value_parser = choice(SPACES))]
    space: Option<Space>,
    /// Colours that the space cannot show: map (keep hue and lightness), clip each component, or keep them out of range [default: map; keep in .exr]
    #[arg(long, value_name = "HOW", value_parser = choice(Gamut::NAMED))]
    gamut: Option<Gamut>,
}

impl PictureArgs {
    /// As what makes pictures takes them.
    pub fn settings(&self) -> PictureSettings {
        let PictureArgs { exposure, tone, space, gamut } = *self;
        PictureSettings { exposure, tone, space, gamut }
    }

    /// For another process.
    pub fn json(&self) -> Value {
        json!({
            "exposure": self.exposure.map(|exposure| exposure.to_string()),
            "tone": self.tone.and_then(|tone| name_of(&Tone::NAMED, tone)),
            "space": self.space.and_then(|space| name_of(&SPACES, space)),
            "gamut": self.gamut.and_then(|gamut| name_of(&Gamut::NAMED, gamut)),
        })
    }

    /// These, and where they leave something open what another process was asked for.
    pub fn or_json(&self, json: &Value) -> Self {
        let text = |name: &str| json[name].as_str().unwrap_or_default();
        let asked = PictureSettings {
            exposure: Exposure::parse(text("exposure")).ok(),
            tone: value_of(&Tone::NAMED, text("tone")),
            space: value_of(&SPACES, text("space")),
            gamut: value_of(&Gamut::NAMED, text("gamut")),
        };
        let PictureSettings { exposure, tone, space, gamut } = self.settings().or(asked);
        PictureArgs { exposure, tone, space, gamut }
    }
}

fn name_of<T: PartialEq>(table: &[(&'static str, T)], value: T) -> Option<&'static str> {
    table.iter().find(|(_, of)| *of == value).map(|(name, _)| *name)
}

fn value_of<T: Clone>(table: &[(&'static str, T)], name: &str) -> Option<T> {
    table.iter().find(|(of, _)| *of == name).map(|(_, value)| value.clone())
}

/// A parser of one of several names.
pub fn choice<T: Clone + Send + Sync + 'static, const N: usize>(
    table: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(table.each_ref().map(|(name, _)| *name));
    names.try_map(move |name| value_of(&table, &name).ok_or("no such name"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_asked_for_is_known_to_another_process() {
        let asked = PictureArgs {
            exposure: Some(Exposure::Auto { share: 0.95, stops: -1.5 }),
            tone: Some(Tone::AgX),
            space: Some(Space::DisplayP3),
            gamut: Some(Gamut::Clip),
        };
        assert_eq!(PictureArgs::default().or_json(&asked.json()), asked);
        let other = PictureArgs { exposure: Some(Exposure::Stops(2.0)), ..PictureArgs::default() };
        assert_eq!(other.or_json(&asked.json()), PictureArgs { exposure: other.exposure, ..asked });
        assert_eq!(other.or_json(&Value::Null), other);
    }
}
