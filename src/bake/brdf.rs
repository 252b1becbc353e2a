//! The matrix of a BRDF: B of Feng et al. 2007, Eq. 5.
//!
//! For light with coefficients l in the local frame, y(o)·B l is the radiance that leaves towards o: B_kl =
//! ∫∫ y_k(o) f(i, o) max(0, i_z) y_l(i) di do. The cosine is part of B. A BRDF is 0 below the horizon, where
//! the series of a few bands is not. For exact exits there are [`rows`], which expand the light's side alone,
//! as the paper does for its views.
//!
//! Every BRDF here is isotropic and mirror-symmetric: it depends on the azimuths by the cosines of multiples
//! of their difference. So one azimuth of the exit is enough, and B couples a function of order m only with
//! those of the same m.

use crate::numeric::order::max;
use crate::sphere::quadrature::gauss_legendre;
use crate::sphere::sh;
use crate::world::brdf::{Brdf, Gloss};
use glam::Vec3;
use std::f64::consts::PI;

/// The fewest nodes of z over the hemisphere, for each side; there are twice as many equal steps of azimuth.
const HEIGHTS: usize = 64;

/// How many nodes of z a lobe needs: three times as many as there are widths 1/√e of a Phong lobe of exponent
/// e in a radian. Beckmann's facets of slope m spread light as a Phong exponent of 1/(2 m²) does.
fn count(brdf: &Brdf) -> usize {
    let exponent = match brdf.gloss {
        Gloss::None => 0.0,
        Gloss::Phong { exponent } => exponent,
        Gloss::CookTorrance { roughness } => 0.5 / (roughness * roughness),
    };
    max((3.0 * exponent.sqrt()).ceil() as usize, HEIGHTS)
}

/// Nodes and weights that integrate over z from 0 to 1.
fn heights(count: usize) -> Vec<(f64, f64)> {
    gauss_legendre(count).into_iter().map(|(node, weight)| (0.5 * (node + 1.0), 0.5 * weight)).collect()
}

/// A direction of height z at an azimuth given in turns.
fn direction(z: f64, turns: f64) -> [f64; 3] {
    let (sine, cosine) = crate::numeric::turns::sin_cos(turns);
    let across = ((1.0 - z) * (1.0 + z)).sqrt();
    [across * cosine, across * sine, z]
}

fn rounded(direction: [f64; 3]) -> Vec3 {
    Vec3::from_array(direction.map(|component| component as f32))
}

/// The coefficients of f(·, o) max(0, i_z) for each exit o (unit, local), RGB, `[exits][bands²]`: with light
/// l in the local frame, row·l is the radiance towards o. 0 for an exit that is not above the surface.
///
/// The BRDF is evaluated in `f32` at 64 heights by 128 azimuths, and at more for lobes narrower than that of
/// a Phong exponent of 455: exact to 2 · 10⁻⁷ for an exponent of 60, to 3 · 10⁻⁵ for all up to 10,000, and to
/// 3 · 10⁻⁴ for roughness 0.01, up to exits of 53°. Cook and Torrance's highlight at grazing exits is
/// narrower than any step: that is 1.5 · 10⁻³ of the first entry of [`matrix`] at roughness 0.4.
///
/// # Panics
/// Where `bands` exceeds [`sh::MAX_BANDS`].
pub fn rows(brdf: &Brdf, bands: usize, exits: &[Vec3]) -> Vec<[f32; 3]> {
    let nodes = nodes(bands, count(brdf));
    let mut rows = Vec::with_capacity(exits.len() * bands * bands);
    for exit in exits {
        rows.extend(row(brdf, &nodes, *exit, bands).iter().map(|rgb| rgb.map(|x| x as f32)));
    }
    rows
}

/// A direction of light, its cosine times solid angle, and the basis there.
struct Node {
    direction: Vec3,
    weight: f64,
    basis: Vec<f64>,
}

fn nodes(bands: usize, count: usize) -> Vec<Node> {
    let azimuths = 2 * count;
    let mut nodes = Vec::with_capacity(count * azimuths);
    for (z, weight) in heights(count) {
        for azimuth in 0..azimuths {
            let towards = direction(z, (azimuth as f64 + 0.5) / azimuths as f64);
            let mut basis = vec![0.0; bands * bands];
            sh::evaluate(bands, towards, &mut basis);
            let weight = z * weight * (2.0 * PI / azimuths as f64);
            nodes.push(Node { direction: rounded(towards), weight, basis });
        }
    }
    nodes
}

fn row(brdf: &Brdf, nodes: &[Node], exit: Vec3, bands: usize) -> Vec<[f64; 3]> {
    let mut row = vec![[0.0; 3]; bands * bands];
    for node in nodes {
        let value = brdf.value(node.direction, exit).as_dvec3() * node.weight;
        for (sum, basis) in row.iter_mut().zip(&node.basis) {
            for channel in 0..3 {
                sum[channel] += value[channel] * basis;
            }
        }
    }
    row
}

/// B by rows, RGB, `[bands²][bands²]`: rows are exit functions, columns those of the light.
///
/// # Panics
/// Where `bands` exceeds [`sh::MAX_BANDS`].
pub fn matrix(brdf: &Brdf, bands: usize) -> Vec<[f32; 3]> {
    let functions = bands * bands;
    let count = count(brdf);
    let nodes = nodes(bands, count);
    let mut matrix = vec![[0.0; 3]; functions * functions];
    let mut exit = vec![0.0; functions];
    for (z, weight) in heights(count) {
        // At azimuth 0 the function (l, |m|) is the profile of (l, ±m).
        let towards = direction(z, 0.0);
        sh::evaluate(bands, towards, &mut exit);
        let row = row(brdf, &nodes, rounded(towards), bands);
        for k in 0..bands {
            for l in 0..bands {
                let orders = if k < l { k } else { l } as isize;
                for m in -orders..=orders {
                    let profile = |l: usize| sh::index(l, m.abs());
                    let around = if m == 0 { 2.0 * PI } else { PI };
                    let factor = weight * around * exit[profile(k)];
                    let entry = &mut matrix[sh::index(k, m) * functions + sh::index(l, m)];
                    for channel in 0..3 {
                        entry[channel] += factor * row[profile(l)][channel];
                    }
                }
            }
        }
    }
    matrix.into_iter().map(|rgb| rgb.map(|x| x as f32)).collect()
}
