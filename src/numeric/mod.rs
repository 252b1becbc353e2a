//! The floor of determinism: everything that a golden value may use beyond `+ − × ÷ √`, comparisons,
//! conversions and integer work.
//!
//! `clippy.toml` bans the standard library's elementary functions, `mul_add`, `min`, `max` and hash
//! collections; what is allowed instead is here.

mod exp;
pub mod lanes;
pub mod order;
pub mod parallel;
pub mod random;
pub mod sum;
pub mod turns;
pub mod vector;

/// Elementary functions in `f32`: correctly rounded, so the same on every processor (pxfm, and
/// [`exp`](single::exp) our own).
pub mod single {
    pub use super::exp::exp;
    pub use pxfm::{
        f_acosf as acos, f_asinf as asin, f_atan2f as atan2, f_cosf as cos, f_logf as log, f_powf as pow,
        f_sinf as sin, f_tanf as tan,
    };
}

/// Elementary functions in `f64`: plain arithmetic without fused operations, so the same on every processor
/// (libm).
pub mod double {
    pub use libm::{acos, asin, atan, atan2, cos, exp, log, pow, sin, tan};
}
