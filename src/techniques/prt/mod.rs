//! Precomputed radiance transfer at the vertices of a solid (Sloan, Kautz and Snyder 2002), the ground that the papers on
//! learned transfer and on skinned animation compress and predict, and the rival of fig. 13b of Banterle and Chalmers.
//! Light is from far away alone: spherical-harmonic coefficients of a few bands.

mod frame;
mod light;
mod seen;

pub use frame::{Frame, Light, Method, Reading, Settings, Subsurface};

use crate::pass::Pass;

/// The technique's passes in flow order.
pub const PASSES: [Pass<Frame>; 2] = [light::PASS, seen::PASS];
