//! Views: from the world to clip space and to pixels.

use super::GUARD;
use crate::numeric::order::{clamp, max};
use crate::world::camera::Camera;
use crate::world::mesh::Bounds;
use glam::{DVec3, Vec3};

/// A view of the world: a projection and an image size.
///
/// Depth is reversed: 1 at the near plane, falling to 0 at infinity (perspective) or at the far plane
/// (orthographic), so that `f32` resolves distant surfaces as well as near ones.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// Rows of the matrix that takes the world to clip space (x, y, z, w), right-handed, y up.
    pub clip_from_world: [[f32; 4]; 4],
    /// Distances of the near and far plane; no far plane for a perspective view.
    range: Range,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Range {
    Perspective { near: f32 },
    Orthographic { near: f32, far: f32 },
}

/// Three axes of a viewer, orthonormal: right, up and forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// To the right of the image.
    pub right: Vec3,
    /// To the top of the image.
    pub up: Vec3,
    /// Into the image.
    pub forward: Vec3,
}

impl Axes {
    /// The axes of a viewer who looks along `forward` with `up` as nearly upward as it can be. Where the two
    /// are parallel, z is taken for up, and where that is parallel too, x.
    pub fn looking(forward: Vec3, up: Vec3) -> Self {
        let forward = forward.normalize();
        let side = [up, Vec3::Z, Vec3::X].map(|up| forward.cross(up.normalize_or_zero()));
        let right = side.into_iter().find(|side| side.length_squared() > 1e-6).unwrap_or(Vec3::X).normalize();
        Self { right, up: right.cross(forward), forward }
    }
}

impl View {
    /// A perspective view from `eye`; `tangents` are those of half the horizontal and vertical angle.
    pub fn perspective(
        eye: Vec3,
        axes: Axes,
        tangents: [f32; 2],
        near: f32,
        [width, height]: [usize; 2],
    ) -> Self {
        let row = |axis: Vec3, scale: f32| plane(axis * scale, eye);
        let clip_from_world = [
            row(axes.right, 1.0 / tangents[0]),
            row(axes.up, 1.0 / tangents[1]),
            [0.0, 0.0, 0.0, near],
            row(axes.forward, 1.0),
        ];
        Self { width, height, clip_from_world, range: Range::Perspective { near } }
    }

    /// A camera's view of what is in a box; `size` is the image's width and height.
    pub fn of(camera: &Camera, bounds: &Bounds, size: [usize; 2]) -> Self {
        Self::perspective(
            camera.position,
            Axes::looking(camera.target - camera.position, camera.up),
            camera.tangents(size[0], size[1]),
            camera.near(bounds),
            size,
        )
    }

    /// An off-axis perspective view: the image spans `middle ± half`, as tangents to the unit axes right, up
    /// and forward. The rows take their constants from `anchor`, a point in the image. If they took them from
    /// a distant eye, the rounding of a row's direction alone would move the image by many pixels.
    pub(super) fn off_axis(
        eye: Vec3,
        [right, up, forward]: [DVec3; 3],
        middle: [f64; 2],
        half: [f32; 2],
        near: f32,
        anchor: Vec3,
        [width, height]: [usize; 2],
    ) -> Self {
        let to = anchor.as_dvec3() - eye.as_dvec3();
        let row = |axis: DVec3, side: usize| {
            let normal = (axis - forward * middle[side]) / f64::from(half[side]);
            let rounded = normal.as_vec3();
            let constant = normal.dot(to) - rounded.as_dvec3().dot(anchor.as_dvec3());
            [rounded.x, rounded.y, rounded.z, constant as f32]
        };
        let clip_from_world =
            [row(right, 0), row(up, 1), [0.0, 0.0, 0.0, near], plane(forward.as_vec3(), eye)];
        Self { width, height, clip_from_world, range: Range::Perspective { near } }
    }

    /// An orthographic view: the image spans `center ± half.x right ± half.y up`, and depth runs from `near`
    /// to `far` along forward, measured from `center`.
    pub fn orthographic(
        center: Vec3,
        axes: Axes,
        half: [f32; 2],
        [near, far]: [f32; 2],
        [width, height]: [usize; 2],
    ) -> Self {
        let mut depth = plane(axes.forward * (-1.0 / (far - near)), center);
        depth[3] += far / (far - near);
        let clip_from_world = [
            plane(axes.right * (1.0 / half[0]), center),
            plane(axes.up * (1.0 / half[1]), center),
            depth,
            [0.0, 0.0, 0.0, 1.0],
        ];
        Self { width, height, clip_from_world, range: Range::Orthographic { near, far } }
    }

    /// The clip-space coordinates of a point: each row summed from left to right.
    #[inline(always)]
    pub fn project(&self, point: Vec3) -> [f32; 4] {
        let row = |row: [f32; 4]| row[0] * point.x + row[1] * point.y + row[2] * point.z + row[3];
        let [x, y, z, w] = self.clip_from_world;
        [row(x), row(y), row(z), row(w)]
    }

