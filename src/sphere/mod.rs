//! Functions on the sphere: spherical harmonics, rotation, quadrature, environments.
