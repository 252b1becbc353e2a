//! Radiance transfer at a vertex: the integrals that Nowrouzezahrai et al. and Feng et al. shade with, as
//! sums over any rule of directions and weights, by brute force over all triangles.
//!
//! Every function takes the rule, so that a fast implementation can be held against the same sum.

use crate::geometry::{Hit, Triangle, face_normal, nearest_hit};
use crate::sh;
use crate::translucency::dipole::Medium;
use crate::vector::{Vec3, dot, scale};
use std::f64::consts::PI;

/// Directions (unit) and the solid angles that they stand for, in steradians.
pub type Rule = [(Vec3, f64)];

/// How near a triangle counts as the one that a ray starts on, in lengths of the direction.
const NEAR: f64 = 1e-7;

/// What a ray that starts on the mesh meets first.
pub fn first_hit(origin: Vec3, direction: Vec3, triangles: &[Triangle]) -> Option<Hit> {
    nearest_hit(origin, direction, triangles, NEAR, f64::INFINITY)
}

/// V(ω): 1 above the horizon of the normal where no triangle stands in the way, from either side.
pub fn visibility(origin: Vec3, normal: Vec3, direction: Vec3, triangles: &[Triangle]) -> f64 {
    let free = dot(normal, direction) > 0.0 && first_hit(origin, direction, triangles).is_none();
    f64::from(free)
}

/// Nowrouzezahrai et al., §3, corrected (errata L1): t = (ρ/π) ∫ V(ω) max(0, n·ω) y(ω) dω.
pub fn vector(
    origin: Vec3,
    normal: Vec3,
    albedo: f64,
    bands: u32,
    rule: &Rule,
    mesh: &[Triangle],
) -> Vec<f64> {
    integrate((bands * bands) as usize, rule, |direction| {
        let cosine = positive(dot(normal, direction));
        let factor = albedo / PI * visibility(origin, normal, direction, mesh) * cosine;
        sh::eval(bands, direction).iter().map(|y| factor * y).collect()
    })
}

/// Nowrouzezahrai et al., §3, as printed: t = ∫ V(ω) y(ω) dω over the hemisphere about n.
pub fn vector_as_printed(origin: Vec3, normal: Vec3, bands: u32, rule: &Rule, mesh: &[Triangle]) -> Vec<f64> {
    integrate((bands * bands) as usize, rule, |direction| {
        let factor = visibility(origin, normal, direction, mesh);
        sh::eval(bands, direction).iter().map(|y| factor * y).collect()
    })
}

/// T of Feng et al., Eq. 5: M_ij = ∫ V(ω) y_i(Rω) y_j(ω) dω by rows; R has the rows `frame` (tangent,
/// bitangent, normal).
pub fn matrix(origin: Vec3, frame: [Vec3; 3], bands: u32, rule: &Rule, mesh: &[Triangle]) -> Vec<f64> {
    let functions = (bands * bands) as usize;
    integrate(functions * functions, rule, |direction| {
        let factor = visibility(origin, frame[2], direction, mesh);
        let local = sh::eval(bands, to_local(frame, direction));
        let world = sh::eval(bands, direction);
        local.iter().flat_map(|i| world.iter().map(move |j| factor * i * j)).collect()
    })
}

/// B of Feng et al., Eq. 5, with the cosine in it: B_kl = ∫∫ y_k(o) f(i, o) max(0, i_z) y_l(i) di do by rows,
/// the BRDF f given light and exit in the local frame.
pub fn brdf_matrix(f: impl Fn(Vec3, Vec3) -> f64, bands: u32, rule: &Rule) -> Vec<f64> {
    let functions = (bands * bands) as usize;
    integrate(functions * functions, rule, |exit| {
        let row = integrate(functions, rule, |light| {
            let factor = f(light, exit) * positive(light[2]);
            sh::eval(bands, light).iter().map(|y| factor * y).collect()
        });
        let at_exit = sh::eval(bands, exit);
        at_exit.iter().flat_map(|k| row.iter().map(move |l| k * l)).collect()
    })
}

/// Γ of Feng et al., Eq. 5, the radiance towards the local direction `exit`: y(o)ᵀ B T L.
pub fn eq5_radiance(exit: Vec3, brdf: &[f64], transfer: &[f64], light: &[f64]) -> f64 {
    let bands = (light.len() as f64).sqrt() as u32;
    let arriving = product(transfer, light);
    dot_all(&sh::eval(bands, exit), &product(brdf, &arriving))
}

