//! `truth/` against closed forms, quadrature and the reference crate.
//!
//! Estimates are compared in standard deviations of their mean, each to within [`LEVEL`]: by chance one
//! comparison in a million would fail, and since the random numbers are fixed, what passes once passes
//! always.
#![allow(clippy::disallowed_methods, reason = "an oracle may use the standard library")]

mod brdf;
#[cfg(feature = "cli")]
mod command;
mod dipole;
mod medium;
mod prt;
mod sums;
mod surface;

use bitlight::numeric::random::Sample;
use bitlight::truth::Sums;
use bitlight::world::mesh::Mesh;
use glam::Vec3;

/// Standard deviations that an estimate may be off: one in a million is beyond.
const LEVEL: f64 = 4.9;

/// The estimate of one number a channel from many samples.
fn estimate(samples: u64, sample: impl Fn(&mut Sample) -> Vec3 + Sync) -> Sums {
    // Elements side by side, so that the work is shared; then one.
    let parts = 64;
    let mut sums = Sums::new(parts);
    sums.advance(samples.div_ceil(parts as u64), |_| |random: &mut Sample| sample(random), &mut |_| {});
    let mut all = Sums::new(1);
    all.samples = sums.samples * parts as u64;
    for part in &sums.values {
        (0..6).for_each(|i| all.values[0][i] += part[i]);
    }
    all
}

/// Holds an estimate against what its mean must be; `error` is what the expectation itself may be off.
#[track_caller]
fn agrees(sums: &Sums, expected: [f64; 3], error: f64, what: &str) {
    let (mean, variance) = (sums.mean(0), sums.variance(0));
    for channel in 0..3 {
        let allowed = LEVEL * variance[channel].sqrt() + error;
        let off = mean[channel] - expected[channel];
        assert!(
            off.abs() <= allowed,
            "{what}, channel {channel}: {} instead of {}, off by {off:.2e} where {allowed:.2e} is allowed",
            mean[channel],
            expected[channel]
        );
    }
}

/// A square of side 2 `half` in the plane z = `height`, seen from above.
fn square(half: f32, height: f32) -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x * half, y * half, height);
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Mesh::new(corners, None, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}
