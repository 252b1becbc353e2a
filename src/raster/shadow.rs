//! Views from lights: a shadow map that just holds a box, or what is in it.

use super::rectangle::tightest;
use super::{Axes, View};
use crate::Error;
use crate::numeric::order::{max, min};
use crate::numeric::vector::length;
use glam::Vec3;

/// The largest tangent of half the angle of a point light's shadow map: beyond it (80°) the texels at its rim
/// see the solid at more than 30 times the slant of those at its centre.
const WIDEST: f32 = 5.671_282;

/// The farthest point light, in radii of the box: beyond it the rounding of a distance in `f32` is over a
/// hundredth of the radius, and no thickness can be measured.
const FARTHEST: f32 = 1e5;

/// A light's view of a box, and its measure of distance: radial from a point, along the direction from a
/// plane otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowView {
    /// The view that rasterizes the map.
    pub view: View,
    /// The point light's position.
    pub(crate) eye: Option<Vec3>,
    /// The plane from which distance along a direction is measured: n·p + d.
    pub(crate) plane: [f32; 4],
    /// The light's position, or the middle of that plane.
    origin: Vec3,
    /// Right, up and ahead of a map that just holds the box.
    axes: Axes,
    /// How far the middle of the map is from where the axis ahead of the origin meets it, measured as `half`
    /// is, along the map's own sides.
    pub(crate) middle: [f32; 2],
    /// Half the extent of the map at distance 1 (point) or at any distance (direction).
    pub(crate) half: [f32; 2],
}

impl ShadowView {
    /// The view of a point light at `eye` on the box `center ± half_extents`, `size` × `size` texels.
    ///
    /// # Errors
    /// Where the light is inside the box, so near that it sees it under more than 160°, or farther away than
    /// 100,000 times the box's radius.
    pub fn point(eye: Vec3, center: Vec3, half_extents: Vec3, size: usize) -> Result<Self, Error> {
        let refused = || {
            Error::new("the light is inside the solid's bounding box, or too near to it for a shadow map")
                .remedy("move the light away from the solid")
        };
        let distance = (center - eye).length();
        if distance == 0.0 {
            return Err(refused());
        }
        if distance > FARTHEST * half_extents.length() {
            return Err(Error::new(format!(
                "the light is {distance} away, over 100,000 times the solid's radius"
            ))
            .remedy("write kind = \"directional\" with the irradiance that arrives, intensity / distance²"));
        }
        let axes = Axes::looking(center - eye, Vec3::Y);
        let (mut near, mut half) = (f32::MAX, [0.0_f32; 2]);
        for corner in corners(center, half_extents) {
            let to = corner - eye;
            let ahead = to.dot(axes.forward);
            if ahead <= 0.0 {
                return Err(refused());
            }
            near = min(near, ahead);
            half[0] = max(half[0], to.dot(axes.right).abs() / ahead);
            half[1] = max(half[1], to.dot(axes.up).abs() / ahead);
        }
        if half[0] > WIDEST || half[1] > WIDEST {
            return Err(refused());
        }
        let half = half.map(|half| margin(half, size));
        // The plane stands just before the nearest corner, so that rounding cannot clip the solid.
        let view = View::perspective(eye, axes, half, near * 0.99, [size, size]);
        let plane = view.clip_from_world[3];
        Ok(Self { view, eye: Some(eye), plane, origin: eye, axes, middle: [0.0; 2], half })
    }

    /// The view of a directional light on the box `center ± half_extents`, `size` × `size` texels;
    /// `direction` is that in which the light travels. Distance is measured from the plane two radii of the
    /// box before its centre, so it is positive on the box.
    pub fn directional(direction: Vec3, center: Vec3, half_extents: Vec3, size: usize) -> Self {
        let axes = Axes::looking(direction, Vec3::Y);
        let radius = half_extents.length();
        let mut half = [0.0_f32; 2];
        for corner in corners(Vec3::ZERO, half_extents) {
            half[0] = max(half[0], corner.dot(axes.right).abs());
            half[1] = max(half[1], corner.dot(axes.up).abs());
        }
        let half = half.map(|half| margin(half, size));
        let origin = center - axes.forward * (2.0 * radius);
        let view = View::orthographic(origin, axes, half, [0.5 * radius, 3.5 * radius], [size, size]);
        let plane = [axes.forward.x, axes.forward.y, axes.forward.z, -axes.forward.dot(origin)];
        Self { view, eye: None, plane, origin, axes, middle: [0.0; 2], half }
    }

