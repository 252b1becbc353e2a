//! Radiance transfer of a posed mesh: what light from far away becomes at each vertex.
//!
//! Light L is a function of direction alone, in `bands`² coefficients. For each vertex with normal n this
//! module computes, from the mesh alone:
//!
//! - which of a fixed set of directions it sees ([`visibility`]): V(ω) is 1 above the horizon (n·ω > 0) where
//!   no triangle stands in the way, from either side, and 0 elsewhere;
//! - the vector T with radiosity / π = ρ T·L ([`vectors`]; Nowrouzezahrai et al. 2007, §3; Sloan, Kautz and
//!   Snyder 2002);
//! - the matrix M with M L the light that arrives, in the vertex's own frame ([`matrices`]; Feng et al. 2007,
//!   Eq. 5), and the matrix B of a BRDF ([`brdf`]), so that the radiance towards o is y(o)·B M L;
//! - what any number of bounces adds to either ([`diffuse_bounces`], [`glossy_bounces`]), along [`meetings`];
//! - what scatters below the surface ([`multiple_scattering`], [`single_scattering`]).
//!
//! # Meshes that are no solids
//!
//! A vertex that no triangle uses has no surface: it sees nothing, and all that is computed of it is 0. A
//! vertex inside of geometry sees what its rays see, which is mostly triangles from behind: these block, and
//! send no light. The same holds for open meshes: their inner side blocks light and is black. Edges of more
//! than two triangles are nothing special, since no neighbourhood is asked for. Vertices in one place are
//! vertices of their own, each with its normal.
//!
//! # Numbers
//!
//! Results are `f32`; sums run in `f64` in the order of the directions, so they are those of a plain loop,
//! and what is off is the quadrature, not the arithmetic: 4 · 10⁻⁵ of a coefficient of unshadowed irradiance
//! with 8,192 directions, 1.4 · 10⁻³ with 512, 10⁻² with 128. Of a concave mesh most of the error is the
//! edges of shadows, which fall to 0.6 of it with each doubling.

mod bounce;
pub mod brdf;
mod diffuse;
mod frame;
mod glossy;
mod matrix;
mod project;
mod scatter;
mod single;
mod triple;
mod visibility;

pub(crate) use bounce::front;
pub use bounce::{Meeting, Meetings, diffuse_bounces, gather, meetings};
pub use diffuse::{irradiance, vectors};
pub use frame::frame;
pub use glossy::glossy_bounces;
pub use matrix::{Matrices, matrices, visibility_bands};
pub use scatter::multiple_scattering;
pub use single::{SingleScattering, single_scattering};
pub use visibility::{Visibility, visibility};

use crate::sphere::quadrature;
use glam::Vec3;
use std::f64::consts::PI;

/// Vertices that one thread takes together.
const RUN: usize = 64;

/// The directions that a bake looks along: spherical Fibonacci points, each of which stands for 4π / count
/// steradians.
#[derive(Debug, Clone)]
pub struct Directions {
    /// Unit vectors, at which the basis is evaluated.
    pub exact: Vec<[f64; 3]>,
    /// The same rounded, along which rays go.
    pub rays: Vec<Vec3>,
}

impl Directions {
    /// `count` directions, at least 1 ([`quadrature::fibonacci`]).
    ///
    /// # Panics
    /// Where `count` is 0.
    pub fn new(count: usize) -> Self {
        assert!(count > 0, "at least one direction");
        let exact = quadrature::fibonacci(count);
        let rays = exact.iter().map(|d| Vec3::from_array(d.map(|component| component as f32))).collect();
        Self { exact, rays }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.exact.len()
    }

    /// The solid angle that each stands for, in steradians.
    pub fn weight(&self) -> f64 {
        4.0 * PI / self.count() as f64
    }
}

/// How the integrals over directions are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimate {
    /// The sum over the visible directions.
    Plain,
    /// The same plus a part of the error that the sum over the whole hemisphere makes, whose integral is
    /// known: the part that is visible. A vertex without shadows is exact, and one that sees nothing is 0.
    Control,
}
