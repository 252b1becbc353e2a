//! The keys of `[prt]`, and what they set.

use crate::bake::Estimate;
use crate::keys::{Key, Kind, PICTURE, PICTURE_AND_TRANSFER, Reading, Values, names};

/// What becomes of light that enters the solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subsurface {
    /// It is lost.
    None,
    /// It leaves elsewhere, by the dipole of Jensen et al. 2001.
    Dipole,
}

const METHODS: [(&str, Estimate); 2] = [("control", Estimate::Control), ("quadrature", Estimate::Plain)];
const METHOD_NAMES: [&str; 2] = names(&METHODS);

const SUBSURFACES: [(&str, Subsurface); 2] = [("none", Subsurface::None), ("dipole", Subsurface::Dipole)];
const SUBSURFACE_NAMES: [&str; 2] = names(&SUBSURFACES);

/// The keys.
pub(super) const KEYS: &[Key] = &[
    Key::new(
        "prt",
        "bands",
        Kind::Whole(1.0, 10.0),
        PICTURE_AND_TRANSFER,
        "Bands n of spherical harmonics: light and transfer have n² coefficients.",
    )
    .or("5"),
    Key::new(
        "prt",
        "directions",
        Kind::Whole(1.0, 65536.0),
        PICTURE_AND_TRANSFER,
        "Directions in which the visibility of a vertex is found.",
    )
    .or("512"),
    Key::new(
        "prt",
        "method",
        Kind::Choice(&METHOD_NAMES),
        PICTURE_AND_TRANSFER,
        "How integrals are estimated: with what the sum over the whole hemisphere lacks as a control, or as \
         plain sums.",
    )
    .or("\"control\""),
    Key::new(
        "prt",
        "reading",
        Kind::Choice(&Reading::NAMES),
        PICTURE_AND_TRANSFER,
        "Whether transfer vectors are as the errata correct them, or the print's, without cosine, albedo \
         and bounces.",
    )
    .or("\"corrected\""),
    Key::new(
        "prt",
        "bounces",
        Kind::Whole(0.0, 64.0),
        PICTURE_AND_TRANSFER,
        "How often light is reflected between points of the solid before it is reflected to the eye.",
    )
    .or("0"),
    Key::new(
        "prt",
        "subsurface",
        Kind::Choice(&SUBSURFACE_NAMES),
        PICTURE_AND_TRANSFER,
        "Whether light that enters the material of [material] leaves elsewhere, by the dipole of Jensen et \
         al. 2001.",
    )
    .or("\"none\""),
    Key::new(
        "prt",
        "poses",
        Kind::Whole(1.0, 100_000.0),
        PICTURE,
        "Poses that `bitlight bake` stores: pose k is frame k.",
    )
    .or("1"),
];

/// The technique's own knobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Bands n of spherical harmonics: n² coefficients.
    pub bands: usize,
    /// Directions in which the visibility of a vertex is found.
    pub directions: usize,
    /// How they are summed.
    pub method: Estimate,
    /// Which reading of the transfer vectors.
    pub reading: Reading,
    /// Reflections between points of the solid before the one to the eye.
    pub bounces: usize,
    /// What becomes of light that enters the solid.
    pub subsurface: Subsurface,
    /// Poses that a bake of the whole scene has.
    pub poses: usize,
}

impl Settings {
    /// Reads them.
    pub fn read(values: &Values) -> Self {
        let table = "prt";
        Self {
            bands: values.whole(table, "bands"),
            directions: values.whole(table, "directions"),
            method: values.word(table, "method", &METHODS),
            reading: values.word(table, "reading", &Reading::WORDS),
            bounces: values.whole(table, "bounces"),
            subsurface: values.word(table, "subsurface", &SUBSURFACES),
            poses: values.whole(table, "poses"),
        }
    }
}
