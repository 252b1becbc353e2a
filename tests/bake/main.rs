//! `bake/` against closed forms, against itself by other routes, and against the reference crate.
#![allow(clippy::disallowed_methods, reason = "an oracle may use the standard library")]

mod vectors;
