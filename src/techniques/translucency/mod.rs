//! Translucent solids after Banterle and Chalmers, "A Fast Translucency Appearance Model for Real-Time
//! Applications": light is accumulated in one point as nine spherical-harmonic coefficients a colour, and leaves
//! attenuated by the thickness that a shadow map measures.
//!
//! ```text
//! cubemap → transmit → projection → matrices ─────────────→ radiosity ──┐
//! shadow ┬→ peel ─────────┐                                             │
//!        ├→ blur ─────────┴→ thickness ────────────────→ attenuation ───┼→ final
//!        └──────────────────────────────→ direct ───────────────────────┘
//! visibility → (gbuffer, radiosity)
//! gbuffer → (thickness, radiosity, attenuation, held, direct, final)
//! thickness → held
//! ```
//!
//! Light is accumulated in one point or, as §5 hopes for, in several (`points`).
//!
//! Every pass has the corrected reading of the errata and, under [`Reading::Paper`], the letter of the print; its head
//! says which rows it decides, why, and what the letter does there. Where the paper says nothing, or what cannot be
//! computed (T5, T8, T13, T14, T15), both readings are one.

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
mod shadow;
mod thickness;
mod transmit;
mod visibility;

pub use export::Export;
pub use frame::{Caster, Evaluation, Fit, Frame, Reading, Settings, Show};
pub use points::Points;

use crate::pass::Pass;

/// The technique's passes in flow order.
pub const PASSES: [Pass<Frame>; 15] = [
    cubemap::PASS,
    transmit::PASS,
    projection::PASS,
    matrices::PASS,
    shadow::PASS,
    peel::PASS,
    blur::PASS,
    visibility::PASS,
    gbuffer::PASS,
    thickness::PASS,
    radiosity::PASS,
    attenuation::PASS,
    held::PASS,
    direct::PASS,
    final_::PASS,
];

/// Pixels or texels that a pass computes together: a constant, so that the order of a thread's work cannot show.
const RUN: usize = 1024;
