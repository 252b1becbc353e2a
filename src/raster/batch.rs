//! Triangles set up side by side: edge functions, and depth as a plane over the screen.

use super::SUBPIXELS;
use super::screen::Projected;
use super::tile::{Tile, first_centre, past_centre};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::{clamp, max, min};

/// The longest side of a triangle's box, in 1/256 pixel, for which its edge functions fit in 32 bits:
/// differences of coordinates up to 2¹⁴ make values up to 2 · 2²⁸. Larger ones (up to 2²³) need 64.
const SMALL: i32 = 1 << 14;

type Lanes<T> = [T; BLOCK];

/// As many triangles as there are lanes, of which the first `count` are set.
pub(super) struct Batch {
    pub(super) count: usize,
    pub(super) triangle: Lanes<u32>,
    /// Corners in 1/256 pixel, and their depths.
    pub(super) x: [Lanes<i32>; 3],
    pub(super) y: [Lanes<i32>; 3],
    pub(super) z: [Lanes<f32>; 3],
    /// Pixels of the tile whose centres lie in the triangle's box: first column and row, and one past the
    /// last; no column where the triangle has no area.
    part: [Lanes<i32>; 4],
    /// Not 0 where edge functions need 64 bits.
    pub(super) large: Lanes<i32>,
    /// Twice the area in squared 1/256 pixels, below 0 where the corners run clockwise on the screen.
    pub(super) area: Lanes<f32>,
    /// The function of each edge (0 to 1, 1 to 2, 2 to 0), which is ≥ 0 inside: its value at the centre of
    /// the part's first pixel, and its change from one pixel to the next along x and y. Without meaning in a
    /// large triangle.
    pub(super) start: [Lanes<i32>; 3],
    pub(super) across: [Lanes<i32>; 3],
    pub(super) down: [Lanes<i32>; 3],
    /// Change of depth along x and y, for each 1/256 pixel.
    pub(super) along: [Lanes<f32>; 2],
    /// The least and the greatest depth at a corner.
    pub(super) low: Lanes<f32>,
    pub(super) high: Lanes<f32>,
}

wide! {
    /// Computes the rest of a batch from its corners.
    pub(super) fn set_up(batch: &mut Batch, tile: &Tile) {
        batch.boxes(tile);
        batch.edges();
        batch.planes();
    }
}

impl Batch {
    /// No triangle.
    pub(super) const EMPTY: Self = Self {
        count: 0,
        triangle: [0; BLOCK],
        x: [[0; BLOCK]; 3],
        y: [[0; BLOCK]; 3],
        z: [[0.0; BLOCK]; 3],
        part: [[0; BLOCK]; 4],
        large: [0; BLOCK],
        area: [0.0; BLOCK],
        start: [[0; BLOCK]; 3],
        across: [[0; BLOCK]; 3],
        down: [[0; BLOCK]; 3],
        along: [[0.0; BLOCK]; 2],
        low: [0.0; BLOCK],
        high: [0.0; BLOCK],
    };

    /// Adds a triangle.
    #[inline(always)]
    pub(super) fn push(&mut self, triangle: u32, corners: [&Projected; 3]) {
        let lane = self.count % BLOCK;
        self.triangle[lane] = triangle;
        for corner in 0..3 {
            let [x, y, z, _] = *corners[corner];
            self.x[corner][lane] = x;
            self.y[corner][lane] = y;
            self.z[corner][lane] = f32::from_bits(z as u32);
        }
        self.count += 1;
    }

    /// The pixels of the tile whose centres lie in a triangle's box: first column and row, and one past the
    /// last.
    #[inline(always)]
    pub(super) fn part(&self, lane: usize) -> [usize; 4] {
        let side = |i: usize| self.part[i][lane] as usize;
        [side(0), side(1), side(2), side(3)]
    }

