//! bitlight: the bit-reproducible CPU ground truth of published techniques that light translucent solids, fur
//! and animated characters with spherical harmonics.

mod error;
pub mod numeric;
pub mod sphere;
pub mod world;

pub use error::Error;
