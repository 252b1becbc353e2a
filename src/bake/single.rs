//! Single scattering in a translucent solid, as transfer to one exit direction a vertex.
//!
//! Light that is scattered once comes from the points of the refracted ray that leaves x towards o (Jensen,
//! Marschner, Levoy and Hanrahan 2001, Eq. 6; as transfer: Wang, Tran and Luebke 2005):
//!
//! L(x, o) = F_t(o) ∫ σ_s e^(−σ_t s) ∫ p(ω·ω'_o) F_t(ω) e^(−σ_t s'(ω)) L(ω) dω ds
//!
//! As there, light reaches a point along the straight line towards ω and not along a refracted one, F_t is
//! that of the surface where this line leaves the solid, and the length is corrected for refraction: s' =
//! s |ω·n| / √(1 − (1 − |ω·n|²)/η²) with the triangle's normal n. The radiance of the sky counts if nothing
//! is in the way beyond.
//!
//! The refracted ray ends where it meets the mesh. Distances along it are Gauss-Legendre nodes in 1 − e^(−σs)
//! with the smallest σ_t of the three colours, so no colour's weight exceeds 1. A line that meets no
//! triangle, or one from the front, brings nothing: where an open mesh ends there is no surface that light
//! could have entered by.

use super::{Directions, RUN};
use crate::numeric::order::{max, min};
use crate::numeric::parallel;
use crate::numeric::{double, single::exp};
use crate::sphere::quadrature::gauss_legendre;
use crate::sphere::sh;
use crate::trace::{Bvh, Ray};
use crate::world::medium::Medium;
use crate::world::mesh::Mesh;
use glam::Vec3;
use std::f64::consts::FRAC_1_PI;

/// How far beyond the surface the way to the sky starts, in radii of the mesh's box: more than the rounding
/// of a hit's place.
const STEP: f32 = 1e-5;

/// How a medium scatters once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleScattering {
    /// Mean cosine g of Henyey and Greenstein's phase function (1941), above −1 and below 1. The medium's σs'
    /// is (1 − g) σs.
    pub anisotropy: f32,
    /// Points along each refracted ray.
    pub points: usize,
}

/// The transfer of singly scattered light to the exit direction of each vertex, RGB, `[vertices][bands²][3]`:
/// times L it is radiance; both of Fresnel's transmittances are in it.
///
/// `exits` are unit vectors of the world, one a vertex: the normals for light that leaves straight, or the
/// directions towards an eye. 0 where the exit is not above the surface, and for vertices that no triangle
/// uses. Costs points × directions nearest hits a vertex, and a shadow ray for each that finds the surface.
///
/// # Panics
/// Where there is not one exit a vertex.
pub fn single_scattering(
    mesh: &Mesh,
    bvh: &Bvh,
    directions: &Directions,
    medium: &Medium,
    scattering: SingleScattering,
    bands: usize,
    exits: &[Vec3],
) -> Vec<f32> {
    assert_eq!(exits.len(), mesh.positions.len(), "one exit a vertex");
    let functions = bands * bands;
    let used = super::visibility::used(mesh);
    let step = STEP * mesh.bounds().radius();
    let way = Way::new(medium, scattering);
    let mut result = vec![0.0; exits.len() * functions * 3];
    // Short runs, since rays are costly and vertices differ.
    parallel::for_each_chunk(&mut result, RUN / 8 * functions * 3, |run, rows| {
        let mut y = vec![0.0; functions];
        for (index, row) in rows.chunks_exact_mut(functions * 3).enumerate() {
            let vertex = run * (RUN / 8) + index;
            if !used[vertex] {
                continue;
            }
            let mut sums = vec![0.0; functions * 3];
            for (point, inward, weight) in way.points(mesh, bvh, vertex, exits[vertex]) {
                for (ray, exact) in directions.rays.iter().zip(&directions.exact) {
                    let arriving = way.arriving(bvh, point, *ray, step);
                    if arriving == [0.0; 3] {
                        continue;
                    }
                    let phase = directions.weight() * way.phase(f64::from(ray.dot(inward)));
                    sh::evaluate(bands, *exact, &mut y);
                    for (sum, y) in sums.chunks_exact_mut(3).zip(&y) {
                        for channel in 0..3 {
                            sum[channel] += phase * weight[channel] * arriving[channel] * y;
                        }
                    }
                }
            }
            row.iter_mut().zip(&sums).for_each(|(out, sum)| *out = *sum as f32);
        }
    });
    result
}

