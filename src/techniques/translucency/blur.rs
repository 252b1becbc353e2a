//! `translucency.blur`: the first distance smoothed by a separable Gaussian (§3).
//!
//! Decides errata T6: eight taps have no middle, and shift the map by half a texel. Here a width of n has
//! 2⌊n/2⌋ + 1 taps, centred, with a standard deviation of n/4. Decides T12: the clear value must not be mixed
//! in at silhouettes, so texels without a surface have no weight. Both directions carry the weighted sum and
//! the sum of weights, and divide once at the end. So a texel without a surface but with one in reach gets a
//! value, which the lookups of `thickness` at a silhouette need; one with none in reach stays 0.
//!
//! To the letter a width of n has n taps, at −⌊n/2⌋ … n − 1 − ⌊n/2⌋. The Gaussian is centred between them, at
//! −½ for an even n, and every texel counts alike. The clear value is the far distance of the light's view,
//! 1.5 radii of the box behind its centre; it also stands for what lies outside the map, where the light sees
//! nothing either.

use super::Frame;
use crate::keys::Reading;
use crate::numeric::{double::exp, lanes::wide, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.blur",
        equation: "§3; T6, T12",
        about: "the first distance, smoothed by a Gaussian that leaves out texels without a surface",
        inputs: &["translucency.shadow"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column],
        unit: "scene unit",
        knob: "translucency.shadow",
        twin: Twin::PLANNED,
        preview: &[Preview::Value],
    },
    run,
};

/// Offsets and weights of the kernel, from the far left (or top) to the far right, unnormalised: the result
/// is divided by the sum of the weights that are used.
fn taps(width: usize) -> Vec<(isize, f32)> {
    let (reach, deviation) = ((width / 2) as isize, width as f64 / 4.0);
    let weight = |offset: isize| match offset {
        0 => 1.0,
        _ => exp(-0.5 * (offset * offset) as f64 / (deviation * deviation)) as f32,
    };
    (-reach..=reach).map(|offset| (offset, weight(offset))).collect()
}

/// Offsets and weights of the kernel to the letter, n of them for a width of n; their sum is 1. A width of 0
/// is that of 1, which changes nothing.
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

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadows = inputs.get("translucency.shadow");
    let (size, width) = (frame.settings.shadow, frame.settings.blur);
    let mut maps = Vec::with_capacity(frame.casters.len());
    for (number, caster) in frame.casters.iter().enumerate() {
        let texels = shadows.slice(number).as_chunks::<3>().0;
        maps.push(match frame.settings.reading {
            Reading::Corrected => {
                let taps = taps(width);
                let sums = convolved(&each(texels, size, |distance| distance), size, &taps, 0.0);
                let covered = each(texels, size, |distance| if distance > 0.0 { 1.0 } else { 0.0 });
                let weights = convolved(&covered, size, &taps, 0.0);
                parallel::images([1, size * size], size, 0.0, |_, row, out| {
                    let row = row * size..(row + 1) * size;
                    for (out, (sum, weight)) in
                        out.iter_mut().zip(sums[row.clone()].iter().zip(&weights[row]))
                    {
                        let share = sum / weight;
                        *out = if *weight > 0.0 { share } else { 0.0 };
                    }
                })
            }
            Reading::Paper => {
                let clear = caster.shadow.distance(frame.bounds.center()) + 1.5 * frame.bounds.radius();
                let filled = each(texels, size, |distance| if distance > 0.0 { distance } else { clear });
                convolved(&filled, size, &taps_as_printed(width), clear)
            }
        });
    }
    // One light's map is the buffer as it is.
    let values = if maps.len() == 1 { maps.remove(0) } else { maps.concat() };
    Buffer::f32(&[frame.casters.len(), size, size], values)
}

/// A number for each texel, made of its distance.
fn each(texels: &[[f32; 3]], size: usize, of: impl Fn(f32) -> f32 + Sync) -> Vec<f32> {
    parallel::images([1, size * size], size, 0.0, |_, row, out| {
        for (out, [distance, ..]) in out.iter_mut().zip(&texels[row * size..]) {
            *out = of(*distance);
        }
    })
}

/// Convolves the rows, then the columns, of a square map, outside which every texel is `outside`.
///
/// One tap at a time over a whole row: a texel's sum is taken in the order of the taps, many texels at once.
fn convolved(map: &[f32], size: usize, taps: &[(isize, f32)], outside: f32) -> Vec<f32> {
    let rows = parallel::images([1, map.len()], size, 0.0, |_, row, out| {
        along(&map[row * size..][..size], taps, outside, out);
    });
    parallel::images([1, map.len()], size, 0.0, |_, row, out| across(&rows, row, taps, outside, out))
}

wide! {
    /// Convolves a row.
    fn along(row: &[f32], taps: &[(isize, f32)], outside: f32, out: &mut [f32]) {
        let size = row.len();
        for (offset, weight) in taps {
            // Where the tap falls on the map: the first texel that it serves, the first that it reads, and
            // how many.
            let count = size.saturating_sub(offset.unsigned_abs());
            let (to, first) = if *offset < 0 { (size - count, 0) } else { (0, size - count) };
            let (left, rest) = out.split_at_mut(to);
            let (served, right) = rest.split_at_mut(count);
            served.iter_mut().zip(&row[first..]).for_each(|(out, value)| *out += weight * value);
            left.iter_mut().chain(right).for_each(|out| *out += weight * outside);
        }
    }
}

wide! {
    /// Convolves the columns of a map in one row.
    fn across(map: &[f32], row: usize, taps: &[(isize, f32)], outside: f32, out: &mut [f32]) {
        let size = out.len();
        for (offset, weight) in taps {
            match row.checked_add_signed(*offset).filter(|from| *from < size) {
                Some(from) => {
                    let from = &map[from * size..][..size];
                    out.iter_mut().zip(from).for_each(|(out, value)| *out += weight * value);
                }
                None => out.iter_mut().for_each(|out| *out += weight * outside),
            }
        }
    }
}
