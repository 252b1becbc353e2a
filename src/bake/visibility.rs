//! Which of the directions each vertex of a mesh sees: V(ω) of every transfer integral.

use super::{Directions, RUN};
use crate::numeric::parallel;
use crate::trace::bundle::{self, WORD};
use crate::world::mesh::Mesh;
use glam::Vec3;

/// The hemisphere above every vertex: which of its directions are visible, and which are blocked.
///
/// Bit j of word w of a vertex stands for the direction 32 w + j. A vertex that no triangle uses has no bits
/// at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Visibility {
    /// Words of a vertex: ⌈directions / 32⌉.
    pub words: usize,
    /// The directions above the horizon (n·ω > 0) along which nothing is met, `[vertices][words]`.
    pub visible: Vec<u32>,
    /// The directions above the horizon along which a triangle is met, from either side, `[vertices][words]`.
    pub blocked: Vec<u32>,
}

impl Visibility {
    /// The words of the directions that a vertex sees, and of those that are blocked.
    pub fn of(&self, vertex: usize) -> (&[u32], &[u32]) {
        let words = vertex * self.words..(vertex + 1) * self.words;
        (&self.visible[words.clone()], &self.blocked[words])
    }

    /// From bits that were traced before (`visible`, as [`Visibility::visible`]): whatever else is above the
    /// horizon of a used vertex is blocked.
    ///
    /// # Panics
    /// Where `visible` has not the mesh's vertices times ⌈directions / 32⌉ words.
    pub fn from_bits(mesh: &Mesh, directions: &Directions, visible: Vec<u32>) -> Self {
        let words = directions.count().div_ceil(WORD);
        assert_eq!(visible.len(), mesh.positions.len() * words, "one row of words a vertex");
        let used = used(mesh);
        let mut blocked = visible;
        let visible = blocked.clone();
        parallel::for_each_chunk(&mut blocked, RUN * words, |run, rows| {
            for (row, bits) in rows.chunks_exact_mut(words).enumerate() {
                let vertex = run * RUN + row;
                if used[vertex] {
                    for (word, rays) in bits.iter_mut().zip(directions.rays.chunks(WORD)) {
                        *word = above(mesh.normals[vertex], rays) & !*word;
                    }
                } else {
                    bits.fill(0);
                }
            }
        });
        Self { words, visible, blocked }
    }
}

/// Which of up to 32 directions are above the horizon of a normal.
fn above(normal: Vec3, rays: &[Vec3]) -> u32 {
    rays.iter().enumerate().fold(0, |word, (bit, ray)| word | u32::from(normal.dot(*ray) > 0.0) << bit)
}

/// Which vertices some triangle uses.
pub(super) fn used(mesh: &Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&corner| used[corner as usize] = true);
    used
}

/// What each vertex sees of `directions`. Rays start in the vertex itself, and the triangles around it do not
/// block them.
pub fn visibility(mesh: &Mesh, directions: &Directions) -> Visibility {
    let words = directions.count().div_ceil(WORD);
    let used: Vec<usize> =
        used(mesh).iter().enumerate().filter_map(|(vertex, used)| used.then_some(vertex)).collect();
    let pick = |of: &[Vec3]| used.iter().map(|&vertex| of[vertex]).collect::<Vec<_>>();
    let rows = bundle::visibility(mesh, &pick(&mesh.positions), &pick(&mesh.normals), &directions.rays);
    let mut visible = vec![0; mesh.positions.len() * words];
    for (row, &vertex) in rows.chunks_exact(words).zip(&used) {
        visible[vertex * words..(vertex + 1) * words].copy_from_slice(row);
    }
    Visibility::from_bits(mesh, directions, visible)
}