    /// The same view on `points` of the box alone: its map has the tightest rectangle around their
    /// projection, turned about the view's axis by at most 45° and moved off it. Distances are measured as
    /// before.
    ///
    /// Of all rectangles the one of least area is taken, which wastes the fewest texels; it can be longer
    /// than the box's map is wide, and its texels are then longer than wide.
    #[must_use]
    pub fn fitted(&self, points: impl Iterator<Item = Vec3>) -> Self {
        let [right, up, forward] =
            [self.axes.right, self.axes.up, self.axes.forward].map(|axis| axis.as_dvec3());
        let (mut near, mut anchor, mut projected) = (f64::MAX, self.origin, Vec::new());
        for point in points {
            let to = point.as_dvec3() - self.origin.as_dvec3();
            let ahead = to.dot(forward);
            (near, anchor) = (min(near, ahead), point);
            let by = if self.eye.is_some() { ahead } else { 1.0 };
            projected.push([to.dot(right) / by, to.dot(up) / by]);
        }
        let Some(rectangle) = tightest(projected) else { return self.clone() };
        let ([cosine, sine], [x, y]) = (rectangle.direction, rectangle.middle);
        let turned = [right * cosine + up * sine, up * cosine - right * sine];
        // A solid seen from its edge has a map too.
        let least = 1e-4 * max(self.half[0], self.half[1]);
        let (size, half) = (self.view.width, rectangle.half.map(|half| max(half as f32, least)));
        let half = half.map(|half| margin(half, size));
        let view = match self.eye {
            Some(eye) => {
                let axes = [turned[0], turned[1], forward];
                View::off_axis(eye, axes, rectangle.middle, half, near as f32 * 0.99, anchor, [size, size])
            }
            None => {
                let middle = self.origin + (turned[0] * x + turned[1] * y).as_vec3();
                let axes = Axes { right: turned[0].as_vec3(), up: turned[1].as_vec3(), ..self.axes };
                let range = [self.view.linear(1.0), self.view.linear(0.0)];
                View::orthographic(middle, axes, half, range, [size, size])
            }
        };
        Self { view, middle: [x as f32, y as f32], half, ..self.clone() }
    }

    /// The distance of `point` from the light, in the scene's unit.
    #[inline(always)]
    pub fn distance(&self, point: Vec3) -> f32 {
        let (radial, ahead) = (length(point - self.origin), self.ahead(point));
        if self.eye.is_some() { radial } else { ahead }
    }

    /// The distance from the light of what texel (`x`, `y`) sees at a rasterized `depth` in (0, 1].
    #[inline(always)]
    pub fn texel_distance(&self, x: usize, y: usize, depth: f32) -> f32 {
        let linear = self.view.linear(depth);
        let [u, v] = self.view.ndc(x, y);
        let [x, y] = [u * self.half[0] + self.middle[0], v * self.half[1] + self.middle[1]];
        let radial = linear * length(Vec3::new(x, y, 1.0));
        if self.eye.is_some() { radial } else { linear }
    }

    /// Where `point` falls on the map, in texels: (0, 0) is the upper left corner, (½, ½) the first centre.
    #[inline(always)]
    pub fn texel(&self, point: Vec3) -> [f32; 2] {
        self.view.pixel(self.view.project(point))
    }

    /// The larger side of a texel at `point`, in the scene's unit.
    #[inline(always)]
    pub fn texel_size(&self, point: Vec3) -> f32 {
        let half = 2.0 * max(self.half[0], self.half[1]) / self.view.width as f32;
        let ahead = half * self.ahead(point);
        if self.eye.is_some() { ahead } else { half }
    }

    #[inline(always)]
    fn ahead(&self, point: Vec3) -> f32 {
        self.plane[0] * point.x + self.plane[1] * point.y + self.plane[2] * point.z + self.plane[3]
    }
}

/// Room for one texel around the box, so that its silhouette has texels on both sides.
fn margin(half: f32, size: usize) -> f32 {
    half * (1.0 + 2.0 / size as f32)
}

