//! What a frame is made of, whatever technique renders it.

use super::brdf::Brdf;
use super::camera::Camera;
use super::light::Light;
use super::medium::Medium;
use super::mesh::Mesh;
use glam::Vec3;
use std::sync::Arc;

/// A solid in its pose, what lights it, and who looks. Solid and environments are shared, so a copy costs
/// little.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// The solid, in the scene's unit.
    pub solid: Arc<Mesh>,
    /// What is below its surface.
    pub medium: Medium,
    /// How its surface reflects, for techniques of opaque solids.
    pub surface: Brdf,
    /// Exponent of the highlight on a medium; 0 for none.
    pub gloss: f32,
    /// In the scene's order.
    pub lights: Vec<Light>,
    /// Who looks.
    pub camera: Camera,
    /// Width and height of the image, in pixels.
    pub size: [usize; 2],
    /// Radiance of pixels that see no surface, RGB.
    pub background: Vec3,
}
