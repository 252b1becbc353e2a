//! An oracle for every pass of the translucency technique: each test takes the recorded inputs of one pass
//! (or the mesh, for the passes that rasterise) and computes its output again in plain `f64`, with the
//! equations of `bitlight-reference` and rays instead of a rasterizer. It shares no code with what it tests.
//!
//! Tolerances are first-order bounds on the rounding of `f32` ([`U`] is half a unit in the last place of 1)
//! and, where pixels are filled, on the snapping of vertices to 1/256 pixel; each test says how its own comes
//! about. A worst error is reported as a share of its tolerance, with its place.

#![expect(clippy::print_stderr, reason = "each test reports the worst error that it found")]
#![expect(clippy::needless_range_loop, reason = "axes and channels are numbers in the equations")]

mod accumulated;
mod coverage;
mod fitted;
mod medium;
mod oracle;
mod physics;
mod points;
mod rasterised;
mod readings;
mod shaded;
mod world;

/// Half a unit in the last place of 1 in `f32`: the largest relative error of one operation.
const U: f64 = 1.0 / 16_777_216.0;

/// The larger of two, neither a NaN.
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The smaller of two, neither a NaN.
fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Collects comparisons, keeps the worst, and fails where it is beyond its tolerance.
struct Worst {
    what: String,
    count: usize,
    share: f64,
    place: String,
}

impl Worst {
    fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), count: 0, share: -1.0, place: String::new() }
    }

    fn check(&mut self, found: f32, expected: f64, tolerance: f64, place: impl std::fmt::Debug) {
        let found = f64::from(found);
        let error = (found - expected).abs();
        let share = if error == 0.0 { 0.0 } else { error / tolerance };
        self.count += 1;
        // A NaN counts as the worst of all.
        if share.is_nan() || share > self.share {
            self.share = if share.is_nan() { f64::INFINITY } else { share };
            self.place = format!("{found:e} for {expected:e} ± {tolerance:.1e} at {place:?}");
        }
    }

    fn done(self, at_least: usize) {
        eprintln!(
            "{}: {} values, worst {:.2} of its tolerance: {}",
            self.what, self.count, self.share, self.place
        );
        assert!(self.count >= at_least, "{}: {} values are too few to mean anything", self.what, self.count);
        assert!(self.share <= 1.0, "{}: {} of its tolerance: {}", self.what, self.share, self.place);
    }
}
