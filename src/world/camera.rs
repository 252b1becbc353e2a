//! The camera.

use super::mesh::Bounds;
use crate::numeric::double;
use glam::Vec3;

/// A pinhole camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// In the scene's unit.
    pub position: Vec3,
    /// The point that it looks at, in the middle of the image.
    pub target: Vec3,
    /// The direction that is upward in the image.
    pub up: Vec3,
    /// The vertical field of view, in degrees.
    pub fov: f32,
}

impl Camera {
    /// Tangents of half the horizontal and the vertical angle of an image of `width` × `height` square
    /// pixels.
    pub fn tangents(&self, width: usize, height: usize) -> [f32; 2] {
        let vertical = double::tan(f64::from(self.fov) * (std::f64::consts::PI / 360.0)) as f32;
        [vertical * (width as f32 / height as f32), vertical]
    }

    /// A distance of the near plane that cuts nothing of a box ahead of the camera; a thousandth of its
    /// radius where the camera is inside or beside it.
    pub fn near(&self, bounds: &Bounds) -> f32 {
        let (center, half) = (bounds.center(), bounds.half_extents());
        let forward = (self.target - self.position).normalize();
        // How far ahead the nearest corner of the box is.
        let nearest = (center - self.position).dot(forward) - half.dot(forward.abs());
        if nearest > 0.0 { nearest * 0.99 } else { half.length() * 1e-3 }
    }
}
