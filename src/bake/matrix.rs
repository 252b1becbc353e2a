//! Transfer matrices of glossy surfaces without interreflection: T of Feng et al. 2007, Eq. 5.
//!
//! M_ij = ∫ V(ω) y_i(R ω) y_j(ω) dω, where R is the vertex's [`frame`]: M L are the coefficients, in that
//! frame, of the radiance that arrives. V includes the horizon, so M without occluders is the hemisphere's
//! Gram matrix turned. Turning one side of a product matrix is a product with the rotation of the basis: y(R
//! ω) = D y(ω), so M = D G with G_ij = ∫ V y_i y_j dω ([`super::triple`]).

use super::frame::frame;
use super::project::project;
use super::triple::Triple;
use super::{Directions, Estimate, Visibility};
use crate::sphere::rotation::Rotation;
use crate::world::mesh::Mesh;
use glam::Vec3;
use std::ops::Range;

/// The bands of visibility that matrices of `bands` bands depend on: 2 `bands` − 1.
pub fn visibility_bands(bands: usize) -> usize {
    2 * bands - 1
}

/// What makes matrices of `bands` bands from the coefficients of visibility.
#[derive(Debug, Clone)]
pub struct Matrices {
    bands: usize,
    triple: Triple,
}

impl Matrices {
    /// For matrices of `bands` bands, 1 to 16.
    ///
    /// # Panics
    /// For another number of bands.
    pub fn new(bands: usize) -> Self {
        assert!((1..=16).contains(&bands), "1 to 16 bands");
        Self { bands, triple: Triple::new(bands) }
    }

    /// M of one vertex by rows, `[bands²][bands²]`, from the coefficients of what it sees: ∫ V y_k dω in
    /// [`visibility_bands`] bands.
    ///
    /// # Panics
    /// Where there is another number of coefficients, or the normal has no length.
    pub fn matrix(&self, coefficients: &[f64], normal: Vec3) -> Vec<f64> {
        let (functions, wide) = (self.bands * self.bands, visibility_bands(self.bands));
        assert_eq!(coefficients.len(), wide * wide, "one coefficient for each function");
        let mut product = vec![0.0; functions * functions];
        self.triple.product(coefficients, &mut product);
        let rotation = Rotation::new(self.bands, frame(normal)).expect("a frame is a rotation");
        rotation.rotate_columns(&product, functions)
    }
}

/// The transfer matrices of `vertices`, by rows, `[vertices][bands²][bands²]`: row i is a function of the
/// local frame, column j one of the world.
///
/// # Panics
/// Where `bands` is not in 1 to 16, `vertices` are not the mesh's, or `visibility` is not that of `mesh` and
/// `directions`.
pub fn matrices(
    mesh: &Mesh,
    directions: &Directions,
    visibility: &Visibility,
    bands: usize,
    estimate: Estimate,
    vertices: Range<usize>,
) -> Vec<f32> {
    let made = Matrices::new(bands);
    let width = bands * bands * bands * bands;
    let put = |vertex: usize, sums: &[f64], out: &mut [f32]| {
        let matrix = made.matrix(sums, mesh.normals[vertex]);
        out.iter_mut().zip(matrix).for_each(|(out, entry)| *out = entry as f32);
    };
    let bands = visibility_bands(bands);
    project(mesh, directions, visibility, bands, estimate, |_| 1.0, vertices, (width, put))
}
