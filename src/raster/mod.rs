//! The deterministic rasterizer: vertices snapped to 1/256 pixel, exact integer edge functions, the top-left
//! rule, depth from one plane a triangle (contract 7).
//!
//! [`View`] projects, [`visibility`] finds the triangle of each pixel, [`View::barycentric`] finds where on
//! it the pixel's centre lies, from the unclipped triangle.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod batch;
mod buffer;
mod clip;
mod fill;
mod rectangle;
mod screen;
mod setup;
mod shadow;
mod surface;
mod tile;
mod view;

pub use buffer::{VisibilityBuffer, two_depths, visibility};
pub use shadow::ShadowView;
pub use surface::{SurfacePoints, surfaces};
pub use tile::NONE;
pub use view::{Axes, View};

/// The largest width and height of an image, in pixels: snapped coordinates stay below 2²³, which is exact in
/// `f32`.
pub const MAX_SIZE: usize = 16_384;

/// How far from the image's centre a vertex may lie before the guard band clips its triangle, in pixels.
const GUARD: f32 = 16_384.0;

/// Steps of the snapping grid in a pixel.
const SUBPIXELS: i32 = 256;
