//! Comparing images and passes: the first difference, how far it is, and where.

mod golden;

pub use golden::{Golden, Pixels, Verdict};

use crate::pass::{Data, Layer};
use std::fmt;

/// Where two layers first differ, and by how much they do altogether.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The layer: a pass, with the light's number where it has one a light.
    pub layer: String,
    /// Column and row of the first pixel that differs, reading from the top left; faces are stacked downward.
    pub pixel: [usize; 2],
    /// The channel that differs there first.
    pub channel: String,
    /// The value that was expected there, and the one that was found.
    pub values: [f64; 2],
    /// Distance of the two in units of the last place, for real numbers; of the indices otherwise.
    pub ulps: u64,
    /// How many pixels differ.
    pub pixels: usize,
    /// The largest absolute difference of all values.
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

/// The first pixel at which two layers of the same size and channels differ, if any. −0 equals +0; a NaN equals
/// only the same NaN.
///
/// # Panics
/// Where sizes or channels differ: compare those first.
pub fn difference(expected: &Layer, found: &Layer) -> Option<Difference> {
    assert_eq!((expected.width, expected.height), (found.width, found.height), "layers of two sizes");
    let names = |layer: &Layer| layer.channels.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(expected), names(found), "layers of different channels");
    let mut first: Option<Difference> = None;
    let (mut pixels, mut largest) = (0, 0.0);
    for index in 0..expected.width * expected.height {
        let mut differs = false;
        for (ours, theirs) in expected.channels.iter().zip(&found.channels) {
            let Some((values, ulps)) = unequal(&ours.data, &theirs.data, index) else { continue };
            differs = true;
            let distance = (values[0] - values[1]).abs();
            if distance > largest {
                largest = distance;
            }
            first.get_or_insert_with(|| Difference {
                layer: expected.name.clone(),
                pixel: [index % expected.width, index / expected.width],
                channel: ours.name.clone(),
                values,
                ulps,
                pixels: 0,
                largest: 0.0,
            });
        }
        pixels += usize::from(differs);
    }
    first.map(|first| Difference { pixels, largest, ..first })
}

/// The two values at `index` and their distance in the last place, where they differ.
fn unequal(a: &Data, b: &Data, index: usize) -> Option<([f64; 2], u64)> {
    match (a, b) {
        (Data::F32(a), Data::F32(b)) => {
            let (a, b) = (a[index], b[index]);
            let same = a == b || a.to_bits() == b.to_bits();
            (!same).then(|| ([f64::from(a), f64::from(b)], ordered(a).abs_diff(ordered(b))))
        }
        (Data::U32(a), Data::U32(b)) => {
            let (a, b) = (a[index], b[index]);
            (a != b).then(|| ([f64::from(a), f64::from(b)], u64::from(a.abs_diff(b))))
        }
        _ => Some(([f64::NAN; 2], u64::MAX)),
    }
}

/// A whole number that counts the real numbers in order, both zeros being 0.
fn ordered(x: f32) -> i64 {
    let bits = i64::from(x.to_bits() & 0x7fff_ffff);
    if x.is_sign_negative() { -bits } else { bits }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass::Channel;

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

    #[test]
    fn ulps_count_across_zero() {
        assert_eq!(ordered(f32::from_bits(1)) - ordered(-f32::from_bits(1)), 2);
        assert_eq!(ordered(0.0), ordered(-0.0));
    }
}
