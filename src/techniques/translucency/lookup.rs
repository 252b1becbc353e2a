//! Reading a light's maps at a point of the surface.

use crate::numeric::order::{max, min};
use crate::raster::ShadowView;
use glam::Vec3;

/// The four texels around a point, and their bilinear weights. Texels outside the map are those of its edge.
pub(super) struct Footprint {
    texels: [usize; 4],
    weights: [f32; 4],
}

impl Footprint {
    pub(super) fn new(shadow: &ShadowView, point: Vec3) -> Self {
        let size = shadow.view.width;
        let [x, y] = shadow.texel(point).map(|at| at - 0.5);
        // The texels left and right of a place, and how far it is on the way between them. Rounding down by a
        // conversion: `floor` would be a call on processors before SSE 4.1.
        let between = |at: f32| {
            let toward_zero = at as i32;
            let below = if (toward_zero as f32) > at { toward_zero - 1 } else { toward_zero };
            let held = |texel: i32| texel.clamp(0, size as i32 - 1) as usize;
            (held(below), held(below.saturating_add(1)), at - below as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (between(x), between(y));
        Self {
            texels: [y0 * size + x0, y0 * size + x1, y1 * size + x0, y1 * size + x1],
            weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        }
    }

    /// The bilinear mean of the texels that hold a distance; `None` where none does.
    pub(super) fn mean(&self, distance: impl Fn(usize) -> f32) -> Option<f32> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (texel, share) in self.texels.iter().zip(self.weights) {
            let distance = distance(*texel);
            if distance > 0.0 {
                sum += share * distance;
                weight += share;
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }

    /// The share of the texels, weighed bilinearly, that `holds` is true of.
    pub(super) fn share(&self, holds: impl Fn(usize) -> bool) -> f32 {
        let weight = |(texel, weight): (&usize, f32)| if holds(*texel) { weight } else { 0.0 };
        let shares: [f32; 4] = std::array::from_fn(|i| weight((&self.texels[i], self.weights[i])));
        min(shares[0] + shares[1] + shares[2] + shares[3], 1.0) // the weights' sum may round above 1
    }
}

/// How much farther than a texel says a point of its surface may lie: a texel's width, plus what a surface that
/// the light meets at `cosine` climbs across it. Within the last texel of its silhouette a sphere as wide as a map of
/// n texels climbs √n of them; nothing rounder than that is asked for more.
pub(super) fn slack(shadow: &ShadowView, point: Vec3, cosine: f32) -> f32 {
    let cosine = cosine.abs();
    let climb = max(1.0 - cosine * cosine, 0.0).sqrt() / max(cosine, 1e-3);
    shadow.texel_size(point) * (1.0 + min(climb, (shadow.view.width as f32).sqrt()))
}
