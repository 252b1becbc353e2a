//! Reading a light's maps at points of the surface.

use crate::numeric::lanes::BLOCK;
use crate::numeric::order::{max, min};
use crate::raster::{ShadowView, SurfacePoints};
use glam::Vec3;

/// The four texels around each of several points, and their bilinear weights. Texels outside the map are
/// those of its edge.
pub(super) struct Footprints {
    texels: [[u32; BLOCK]; 4],
    weights: [[f32; BLOCK]; 4],
}

impl Footprints {
    #[inline(always)]
    pub(super) fn new(shadow: &ShadowView, points: &SurfacePoints) -> Self {
        let mut all = Self { texels: [[0; BLOCK]; 4], weights: [[0.0; BLOCK]; 4] };
        let size = shadow.view.width as i32;
        for lane in 0..BLOCK {
            let [x, y] = shadow.texel(points.position(lane));
            let ((x0, x1, u), (y0, y1, v)) = (between(x - 0.5, size), between(y - 0.5, size));
            let texels = [y0 * size + x0, y0 * size + x1, y1 * size + x0, y1 * size + x1];
            let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            for corner in 0..4 {
                all.texels[corner][lane] = texels[corner] as u32;
                all.weights[corner][lane] = weights[corner];
            }
        }
        all
    }

    /// What a map holds at the four texels around each of the first `count` points, by `texel`.
    #[inline(always)]
    pub(super) fn gather(&self, count: usize, texel: impl Fn(usize) -> f32) -> [[f32; BLOCK]; 4] {
        let mut values = [[0.0; BLOCK]; 4];
        for (values, texels) in values.iter_mut().zip(&self.texels) {
            for (value, at) in values.iter_mut().zip(texels).take(count) {
                *value = texel(*at as usize);
            }
        }
        values
    }

    /// The bilinear mean of the distances in a lane that are not 0, or `otherwise` where all are.
    #[inline(always)]
    pub(super) fn mean(&self, distances: &[[f32; BLOCK]; 4], lane: usize, otherwise: f32) -> f32 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for corner in 0..4 {
            let (distance, share) = (distances[corner][lane], self.weights[corner][lane]);
            let there = distance > 0.0;
            sum = if there { sum + share * distance } else { sum };
            weight = if there { weight + share } else { weight };
        }
        let mean = sum / weight;
        if weight > 0.0 { mean } else { otherwise }
    }

    /// The share of the texels in a lane, weighted bilinearly, for whose values `holds` is true.
    #[inline(always)]
    pub(super) fn share(&self, values: &[[f32; BLOCK]; 4], lane: usize, holds: impl Fn(f32) -> bool) -> f32 {
        let share = |corner: usize| {
            let weight = self.weights[corner][lane];
            if holds(values[corner][lane]) { weight } else { 0.0 }
        };
        min(share(0) + share(1) + share(2) + share(3), 1.0) // the weights' sum may round above 1
    }
}

/// The texels left and right of a place, and how far it is on the way between them.
#[inline(always)]
fn between(at: f32, size: i32) -> (i32, i32, f32) {
    // Rounding down by a conversion: `floor` would be a call on processors before SSE 4.1.
    let toward_zero = at as i32;
    let below = if (toward_zero as f32) > at { toward_zero - 1 } else { toward_zero };
    let held = |texel: i32| max(min(texel, size - 1), 0);
    (held(below), held(below.saturating_add(1)), at - below as f32)
}

/// How much farther from the light than its texel says a point may lie and still be on the texel's surface: a
/// texel's width, plus the rise across it of a surface that the light meets at `cosine`. In a map of n texels
/// the rise is held to √n of them: that is how much a sphere as wide as the map rises within the last texel
/// of its silhouette.
#[inline(always)]
pub(super) fn slack(shadow: &ShadowView, point: Vec3, cosine: f32) -> f32 {
    let cosine = cosine.abs();
    let climb = max(1.0 - cosine * cosine, 0.0).sqrt() / max(cosine, 1e-3);
    shadow.texel_size(point) * (1.0 + min(climb, (shadow.view.width as f32).sqrt()))
}
