//! The points of a bundle sorted into the cells of a grid across the direction.

use super::Hit;
use super::morton::{Bundle, LANES};
use crate::numeric::lanes::wide;
use crate::numeric::order::{clamp, max, min};

/// Rows of the grid, in square roots of the number of triangles.
const ROWS: f32 = 0.25;

/// Columns of the grid, in square roots of the number of points that look along the direction.
const COLUMNS: f32 = 4.0;

/// Columns that share a front.
pub(super) const BLOCK_COLUMNS: usize = 8;

/// The buffers of a task, which it reuses from one direction to the next.
#[derive(Default)]
pub(super) struct Cells {
    /// The sheared position of every place.
    pub(super) sheared: Vec<[f32; 4]>,
    /// The points that look along the direction.
    pub(super) looking: Vec<u32>,
    /// Whether the ray from a place is blocked.
    pub(super) blocked: Vec<bool>,
    /// Pairs of a place and a triangle that may block the ray from it, both in the bundle's order.
    pub(super) pairs: Vec<[u32; 2]>,
    /// What the ray from a place meets first, as far as is known.
    pub(super) met: Vec<Option<Hit>>,
    /// Where each cell's points start, and where those of the last cell end. A cell has the points of two
    /// rows of the grid, its own and the next. So a triangle that is no higher than a row has all its points
    /// in neighbouring cells of one row.
    pub(super) starts: Vec<u32>,
    /// Fronts: the least depth of a point in [`BLOCK_COLUMNS`] neighbouring cells and the [`BLOCK_COLUMNS`]
    /// after them. A triangle that is no wider than that, and everywhere before this depth, blocks nothing.
    pub(super) fronts: Vec<f32>,
    /// The points as they are sorted: x, y and z of the sheared position, and the bits of the place. Then
    /// their cells.
    sorted: Vec<[f32; 4]>,
    cells: Vec<u32>,
    /// The points of all cells; each point is there twice.
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

/// A grid of cells over x and y of sheared space.
pub(super) struct Grid {
    pub(super) low: [f32; 2],
    /// Cells a unit of length.
    pub(super) per: [f32; 2],
    /// Cells along x and y.
    pub(super) size: [usize; 2],
    /// The larger side of a cell, in sheared units.
    pub(super) width: f32,
}

impl Grid {
    /// A grid between the `ends` of x and y. Its rows are about as high as the triangles, if these are alike.
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

    /// Blocks of [`BLOCK_COLUMNS`] in a row, and an empty one before the first: it follows the last block of
    /// the row before.
    pub(super) fn blocks(&self) -> usize {
        self.size[0].div_ceil(BLOCK_COLUMNS) + 1
    }

    /// The column or row that a coordinate falls into.
    #[inline(always)]
    pub(super) fn cell(&self, axis: usize, coordinate: f32) -> usize {
        min(((coordinate - self.low[axis]) * self.per[axis]) as i32 as usize, self.size[axis] - 1)
    }
}

impl Cells {
    /// Sorts the points that look along the direction into cells.
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
        // Each cell gets the next row's points too, and each front those of its neighbours.
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
        // The lanes after the last point are padding. Their depth is not a number, so nothing blocks them.
        lanes.z[count..count + LANES].fill(f32::NAN);
    }
}

wide! {
    /// Splits points into one list a coordinate.
    fn spread(sorted: &[[f32; 4]], lanes: &mut Lanes) {
        let coordinates = lanes.x.iter_mut().zip(&mut lanes.y).zip(&mut lanes.z);
        for (([x, y, z, number], ((to_x, to_y), to_z)), place) in sorted.iter().zip(coordinates).zip(&mut lanes.place) {
            (*to_x, *to_y, *to_z, *place) = (*x, *y, *z, number.to_bits());
        }
    }
}
