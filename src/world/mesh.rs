//! Triangle meshes.

use glam::Vec3;

/// A triangle mesh with one normal a vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in the scene's unit.
    pub positions: Vec<Vec3>,
    /// Unit normals, one a vertex.
    pub normals: Vec<Vec3>,
    /// Three vertex indices a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}
