//! The keys of `[translucency]`, and what they set.

use crate::keys::{Key, Kind, PICTURE, Reading, Values, names};

/// What the view of a light's shadow map is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The solid's bounding box.
    Box,
    /// The solid: the tightest rectangle around its projection.
    Solid,
}

/// Which light the picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Show {
    /// Both.
    All,
    /// What the surface reflects, as in fig. 10a and 11a.
    Direct,
    /// What has come through the solid.
    Scattered,
}

/// Where the radiosity is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evaluation {
    /// At each pixel.
    Pixel,
    /// At each vertex, and interpolated over the triangle (fig. 6).
    Vertex,
}

const FITS: [(&str, Fit); 2] = [("box", Fit::Box), ("solid", Fit::Solid)];
const FIT_NAMES: [&str; 2] = names(&FITS);

const SHOWS: [(&str, Show); 3] =
    [("all", Show::All), ("direct", Show::Direct), ("scattered", Show::Scattered)];
const SHOW_NAMES: [&str; 3] = names(&SHOWS);

const EVALUATIONS: [(&str, Evaluation); 2] = [("pixel", Evaluation::Pixel), ("vertex", Evaluation::Vertex)];
const EVALUATION_NAMES: [&str; 2] = names(&EVALUATIONS);

/// The keys.
pub(super) const KEYS: &[Key] = &[
    Key::new(
        "translucency",
        "cubemap",
        Kind::Whole(1.0, 2048.0),
        PICTURE,
        "Texels along a side of a face of the external cubemap.",
    )
    .or("64"),
    Key::new(
        "translucency",
        "accumulation",
        Kind::Whole(1.0, 16.0),
        PICTURE,
        "Accumulation points along the longest side of the solid's box, and along the others in proportion.",
    )
    .or("1"),
    Key::new(
        "translucency",
        "shadow",
        Kind::Whole(1.0, 8192.0),
        PICTURE,
        "Texels along a side of a light's shadow map.",
    )
    .or("512"),
    Key::new(
        "translucency",
        "blur",
        Kind::Whole(0.0, 256.0),
        PICTURE,
        "Width in texels of the Gaussian that smooths the shadow map; 0 for none.",
    )
    .or("8"),
    Key::new(
        "translucency",
        "reading",
        Kind::Choice(&Reading::NAMES),
        PICTURE,
        "Whether the equations are computed as the errata correct them or to the letter of the print.",
    )
    .or("\"corrected\""),
    Key::new(
        "translucency",
        "smallest_d",
        Kind::Number(1e-9, 1e12),
        PICTURE,
        "Least thickness with which the printed Eq. 12 is computed; 0.001 of half the bounding box's diagonal \
         where absent.",
    )
    .example("0.01")
    .aside(),
    Key::new(
        "translucency",
        "evaluation",
        Kind::Choice(&EVALUATION_NAMES),
        PICTURE,
        "Whether the radiosity is evaluated at each pixel, or at each vertex and interpolated (fig. 6).",
    )
    .or("\"pixel\""),
    Key::new(
        "translucency",
        "second_layer",
        Kind::Flag,
        PICTURE,
        "Whether only points up to the second surface that the light meets receive it (fig. 9), or all.",
    )
    .or("true"),
    Key::new(
        "translucency",
        "shift_cure",
        Kind::Flag,
        PICTURE,
        "Whether the radiosity is looked up where the refracted ray leaves the box (fig. 7a), or along its \
         direction.",
    )
    .or("true"),
    Key::new(
        "translucency",
        "blindness_cure",
        Kind::Flag,
        PICTURE,
        "Whether the cubemap's views fill the solid's bounding box (fig. 8), or a cube around it (fig. 7b).",
    )
    .or("true"),
    Key::new(
        "translucency",
        "fit",
        Kind::Choice(&FIT_NAMES),
        PICTURE,
        "What a shadow map is fitted to: the solid's bounding box, or the solid itself, which wastes fewer \
         texels.",
    )
    .or("\"box\""),
    Key::new(
        "translucency",
        "show",
        Kind::Choice(&SHOW_NAMES),
        PICTURE,
        "Which light the picture shows: what the surface reflects, what has come through the solid, or both.",
    )
    .or("\"all\""),
];

/// The technique's own knobs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Width and height of a face of the external cubemap, in texels.
    pub cubemap: usize,
    /// Width and height of a light's shadow map, in texels.
    pub shadow: usize,
    /// Width of the Gaussian that blurs it, in texels; 0 and 1 leave it as it is.
    pub blur: usize,
    /// Which reading of the equations.
    pub reading: Reading,
    /// The thickness at which [`Reading::Paper`] holds the attenuation of Eq. 12, in the scene's unit; `None`
    /// for 10⁻³ of half the bounding box's diagonal.
    pub smallest_d: Option<f32>,
    /// Where the radiosity is evaluated.
    pub evaluation: Evaluation,
    /// Whether only points up to the second surface that the light meets receive it (fig. 9); else all do.
    pub second_layer: bool,
    /// Whether the radiosity is looked up where the refracted ray leaves the box (the cure of fig. 7a); else
    /// along the ray's direction from the centre.
    pub shift_cure: bool,
    /// Whether the six views fill the solid's bounding box (fig. 8, the cure of fig. 7b); else a cube around
    /// it.
    pub blindness_cure: bool,
    /// What the view of a light's shadow map is fitted to.
    pub fit: Fit,
    /// Accumulation points along the longest side of the box that the cubemap's views fill.
    pub accumulation: usize,
    /// Which light the picture shows.
    pub show: Show,
}

impl Settings {
    /// Reads them.
    pub fn read(values: &Values) -> Self {
        let table = "translucency";
        Self {
            cubemap: values.whole(table, "cubemap"),
            shadow: values.whole(table, "shadow"),
            blur: values.whole(table, "blur"),
            reading: values.word(table, "reading", &Reading::WORDS),
            smallest_d: values.number(table, "smallest_d").map(|d| d as f32),
            evaluation: values.word(table, "evaluation", &EVALUATIONS),
            second_layer: values.flag(table, "second_layer"),
            shift_cure: values.flag(table, "shift_cure"),
            blindness_cure: values.flag(table, "blindness_cure"),
            fit: values.word(table, "fit", &FITS),
            accumulation: values.whole(table, "accumulation"),
            show: values.word(table, "show", &SHOWS),
        }
    }
}
