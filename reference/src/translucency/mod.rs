//! The equations of Banterle and Chalmers, Eq. 1 to Eq. 12 (Eq. 6 to Eq. 9 for functions on the
//! sphere are in [`crate::sh`]), and what the paper needs but does not number.
//!
//! | equation | here |
//! |---|---|
//! | Eq. 1 | [`eq1_exitant_radiance`] |
//! | Eq. 2 | [`eq2_radiosity`] |
//! | Eq. 3 | [`eq3_factorised_radiance`] |
//! | Eq. 4 | [`eq4_accumulated_irradiance`] |
//! | Eq. 5 | [`eq5_hemisphere_radiosity`], [`eq5_hemisphere_radiosity_as_printed`] |
//! | Eq. 6 | [`eq6_project_samples`], [`crate::sh::project`] |
//! | Eq. 7 | [`crate::sh::eq7_complex`] |
//! | Eq. 8 | [`crate::sh::k`] |
//! | Eq. 9 | [`crate::sh::eq9_real`], [`crate::sh::y`] |
//! | Eq. 10 | [`eq10_radiosity`] |
//! | Eq. 11 | [`eq11_matrix`], [`eq11_constants`] |
//! | Eq. 11 as printed | [`eq11_matrix_as_printed`], [`EQ11_CONSTANTS_AS_PRINTED`] |
//! | Eq. 12 | [`eq12_radiance`], [`eq12_attenuation_as_printed`], [`eq12_radiance_as_printed`] |

pub mod blur;
pub mod cube;
pub mod dipole;
pub mod optics;

#[cfg(test)]
mod tests;

use crate::sh;
use crate::vector::{Vec3, add, dot, frame, length, scale, sub};
use dipole::Medium;
use std::f64::consts::PI;

/// A small piece of a surface for the sums of Eq. 2 and Eq. 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Where it lies, in the unit of length of the medium.
    pub position: Vec3,
    /// Its area, in that unit squared.
    pub area: f64,
    /// The irradiance E that it receives, in watts per unit of area (any unit: it is linear).
    pub irradiance: f64,
}

/// One texel of the external cubemap for the sum of Eq. 6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubemapSample {
    /// The unit vector that it stands for.
    pub direction: Vec3,
    /// Its solid angle in steradians.
    pub solid_angle: f64,
    /// The irradiance E of the surface seen in it, Fresnel transmittance included; 0 where there
    /// is none.
    pub irradiance: f64,
}

/// Banterle and Chalmers, Eq. 1: the radiance that leaves a point, F_t B / π.
///
/// `fresnel_transmittance` is F_t(η, ω_out), without unit; `radiosity` is B of Eq. 2.
pub fn eq1_exitant_radiance(fresnel_transmittance: f64, radiosity: f64) -> f64 {
    fresnel_transmittance * radiosity / PI
}

