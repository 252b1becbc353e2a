//! The external cubemap and the box of Banterle and Chalmers, sections 2.1 and 3.
//!
//! The paper does not say what the six views are. Here each face is an orthographic view from
//! outside towards the centre, the bounding box being mapped to the cube [−1, 1]³ axis by axis;
//! texel (column i, row j) of an n × n face stands for the point of the cube's surface that it
//! lies on, and for the direction from the centre to that point.

use crate::vector::{Vec3, add, normalize, scale, sub};

/// A face of the external cubemap, named after the axis on which its camera stands; in the order
/// in which faces are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// +x: right in the image is −z, up is +y.
    PosX,
    /// −x: right is +z, up is +y.
    NegX,
    /// +y: right is +x, up is −z.
    PosY,
    /// −y: right is +x, up is +z.
    NegY,
    /// +z: right is +x, up is +y.
    PosZ,
    /// −z: right is −x, up is +y.
    NegZ,
}

/// The six faces in the order in which they are stored: +x, −x, +y, −y, +z, −z.
pub const FACES: [Face; 6] = [Face::PosX, Face::NegX, Face::PosY, Face::NegY, Face::PosZ, Face::NegZ];

/// The point of the cube [−1, 1]³ at (s, t) of a face: s rightwards and t upwards in the image,
/// both in [−1, 1].
pub fn face_point(face: Face, s: f64, t: f64) -> Vec3 {
    match face {
        Face::PosX => [1.0, t, -s],
        Face::NegX => [-1.0, t, s],
        Face::PosY => [s, 1.0, -t],
        Face::NegY => [s, -1.0, t],
        Face::PosZ => [s, t, 1.0],
        Face::NegZ => [-s, t, -1.0],
    }
}

/// The point of the cube [−1, 1]³ at the centre of texel (column i, row j) of an n × n face:
/// s = (2i + 1)/n − 1, t = 1 − (2j + 1)/n, row 0 at the top.
pub fn texel_point(face: Face, n: u32, i: u32, j: u32) -> Vec3 {
    let s = f64::from(2 * i + 1) / f64::from(n) - 1.0;
    let t = 1.0 - f64::from(2 * j + 1) / f64::from(n);
    face_point(face, s, t)
}

/// The unit vector from the cube's centre to the centre of texel (column i, row j).
pub fn texel_direction(face: Face, n: u32, i: u32, j: u32) -> Vec3 {
    normalize(texel_point(face, n, i, j))
}

/// The solid angle, in steradians, of the rectangle [u0, u1] × [v0, v1] on the plane at distance 1.
pub fn rectangle_solid_angle(u0: f64, u1: f64, v0: f64, v1: f64) -> f64 {
    // The rectangle between the plane's foot point and (u, v) has atan(uv / √(u² + v² + 1)).
    let corner = |u: f64, v: f64| libm::atan2(u * v, (u * u + v * v + 1.0).sqrt());
    corner(u1, v1) - corner(u0, v1) - corner(u1, v0) + corner(u0, v0)
}

/// The solid angle, in steradians, of texel (column i, row j) of an n × n face seen from the
/// centre; the same on all faces.
pub fn texel_solid_angle(n: u32, i: u32, j: u32) -> f64 {
    let edge = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
    rectangle_solid_angle(edge(i), edge(i + 1), edge(j), edge(j + 1))
}