/// A mesh's corners of triangle, as vertex indices, and the frame of each vertex.
pub struct Vertices<'a> {
    /// Three vertices a triangle.
    pub corners: &'a [[usize; 3]],
    /// The triangles' places, in the same order.
    pub triangles: &'a [Triangle],
    /// Position of each vertex.
    pub positions: &'a [Vec3],
    /// Tangent, bitangent and normal of each vertex.
    pub frames: &'a [[Vec3; 3]],
}

/// One diffuse bounce (Sloan, Kautz and Snyder 2002): (1/π) ∫ max(0, n·ω) s dω, s interpolated where a
/// direction meets a triangle from the front, 0 elsewhere.
pub fn diffuse_bounce(mesh: &Vertices, vertex: usize, source: &[f64], rule: &Rule) -> f64 {
    let sum = integrate(1, rule, |direction| {
        let cosine = positive(dot(mesh.frames[vertex][2], direction));
        vec![met(mesh, vertex, direction, |corner| source[corner]) * cosine / PI]
    });
    sum[0]
}

/// One glossy bounce: the matrix of the light that arrives at a vertex from vertices whose own matrices are
/// `before`.
pub fn glossy_bounce(
    mesh: &Vertices,
    vertex: usize,
    before: &[Vec<f64>],
    brdf: &[f64],
    bands: u32,
    rule: &Rule,
) -> Vec<f64> {
    let functions = (bands * bands) as usize;
    integrate(functions * functions, rule, |direction| {
        let local = sh::eval(bands, to_local(mesh.frames[vertex], direction));
        let mut terms = vec![0.0; functions * functions];
        if dot(mesh.frames[vertex][2], direction) <= 0.0 {
            return terms;
        }
        for j in 0..functions {
            let leaving = met(mesh, vertex, direction, |corner| {
                let exit = sh::eval(bands, to_local(mesh.frames[corner], scale(-1.0, direction)));
                let column: Vec<f64> = (0..functions).map(|i| before[corner][i * functions + j]).collect();
                dot_all(&exit, &product(brdf, &column))
            });
            for i in 0..functions {
                terms[i * functions + j] = local[i] * leaving;
            }
        }
        terms
    })
}

/// What `of` gives at the corners of the triangle that a direction meets from the front, interpolated; 0
/// where none is.
fn met(mesh: &Vertices, vertex: usize, direction: Vec3, of: impl Fn(usize) -> f64) -> f64 {
    if dot(mesh.frames[vertex][2], direction) <= 0.0 {
        return 0.0;
    }
    match first_hit(mesh.positions[vertex], direction, mesh.triangles) {
        Some(hit) if dot(face_normal(&mesh.triangles[hit.triangle]), direction) < 0.0 => {
            let [a, b, c] = mesh.corners[hit.triangle];
            (1.0 - hit.u - hit.v) * of(a) + hit.u * of(b) + hit.v * of(c)
        }
        _ => 0.0,
    }
}

/// The transfer of singly scattered light to an exit at `cosine` from a slab of that `thickness` under any
/// light, normal +z, isotropic scattering (Jensen et al. 2001, Eq. 6, whose integral along the exit's
/// refracted ray is elementary there): σ_s F_t(o) ∫ F_t(ω) / 4π D(ω) y(ω) dω. With μ' the cosines inside and
/// S = thickness / μ'_o, light from above has D = ∫₀^S e^(−σ_t s (1 + μ'_o/μ'_i)) ds, light from below
/// e^(−σ_t thickness/μ'_i) ∫₀^S e^(−σ_t s (1 − μ'_o/μ'_i)) ds. A half-space is infinitely thick.
///
/// σ_s is the medium's σ'_s: isotropic scattering has no other.
pub fn slab_single_scattering(
    medium: &Medium,
    thickness: f64,
    transmittance: impl Fn(f64) -> f64,
    cosine: f64,
    bands: u32,
    rule: &Rule,
) -> Vec<f64> {
    let inside = |c: f64| (1.0 - (1.0 - c * c) / (medium.eta * medium.eta)).sqrt();
    let extinction = medium.sigma_s_prime + medium.sigma_a;
    let along = thickness / inside(cosine);
    integrate((bands * bands) as usize, rule, |direction| {
        let arriving = direction[2].abs();
        let ratio = inside(cosine) / inside(arriving);
        let depth = if direction[2] > 0.0 {
            let rate = extinction * (1.0 + ratio);
            (1.0 - libm::exp(-rate * along)) / rate
        } else if thickness.is_finite() {
            let rate = extinction * (1.0 - ratio);
            // 1 − e^(−x) over x, at x = 0 its limit
            let mean = if rate == 0.0 { along } else { -libm::expm1(-rate * along) / rate };
            libm::exp(-extinction * thickness / inside(arriving)) * mean
        } else {
            0.0
        };
        let factor =
            medium.sigma_s_prime * transmittance(cosine) * transmittance(arriving) / (4.0 * PI) * depth;
        sh::eval(bands, direction).iter().map(|y| factor * y).collect()
    })
}

