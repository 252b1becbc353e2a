//! bitlight: the bit-reproducible CPU ground truth of published techniques that light translucent solids, fur
//! and animated characters with spherical harmonics.
//!
//! [`run::render`] renders a [`scene::Scene`] pass by pass into a [`pass::Recorder`]. What each pass computes
//! is in [`techniques`]. Every bit is the same on every machine; ARCHITECTURE.md says why, and how that is
//! proved.
//!
//! A frame, from a scene's text to the digest of each pass that ran:
//!
//! ```
//! use bitlight::pass::Digests;
//! use bitlight::run;
//! use bitlight::scene::{Assets, Scene};
//!
//! let text = r#"
//! technique = "translucency"
//! image = { width = 32, height = 32 }
//! camera = { position = [0, 0, 4] }
//! solid = { shape = "torus-knot", resolution = 8 }
//! light = [{ kind = "point", position = [0, 3, -3], intensity = [9, 9, 9] }]
//! "#;
//! let scene = Scene::parse(text, "knot.toml".as_ref(), &[])?;
//! let mut digests = Digests::default();
//! run::render(&scene, &Assets::None, &scene.technique.wanted("final")?, &mut digests)?;
//! for pass in &digests.0 {
//!     println!("{} {:?} {}", pass.name, pass.shape, pass.digest);
//! }
//! assert_eq!(digests.0.last().unwrap().shape, [32, 32, 3]);
//! # Ok::<(), bitlight::Error>(())
//! ```
//!
//! Spherical harmonics alone: the nine coefficients of a sky that is white above and black below. The floor
//! under it receives an irradiance of π exactly, and of 3.14 by nine coefficients.
//!
//! ```
//! use bitlight::sphere::environment::LatLong;
//! use bitlight::sphere::irradiance;
//! use glam::Vec3;
//!
//! let (width, height) = (64, 32);
//! let white = |texel| texel < width * height / 2;
//! let sky = (0..width * height).map(|texel| if white(texel) { Vec3::ONE } else { Vec3::ZERO });
//! let coefficients = LatLong::new(width, height, sky.collect())?.project(3);
//! let matrices = irradiance::matrix(&coefficients.try_into().unwrap());
//! let floor = irradiance::evaluate(&matrices[0], Vec3::Y);
//! assert!((floor - std::f32::consts::PI).abs() < 0.01, "{floor}");
//! # Ok::<(), bitlight::Error>(())
//! ```

pub mod bake;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
mod error;
pub mod keys;
pub mod numeric;
pub mod pass;
pub mod raster;
pub mod run;
pub mod scene;
pub mod sphere;
pub mod store;
pub mod techniques;
pub mod trace;
pub mod truth;
pub mod world;

pub use error::Error;
pub(crate) use error::{nearest, unknown};

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
