//! bitlight: the bit-reproducible CPU ground truth of published techniques that light translucent solids, fur
//! and animated characters with spherical harmonics.
//!
//! [`run::render`] renders a [`scene::Scene`] pass by pass into a [`pass::Recorder`]. What each pass computes is in
//! [`techniques`]; every bit of it is the same on every machine (ARCHITECTURE.md says why and how that is proved).

pub mod bake;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
mod error;
pub mod keys;
pub mod numeric;
pub mod pass;
pub mod raster;
pub mod run;
pub mod scene;
pub mod sphere;
pub mod store;
pub mod techniques;
pub mod trace;
pub mod truth;
pub mod world;

pub use error::Error;
pub(crate) use error::{nearest, unknown};

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
