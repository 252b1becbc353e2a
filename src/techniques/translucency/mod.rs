//! Translucent solids after Banterle and Chalmers, "A Fast Translucency Appearance Model for Real-Time
//! Applications": light is accumulated in one point as nine spherical-harmonic coefficients a colour, and leaves
//! attenuated by the thickness that a shadow map measures.
//!
//! ```text
//! cubemap → transmit → projection → matrices ─────────────→ radiosity ──┐
//! shadow ┬→ peel ─────────┐                                             │
//!        ├→ blur ─────────┴→ thickness ────────────────→ attenuation ───┼→ final
//!        └──────────────────────────────→ direct ───────────────────────┘
//! visibility → gbuffer → (thickness, radiosity, attenuation, direct, final)
//! ```
//!
//! Every pass has the corrected reading of the errata; its head says which rows it decides and why.

mod attenuation;
mod blur;
mod cubemap;
mod direct;
mod export;
mod final_;
mod frame;
mod gbuffer;
mod lookup;
mod matrices;
mod peel;
mod projection;
mod radiosity;
mod shadow;
mod thickness;
mod transmit;
mod visibility;

pub use export::Export;
pub use frame::{Caster, Frame, Settings};

use crate::pass::Pass;

/// The technique's passes in flow order.
pub const PASSES: [Pass<Frame>; 14] = [
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
    direct::PASS,
    final_::PASS,
];

/// Pixels or texels that a pass computes together: a constant, so that the order of a thread's work cannot show.
const RUN: usize = 1024;
