//! The keys of `[truth]`, and what they set.

use super::Filter;
use crate::keys::{Bears, Key, Kind, Values, names};

/// A model of light transport, by its word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// Reflection between surfaces.
    Surface,
    /// Scattering in the medium.
    Medium,
    /// The dipole over the surface.
    Dipole,
}

impl Transport {
    const WORDS: [(&'static str, Self); 3] =
        [("surface", Self::Surface), ("medium", Self::Medium), ("dipole", Self::Dipole)];
    const NAMES: [&'static str; 3] = names(&Self::WORDS);

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Surface => "surface",
            Self::Medium => "medium",
            Self::Dipole => "dipole",
        }
    }
}

const FILTERS: [(&str, Filter); 2] = [("point", Filter::Point), ("box", Filter::Box)];
const FILTER_NAMES: [&str; 2] = names(&FILTERS);

const TRUTH: &[Bears] = &[Bears::Truth];

/// The keys.
pub const KEYS: &[Key] = &[
    Key::new(
        "truth",
        "model",
        Kind::Choice(&Transport::NAMES),
        &[], // `run::truth` adds the transport that is traced, also where the technique says which
        "What the ground truth traces: light between surfaces, in the medium, or by the dipole; what the \
         technique approximates if absent.",
    )
    .example("\"surface\"")
    .aside(),
    Key::new(
        "truth",
        "bands",
        Kind::Whole(0.0, 32.0),
        TRUTH,
        "Bands to which the ground truth projects environments and directional lights; 0 for the lights \
         themselves.",
    )
    .or("0"),
    Key::new(
        "truth",
        "bounces",
        Kind::Whole(0.0, 10_000.0),
        TRUTH,
        "The most reflections between points of the solid before the one to the eye; no limit if absent.",
    )
    .example("8")
    .aside(),
    Key::new(
        "truth",
        "anisotropy",
        Kind::Number(-0.99, 0.99),
        TRUTH,
        "Mean cosine of the scattering angle in the medium of the ground truth.",
    )
    .or("0"),
    Key::new(
        "truth",
        "filter",
        Kind::Choice(&FILTER_NAMES),
        TRUTH,
        "Where the ground truth samples a pixel: in its centre, which the passes shade, or all over its \
         area.",
    )
    .or("\"point\""),
];

/// What the ground truth traces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which transport; `None` for the one that the technique approximates.
    pub model: Option<Transport>,
    /// Bands to which environments and directions are projected; 0 to take them as they are.
    pub bands: usize,
    /// The most reflections between points of the solid before the one to the eye; `None` for no limit.
    pub bounces: Option<usize>,
    /// Mean cosine of the scattering angle in the medium.
    pub anisotropy: f32,
    /// Where in a pixel its samples lie.
    pub filter: Filter,
}

impl Settings {
    /// Reads them.
    pub fn read(values: &Values) -> Self {
        Self {
            model: values.word_if("truth", "model", &Transport::WORDS),
            bands: values.whole("truth", "bands"),
            bounces: values.number("truth", "bounces").map(|bounces| bounces as usize),
            anisotropy: values.real("truth", "anisotropy"),
            filter: values.word("truth", "filter", &FILTERS),
        }
    }
}