/// Multiple scattering at a vertex, B/π: (1/π) Σ A_u R_d(|x − x_u|) E_u over all other vertices, and over the
/// disc of its own area, by rings, about itself.
pub fn multiple_scattering(
    positions: &[Vec3],
    areas: &[f64],
    irradiance: &[f64],
    medium: &Medium,
    vertex: usize,
) -> f64 {
    let mut sum = 0.0;
    for u in 0..positions.len() {
        if u == vertex {
            let (radius, rings) = ((areas[u] / PI).sqrt(), 2000);
            for ring in 0..rings {
                let r = radius * (f64::from(ring) + 0.5) / f64::from(rings);
                sum += irradiance[u] * medium.r_d(r) * 2.0 * PI * r * radius / f64::from(rings);
            }
        } else {
            let d = crate::vector::length(crate::vector::sub(positions[u], positions[vertex]));
            sum += irradiance[u] * medium.r_d(d) * areas[u];
        }
    }
    sum / PI
}

/// max(0, x).
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// A direction of the world in a frame.
fn to_local(frame: [Vec3; 3], direction: Vec3) -> Vec3 {
    [dot(frame[0], direction), dot(frame[1], direction), dot(frame[2], direction)]
}

/// Σ weight · f(direction), `length` items.
fn integrate(length: usize, rule: &Rule, f: impl Fn(Vec3) -> Vec<f64>) -> Vec<f64> {
    let mut sums = vec![0.0; length];
    for (direction, weight) in rule {
        for (sum, term) in sums.iter_mut().zip(f(*direction)) {
            *sum += weight * term;
        }
    }
    sums
}

/// A square or wide matrix by rows, times a vector.
fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix.chunks(vector.len()).map(|row| dot_all(row, vector)).collect()
}

fn dot_all(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (x, y) in a.iter().zip(b) {
        sum += x * y;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing blocks: the clamped cosine has A_l y(n), π, 2π/3, π/4, 0 (Ramamoorthi and Hanrahan 2001).
    #[test]
    fn without_occluders_the_vector_is_the_clamped_cosine() {
        let normal = crate::vector::normalize([1.0, 2.0, -2.0]);
        // The kink at the horizon slows the rule down.
        let found = vector([0.0; 3], normal, 0.5, 4, &sh::sphere_rule(200), &[]);
        let y = sh::eval(4, normal);
        for (i, (a, y)) in found.iter().zip(&y).enumerate() {
            let l = (i as f64).sqrt() as usize;
            let exact = 0.5 * [1.0, 2.0 / 3.0, 0.25, 0.0][l] * y;
            assert!((a - exact).abs() < 1e-4, "{i}: {a} against {exact}");
        }
    }

    /// A wall that covers half of the hemisphere halves the first coefficient, under both readings.
    #[test]
    fn a_wall_hides_half() {
        let wall = [[[0.0, -1e6, -1e6], [0.0, 1e6, -1e6], [0.0, 0.0, 1e6]]]
            .map(|t| t.map(|p: Vec3| [p[0] + 0.01, p[1], p[2]]));
        let rule = sh::sphere_rule(101);
        for reading in [0, 1] {
            let of = |mesh: &[Triangle]| match reading {
                0 => vector([0.0; 3], [0.0, 0.0, 1.0], 1.0, 1, &rule, mesh)[0],
                _ => vector_as_printed([0.0; 3], [0.0, 0.0, 1.0], 1, &rule, mesh)[0],
            };
            assert!((of(&wall) / of(&[]) - 0.5).abs() < 0.02, "{}", of(&wall) / of(&[]));
        }
    }

    /// Lambert's B is the outer product of the hemisphere's coefficients and the cosine's.
    #[test]
    fn a_lambertian_matrix_is_an_outer_product() {
        // An even number of heights: none lies on the horizon.
        let rule = sh::sphere_rule(62);
        let b = brdf_matrix(|_, o| if o[2] > 0.0 { 1.0 / PI } else { 0.0 }, 2, &rule);
        // ∫ y_00 over the hemisphere is √π, that of cos y_00 is √π/2.
        assert!((b[0] - 0.5).abs() < 1e-3, "{}", b[0]);
        assert!(b[1].abs() < 1e-12 && b[3].abs() < 1e-12);
    }
}