/// An axis-aligned box with positive extents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the least coordinates.
    pub min: Vec3,
    /// The corner with the greatest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The centre, where the paper's one accumulation point lies.
    pub fn centre(&self) -> Vec3 {
        scale(0.5, add(self.min, self.max))
    }

    /// Half the extent along each axis.
    pub fn half_extents(&self) -> Vec3 {
        scale(0.5, sub(self.max, self.min))
    }

    /// A point in the coordinates of the cube [−1, 1]³ that the box is mapped to.
    pub fn to_cube(&self, point: Vec3) -> Vec3 {
        let from_centre = sub(point, self.centre());
        let half = self.half_extents();
        [from_centre[0] / half[0], from_centre[1] / half[1], from_centre[2] / half[2]]
    }

    /// Where a ray from a point in the box leaves it; `direction` must not be zero. From a point
    /// that rounding put just outside, the ray does not go backwards.
    pub fn exit(&self, origin: Vec3, direction: Vec3) -> Vec3 {
        let mut nearest = f64::INFINITY;
        for axis in 0..3 {
            let wall = if direction[axis] > 0.0 { self.max[axis] } else { self.min[axis] };
            let t = (wall - origin[axis]) / direction[axis];
            if direction[axis] != 0.0 && t < nearest {
                nearest = t;
            }
        }
        let t = if nearest > 0.0 { nearest } else { 0.0 };
        add(origin, scale(t, direction))
    }

    /// The unit vector with which the spherical harmonics are looked up, the cure of the "shift
    /// problem" in section 3: from the centre to the point where the refracted ray leaves the box,
    /// in the coordinates of the cube, in which the cubemap was projected.
    pub fn lookup_direction(&self, origin: Vec3, direction: Vec3) -> Vec3 {
        normalize(self.to_cube(self.exit(origin, direction)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{cross, dot, length};
    use std::f64::consts::PI;

    #[test]
    fn solid_angles_sum_to_the_sphere() {
        for n in [1, 2, 3, 64] {
            let mut sum = 0.0;
            for j in 0..n {
                for i in 0..n {
                    sum += texel_solid_angle(n, i, j);
                }
            }
            assert!((6.0 * sum - 4.0 * PI).abs() < 1e-11, "{n}: {sum}");
        }
        assert!((texel_solid_angle(1, 0, 0) - 2.0 * PI / 3.0).abs() < 1e-15);
    }

    /// A small texel's solid angle is its area times the cosine over the squared distance.
    #[test]
    fn solid_angle_of_a_small_texel() {
        let n = 256;
        for (i, j) in [(0, 0), (128, 128), (200, 17)] {
            let p = texel_point(Face::PosZ, n, i, j);
            let r2 = dot(p, p);
            let estimate = 4.0 / f64::from(n * n) / (r2 * r2.sqrt());
            assert!((texel_solid_angle(n, i, j) / estimate - 1.0).abs() < 1e-4);
        }
    }

    /// Seen from outside: image-right × image-up points at the camera, outwards along the face.
    #[test]
    fn faces_are_views_from_outside() {
        for face in FACES {
            let centre = face_point(face, 0.0, 0.0);
            let right = sub(face_point(face, 1.0, 0.0), centre);
            let up = sub(face_point(face, 0.0, 1.0), centre);
            assert_eq!(cross(right, up), centre, "{face:?}");
        }
        assert_eq!(texel_point(Face::PosX, 2, 0, 0), [1.0, 0.5, 0.5]);
        assert_eq!(texel_point(Face::PosY, 2, 1, 0), [0.5, 1.0, -0.5]);
        assert!((length(texel_direction(Face::NegZ, 7, 3, 5)) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn rays_leave_through_the_nearest_wall() {
        let bounds = Aabb { min: [-1.0, 0.0, -3.0], max: [3.0, 2.0, 3.0] };
        assert_eq!(bounds.exit([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]), [0.0, 1.0, 3.0]);
        assert_eq!(bounds.exit([0.0, 1.0, 0.0], [1.0, -1.0, 0.0]), [1.0, 0.0, 0.0]);
        assert_eq!(bounds.exit([0.0, 2.0, 0.0], [0.5, 1.0, 0.0]), [0.0, 2.0, 0.0], "starts at the wall");
        // from the centre of the top to the bottom's edge at x = max
        let d = bounds.lookup_direction([1.0, 2.0, 0.0], [1.0, -1.0, 0.0]);
        let expected = normalize([1.0, -1.0, 0.0]);
        assert!(length(sub(d, expected)) < 1e-15);
    }

    /// From the centre of a cube the lookup is the ray's own direction.
    #[test]
    fn lookup_from_the_centre_of_a_cube_is_the_ray() {
        let bounds = Aabb { min: [4.0; 3], max: [10.0; 3] };
        let ray = normalize([0.3, -0.5, 0.2]);
        assert!(length(sub(bounds.lookup_direction([7.0; 3], ray), ray)) < 1e-15);
    }
}
