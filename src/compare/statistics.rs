//! How far two layers differ: largest, mean and root-mean-square difference, how many pixels, and the first.

use super::Difference;
use crate::numeric::order::max;
use crate::numeric::sum::sum;
use crate::pass::{Channel, Data, Layer};

/// How far two layers differ, in the unit of their values.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// The largest absolute difference of two finite values.
    pub largest: f64,
    /// The mean absolute difference of all finite values.
    pub mean: f64,
    /// The root of the mean squared difference of all finite values.
    pub rmse: f64,
    /// How many values are a NaN or an infinity in one layer or both; the three above leave these out.
    pub not_finite: usize,
    /// The first pixel that differs and how many do; `None` where none differs by more than the tolerance.
    pub difference: Option<Difference>,
}

/// What keeps two layers from being compared value by value: the size, the channels or a channel's type. The
/// order of the channels does not matter.
pub fn mismatch(a: &Layer, b: &Layer) -> Option<String> {
    if (a.width, a.height) != (b.width, b.height) {
        return Some(format!("{} x {} in A, {} x {} in B", a.width, a.height, b.width, b.height));
    }
    let (ours, theirs) = (sorted(a), sorted(b));
    let names = |channels: &[&Channel]| {
        channels.iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(" ")
    };
    if names(&ours) != names(&theirs) {
        return Some(format!("channels {} in A, {} in B", names(&ours), names(&theirs)));
    }
    let types = |(ours, theirs): (&&Channel, &&Channel)| {
        let [a, b] = [ours.data.type_name(), theirs.data.type_name()];
        (a != b).then(|| format!("channel {} is {a} in A, {b} in B", ours.name))
    };
    ours.iter().zip(&theirs).find_map(types)
}

/// How far two layers differ. Channels are paired, and read at each pixel, in the order of their names.
///
/// −0 equals +0; a NaN equals only the same NaN. Real numbers that differ by at most `tolerance` count as the
/// same, but enter the largest, the mean and the root-mean-square difference. Indices have no tolerance. Rows
/// are summed first, then the rows' sums, each in the order of [`sum`].
///
/// # Panics
/// Where there is a [`mismatch`].
pub fn statistics(a: &Layer, b: &Layer, tolerance: f64) -> Statistics {
    if let Some(what) = mismatch(a, b) {
        panic!("{}: {what}", a.name);
    }
    let channels: Vec<(&Channel, &Channel)> = sorted(a).into_iter().zip(sorted(b)).collect();
    let (mut absolute, mut squared) = (Vec::with_capacity(a.height), Vec::with_capacity(a.height));
    let (mut largest, mut finite, mut pixels, mut first) = (0.0, 0, 0, None);
    let mut distances = Vec::with_capacity(a.width * channels.len());
    for y in 0..a.height {
        distances.clear();
        for x in 0..a.width {
            let mut differs = false;
            for (ours, theirs) in &channels {
                let values = [&ours.data, &theirs.data].map(|data| value(data, y * a.width + x));
                if values[0].is_finite() && values[1].is_finite() {
                    distances.push((values[0] - values[1]).abs());
                }
                let Some(ulps) = unequal(&ours.data, &theirs.data, y * a.width + x, tolerance) else {
                    continue;
                };
                differs = true;
                first.get_or_insert_with(|| Difference {
                    layer: a.name.clone(),
                    pixel: [x, y],
                    channel: ours.name.clone(),
                    values,
                    ulps,
                    pixels: 0,
                    largest: 0.0,
                });
            }
            pixels += usize::from(differs);
        }
        finite += distances.len();
        largest = distances.iter().copied().fold(largest, max);
        absolute.push(sum(&distances));
        distances.iter_mut().for_each(|distance| *distance *= *distance);
        squared.push(sum(&distances));
    }
    let mean = |sums: &[f64]| if finite == 0 { 0.0 } else { sum(sums) / finite as f64 };
    Statistics {
        largest,
        mean: mean(&absolute),
        rmse: mean(&squared).sqrt(),
        not_finite: a.width * a.height * channels.len() - finite,
        difference: first.map(|first| Difference { pixels, largest, ..first }),
    }
}

/// The channels in the order of their names, as EXR has them.
pub(super) fn sorted(layer: &Layer) -> Vec<&Channel> {
    let mut channels: Vec<_> = layer.channels.iter().collect();
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    channels
}

pub(super) fn value(data: &Data, index: usize) -> f64 {
    match data {
        Data::F32(values) => f64::from(values[index]),
        Data::U32(values) => f64::from(values[index]),
    }
}

/// How far apart two values are that differ by more than `tolerance`: in units of the last place, for indices
/// their difference.
pub(super) fn unequal(a: &Data, b: &Data, index: usize, tolerance: f64) -> Option<u64> {
    match (a, b) {
        (Data::F32(a), Data::F32(b)) => {
            let (a, b) = (a[index], b[index]);
            let same = a == b || a.to_bits() == b.to_bits() || near(a, b, tolerance);
            (!same).then(|| ordered(a).abs_diff(ordered(b)))
        }
        (Data::U32(a), Data::U32(b)) => {
            (a[index] != b[index]).then(|| u64::from(a[index].abs_diff(b[index])))
        }
        _ => Some(u64::MAX),
    }
}

