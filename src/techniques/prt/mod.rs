//! Precomputed radiance transfer at the vertices of a solid (Sloan, Kautz and Snyder 2002). Papers on learned
//! transfer and on skinned animation compress and predict this data; fig. 13b of Banterle and Chalmers
//! compares with it. All light comes from far away: it is given as spherical-harmonic coefficients of a few
//! bands.
//!
//! ```text
//! visibility ┬→ vectors (diffuse) ─────────────┐
//!            ├→ matrices → bounced (highlight) ┤
//!            └→ scattered (in the solid) ──────┼→ shading ┐
//! brdf → bounced;  exits ───────────────────────┤          ├→ final
//! light ───────────────────────────────────────┘ vbuffer ─┘
//! ```
//!
//! A surface has one side: the inner one of an open mesh is black, whereas the ground truth reflects on both.
//! A pass that neither surface nor settings ask for has an empty buffer ([`computes`]). [`crate::bake`]
//! computes the transfer; these passes choose what a frame needs of it, and light it.

mod bounced;
mod brdf;
mod exits;
mod final_;
mod frame;
mod light;
mod matrices;
mod scattered;
mod settings;
mod shading;
mod vbuffer;
mod vectors;
mod visibility;

pub use exits::EXITS;
pub use frame::{Frame, computes};
pub use settings::{Settings, Subsurface};

use super::{Bake, Outline, Technique};
use crate::Error;
use crate::keys::Values;
use crate::pass::{Axis, Given, Info, Pass, Recorder, execute, infos};
use crate::truth::Transport;
use crate::world::Stage;
use crate::world::brdf::Gloss;
use glam::Vec3;

/// The technique's row.
pub static TECHNIQUE: Technique = Technique {
    name: "prt",
    about: "precomputed radiance transfer at vertices, after Sloan, Kautz and Snyder 2002",
    scene: "scenes/prt/bend.toml",
    keys: settings::KEYS,
    tables: &["material", "surface"],
    lights: &["environment", "directional"],
    other_light: "it takes light from far away alone: make it directional, with the irradiance at the solid",
    passes: &INFOS,
    bands: |values| Settings::read(values).bands,
    length,
    scratch,
    enters: |values| Settings::read(values).subsurface != Subsurface::None,
    bake: Some(Bake {
        passes: &["prt.visibility", "prt.vectors", "prt.matrices", "prt.bounced", "prt.scattered"],
        stored,
        poses: |values| Settings::read(values).poses as u32,
    }),
    transport,
    render,
    export: None,
};

const INFOS: [Info; 11] = infos(&PASSES);

/// The technique's passes in flow order.
pub const PASSES: [Pass<Frame>; 11] = [
    light::PASS,
    visibility::PASS,
    vectors::PASS,
    matrices::PASS,
    brdf::PASS,
    bounced::PASS,
    exits::PASS,
    scattered::PASS,
    shading::PASS,
    vbuffer::PASS,
    final_::PASS,
];

/// Vertices or pixels that a pass computes together: a constant, so that results do not depend on the number
/// of threads.
const RUN: usize = 256;

fn length(outline: &Outline<'_>, info: &Info, axis: Axis) -> Option<usize> {
    let settings = Settings::read(outline.values);
    let computes = |length| if computes(info.name, outline.surface, &settings) { length } else { 0 };
    match axis {
        Axis::Vertex => Some(computes(outline.vertices)),
        Axis::Coefficient => Some(settings.bands * settings.bands),
        Axis::Of("word") => Some(settings.directions.div_ceil(32)),
        Axis::Of("exit") => Some(computes(EXITS)),
        Axis::Of(_) => Some(computes(settings.bands * settings.bands)), // rows and columns of matrices
        _ => None,
    }
}

/// Where light bounces, the bytes for what each blocked direction meets: a hit, a meeting of its vertex, and
/// one of the list. At most all directions above the horizon are blocked.
fn scratch(outline: &Outline<'_>, info: &Info) -> Option<(&'static str, u64)> {
    let settings = Settings::read(outline.values);
    let bounces = settings.bounces > 0 && computes(info.name, outline.surface, &settings);
    let met = outline.vertices as u64 * settings.directions as u64 / 2;
    (bounces && ["prt.vectors", "prt.bounced"].contains(&info.name))
        .then_some(("prt.directions", met * (20 + 16 + 16)))
}

/// What each vertex sees, and its transfer.
fn stored(outline: &Outline<'_>) -> Vec<&'static str> {
    let settings = Settings::read(outline.values);
    let computes = |pass: &str| computes(pass, outline.surface, &settings);
    // `bounced` has the matrices to which bounces add in it.
    let matrices = if computes("prt.bounced") { "prt.bounced" } else { "prt.matrices" };
    let all = ["prt.visibility", "prt.vectors", matrices, "prt.scattered"];
    all.into_iter().filter(|pass| computes(pass)).collect()
}

/// Reflection, or the dipole where the surface reflects nothing.
fn transport(stage: &Stage, values: &Values) -> Result<Transport, Error> {
    let reflects = stage.surface.albedo != Vec3::ZERO || stage.surface.gloss != Gloss::None;
    match Settings::read(values).subsurface {
        Subsurface::None => Ok(Transport::Surface),
        Subsurface::Dipole if reflects => {
            Err(Error::new("is absent, and the solid both reflects light and lets it through")
                .key("truth.model")
                .remedy("set it to \"surface\" or \"dipole\": the whole light is the sum of the two"))
        }
        Subsurface::Dipole => Ok(Transport::Dipole),
    }
}

fn render(
    stage: Stage,
    values: &Values,
    wanted: &[&str],
    given: Given,
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    execute(&PASSES, &Frame::new(stage, Settings::read(values)), wanted, given, recorder)
}
