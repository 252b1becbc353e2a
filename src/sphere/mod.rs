//! Functions on the sphere: spherical harmonics, rotation, quadrature, environments.

pub mod convention;
pub mod environment;
pub mod irradiance;
pub mod probes;
pub mod quadrature;
pub mod rotation;
pub mod sh;
