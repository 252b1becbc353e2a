//! Comparing images and passes: the first difference, how far it is, and where.

#[cfg(feature = "exr")]
mod files;
mod golden;
mod picture;
mod statistics;

#[cfg(feature = "exr")]
pub use files::{Outcome, Row, diverges_first, files};
pub use golden::{Golden, Pixels, Verdict};
pub use picture::picture;
pub use statistics::{Statistics, mismatch, statistics};

use crate::pass::Layer;
use std::fmt;

/// Where two layers first differ, and by how much they do altogether.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The layer: a pass, with the light's number where it has a layer for each light.
    pub layer: String,
    /// Column and row of the first pixel that differs, reading from the top left; faces are stacked downward.
    pub pixel: [usize; 2],
    /// The channel that differs there first.
    pub channel: String,
    /// The value that was expected there, and the one that was found.
    pub values: [f64; 2],
    /// Distance of the two: for real numbers in units of the last place, for indices their difference.
    pub ulps: u64,
    /// How many pixels differ.
    pub pixels: usize,
    /// The largest absolute difference of all values that are finite.
    pub largest: f64,
}

impl fmt::Display for Difference {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { layer, pixel: [x, y], channel, values: [expected, found], ulps, pixels, largest } = self;
        let distance = (found - expected).abs();
        write!(
            out,
            "{layer} first differs at pixel ({x}, {y}), channel {channel}: expected {expected:e}, found "
        )?;
        write!(
            out,
            "{found:e}, a distance of {distance:e} ({ulps} ULP); {pixels} pixels differ, by at most {largest:e}"
        )
    }
}

/// The first pixel at which two layers of the same size and channels differ, if any. −0 equals +0; a NaN
/// equals only the same NaN.
///
/// # Panics
/// Where sizes, channels or types differ: ask [`mismatch`] first.
pub fn difference(expected: &Layer, found: &Layer) -> Option<Difference> {
    statistics(expected, found, 0.0).difference
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass::{Channel, Data};

    fn layer(values: [f32; 6]) -> Layer {
        let channels = vec![Channel { name: "Y".into(), data: Data::F32(values.to_vec()) }];
        Layer { name: "t.a".into(), width: 3, height: 2, channels }
    }

    #[test]
    fn one_injected_fault_is_found_at_its_pixel() {
        let clean = layer([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(difference(&clean, &clean), None);
        assert_eq!(difference(&clean, &layer([-0.0, 1.0, 2.0, 3.0, 4.0, 5.0])), None);
        let faulty = layer([0.0, 1.0, 2.0, 3.0, 4.0_f32.next_up(), 5.0]);
        let found = difference(&clean, &faulty).unwrap();
        assert_eq!((found.pixel, found.ulps, found.pixels), ([1, 1], 1, 1));
        assert!(
            found.to_string().contains("t.a first differs at pixel (1, 1), channel Y: expected 4e0"),
            "{found}"
        );
    }
}