/// Banterle and Chalmers, Eq. 2: the radiosity B(x_out), the sum over the surface of
/// E R_d(|x_in − x_out|) dA, by brute force.
///
/// `r_d` maps a distance to the diffuse reflectance per unit of area ([`Medium::r_d`]); the result
/// has the unit of the irradiance. Unlike Eq. 5 there is no cosine: the emergent flux is diffuse.
pub fn eq2_radiosity(x_out: Vec3, samples: &[SurfaceSample], r_d: impl Fn(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for s in samples {
        sum += s.irradiance * r_d(length(sub(s.position, x_out))) * s.area;
    }
    sum
}

/// Banterle and Chalmers, Eq. 3: F_t R_d B / π with R_d taken once, at the point that the refracted
/// ray meets, and B from Eq. 4.
///
/// Not an identity: R_d leaves the integral of Eq. 2. It equals Eq. 1 where R_d is the same for all
/// samples, and its distance from Eq. 1 and 2 is the error of the technique's first step.
pub fn eq3_factorised_radiance(fresnel_transmittance: f64, r_d: f64, accumulated: f64) -> f64 {
    fresnel_transmittance * r_d * accumulated / PI
}

/// Banterle and Chalmers, Eq. 4: the integral of E over the surface, a flux (irradiance times area),
/// although the paper gives it the name of the radiosity of Eq. 2.
pub fn eq4_accumulated_irradiance(samples: &[SurfaceSample]) -> f64 {
    let mut sum = 0.0;
    for s in samples {
        sum += s.irradiance * s.area;
    }
    sum
}

/// ∫ over the hemisphere about `axis` of E(ω) (r · ω) dω, exact where E is a polynomial up to
/// `degree` on that hemisphere.
fn hemisphere_integral(e: &impl Fn(Vec3) -> f64, axis: Vec3, r: Vec3, degree: u32) -> f64 {
    let [tangent, bitangent, normal] = frame(axis);
    let azimuths = degree + 2; // the cosine about r adds one to the degree
    let mut sum = 0.0;
    for (node, weight) in sh::gauss_legendre(degree / 2 + 2) {
        // from [−1, 1] to cos θ in [0, 1]
        let cosine = (node + 1.0) / 2.0;
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        for j in 0..azimuths {
            let phi = 2.0 * PI * f64::from(j) / f64::from(azimuths);
            let across = add(scale(sine * libm::cos(phi), tangent), scale(sine * libm::sin(phi), bitangent));
            let direction = add(across, scale(cosine, normal));
            sum += weight * PI / f64::from(azimuths) * e(direction) * dot(r, direction);
        }
    }
    sum
}

/// Banterle and Chalmers, Eq. 5, corrected: B = ∫ E(ω) (r · ω) dω over the hemisphere about the
/// refraction vector `r`, a unit vector; in the unit of E times steradians.
///
/// The paper names the hemisphere after the normal but takes the cosine about r: then the cosine
/// turns negative within the hemisphere, and so can B. Exact where E is a polynomial up to `degree`.
pub fn eq5_hemisphere_radiosity(e: impl Fn(Vec3) -> f64, r: Vec3, degree: u32) -> f64 {
    hemisphere_integral(&e, r, r, degree)
}

/// Banterle and Chalmers, Eq. 5 to the letter: the hemisphere is about the normal `n_out`, the
/// cosine, unclamped, about `r`; both unit vectors. Can be negative for a positive E.
pub fn eq5_hemisphere_radiosity_as_printed(
    e: impl Fn(Vec3) -> f64,
    n_out: Vec3,
    r: Vec3,
    degree: u32,
) -> f64 {
    hemisphere_integral(&e, n_out, r, degree)
}

/// Banterle and Chalmers, Eq. 6 as the sum over the texels of the cubemap:
/// E_lm = Σ E Y_lm(direction) · solid angle; order l² + l + m.
pub fn eq6_project_samples(bands: u32, samples: &[CubemapSample]) -> Vec<f64> {
    let mut coefficients = vec![0.0; (bands * bands) as usize];
    for s in samples {
        for (c, y) in coefficients.iter_mut().zip(sh::eval(bands, s.direction)) {
            *c += s.irradiance * y * s.solid_angle;
        }
    }
    coefficients
}

/// Banterle and Chalmers, Eq. 10: rᵗ M r with r extended to (r, 1), as the 4×4 matrix needs (the
/// print does not say so).
///
/// With the matrix and constants of Eq. 11 it equals Eq. 5 for an E of three bands. The constants
/// already hold the clamped cosine, so a constant E gives B = πE.
pub fn eq10_radiosity(matrix: &[[f64; 4]; 4], r: Vec3) -> f64 {
    let v = [r[0], r[1], r[2], 1.0];
    let mut sum = 0.0;
    for (row, a) in matrix.iter().zip(v) {
        for (entry, b) in row.iter().zip(v) {
            sum += a * entry * b;
        }
    }
    sum
}

/// The constants c1 to c5 of Banterle and Chalmers, Eq. 11, as printed there and in Ramamoorthi and
/// Hanrahan 2001. c2 and c3 are rounded the wrong way in their sixth digit.
pub const EQ11_CONSTANTS_AS_PRINTED: [f64; 5] = [0.429043, 0.511664, 0.743125, 0.886227, 0.247708];

/// The factors A_0 = π, A_1 = 2π/3, A_2 = π/4 by which a clamped cosine scales the bands of a
/// function on the sphere; Ramamoorthi and Hanrahan 2001.
pub const CLAMPED_COSINE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// The constants c1 to c5 of Banterle and Chalmers, Eq. 11, from their definitions: the factor of
/// the clamped cosine in each band times the constant of its polynomials in x, y, z.
pub fn eq11_constants() -> [f64; 5] {
    // Y_22 = √2 K_22 P_2^2 … = √2 K_22 · 3 (x² − y²)
    let c1 = CLAMPED_COSINE[2] * 2f64.sqrt() * sh::k(2, 2) * 3.0;
    // √2 K_11 (x, y) and K_10 z share one constant; M holds each product twice
    let c2 = CLAMPED_COSINE[1] * sh::k(1, 0) / 2.0;
    // Y_20 = K_20 (3 z² − 1) / 2
    let c3 = CLAMPED_COSINE[2] * sh::k(2, 0) * 1.5;
    let c4 = CLAMPED_COSINE[0] * sh::k(0, 0);
    let c5 = CLAMPED_COSINE[2] * sh::k(2, 0) * 0.5;
    [c1, c2, c3, c4, c5]
}

/// The upper three rows of M, on which print and correction agree.
fn eq11_upper_rows(e: &[f64; 9], c: &[f64; 5]) -> [[f64; 4]; 3] {
    let [_, e1m1, e10, e11, e2m2, e2m1, e20, e21, e22] = *e;
    let [c1, c2, c3, _, _] = *c;
    [
        [c1 * e22, c1 * e2m2, c1 * e21, c2 * e11],
        [c1 * e2m2, -c1 * e22, c1 * e2m1, c2 * e1m1],
        [c1 * e21, c1 * e2m1, c3 * e20, c2 * e10],
    ]
}

/// Banterle and Chalmers, Eq. 11, corrected: the symmetric matrix M of one colour channel from its
/// nine coefficients E_lm (order l² + l + m) and the constants c1 to c5; rows, then columns.
pub fn eq11_matrix(e: &[f64; 9], c: &[f64; 5]) -> [[f64; 4]; 4] {
    let [a, b, d] = eq11_upper_rows(e, c);
    let [e00, e1m1, e10, e11, _, _, e20, _, _] = *e;
    [a, b, d, [c[1] * e11, c[1] * e1m1, c[1] * e10, c[3] * e00 - c[4] * e20]]
}

/// Banterle and Chalmers, Eq. 11 to the letter: the last row has c1 E_11 and c2 E_2−1 where the
/// symmetry of M asks for c2 E_11 and c2 E_1−1.
pub fn eq11_matrix_as_printed(e: &[f64; 9], c: &[f64; 5]) -> [[f64; 4]; 4] {
    let [a, b, d] = eq11_upper_rows(e, c);
    let [e00, _, e10, e11, _, e2m1, e20, _, _] = *e;
    [a, b, d, [c[0] * e11, c[1] * e2m1, c[1] * e10, c[3] * e00 - c[4] * e20]]
}

/// The attenuation of Banterle and Chalmers, Eq. 12 to the letter:
/// (σ_tr d + 1) e^{−σ_tr d} / (σ'_t d³), per unit of area.
///
/// It diverges as d → 0 and is negative for d < 0, and its value changes with the unit of length.
pub fn eq12_attenuation_as_printed(medium: &Medium, d: f64) -> f64 {
    let x = medium.sigma_tr() * d;
    (x + 1.0) * libm::exp(-x) / (medium.sigma_t_prime() * d * d * d)
}

/// Banterle and Chalmers, Eq. 12 to the letter: F_t/π · attenuation · B with
/// [`eq12_attenuation_as_printed`]. `d` is the thickness in the medium's unit of length.
pub fn eq12_radiance_as_printed(fresnel_transmittance: f64, medium: &Medium, d: f64, radiosity: f64) -> f64 {
    fresnel_transmittance / PI * eq12_attenuation_as_printed(medium, d) * radiosity
}

/// Banterle and Chalmers, Eq. 12, corrected: F_t/π · attenuation · B with [`Medium::attenuation`],
/// which stays finite, does not depend on the unit of length, and undoes the π that B carries.
pub fn eq12_radiance(fresnel_transmittance: f64, medium: &Medium, d: f64, radiosity: f64) -> f64 {
    fresnel_transmittance / PI * medium.attenuation(d) * radiosity
}

/// Banterle and Chalmers, Eq. 12, corrected, for several lights: each light i has its own
/// (thickness d_i, B_i), because one projection of all lights would mix what only its own thickness
/// may attenuate. F_t/π · Σ attenuation(d_i) B_i.
pub fn eq12_radiance_of_lights(fresnel_transmittance: f64, medium: &Medium, lights: &[(f64, f64)]) -> f64 {
    let mut sum = 0.0;
    for &(d, radiosity) in lights {
        sum += medium.attenuation(d) * radiosity;
    }
    fresnel_transmittance / PI * sum
}

/// The thickness of Banterle and Chalmers, section 2.2, corrected: how much further from the light
/// the shaded point lies than the first surface the light meets; both distances along the ray of
/// light, linear and in the same unit. A surface in front of the map's gives 0.
pub fn thickness(shadow_map_depth: f64, distance_to_light: f64) -> f64 {
    let d = distance_to_light - shadow_map_depth;
    if d > 0.0 { d } else { 0.0 }
}

/// The thickness of Banterle and Chalmers, section 2.2 to the letter: the depth minus the distance,
/// which is negative inside the object.
pub fn thickness_as_printed(shadow_map_depth: f64, distance_to_light: f64) -> f64 {
    shadow_map_depth - distance_to_light
}