    #[inline(always)]
    fn boxes(&mut self, tile: &Tile) {
        let [left, top] = [tile.left as i32, tile.top as i32];
        let [right, bottom] = [left + tile.width as i32, top + tile.height as i32];
        let range = |[a, b, c]: [i32; 3]| (min(min(a, b), c), max(max(a, b), c));
        for lane in 0..BLOCK {
            let (low, high) = range([self.x[0][lane], self.x[1][lane], self.x[2][lane]]);
            self.part[0][lane] = max(first_centre(low), left);
            self.part[2][lane] = min(past_centre(high), right);
            self.large[lane] = i32::from(high - low > SMALL);
        }
        for lane in 0..BLOCK {
            let (low, high) = range([self.y[0][lane], self.y[1][lane], self.y[2][lane]]);
            self.part[1][lane] = max(first_centre(low), top);
            self.part[3][lane] = min(past_centre(high), bottom);
            self.large[lane] |= i32::from(high - low > SMALL);
        }
    }

    #[inline(always)]
    fn edges(&mut self) {
        for lane in 0..BLOCK {
            // Exact: differences of snapped coordinates are whole numbers up to 2²⁴, their products up to
            // 2⁴⁸.
            let (ax, ay) = (self.x[1][lane] - self.x[0][lane], self.y[1][lane] - self.y[0][lane]);
            let (bx, by) = (self.x[2][lane] - self.x[0][lane], self.y[2][lane] - self.y[0][lane]);
            self.area[lane] = (f64::from(ax) * f64::from(by) - f64::from(bx) * f64::from(ay)) as f32;
        }
        for lane in 0..BLOCK {
            self.part[2][lane] = if self.area[lane] == 0.0 { self.part[0][lane] } else { self.part[2][lane] };
        }
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            for lane in 0..BLOCK {
                let (from, to) = ([self.x[i][lane], self.y[i][lane]], [self.x[j][lane], self.y[j][lane]]);
                // Where the area is negative the edge runs the other way round.
                let turned = if self.area[lane] < 0.0 { -1 } else { 0 };
                let (dx, dy) = (((to[0] - from[0]) ^ turned) - turned, ((to[1] - from[1]) ^ turned) - turned);
                let at = |pixel: i32, from: i32| (pixel * SUBPIXELS + SUBPIXELS / 2) - from;
                let (x, y) = (at(self.part[0][lane], from[0]), at(self.part[1][lane], from[1]));
                let start = dx.wrapping_mul(y).wrapping_sub(dy.wrapping_mul(x));
                // The top-left rule: a centre on an edge belongs to the triangle whose top or left edge it
                // is, where dy < 0, or dy = 0 and dx > 0.
                self.start[i][lane] = start.wrapping_sub(i32::from(dy >= i32::from(dx > 0)));
                self.across[i][lane] = dy.wrapping_mul(-SUBPIXELS);
                self.down[i][lane] = dx.wrapping_mul(SUBPIXELS);
            }
        }
    }

    #[inline(always)]
    fn planes(&mut self) {
        for lane in 0..BLOCK {
            let (z0, z1, z2) = (self.z[0][lane], self.z[1][lane], self.z[2][lane]);
            let x = |i: usize| (self.x[i][lane] - self.x[0][lane]) as f32;
            let y = |i: usize| (self.y[i][lane] - self.y[0][lane]) as f32;
            let (ax, ay, az, bx, by, bz) = (x(1), y(1), z1 - z0, x(2), y(2), z2 - z0);
            self.along[0][lane] = (az * by - bz * ay) / self.area[lane];
            self.along[1][lane] = (bz * ax - az * bx) / self.area[lane];
            self.low[lane] = min(min(z0, z1), z2);
            self.high[lane] = max(max(z0, z1), z2);
        }
    }

    /// The depth at the centre (`x`, `y`) of a pixel, in 1/256 pixel, from the triangle's plane, summed from
    /// left to right. On a sliver the slopes are steep and rounding would leave the triangle. So the depth is
    /// clamped to the range of the corners' depths.
    #[inline(always)]
    pub(super) fn depth(&self, lane: usize, x: i32, y: i32) -> f32 {
        let [x, y] = [(x - self.x[0][lane]) as f32, (y - self.y[0][lane]) as f32];
        let depth = self.z[0][lane] + self.along[0][lane] * x + self.along[1][lane] * y;
        clamp(depth, self.low[lane], self.high[lane])
    }
}
