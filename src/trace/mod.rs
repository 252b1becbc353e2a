//! Rays against triangles: nearest and any hit through a tree of boxes, and bundles of parallel rays
//! (contract 6).
//!
//! A hit is a function of the ray and the triangles alone: the nearest `t`, ties going to the lowest
//! triangle. No tree can change it: [`triangle`] says what a hit is, and the interval of `t` in which a ray
//! is in a box contains the intervals of everything in that box.
//!
//! A *walk* here is the traversal of a tree, or of the cells of a bundle. Its *twin* is the same function
//! with wider instructions and the same bits.

mod build;
pub mod bundle;
mod bvh;
mod cells;
mod hold;
#[cfg(target_arch = "x86_64")]
mod hold_avx2;
#[cfg(target_arch = "x86_64")]
mod hold_avx512;
mod morton;
mod node;
pub mod triangle;
mod walk;
#[cfg(target_arch = "x86_64")]
mod walk_avx2;

pub use bvh::Bvh;

use glam::Vec3;

/// A ray, or a piece of one: `origin + t · direction` for 0 < t ≤ `far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// In the scene's unit.
    pub origin: Vec3,
    /// Of any length, its largest component within 10⁻¹⁵ … 10¹⁵; `t` is in units of this length.
    pub direction: Vec3,
    /// The largest t that counts; infinite for a whole ray.
    pub far: f32,
}

impl Ray {
    /// A whole ray.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, far: f32::INFINITY }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Its index in the mesh.
    pub triangle: u32,
    /// Distance in lengths of the ray's direction, above 0.
    pub t: f32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f32,
    /// Barycentric weight of the third corner; 1 − u − v is that of the first.
    pub v: f32,
}
