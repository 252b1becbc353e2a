//! Filling the pixels of a tile whose centres a triangle covers.

use super::batch::{Batch, set_up};
use super::setup::Sorted;
use super::tile::{Tile, centre};
use crate::numeric::lanes::BLOCK;
use crate::numeric::order::{max, min};

/// Fills what triangles cover of the tile with this number.
pub(super) fn fill<const TWO: bool>(tile: &mut Tile, sorted: &Sorted<'_>, number: usize) {
    batches(tile, sorted, number, small::<TWO>, large::<TWO>);
}

/// Sets triangles up, a batch at a time, and fills each: with `small` where its edge functions fit in 32
/// bits, with `large` where they do not.
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
    sorted.touching(number, |triangle, corners| {
        batch.push(triangle, corners);
        if batch.count == BLOCK {
            draw(&mut batch);
        }
    });
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

/// Draws a pixel whose centre the triangle covers.
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
