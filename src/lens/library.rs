//! The lenses that ship, as files of `scenes/lenses/`.

/// Name and text of each.
pub const LENSES: [(&str, &str); 4] = [
    ("singlet", include_str!("../../scenes/lenses/singlet.json")),
    ("achromat", include_str!("../../scenes/lenses/achromat.json")),
    ("triplet", include_str!("../../scenes/lenses/triplet.json")),
    ("gauss", include_str!("../../scenes/lenses/gauss.json")),
];

/// The text of the lens of this name.
pub fn text(name: &str) -> Option<&'static str> {
    LENSES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
