//! The watertight test of a ray against a triangle (Woop, Benthin and Wald 2013): no ray slips through
//! between two triangles that share an edge.
//!
//! The space is sheared along the ray so that the ray becomes the z axis; the three edge functions U, V and W
//! of the sheared triangle then say by their signs whether the axis passes through it. An edge's function has
//! the same magnitude in both triangles that share it, to the bit, so a ray cannot pass between the two, and
//! one that meets the edge meets both. Woop et al. compute in `f32` and repeat in `f64` where a function
//! is 0. Here all is `f64`, from the shear on, and points are sheared before they are moved to the origin. So
//! all rays of one direction share the sheared corners ([`super::bundle`]), meshes of any scale that `f32`
//! can hold neither underflow nor overflow, and a ray that starts in a corner of a triangle has exactly t = 0
//! there and does not meet it.
//!
//! Where a ray runs in a triangle's plane, the edge functions can be nothing but rounding. So a hit must also
//! lie in the triangle's box: the test of `interval` is part of what a hit is, and `t` is clamped to that
//! interval. Rounding is monotone, so the interval of a box contains those of the boxes in it. Hence a walk
//! through any tree of boxes gives the bits of a loop over all triangles.

use super::{Hit, Ray};
use crate::numeric::order::{clamp, max, max3, min, min3};
use glam::Vec3;

/// How far an interval is widened, relative to its ends: by over six roundings of `f32`, more than its
/// products and differences have.
pub(super) const PADDING: f32 = 5e-7;

/// The shear that makes the z axis of a direction (Woop et al. 2013, §3).
#[derive(Debug, Clone, Copy)]
pub struct Shear {
    /// Which of the world's axes become x, y and z.
    pub(super) axes: [usize; 3],
    /// What x and y lose for each unit of z, and the scale of z.
    pub(super) by: [f64; 3],
}

impl Shear {
    /// The shear of `direction`; its largest component becomes z, the first of equal ones.
    #[inline(always)]
    pub fn new(direction: Vec3) -> Self {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        // Tables, since no processor predicts a branch on a direction's largest component.
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let [x, y, z] = picked(direction, axes);
        Self { axes, by: [x / z, y / z, 1.0 / z] }
    }

    /// How far the sheared points of a box of half extents `half` reach from its middle, for each axis.
    pub(super) fn reach(&self, half: Vec3) -> [f64; 3] {
        let [x, y, z] = self.axes.map(|axis| f64::from(half[axis]));
        [x + self.by[0].abs() * z, y + self.by[1].abs() * z, z * self.by[2].abs()]
    }

    /// A sheared point: where it lies across the direction, and how far along it.
    #[inline(always)]
    pub fn apply(&self, point: Vec3) -> [f64; 3] {
        let [x, y, z] = picked(point, self.axes);
        [x - self.by[0] * z, y - self.by[1] * z, z * self.by[2]]
    }
}

/// The components of a vector by these axes.
#[inline(always)]
fn picked(vector: Vec3, axes: [usize; 3]) -> [f64; 3] {
    // (Here and below no `array::map`, which may stay a call.)
    let vector = vector.to_array();
    [f64::from(vector[axes[0]]), f64::from(vector[axes[1]]), f64::from(vector[axes[2]])]
}

/// Where the z axis through `origin` meets the triangle of sheared `corners`: t, and the weights of the
/// second and the third corner. None where it misses, where the triangle is seen edge-on, and where t is not
/// above 0.
#[inline(always)]
pub fn meets(corners: &[[f64; 3]; 3], origin: [f64; 3]) -> Option<[f64; 3]> {
    let moved = |corner: &[f64; 3]| [corner[0] - origin[0], corner[1] - origin[1], corner[2] - origin[2]];
    let (a, b, c) = (moved(&corners[0]), moved(&corners[1]), moved(&corners[2]));
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let sum = u + v + w;
    let t = (u * a[2] + v * b[2] + w * c[2]) / sum;
    // Where the sum is 0, t is not a number, and so not above 0.
    if t > 0.0 { Some([t, v / sum, w / sum]) } else { None }
}

/// What the tests of boxes need of a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slabs {
    pub(super) origin: [f32; 3],
    /// 1 / direction: infinite where a component is 0.
    pub(super) inverse: [f32; 3],
    /// Which side of a box comes first, for each axis: 0 its low or 1 its high one.
    pub(super) first: [usize; 3],
}

impl Slabs {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let inverse = ray.direction.to_array().map(|component| 1.0 / component);
        let first = inverse.map(|inverse| usize::from(inverse < 0.0));
        Self { origin: ray.origin.to_array(), inverse, first }
    }

    /// The interval of t in which a ray is in a box, widened for rounding; `first` and `second` are the
    /// planes of each axis in the order in which it meets them. Empty where the first end exceeds the second.
    ///
    /// A ray that runs in a plane of the box gives 0 · ∞, which is not a number and which the comparisons
    /// ignore.
    #[inline(always)]
    pub(super) fn interval(&self, first: [f32; 3], second: [f32; 3]) -> [f32; 2] {
        let mut near = 0.0;
        let mut far = f32::INFINITY;
        for axis in 0..3 {
            near = max(near, (first[axis] - self.origin[axis]) * self.inverse[axis]);
            far = min(far, (second[axis] - self.origin[axis]) * self.inverse[axis]);
        }
        [near * (1.0 - PADDING), far * (1.0 + PADDING)]
    }
}

/// The low and the high end of a triangle's box.
#[inline(always)]
pub(super) fn ends([a, b, c]: &[Vec3; 3]) -> (Vec3, Vec3) {
    (min3(min3(*a, *b), *c), max3(max3(*a, *b), *c))
}

/// The interval of t in which the ray is in the triangle's box, widened by [`PADDING`]; empty where its first
/// end exceeds the second.
#[inline(always)]
pub(super) fn interval(slabs: &Slabs, corners: &[Vec3; 3]) -> [f32; 2] {
    let (low, high) = ends(corners);
    let ends = [low.to_array(), high.to_array()];
    let pick = |flip: usize| std::array::from_fn(|axis| ends[slabs.first[axis] ^ flip][axis]);
    slabs.interval(pick(0), pick(1))
}

/// Where a ray meets a triangle, at most at t = `most`; `near` and `far` are the ends of its [`interval`].
#[inline(always)]
pub(super) fn within(
    shear: &Shear,
    origin: [f64; 3],
    corners: &[Vec3; 3],
    triangle: u32,
    [near, far]: [f32; 2],
    most: f32,
) -> Option<Hit> {
    let sheared = [shear.apply(corners[0]), shear.apply(corners[1]), shear.apply(corners[2])];
    let [t, u, v] = meets(&sheared, origin)?;
    let t = clamp(t as f32, near, far);
    (t > 0.0 && t <= most).then_some(Hit { triangle, t, u: u as f32, v: v as f32 })
}

/// Where a ray meets one triangle. Every walk through many gives what this test gives.
pub fn hit(ray: &Ray, corners: &[Vec3; 3], triangle: u32) -> Option<Hit> {
    along(&Shear::new(ray.direction), &Slabs::new(ray), ray, corners, triangle)
}

/// [`hit`] for a ray whose shear and slabs are known.
#[inline(always)]
pub(super) fn along(
    shear: &Shear,
    slabs: &Slabs,
    ray: &Ray,
    corners: &[Vec3; 3],
    triangle: u32,
) -> Option<Hit> {
    let interval = interval(slabs, corners);
    if interval[0] > interval[1] {
        return None;
    }
    within(shear, shear.apply(ray.origin), corners, triangle, interval, ray.far)
}
