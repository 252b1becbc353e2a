//! Precomputed radiance transfer at the vertices of a solid (Sloan, Kautz and Snyder 2002), the ground that the papers on
//! learned transfer and on skinned animation compress and predict, and the rival of fig. 13b of Banterle and Chalmers.
//! Light is from far away alone: spherical-harmonic coefficients of a few bands.
//!
//! ```text
//! visibility ┬→ vectors (diffuse) ─────────────┐
//!            ├→ matrices → bounced (highlight) ┤
//!            └→ scattered (in the solid) ──────┼→ shading ┐
//! brdf → bounced;  exits ───────────────────────┤          ├→ final
//! light ───────────────────────────────────────┘   seen ──┘
//! ```
//!
//! A surface has one side: the inner one of an open mesh is black, where the ground truth reflects on both.
//! What a surface or the settings do not ask for is an empty buffer ([`computes`]). The transfer is that of
//! [`crate::bake`]; these passes say which of it a frame needs, and light it.

mod bounced;
mod brdf;
mod exits;
mod final_;
mod frame;
mod light;
mod matrices;
mod scattered;
mod seen;
mod shading;
mod vectors;
mod visibility;

pub use exits::EXITS;
pub use frame::{Frame, Light, Settings, Subsurface, computes, stored};

use crate::pass::Pass;

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
    seen::PASS,
    final_::PASS,
];

/// Vertices or pixels that a pass computes together: a constant, so that the order of a thread's work cannot show.
const RUN: usize = 256;
