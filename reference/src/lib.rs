//! The papers behind bitlight, equation by equation, in plain `f64`.
//!
//! Each numbered equation is one function whose documentation names it ("Banterle and Chalmers,
//! Eq. 12"), so one search finds it with the paper open. Where the print errs or is silent there
//! are two functions: one takes the text to the letter (`…_as_printed`, or a `Reading`), the other
//! is the corrected reading, and the documentation says why they differ.
//!
//! Nothing here is fast and nothing is clever: this crate is the oracle that a fast `f32`
//! implementation is tested against, and it shares no code with it. Preconditions (unit vectors,
//! positive distances) are stated and not checked, unless breaking one would give a plausible
//! wrong number.
//!
//! Conventions: vectors are `[f64; 3]` in a right-handed frame with y up. Spherical harmonics are
//! real, without the Condon-Shortley phase, their polar axis is z, and their order is l² + l + m.
//! Image rows run downwards from row 0 at the top. Colours are handled one channel at a time.
//! Elementary functions come from `libm`, so the same input gives the same bits on every processor.
//!
//! Papers, as cited:
//! - "Banterle and Chalmers": A Fast Translucency Appearance Model for Real-Time Applications, 2006.
//! - "Feng et al.": Large-Scale Data Management for PRT-Based Real-Time Rendering of Dynamically
//!   Skinned Models, EGSR 2007.
//! - "Jensen et al. 2001": A Practical Model for Subsurface Light Transport, SIGGRAPH 2001.
//! - "Klotzli and Olano": Real-Time Fur with Local, Dynamic Precomputed Radiance Transfer.
//! - "Nowrouzezahrai et al.": Learning Radiance Transfer for Articulated Characters, 2007.
//! - "Ramamoorthi and Hanrahan 2001": An Efficient Representation for Irradiance Environment Maps,
//!   SIGGRAPH 2001.
//! - "Schlick 1994": An Inexpensive BRDF Model for Physically-Based Rendering, CGF 13(3).

#![warn(missing_docs)]
#![forbid(unsafe_code)]

pub mod coverage;
pub mod fur;
pub mod geometry;
pub mod sh;
pub mod tables;
pub mod transfer;
pub mod translucency;
pub mod vector;
