//! The points of a bundle sorted into the cells of a grid across the direction.

use super::Hit;
use super::morton::{Bundle, LANES};
use crate::numeric::lanes::wide;
use crate::numeric::order::{clamp, max, min};

/// Rows of the grid for each square root of a triangle.
const ROWS: f32 = 0.25;

/// Columns of the grid for each square root of a point that looks.
const COLUMNS: f32 = 4.0;

/// Columns that share a front.
pub(super) const BLOCK_COLUMNS: usize = 8;

/// What a task keeps from one direction to the next.
#[derive(Default)]
pub(super) struct Cells {
    /// Sheared places.
    pub(super) sheared: Vec<[f32; 4]>,
    /// The points that look along the direction.
    pub(super) looking: Vec<u32>,
    /// Whether what looks from a place is blocked.
    pub(super) blocked: Vec<bool>,
    /// Places and triangles that may block what looks from there, both in the bundle's order.
    pub(super) pairs: Vec<[u32; 2]>,
    /// What looks from a place meets first, as far as is known.
    pub(super) met: Vec<Option<Hit>>,
    /// Where each cell's points start, and the last one's end. A cell has the points of two rows of the grid, its own and
    /// the next, so that a triangle that is no higher than a row has all its points in cells of one row, side by side.
    pub(super) starts: Vec<u32>,
    /// The least depth of a point in [`BLOCK_COLUMNS`] neighbouring cells and the [`BLOCK_COLUMNS`] after them: a triangle
    /// no wider than that and before this depth blocks nothing.
    pub(super) fronts: Vec<f32>,
    /// The points as they are sorted: sheared place, and the bits of the place's number; and their cells.
    sorted: Vec<[f32; 4]>,
    cells: Vec<u32>,
    /// The points of all cells, each twice.
    pub(super) lanes: Lanes,
}

/// Points in the order of cells.
#[derive(Default)]
pub(super) struct Lanes {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    /// Depth along the direction; not a number once the point is blocked.
    pub(super) z: Vec<f32>,
    /// The point's place, to leave out the triangles around it.
    pub(super) place: Vec<u32>,
}

/// Cells of sheared space.
pub(super) struct Grid {
    pub(super) low: [f32; 2],
    /// Cells a unit.
    pub(super) per: [f32; 2],
    /// Cells along x and y.
    pub(super) size: [usize; 2],
    /// The larger side of a cell, in sheared units.
    pub(super) width: f32,
}

impl Grid {
    /// A grid between the `ends` of the sheared places, whose rows are about as high as triangles if these are alike.
    pub(super) fn new(bundle: &Bundle, ends: [[f32; 2]; 2], looking: usize) -> Self {
        let rows = clamp(((bundle.triangles.len() * LANES) as f32).sqrt() * ROWS, 1.0, 2048.0);
        let columns = clamp((looking as f32).sqrt() * COLUMNS, 1.0, 2048.0);
        let size = [columns, rows];
        let low = [ends[0][0], ends[1][0]];
        let side = ends.map(|[low, high]| max(high - low, f32::MIN_POSITIVE));
        let width = max(side[0] / columns, side[1] / rows);
        let per = [0, 1].map(|axis| min(size[axis] / side[axis], 1e9));
        Self { low, per, size: size.map(|size| size as usize + 1), width }
    }

    /// Blocks of a row, with one before the first for the points' second place.
    pub(super) fn blocks(&self) -> usize {
        self.size[0].div_ceil(BLOCK_COLUMNS) + 1
    }

    /// The cell along an axis of a coordinate.
    #[inline(always)]
    pub(super) fn cell(&self, axis: usize, coordinate: f32) -> usize {
        min(((coordinate - self.low[axis]) * self.per[axis]) as i32 as usize, self.size[axis] - 1)
    }
}

impl Cells {
    /// Sorts the points that look along the direction by cells.
    pub(super) fn sort(&mut self, grid: &Grid, bundle: &Bundle) {
        let [columns, rows] = grid.size;
        let blocks = grid.blocks();
        self.starts.clear();
        self.starts.resize(columns * (rows + 2) + 2, 0);
        self.fronts.clear();
        self.fronts.resize(blocks * (rows + 2) + 2, f32::INFINITY);
        self.cells.resize(self.looking.len(), 0);
        for (point, to) in self.looking.iter().zip(&mut self.cells) {
            let [x, y, z, _] = self.sheared[bundle.points[*point as usize] as usize];
            let (column, row) = (grid.cell(0, x), grid.cell(1, y));
            let cell = row * columns + column;
            self.starts[cell + columns + 2] += 1;
            let front = &mut self.fronts[(row + 1) * blocks + column / BLOCK_COLUMNS + 1];
            *front = min(*front, z);
            *to = cell as u32;
        }
        // What each cell has with the next row's points, and each front with its neighbours'.
        for at in 0..columns * (rows + 1) {
            self.starts[at + 2] += self.starts[at + columns + 2];
        }
        for at in 0..blocks * (rows + 1) {
            let [own, next] = [at, at + blocks].map(|at| min(self.fronts[at], self.fronts[at + 1]));
            self.fronts[at] = min(own, next);
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += *start;
            *start = total;
        }
        let count = 2 * self.looking.len();
        self.sorted.resize(count, [0.0; 4]);
        for (point, cell) in self.looking.iter().zip(&self.cells) {
            let number = bundle.points[*point as usize];
            let [x, y, z, _] = self.sheared[number as usize];
            for cell in [*cell as usize, *cell as usize + columns] {
                let next = &mut self.starts[cell + 1];
                self.sorted[*next as usize] = [x, y, z, f32::from_bits(number)];
                *next += 1;
            }
        }
        let lanes = &mut self.lanes;
        for list in [&mut lanes.x, &mut lanes.y, &mut lanes.z] {
            list.resize(count + LANES, 0.0);
        }
        lanes.place.resize(count + LANES, 0);
        spread(&self.sorted, lanes);
        // What comes after the last point is nobody.
        lanes.z[count..count + LANES].fill(f32::NAN);
    }
}

wide! {
    /// Makes one list a coordinate.
    fn spread(sorted: &[[f32; 4]], lanes: &mut Lanes) {
        let coordinates = lanes.x.iter_mut().zip(&mut lanes.y).zip(&mut lanes.z);
        for (([x, y, z, number], ((to_x, to_y), to_z)), place) in sorted.iter().zip(coordinates).zip(&mut lanes.place) {
            (*to_x, *to_y, *to_z, *place) = (*x, *y, *z, number.to_bits());
        }
    }
}
