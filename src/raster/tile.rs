//! A tile of the image, its pixels, and where their centres lie.

use super::{SUBPIXELS, View};
use crate::numeric::order::min;

/// The triangle of a pixel that none covers.
pub const NONE: u32 = u32::MAX;

/// Width and height of a tile, in pixels.
pub(super) const TILE: usize = 64;

/// Pixels of a row that may be filled together.
pub(super) const LANES: usize = 8;

/// Pixels from row to row of a tile's buffers. Pixels that are filled together may reach beyond the tile's
/// last column.
pub(super) const PITCH: usize = TILE + LANES;

/// A part of the image that one thread fills.
pub(super) struct Tile {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rows: Vec<Row>,
}

/// The nearest triangle of each pixel of a row, and the depths.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) triangle: [u32; PITCH],
    pub(super) depth: [f32; PITCH],
    /// The greatest depth below `depth`, where it is asked for.
    pub(super) second: [f32; PITCH],
}

impl Tile {
    pub(super) fn new(view: &View, left: usize, top: usize) -> Self {
        let (width, height) = (min(TILE, view.width - left), min(TILE, view.height - top));
        let empty = Row { triangle: [NONE; PITCH], depth: [0.0; PITCH], second: [0.0; PITCH] };
        Self { left, top, width, height, rows: vec![empty; height] }
    }
}

/// The centre of a column or row of pixels, in 1/256 pixel.
#[inline(always)]
pub(super) fn centre(pixel: usize) -> i32 {
    pixel as i32 * SUBPIXELS + SUBPIXELS / 2
}

/// The first column or row of pixels whose centres are not below `low`, in 1/256 pixel: ⌈low − ½⌉ in pixels.
/// The shift is a division that rounds down.
#[inline(always)]
pub(super) fn first_centre(low: i32) -> i32 {
    low.wrapping_add(SUBPIXELS / 2 - 1) >> SUBPIXELS.trailing_zeros()
}

/// One past the last column or row of pixels whose centres are not above `high`: ⌊high − ½⌋ + 1 in pixels.
#[inline(always)]
pub(super) fn past_centre(high: i32) -> i32 {
    high.wrapping_add(SUBPIXELS / 2) >> SUBPIXELS.trailing_zeros()
}
