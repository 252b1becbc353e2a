//! *Places*, the points of a surface that paths meet, and rays that leave them on the intended side.

use super::Normals;
use crate::numeric::order::max3;
use crate::numeric::vector::unit_or_zero;
use crate::trace::{Bvh, Hit, Ray};
use crate::world::mesh::Mesh;
use glam::Vec3;

/// A bound of how far a coordinate of a hit is from its triangle's plane, as a part of the largest coordinate
/// that it is made from: the rounding to `f32` and the rounding of the normal, doubled.
const ERROR: f32 = 4.0 / 16_777_216.0;

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) point: Vec3,
    /// Unit normal of the triangle, on its counter-clockwise side; zero for a free point, which rays leave
    /// exactly.
    pub(super) face: Vec3,
    /// Unit normal that it is shaded with.
    pub(super) normal: Vec3,
    /// Which triangle; meaningless for a free point.
    pub(super) triangle: u32,
    /// How far the point may be from the plane, along the normal.
    error: f32,
}

impl Place {
    /// Where a ray hits.
    pub(super) fn new(mesh: &Mesh, bvh: &Bvh, hit: &Hit, normals: Normals) -> Self {
        let corners = bvh.corners()[hit.triangle as usize];
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let exact = a + (b - a) * u + (c - a) * v;
        let across = (b - a).cross(c - a);
        let face = (across / across.dot(across).sqrt()).as_vec3();
        let [first, second, third] = corners.map(Vec3::abs);
        let largest = max3(max3(first, second), third);
        let normal = match normals {
            Normals::Face => face,
            Normals::Interpolated => {
                let [a, b, c] =
                    mesh.triangles[hit.triangle as usize].map(|corner| mesh.normals[corner as usize]);
                let smooth = unit_or_zero(a + (b - a) * hit.u + (c - a) * hit.v);
                if smooth == Vec3::ZERO { face } else { smooth }
            }
        };
        let error = face.abs().dot(largest) * ERROR;
        Self { point: exact.as_vec3(), face, normal, triangle: hit.triangle, error }
    }

    /// A point in space with a normal, such as a vertex: its rays avoid no triangle but those that it is a
    /// corner of.
    pub(super) fn free(point: Vec3, normal: Vec3) -> Self {
        Self { point, face: Vec3::ZERO, normal, triangle: 0, error: 0.0 }
    }

    /// The same point seen from the other side.
    pub(super) fn turned(self) -> Self {
        Self { face: -self.face, normal: -self.normal, ..self }
    }

    /// A ray from the point that cannot meet its triangle: the origin is moved off the plane by as much as
    /// rounding can have moved it there, to the side that `direction` goes to, and each coordinate is rounded
    /// outward (Pharr, Jakob and Humphreys, Physically Based Rendering, §6.8).
    #[inline]
    pub(super) fn ray(&self, direction: Vec3) -> Ray {
        Ray::new(self.origin(direction), direction)
    }

    /// A ray from the point up to `target`.
    pub(super) fn ray_to(&self, target: Vec3) -> Ray {
        let origin = self.origin(target - self.point);
        Ray { origin, direction: target - origin, far: 1.0 }
    }

    fn origin(&self, direction: Vec3) -> Vec3 {
        if self.face == Vec3::ZERO {
            return self.point;
        }
        let outward = if direction.dot(self.face) < 0.0 { -self.face } else { self.face };
        let moved = self.point + outward * self.error;
        let away = |moved: f32, outward: f32| {
            if outward > 0.0 {
                moved.next_up()
            } else if outward < 0.0 {
                moved.next_down()
            } else {
                moved
            }
        };
        Vec3::new(away(moved.x, outward.x), away(moved.y, outward.y), away(moved.z, outward.z))
    }
}