    /// The point in pixels (x to the right, y down, the first pixel's centre at ½, ½) of clip coordinates.
    #[inline(always)]
    pub fn pixel(&self, clip: [f32; 4]) -> [f32; 2] {
        [
            (clip[0] / clip[3] * 0.5 + 0.5) * self.width as f32,
            (0.5 - clip[1] / clip[3] * 0.5) * self.height as f32,
        ]
    }

    /// x/w and y/w of the centre of pixel (`x`, `y`).
    #[inline(always)]
    pub fn ndc(&self, x: usize, y: usize) -> [f32; 2] {
        // By way of `i32`, since vector instructions convert from it.
        let odd = |pixel: usize| (2 * pixel as i32 + 1) as f32;
        [odd(x) / self.width as f32 - 1.0, 1.0 - odd(y) / self.height as f32]
    }

    /// Distance along the view's forward axis, in the scene's unit, of a rasterized depth in (0, 1].
    #[inline]
    pub fn linear(&self, depth: f32) -> f32 {
        match self.range {
            Range::Perspective { near } => near / depth,
            Range::Orthographic { near, far } => near + (1.0 - depth) * (far - near),
        }
    }

    /// x/w and y/w at which the guard band clips.
    pub(super) fn guard(&self) -> [f32; 2] {
        [2.0 * GUARD / self.width as f32, 2.0 * GUARD / self.height as f32]
    }

    /// Perspective-correct barycentric coordinates of a pixel's centre, as [`Self::ndc`] gives it, on a
    /// triangle, each in [0, 1], their sum 1.
    ///
    /// They are the ratios of 2D cross products in homogeneous coordinates (Olano and Greer 1997), taken
    /// relative to the pixel, so a triangle that crosses the near plane needs no clipping. The centre is
    /// inside the snapped triangle but may be outside the unsnapped one by 1/256 pixel, so coordinates are
    /// held to ≥ 0.
    #[inline(always)]
    pub fn barycentric(&self, [a, b, c]: [Vec3; 3], ndc: [f32; 2]) -> [f32; 3] {
        let relative = |corner: Vec3| {
            let clip = self.project(corner);
            [clip[0] - ndc[0] * clip[3], clip[1] - ndc[1] * clip[3]]
        };
        let (a, b, c) = (relative(a), relative(b), relative(c));
        let cross = |a: [f32; 2], b: [f32; 2]| a[0] * b[1] - a[1] * b[0];
        let (a, b, c) = (cross(b, c), cross(c, a), cross(a, b));
        let clockwise = a + b + c < 0.0;
        let held = |weight: f32| max(if clockwise { -weight } else { weight }, 0.0);
        let weights = [held(a), held(b), held(c)];
        let total = weights[0] + weights[1] + weights[2];
        if total > 0.0 {
            let [a, b] = [weights[0] / total, weights[1] / total];
            [a, b, clamp(1.0 - a - b, 0.0, 1.0)]
        } else {
            [1.0 / 3.0; 3] // a sliver below the resolution of f32: its middle
        }
    }
}

/// The row (n, −n·p): the signed distance from the plane through `point`, scaled by the length of `normal`.
fn plane(normal: Vec3, point: Vec3) -> [f32; 4] {
    [normal.x, normal.y, normal.z, -normal.dot(point)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let axes = Axes::looking(Vec3::new(0.0, 0.0, -1.0), Vec3::Y);
        View::perspective(Vec3::new(0.0, 0.0, 5.0), axes, [1.0, 0.5], 0.1, [200, 100])
    }

    #[test]
    fn right_is_right_and_up_is_up() {
        let view = view();
        assert_eq!(view.pixel(view.project(Vec3::ZERO)), [100.0, 50.0]);
        assert_eq!(view.pixel(view.project(Vec3::new(5.0, 2.5, 0.0))), [200.0, 0.0]);
        let depth = {
            let clip = view.project(Vec3::new(1.0, 1.0, 2.0));
            clip[2] / clip[3]
        };
        assert!((view.linear(depth) - 3.0).abs() < 1e-6);
    }

    #[test]
    fn a_viewer_who_looks_along_up_still_has_orthonormal_axes() {
        for forward in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::Z, Vec3::new(1.0, 2.0, 3.0)] {
            for up in [Vec3::Y, Vec3::Z, Vec3::ZERO] {
                let f = Axes::looking(forward, up);
                assert!((f.right.cross(f.up) + f.forward).length() < 1e-6, "{f:?}");
                assert!((f.right.length() - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn barycentric_coordinates_are_perspective_correct() {
        let view = view();
        let corners = [Vec3::new(-3.0, -1.0, 2.0), Vec3::new(3.0, -1.0, -4.0), Vec3::new(0.0, 2.0, -1.0)];
        for weights in [[0.2, 0.3, 0.5], [0.6, 0.3, 0.1]] {
            let point = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
            let pixel = view.pixel(view.project(point));
            let (x, y) = (pixel[0] as usize, pixel[1] as usize);
            let found = view.barycentric(corners, view.ndc(x, y));
            let again = corners[0] * found[0] + corners[1] * found[1] + corners[2] * found[2];
            let again = view.pixel(view.project(again));
            assert!((again[0] - x as f32 - 0.5).abs() < 1e-3 && (again[1] - y as f32 - 0.5).abs() < 1e-3);
        }
    }
}
