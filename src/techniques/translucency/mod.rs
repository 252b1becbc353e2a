//! Translucent solids after Banterle and Chalmers, "A Fast Translucency Appearance Model for Real-Time
//! Applications": light is accumulated in one point as nine spherical-harmonic coefficients a colour, and
//! leaves attenuated by the thickness that a shadow map measures.
//!
//! ```text
//! cubemap → transmit → projection → matrices ─────────────→ radiosity ──┐
//! shadow ┬→ peel ─────────┐                                             │
//!        ├→ blur ─────────┴→ thickness ────────────────→ attenuation ───┼→ final
//!        └──────────────────────────────→ direct ───────────────────────┘
//! vbuffer → (gbuffer, radiosity)
//! gbuffer → (thickness, radiosity, attenuation, held, direct, final)
//! thickness → held
//! ```
//!
//! Light is accumulated in one point or, as §5 hopes for, in several (`points`).
//!
//! Every pass has the corrected reading of the errata and, under
//! [`Reading::Paper`](crate::keys::Reading::Paper), the letter of the print; its head says which rows it
//! decides, why, and what the letter does there. Where the paper says nothing, or something that cannot be
//! computed (T5, T8, T13, T14, T15), both readings are the same.

mod attenuation;
mod blur;
mod cubemap;
mod direct;
mod export;
mod final_;
mod frame;
mod gbuffer;
mod held;
mod lookup;
mod matrices;
mod peel;
mod points;
mod projection;
mod radiosity;
mod settings;
mod shadow;
mod thickness;
mod transmit;
mod vbuffer;

pub use frame::{Caster, Frame};
pub use points::Points;
pub use settings::{Evaluation, Fit, Settings, Show};

use super::{Outline, Technique};
use crate::Error;
use crate::keys::Values;
use crate::pass::{Axis, Given, Info, Pass, Recorder, execute, infos};
use crate::truth::Transport;
use crate::world::Stage;

/// The technique's row.
pub static TECHNIQUE: Technique = Technique {
    name: "translucency",
    about: "translucent solids, after Banterle and Chalmers",
    scene: "scenes/translucency/knot.toml",
    keys: settings::KEYS,
    tables: &["material"],
    lights: &["point", "directional", "environment"],
    other_light: "",
    passes: &INFOS,
    bands: |_| 3,
    length,
    scratch,
    enters: |_| true,
    bake: None,
    transport: |_, _| Ok(Transport::Dipole),
    render,
    export: Some(export::EXPORT),
};

const INFOS: [Info; 15] = infos(&PASSES);

/// The technique's passes in flow order.
pub const PASSES: [Pass<Frame>; 15] = [
    cubemap::PASS,
    transmit::PASS,
    projection::PASS,
    matrices::PASS,
    shadow::PASS,
    peel::PASS,
    blur::PASS,
    vbuffer::PASS,
    gbuffer::PASS,
    thickness::PASS,
    radiosity::PASS,
    attenuation::PASS,
    held::PASS,
    direct::PASS,
    final_::PASS,
];

/// Pixels or texels that a pass computes together: a constant, so that results do not depend on the number of
/// threads.
const RUN: usize = 1024;

fn length(outline: &Outline<'_>, info: &Info, axis: Axis) -> Option<usize> {
    let settings = Settings::read(outline.values);
    match (axis, info.knob) {
        (Axis::Row | Axis::Column, "translucency.cubemap") => Some(settings.cubemap),
        (Axis::Row | Axis::Column, "translucency.shadow") => Some(settings.shadow),
        (Axis::Coefficient, _) => Some(9),
        (Axis::Of(_), _) => Some(4), // rows and columns of the matrices
        (Axis::Several(_), _) => Some(settings.accumulation.pow(3)),
        _ => None,
    }
}

/// The bytes of each texel of the cubemap: its triangle, its part of a tile that is being filled, and its
/// corner's solid angle.
fn scratch(outline: &Outline<'_>, info: &Info) -> Option<(&'static str, u64)> {
    let texels = 6 * (Settings::read(outline.values).cubemap as u64).pow(2);
    (info.name == "translucency.cubemap").then_some((info.knob, texels * (4 + 14 + 8)))
}

fn render(
    stage: Stage,
    values: &Values,
    wanted: &[&str],
    given: Given,
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    let frame = Frame::new(stage, Settings::read(values))?;
    execute(&PASSES, &frame, wanted, given, recorder)
}
