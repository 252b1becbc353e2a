//! The visibility buffer: the nearest triangle of every pixel, and its depth; or the depths of the two nearest.
//!
//! Triangles are sorted, in runs of a constant length, into the tiles that they touch, and each tile is filled by one
//! thread. A pixel keeps the largest (reversed) depth, ties going to the lowest triangle, so the order of filling
//! cannot show.

use super::batch::{Batch, set_up};
use super::screen::{Projected, project};
use super::setup::{RUN, Run};
use super::{SUBPIXELS, View};
use crate::numeric::lanes::BLOCK;
use crate::numeric::order::{max, min};
use crate::numeric::parallel;
use glam::Vec3;

/// The triangle of a pixel that none covers.
pub const NONE: u32 = u32::MAX;

/// Width and height of a tile, in pixels.
pub(super) const TILE: usize = 64;

/// Pixels of a row that may be filled together.
pub(super) const LANES: usize = 8;

/// Pixels from row to row of a tile's buffers: what is filled together may reach beyond its last column.
const PITCH: usize = TILE + LANES;

/// The nearest triangle of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// `height × width` indices of triangles, the top row first; [`NONE`] where there is none.
    pub triangle: Vec<u32>,
    /// As many depths: 1 at the near plane, falling with distance, 0 where there is no triangle.
    pub depth: Vec<f32>,
}

/// The nearest triangle of every pixel of `view`, both sides of a triangle alike.
///
/// # Panics
/// Where a triangle's index is out of range, or the view is larger than [`super::MAX_SIZE`].
pub fn visibility(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> Visibility {
    let tiles = tiles::<false>(positions, triangles, view);
    Visibility {
        triangle: image(&tiles, view, NONE, |row| &row.triangle),
        depth: image(&tiles, view, 0.0, |row| &row.depth),
    }
}

/// The depths of the two nearest surfaces in every pixel of `view`, each as in [`Visibility::depth`]. The second is the
/// greatest depth below the first, which depth peeling (Everitt 2001) finds by filling all triangles again.
///
/// # Panics
/// As [`visibility`].
pub fn two_depths(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> [Vec<f32>; 2] {
    let tiles = tiles::<true>(positions, triangles, view);
    [image(&tiles, view, 0.0, |row| &row.depth), image(&tiles, view, 0.0, |row| &row.second)]
}

fn tiles<const TWO: bool>(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> Vec<Tile> {
    assert!(max(view.width, view.height) <= super::MAX_SIZE, "{} × {} pixels", view.width, view.height);
    let vertices = project(positions, view);
    let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
        Run::new(positions, triangles, &vertices, view, run * RUN)
    });
    let sorted = Sorted { triangles, vertices, runs };
    let columns = view.width.div_ceil(TILE);
    parallel::map(columns * view.height.div_ceil(TILE), |number| {
        let mut tile = Tile::new(view, number % columns * TILE, number / columns * TILE);
        fill::<TWO>(&mut tile, &sorted, number);
        tile
    })
}

/// The image that tiles make.
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

/// A part of the image that one thread fills.
pub(super) struct Tile {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rows: Vec<Row>,
}

/// What is known of a row of pixels.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) triangle: [u32; PITCH],
    pub(super) depth: [f32; PITCH],
    /// The greatest depth below `depth`, where it is asked for.
    pub(super) second: [f32; PITCH],
}

impl Tile {
    fn new(view: &View, left: usize, top: usize) -> Self {
        let (width, height) = (min(TILE, view.width - left), min(TILE, view.height - top));
        let empty = Row { triangle: [NONE; PITCH], depth: [0.0; PITCH], second: [0.0; PITCH] };
        Self { left, top, width, height, rows: vec![empty; height] }
    }
}

/// Triangles in runs, sorted into tiles, and their vertices on the screen.
pub(super) struct Sorted<'a> {
    triangles: &'a [[u32; 3]],
    vertices: Vec<Projected>,
    runs: Vec<Run>,
}

/// Fills what triangles cover of a tile, whose number is `number`.
fn fill<const TWO: bool>(tile: &mut Tile, sorted: &Sorted<'_>, number: usize) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
        // SAFETY: the processor has AVX2.
        return unsafe { super::avx2::fill::<TWO>(tile, sorted, number) };
    }
    batches(tile, sorted, number, small::<TWO>, large::<TWO>);
}

