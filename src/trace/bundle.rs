//! Bundles of parallel rays: what each of many points sees of a set of directions.

use super::{Bvh, Ray};
use crate::numeric::parallel;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// Directions whose bits share a word.
pub const WORD: usize = 32;

/// Which of `directions` each of `points` sees: bit j of word w of point p, `[points][⌈directions / 32⌉]`, is set where
/// the direction 32 w + j is above the horizon of the point's normal (n·ω > 0) and the ray from the point along it meets
/// no triangle of the mesh. All other bits are 0.
///
/// # Panics
/// Where there are not as many normals as points.
pub fn visibility(mesh: &Mesh, points: &[Vec3], normals: &[Vec3], directions: &[Vec3]) -> Vec<u32> {
    assert_eq!(points.len(), normals.len(), "one normal a point");
    let bvh = Bvh::new(mesh);
    let words = directions.len().div_ceil(WORD);
    let rows = parallel::map(points.len(), |point| {
        let sees = |direction: &Vec3| {
            normals[point].dot(*direction) > 0.0 && !bvh.blocked(&Ray::new(points[point], *direction))
        };
        let word = |directions: &[Vec3]| {
            directions
                .iter()
                .enumerate()
                .fold(0, |word, (bit, direction)| word | u32::from(sees(direction)) << bit)
        };
        directions.chunks(WORD).map(word).collect::<Vec<u32>>()
    });
    let mut bits = Vec::with_capacity(points.len() * words);
    rows.into_iter().for_each(|row| bits.extend(row));
    bits
}
