//! `translucency.blur`: the first distance smoothed by a separable Gaussian (§3).
//!
//! Decides errata T6: eight taps have no middle, and shift the map by half a texel; a width of n has 2⌊n/2⌋ + 1
//! taps here, centred, with a standard deviation of n/4. And T12: the clear value must not be mixed in at
//! silhouettes, so texels without a surface have no weight: both directions carry the weighted sum and the sum of
//! weights, and divide once at the end. A texel without a surface but with one in reach thereby gets a value, which
//! the lookups of `thickness` at a silhouette need; one without any stays 0.
//!
//! To the letter a width of n has n taps, at −⌊n/2⌋ … n − 1 − ⌊n/2⌋ and centred between them, at −½ for an even n, and
//! takes every texel alike. The clear value is the far distance of the light's view, 1.5 radii of the box behind its
//! centre; it also stands for what lies outside the map, where the light sees nothing either.

use super::Frame;
use crate::numeric::{double::exp, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.blur",
        equation: "§3; T6, T12",
        about: "the first distance, smoothed by a Gaussian that leaves out texels without a surface",
        inputs: &["translucency.shadow"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column],
        unit: "scene unit",
    },
    run,
};

/// The right half of the kernel: weights at 0, 1, … ⌊n/2⌋ texels, unnormalised, as the sum of those used divides.
fn taps(width: usize) -> Vec<f32> {
    let deviation = width as f64 / 4.0;
    let weight = |offset: usize| match offset {
        0 => 1.0,
        _ => exp(-0.5 * (offset * offset) as f64 / (deviation * deviation)) as f32,
    };
    (0..=width / 2).map(weight).collect()
}

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadows = inputs.get("translucency.shadow");
    let size = frame.settings.shadow;
    let mut values = Vec::with_capacity(frame.casters.len() * size * size);
    if frame.paper() {
        let taps = taps_as_printed(frame.settings.blur);
        for (number, caster) in frame.casters.iter().enumerate() {
            let clear = caster.shadow.distance(frame.bounds.center()) + 1.5 * frame.bounds.radius();
            let filled: Vec<f32> = shadows
                .slice(number)
                .chunks_exact(2)
                .map(|texel| if texel[0] > 0.0 { texel[0] } else { clear })
                .collect();
            let across = convolved_as_printed(&filled, size, 1, &taps, clear);
            values.extend(convolved_as_printed(&across, size, size, &taps, clear));
        }
        return Buffer::f32(&[frame.casters.len(), size, size], values);
    }
    let taps = taps(frame.settings.blur);
    for number in 0..frame.casters.len() {
        let weighed: Vec<[f32; 2]> = shadows
            .slice(number)
            .chunks_exact(2)
            .map(|texel| if texel[0] > 0.0 { [texel[0], 1.0] } else { [0.0; 2] })
            .collect();
        let across = convolved(&weighed, size, 1, &taps);
        let down = convolved(&across, size, size, &taps);
        values.extend(down.iter().map(|[sum, weight]| if *weight > 0.0 { sum / weight } else { 0.0 }));
    }
    Buffer::f32(&[frame.casters.len(), size, size], values)
}

/// Offsets and weights of the kernel to the letter, n of them for a width of n; their sum is 1. A width of 0 is that of
/// 1, which changes nothing.
fn taps_as_printed(width: usize) -> Vec<(isize, f32)> {
    let (count, first) = (width.max(1) as isize, -((width / 2) as isize));
    let middle = first as f64 + (count - 1) as f64 / 2.0;
    let deviation = count as f64 / 4.0;
    let weight = |offset: isize| {
        let x = (offset as f64 - middle) / deviation;
        exp(-0.5 * x * x)
    };
    let total = (first..first + count).map(weight).fold(0.0, |sum, weight| sum + weight);
    (first..first + count).map(|offset| (offset, (weight(offset) / total) as f32)).collect()
}

/// Convolves values along the axis whose neighbours lie `stride` apart, from the first tap to the last; what lies
/// outside the map is `clear`.
fn convolved_as_printed(
    values: &[f32],
    size: usize,
    stride: usize,
    taps: &[(isize, f32)],
    clear: f32,
) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    parallel::for_each_chunk(&mut out, size, |row, out| {
        for (column, out) in out.iter_mut().enumerate() {
            let at = if stride == 1 { column } else { row };
            let line = row * size + column - at * stride;
            for (offset, weight) in taps {
                let place = at.checked_add_signed(*offset).filter(|place| *place < size);
                *out += weight * place.map_or(clear, |place| values[line + place * stride]);
            }
        }
    });
    out
}

/// Convolves pairs along the axis whose neighbours lie `stride` apart; what lies outside the map has no weight.
fn convolved(pairs: &[[f32; 2]], size: usize, stride: usize, taps: &[f32]) -> Vec<[f32; 2]> {
    let mut out = vec![[0.0; 2]; pairs.len()];
    parallel::for_each_chunk(&mut out, size, |row, out| {
        for (column, out) in out.iter_mut().enumerate() {
            let index = row * size + column;
            let at = if stride == 1 { column } else { row };
            let mut total = [0.0_f32; 2];
            let mut add = |weight: f32, pair: [f32; 2]| {
                total = [total[0] + weight * pair[0], total[1] + weight * pair[1]];
            };
            // From the far left to the far right.
            for offset in (1..taps.len()).rev().filter(|offset| *offset <= at) {
                add(taps[offset], pairs[index - offset * stride]);
            }
            for (offset, weight) in taps.iter().enumerate().take(size - at) {
                add(*weight, pairs[index + offset * stride]);
            }
            *out = total;
        }
    });
    out
}