fn corners(center: Vec3, half: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let side = |bit: usize, half: f32| if i & bit == 0 { -half } else { half };
        center + Vec3::new(side(1, half.x), side(2, half.y), side(4, half.z))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corner_falls_on_the_map_at_its_distance() {
        let (center, half) = (Vec3::new(1.0, 2.0, -1.0), Vec3::new(1.0, 0.5, 2.0));
        let point = ShadowView::point(Vec3::new(5.0, 6.0, 3.0), center, half, 64).unwrap();
        let beam = ShadowView::directional(Vec3::new(0.3, -1.0, 0.2), center, half, 64);
        for shadow in [point, beam] {
            for corner in corners(center, half) {
                let [x, y] = shadow.texel(corner);
                assert!((0.0..64.0).contains(&x) && (0.0..64.0).contains(&y), "({x}, {y})");
                let clip = shadow.view.project(corner);
                assert!(clip[2] <= clip[3] && clip[2] >= 0.0);
                // At the texel's centre instead of the corner's own place: within a texel.
                let found = shadow.texel_distance(x as usize, y as usize, clip[2] / clip[3]);
                let distance = shadow.distance(corner);
                assert!((found - distance).abs() < shadow.texel_size(corner), "{found} {distance}");
            }
        }
    }

    #[test]
    fn a_fitted_map_just_holds_the_points_at_their_distances() {
        let (center, half) = (Vec3::new(40.0, 2.0, -1.0), Vec3::new(1.0, 0.5, 2.0));
        // A rod from corner to corner of the box, with a bulge.
        let points: Vec<Vec3> = (0..60)
            .map(|i| {
                let along = i as f32 / 59.0 * 2.0 - 1.0;
                let off = if i % 2 == 0 { 0.1 } else { -0.1 } * (1.0 - along.abs());
                center + half * along + Vec3::new(off, off, -off) * half
            })
            .collect();
        let direction = Vec3::new(0.7, -1.0, 0.2).normalize();
        let mut views = vec![ShadowView::directional(direction, center, half, 64)];
        for away in [4.0, 30.0, 1e3, 1e5] {
            views.push(ShadowView::point(center - direction * away, center, half, 64).unwrap());
        }
        for boxed in views {
            let fitted = boxed.fitted(points.iter().copied());
            let (mut low, mut high) = ([f32::MAX; 2], [-f32::MAX; 2]);
            for point in &points {
                let at = fitted.texel(*point);
                for side in 0..2 {
                    (low[side], high[side]) = (min(low[side], at[side]), max(high[side], at[side]));
                }
                let clip = fitted.view.project(*point);
                assert!(clip[2] <= clip[3] && clip[2] >= 0.0, "{clip:?}");
                let (found, distance) = (
                    fitted.texel_distance(at[0] as usize, at[1] as usize, clip[2] / clip[3]),
                    fitted.distance(*point),
                );
                assert_eq!(distance, boxed.distance(*point));
                let slack = fitted.texel_size(*point) + 4e-7 * distance;
                assert!((found - distance).abs() < slack, "{found} {distance}");
            }
            // A texel's margin all around: 64 · 1 / (1 + 2/64) texels between, from ⁓1 to ⁓63.
            for side in 0..2 {
                assert!(
                    (low[side] - 0.97).abs() < 0.05 && (high[side] - 63.03).abs() < 0.05,
                    "{low:?} {high:?}"
                );
            }
            let area = |view: &ShadowView| view.half[0] * view.half[1];
            assert!(area(&fitted) < 0.5 * area(&boxed), "{} {}", area(&fitted), area(&boxed));
            let again = fitted.fitted(points.iter().copied());
            assert_eq!(again.view, fitted.view, "fitting changes nothing once it fits");
        }
    }

    #[test]
    fn a_light_inside_the_box_is_refused() {
        for eye in [Vec3::ZERO, Vec3::new(0.2, 0.9, 0.1), Vec3::new(0.0, 1.01, 0.0)] {
            let error = ShadowView::point(eye, Vec3::ZERO, Vec3::ONE, 64).unwrap_err().to_string();
            assert!(error.contains("inside the solid's bounding box"), "{error}");
        }
    }
}
