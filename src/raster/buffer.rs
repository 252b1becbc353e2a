//! The visibility buffer: the nearest triangle of every pixel, and its depth; or the depths of the two
//! nearest.
//!
//! Triangles are sorted into the tiles that they touch, a *run* of a constant number of triangles at a time,
//! and each tile is filled by one thread. A pixel keeps the largest (reversed) depth, ties going to the
//! lowest triangle, so the order of filling changes nothing.

use super::View;
use super::setup::Sorted;
use super::tile::{NONE, PITCH, Row, TILE, Tile};
use crate::numeric::order::max;
use crate::numeric::parallel;
use glam::Vec3;

/// The nearest triangle of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibilityBuffer {
    /// `height × width` indices of triangles, the top row first; [`NONE`] where there is none.
    pub triangle: Vec<u32>,
    /// As many depths: 1 at the near plane, falling with distance, 0 where there is no triangle.
    pub depth: Vec<f32>,
}

/// The nearest triangle of every pixel of `view`, both sides of a triangle alike.
///
/// # Panics
/// Where a triangle's index is out of range, or the view is larger than [`super::MAX_SIZE`].
pub fn visibility(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> VisibilityBuffer {
    let tiles = tiles::<false>(positions, triangles, view);
    VisibilityBuffer {
        triangle: image(&tiles, view, NONE, |row| &row.triangle),
        depth: image(&tiles, view, 0.0, |row| &row.depth),
    }
}

/// The depths of the two nearest surfaces in every pixel of `view`, each as in [`VisibilityBuffer::depth`].
/// The second is the greatest depth below the first, which depth peeling (Everitt 2001) finds by filling all
/// triangles again.
///
/// # Panics
/// As [`visibility`].
pub fn two_depths(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> [Vec<f32>; 2] {
    let tiles = tiles::<true>(positions, triangles, view);
    [image(&tiles, view, 0.0, |row| &row.depth), image(&tiles, view, 0.0, |row| &row.second)]
}

fn tiles<const TWO: bool>(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> Vec<Tile> {
    assert!(max(view.width, view.height) <= super::MAX_SIZE, "{} × {} pixels", view.width, view.height);
    let sorted = Sorted::new(positions, triangles, view);
    let columns = view.width.div_ceil(TILE);
    parallel::map(columns * view.height.div_ceil(TILE), |number| {
        let mut tile = Tile::new(view, number % columns * TILE, number / columns * TILE);
        fill::<TWO>(&mut tile, &sorted, number);
        tile
    })
}

/// The image that the tiles make up.
fn image<T: Copy + Send + Sync>(
    tiles: &[Tile],
    view: &View,
    empty: T,
    of: impl Fn(&Row) -> &[T; PITCH] + Sync,
) -> Vec<T> {
    let columns = view.width.div_ceil(TILE);
    parallel::images([1, view.width * view.height], view.width, empty, |_, y, out| {
        for (out, tile) in out.chunks_mut(TILE).zip(&tiles[y / TILE * columns..]) {
            out.copy_from_slice(&of(&tile.rows[y % TILE])[..out.len()]);
        }
    })
}

/// Fills what triangles cover of the tile with this number: `fill::fill`, or its twin, the same function with
/// wider instructions.
fn fill<const TWO: bool>(tile: &mut Tile, sorted: &Sorted<'_>, number: usize) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
        // SAFETY: the processor has AVX2.
        return unsafe { super::avx2::fill::<TWO>(tile, sorted, number) };
    }
    super::fill::fill::<TWO>(tile, sorted, number);
}
