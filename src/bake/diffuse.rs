//! Diffuse transfer vectors without interreflection: Nowrouzezahrai et al. 2007, §3 (errata L1).

use super::project::project;
use super::{Directions, Estimate, Visibility};
use crate::keys::Reading;
use crate::world::medium::Medium;
use crate::world::mesh::Mesh;
use std::f64::consts::FRAC_1_PI;

/// The transfer vector of every vertex for albedo 1, `[vertices][bands²]`, order l² + l + m: T·L is the
/// radiance that a white diffuse surface sends out in light L. Under [`Reading::Paper`] it lacks cosine and
/// 1/π.
///
/// # Panics
/// Where `bands` exceeds [`crate::sphere::sh::MAX_BANDS`], or `visibility` is not that of `mesh` and
/// `directions`.
pub fn vectors(
    mesh: &Mesh,
    directions: &Directions,
    visibility: &Visibility,
    bands: usize,
    reading: Reading,
    estimate: Estimate,
) -> Vec<f32> {
    match reading {
        Reading::Corrected => {
            weighted(mesh, directions, visibility, bands, estimate, |cosine| cosine * FRAC_1_PI)
        }
        Reading::Paper => weighted(mesh, directions, visibility, bands, estimate, |_| 1.0),
    }
}

/// The irradiance that enters a translucent solid at every vertex, `[vertices][bands²]`:
/// ∫ V(ω) max(0, n·ω) F_t(n·ω) y(ω) dω with Schlick's transmittance.
///
/// # Panics
/// As [`vectors`].
pub fn irradiance(
    mesh: &Mesh,
    directions: &Directions,
    visibility: &Visibility,
    bands: usize,
    medium: &Medium,
    estimate: Estimate,
) -> Vec<f32> {
    let transmitted = |cosine: f64| cosine * f64::from(medium.transmittance(cosine as f32));
    weighted(mesh, directions, visibility, bands, estimate, transmitted)
}

fn weighted(
    mesh: &Mesh,
    directions: &Directions,
    visibility: &Visibility,
    bands: usize,
    estimate: Estimate,
    k: impl Fn(f64) -> f64 + Sync,
) -> Vec<f32> {
    let put = |_: usize, sums: &[f64], out: &mut [f32]| {
        out.iter_mut().zip(sums).for_each(|(out, sum)| *out = *sum as f32);
    };
    project(mesh, directions, visibility, bands, estimate, k, 0..mesh.positions.len(), (bands * bands, put))
}
