//! `translucency.blur`: the first distance smoothed by a separable Gaussian (§3).
//!
//! Decides errata T6: eight taps have no middle, and shift the map by half a texel; a width of n has 2⌊n/2⌋ + 1
//! taps here, centred, with a standard deviation of n/4. And T12: the clear value must not be mixed in at
//! silhouettes, so texels without a surface have no weight: both directions carry the weighted sum and the sum of
//! weights, and divide once at the end. A texel without a surface but with one in reach thereby gets a value, which
//! the lookups of `thickness` at a silhouette need; one without any stays 0.

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
    let (size, taps) = (frame.settings.shadow, taps(frame.settings.blur));
    let mut values = Vec::with_capacity(frame.casters.len() * size * size);
    for number in 0..frame.casters.len() {
        let shadow = shadows.slice(number);
        let mut sums: Vec<f32> = shadow.iter().step_by(2).copied().collect();
        let mut weights: Vec<f32> =
            sums.iter().map(|distance| f32::from(u8::from(*distance > 0.0))).collect();
        for map in [&mut sums, &mut weights] {
            *map = down(&across(map, size, &taps), size, &taps);
        }
        let share = |(sum, weight): (&f32, &f32)| if *weight > 0.0 { sum / weight } else { 0.0 };
        values.extend(sums.iter().zip(&weights).map(share));
    }
    Buffer::f32(&[frame.casters.len(), size, size], values)
}

/// Where a tap `offset` texels away falls on a map of `size`, outside which nothing has weight: the first texel that
/// it reaches, the texel it then reads, and for how many texels.
fn reach(offset: isize, size: usize) -> (usize, usize, usize) {
    let count = size.saturating_sub(offset.unsigned_abs());
    if offset < 0 { (size - count, 0, count) } else { (0, size - count, count) }
}

/// The taps from the far left (or top) to the far right: a texel's sum is taken in this order.
fn ordered(taps: &[f32]) -> impl Iterator<Item = (isize, f32)> {
    let reach = taps.len() as isize - 1;
    (-reach..=reach).map(|offset| (offset, taps[offset.unsigned_abs()]))
}

/// Convolves each row. One tap at a time over the whole row: the same order of additions for each texel, and many
/// texels at once.
fn across(map: &[f32], size: usize, taps: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; map.len()];
    parallel::for_each_chunk(&mut out, size, |row, out| {
        let from = &map[row * size..][..size];
        for (offset, weight) in ordered(taps) {
            let (to, first, count) = reach(offset, size);
            add(&mut out[to..to + count], &from[first..first + count], weight);
        }
    });
    out
}

/// Convolves each column, a row at a time.
fn down(map: &[f32], size: usize, taps: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; map.len()];
    parallel::for_each_chunk(&mut out, size, |row, out| {
        for (offset, weight) in ordered(taps) {
            if let Some(from) = row.checked_add_signed(offset).filter(|from| *from < size) {
                add(out, &map[from * size..][..size], weight);
            }
        }
    });
    out
}

fn add(out: &mut [f32], from: &[f32], weight: f32) {
    out.iter_mut().zip(from).for_each(|(out, value)| *out += weight * value);
}