/// Sets triangles up, a batch at a time, and fills each: a lane of the batch with `small` where its edge functions fit
/// in 32 bits, with `large` where they do not.
#[inline(always)]
pub(super) fn batches(
    tile: &mut Tile,
    sorted: &Sorted<'_>,
    number: usize,
    small: impl Fn(&mut Tile, &Batch, usize),
    large: impl Fn(&mut Tile, &Batch, usize),
) {
    let mut batch = Batch::EMPTY;
    let mut draw = |batch: &mut Batch| {
        set_up(batch, tile);
        for lane in 0..batch.count {
            if batch.large[lane] == 0 { small(tile, batch, lane) } else { large(tile, batch, lane) }
        }
        batch.count = 0;
    };
    for run in &sorted.runs {
        run.touching(number, sorted.triangles, &sorted.vertices, |triangle, corners| {
            batch.push(triangle, corners);
            if batch.count == BLOCK {
                draw(&mut batch);
            }
        });
    }
    if batch.count > 0 {
        draw(&mut batch);
    }
}

/// Fills a triangle with edge functions of 32 bits.
fn small<const TWO: bool>(tile: &mut Tile, batch: &Batch, lane: usize) {
    let [left, top, right, bottom] = batch.part(lane);
    let edge = |i: usize| [batch.start[i][lane], batch.across[i][lane], batch.down[i][lane]];
    let edges = [edge(0), edge(1), edge(2)];
    let mut row = edges.map(|edge| edge[0]);
    for y in top..bottom {
        let mut at = row;
        for x in left..right {
            if at[0] | at[1] | at[2] >= 0 {
                touch::<TWO>(tile, batch, lane, x, y);
            }
            at = [at[0] + edges[0][1], at[1] + edges[1][1], at[2] + edges[2][1]];
        }
        row = [row[0] + edges[0][2], row[1] + edges[1][2], row[2] + edges[2][2]];
    }
}

/// Fills a triangle with edge functions of 64 bits.
pub(super) fn large<const TWO: bool>(tile: &mut Tile, batch: &Batch, lane: usize) {
    let [left, top, right, bottom] = batch.part(lane);
    let corner = |i: usize| [batch.x[i][lane], batch.y[i][lane]].map(i64::from);
    let sign = if batch.area[lane] < 0.0 { -1 } else { 1 };
    let edge = |[x0, y0]: [i64; 2], [x1, y1]: [i64; 2]| {
        let (dx, dy) = (sign * (x1 - x0), sign * (y1 - y0));
        // The top-left rule: a centre on an edge belongs to the triangle whose top or left edge it is.
        let kept = dy < 0 || (dy == 0 && dx > 0);
        move |x: i64, y: i64| dx * (y - y0) - dy * (x - x0) >= i64::from(!kept)
    };
    let (a, b, c) = (corner(0), corner(1), corner(2));
    let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
    for y in top..bottom {
        for x in left..right {
            let [at_x, at_y] = [centre(x), centre(y)].map(i64::from);
            if ab(at_x, at_y) && bc(at_x, at_y) && ca(at_x, at_y) {
                touch::<TWO>(tile, batch, lane, x, y);
            }
        }
    }
}

/// A triangle covers the centre of a pixel.
#[inline(always)]
pub(super) fn touch<const TWO: bool>(tile: &mut Tile, batch: &Batch, lane: usize, x: usize, y: usize) {
    let (row, at) = (&mut tile.rows[y - tile.top], x - tile.left);
    let (depth, triangle) = (batch.depth(lane, centre(x), centre(y)), batch.triangle[lane]);
    let old = row.depth[at];
    if TWO && depth != old {
        row.second[at] = max(row.second[at], min(depth, old));
    }
    if depth > old || (depth == old && triangle < row.triangle[at]) {
        (row.depth[at], row.triangle[at]) = (depth, triangle);
    }
}

/// The centre of a column or row of pixels, in 1/256 pixel.
#[inline(always)]
pub(super) fn centre(pixel: usize) -> i32 {
    pixel as i32 * SUBPIXELS + SUBPIXELS / 2
}
