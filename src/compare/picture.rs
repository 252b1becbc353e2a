//! Pictures of where two layers differ.

use super::statistics::{sorted, unequal, value};
use crate::Error;
use crate::numeric::double::log;
use crate::pass::Layer;
use crate::store::file;
use std::path::Path;

/// Writes a PNG that shows where two layers differ by more than `tolerance`. Pixels that are the same are
/// grey. The others run from red to yellow with the logarithm of the largest relative difference of their
/// channels, from one unit in the last place to 1. A pixel with a value that is finite in one layer alone is
/// yellow.
///
/// # Errors
/// What the system refuses, naming the file or the folder, which is made if it is not there.
///
/// # Panics
/// Where sizes or channels differ: ask [`super::mismatch`] first.
pub fn picture(path: &Path, a: &Layer, b: &Layer, tolerance: f64) -> Result<(), Error> {
    if let Some(folder) = path.parent() {
        file::make_folder(folder)?;
    }
    let (ours, theirs) = (sorted(a), sorted(b));
    let mut rgb = Vec::new();
    for index in 0..a.width * a.height {
        let mut worst = None;
        for (a, b) in ours.iter().zip(&theirs) {
            if unequal(&a.data, &b.data, index, tolerance).is_none() {
                continue;
            }
            let (a, b) = (value(&a.data, index), value(&b.data, index));
            let scale = if a.abs() > b.abs() { a.abs() } else { b.abs() };
            let relative = (a - b).abs() / scale;
            let relative = if relative.is_finite() { relative } else { 1.0 };
            worst = Some(worst.map_or(relative, |worst| if relative > worst { relative } else { worst }));
        }
        // 2^-24 gives 0, 1 gives 1.
        let heat = |worst: f64| ((1.0 + log(worst) / 16.635_532) * 255.0) as u8;
        rgb.extend(worst.map_or([40; 3], |worst| [255, heat(worst), 0]));
    }
    file::write_png(path, a.width, a.height, &rgb)
}