/// Whether two values differ by at most `tolerance`. False for a NaN, and for an infinity under any finite
/// tolerance.
fn near(a: f32, b: f32, tolerance: f64) -> bool {
    (f64::from(a) - f64::from(b)).abs() <= tolerance
}

/// A whole number that counts the real numbers in order, both zeros being 0.
fn ordered(x: f32) -> i64 {
    let bits = i64::from(x.to_bits() & 0x7fff_ffff);
    if x.is_sign_negative() { -bits } else { bits }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, values: [f32; 4]) -> Channel {
        Channel { name: name.into(), data: Data::F32(values.to_vec()) }
    }

    fn layer(channels: Vec<Channel>) -> Layer {
        Layer { name: "t.a".into(), width: 2, height: 2, channels }
    }

    fn one(values: [f32; 4]) -> Layer {
        layer(vec![channel("Y", values)])
    }

    #[test]
    fn the_figures_are_those_worked_out_by_hand() {
        let found = statistics(&one([0.0, 1.0, 2.0, 3.0]), &one([-0.0, 1.0, 5.0, -1.0]), 0.0);
        assert_eq!((found.largest, found.mean, found.rmse), (4.0, 1.75, 2.5));
        let difference = found.difference.unwrap();
        assert_eq!((difference.pixel, difference.pixels, difference.values), ([0, 1], 2, [2.0, 5.0]));
        assert_eq!(found.not_finite, 0);
    }

    #[test]
    fn the_order_of_channels_does_not_matter() {
        let (r, g) = (channel("R", [0.1, 0.2, 0.3, 0.4]), channel("G", [1.0; 4]));
        let changed = channel("R", [0.1, 0.2, 0.7, 0.4]);
        let a = layer(vec![r.clone(), g.clone()]);
        let found = [vec![changed.clone(), g.clone()], vec![g, changed]]
            .map(|channels| statistics(&a, &layer(channels), 0.0));
        assert_eq!(found[0], found[1]);
        assert_eq!(found[0].difference.as_ref().unwrap().channel, "R");
    }

    #[test]
    fn a_tolerance_leaves_out_small_differences_of_the_count_but_not_of_the_figures() {
        let found = statistics(&one([0.0, 1.0, 2.0, 3.0]), &one([0.5, 1.0, 4.0, 3.0]), 0.5);
        let difference = found.difference.unwrap();
        assert_eq!((difference.pixel, difference.pixels, found.mean), ([0, 1], 1, 0.625));
        let within = statistics(&one([0.0; 4]), &one([0.25; 4]), 0.25);
        assert_eq!((within.difference, within.largest), (None, 0.25));
        let indices = |id| layer(vec![Channel { name: "Y".into(), data: Data::U32(vec![id; 4]) }]);
        assert_eq!(statistics(&indices(7), &indices(9), 5.0).difference.unwrap().ulps, 2);
    }

    #[test]
    fn a_nan_differs_from_all_but_the_same_nan_under_any_tolerance_and_is_counted() {
        let nan = one([f32::NAN, 1.0, f32::INFINITY, 0.0]);
        let same = statistics(&nan, &nan, 0.0);
        assert_eq!((same.difference, same.not_finite, same.largest), (None, 2, 0.0));
        let found = statistics(&one([0.0, 1.0, 0.0, 2.0]), &nan, 9.0);
        let difference = found.difference.unwrap();
        assert_eq!((difference.pixel, difference.pixels, found.not_finite), ([0, 0], 2, 2));
        assert!(difference.values[1].is_nan());
        assert_eq!((found.largest, found.mean), (2.0, 1.0));
    }

    #[test]
    fn what_cannot_be_compared_is_named() {
        let wide = Layer { width: 4, height: 1, ..one([0.0; 4]) };
        assert_eq!(mismatch(&one([0.0; 4]), &wide).unwrap(), "2 x 2 in A, 4 x 1 in B");
        let two = layer(vec![channel("R", [0.0; 4]), channel("A", [0.0; 4])]);
        assert_eq!(mismatch(&two, &one([0.0; 4])).unwrap(), "channels A R in A, Y in B");
        let indices = layer(vec![Channel { name: "Y".into(), data: Data::U32(vec![0; 4]) }]);
        assert_eq!(mismatch(&one([0.0; 4]), &indices).unwrap(), "channel Y is f32 in A, u32 in B");
        assert_eq!(mismatch(&two, &two), None);
    }

    #[test]
    fn ulps_count_across_zero() {
        assert_eq!(ordered(f32::from_bits(1)) - ordered(-f32::from_bits(1)), 2);
        assert_eq!(ordered(0.0), ordered(-0.0));
    }
}
