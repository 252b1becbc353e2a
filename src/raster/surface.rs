//! The point and normal of a mesh that a pixel sees.

use super::View;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// What the centre of pixel (`x`, `y`) sees of `triangle`: the interpolated position and unit normal. The normal
/// is zero where the corners' normals cancel.
#[inline]
pub fn surface(mesh: &Mesh, view: &View, triangle: u32, x: usize, y: usize) -> (Vec3, Vec3) {
    let corners = mesh.triangles[triangle as usize].map(|corner| corner as usize);
    let positions = corners.map(|corner| mesh.positions[corner]);
    let normals = corners.map(|corner| mesh.normals[corner]);
    let weights = view.barycentric(positions, x, y);
    let blend = |of: [Vec3; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
    (blend(positions), blend(normals).normalize_or_zero())
}