/// The medium's part of the integral.
struct Way {
    medium: Medium,
    /// σ_s and σ_t per unit of the mesh.
    scattering: [f64; 3],
    extinction: [f64; 3],
    anisotropy: f64,
    /// Nodes and weights on [0, 1].
    rule: Vec<(f64, f64)>,
}

impl Way {
    fn new(medium: &Medium, single: SingleScattering) -> Self {
        let unit = f64::from(medium.millimetres);
        let anisotropy = f64::from(single.anisotropy);
        let scattering = medium.scattering.map(|reduced| f64::from(reduced) * unit / (1.0 - anisotropy));
        let extinction = [0, 1, 2].map(|c| scattering[c] + f64::from(medium.absorption[c]) * unit);
        let rule = gauss_legendre(single.points);
        let rule = rule.into_iter().map(|(node, weight)| (0.5 * (node + 1.0), 0.5 * weight)).collect();
        Self { medium: *medium, scattering, extinction, anisotropy, rule }
    }

    /// The cosine inside that belongs to one outside (Snell's law).
    fn refracted(&self, cosine: f64) -> f64 {
        let eta = f64::from(self.medium.eta);
        (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt()
    }

    /// The points of a vertex's refracted ray, the ray's direction into the solid, and each point's weight:
    /// F_t σ_s e^(−σ_t s) ds.
    fn points(&self, mesh: &Mesh, bvh: &Bvh, vertex: usize, exit: Vec3) -> Vec<(Vec3, Vec3, [f64; 3])> {
        let normal = mesh.normals[vertex];
        let cosine = normal.dot(exit);
        if cosine <= 0.0 {
            return Vec::new();
        }
        let eta = self.medium.eta;
        let inside = self.refracted(f64::from(min(cosine, 1.0))) as f32;
        let inward = (normal * (cosine / eta - inside) - exit / eta).normalize();
        let ray = Ray::new(mesh.positions[vertex], inward);
        let end = bvh.nearest(&ray).map_or(f64::INFINITY, |hit| f64::from(hit.t));
        let least = self.extinction.iter().fold(f64::INFINITY, |least, sigma| min(least, *sigma));
        let whole = 1.0 - double::exp(-least * end);
        let transmitted = f64::from(self.medium.transmittance(cosine));
        self.rule
            .iter()
            .map(|(node, weight)| {
                let s = -double::log(1.0 - node * whole) / least;
                let weight = [0, 1, 2].map(|c| {
                    let density = double::exp((least - self.extinction[c]) * s) / least;
                    transmitted * self.scattering[c] * density * weight * whole
                });
                (ray.at(s as f32), inward, weight)
            })
            .collect()
    }

    /// The part of the sky's radiance from `towards` that arrives at a point within.
    fn arriving(&self, bvh: &Bvh, point: Vec3, towards: Vec3, step: f32) -> [f64; 3] {
        let ray = Ray::new(point, towards);
        let Some(hit) = bvh.nearest(&ray) else { return [0.0; 3] };
        let [a, b, c] = bvh.corners()[hit.triangle as usize].map(Vec3::as_dvec3);
        let cosine = (b - a).cross(c - a).normalize_or_zero().dot(towards.as_dvec3());
        if cosine <= 0.0 || bvh.blocked(&Ray::new(ray.at(hit.t + step), towards)) {
            return [0.0; 3];
        }
        let cosine = min(cosine, 1.0);
        let length = f64::from(hit.t) * cosine / self.refracted(cosine);
        let transmitted = f64::from(self.medium.transmittance(cosine as f32));
        self.extinction.map(|sigma| transmitted * f64::from(exp((-sigma * length) as f32)))
    }

    /// Henyey and Greenstein's phase function, per steradian, of the cosine between the ways before and
    /// after.
    fn phase(&self, cosine: f64) -> f64 {
        let g = self.anisotropy;
        let base = max(1.0 + g * g - 2.0 * g * cosine, 1e-12);
        0.25 * FRAC_1_PI * (1.0 - g * g) / (base * base.sqrt())
    }
}
