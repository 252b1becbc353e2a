//! Diffuse transfer vectors: the clamped cosine, the error of the sum, and what meshes that are no solids get.

use bitlight::bake::{Directions, Estimate, Reading, vectors, visibility};
use bitlight::sphere::sh;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;

const PI: f64 = std::f64::consts::PI;

/// A sphere: nothing blocks light above the horizon of a convex solid.
fn sphere() -> Mesh {
    shapes::sphere(6).unwrap()
}

/// The coefficients of max(0, n·ω)/π: A_l/π y(n), A_l by the closed form of Ramamoorthi and Hanrahan 2001, Eq. 8.
fn clamped_cosine(bands: usize, normal: Vec3) -> Vec<f64> {
    let mut y = vec![0.0; bands * bands];
    sh::evaluate(bands, normal.as_dvec3().to_array(), &mut y);
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    for l in 0..bands {
        let a = match l {
            0 => PI,
            1 => 2.0 * PI / 3.0,
            _ if l % 2 == 1 => 0.0,
            _ => {
                let sign = if l / 2 % 2 == 1 { 1.0 } else { -1.0 };
                let half = factorial(l / 2);
                2.0 * PI * sign / ((l + 2) as f64 * (l as f64 - 1.0)) * factorial(l)
                    / (2.0_f64.powi(l as i32) * half * half)
            }
        };
        y[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= a / PI);
    }
    y
}

fn rms(found: &[f32], exact: &[f64]) -> f64 {
    let square: f64 = found.iter().zip(exact).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
    square.sqrt()
}

#[test]
fn an_unshadowed_vertex_has_the_clamped_cosines_coefficients() {
    let (mesh, directions) = (sphere(), Directions::new(256));
    let seen = visibility(&mesh, &directions);
    assert!(seen.blocked.iter().all(|word| *word == 0), "a sphere blocks nothing");
    for bands in [1, 2, 3, 4, 5, 6, 10] {
        let found = vectors(&mesh, &directions, &seen, bands, Reading::Corrected, Estimate::Control);
        for (normal, found) in mesh.normals.iter().zip(found.chunks_exact(bands * bands)) {
            for (a, b) in found.iter().zip(clamped_cosine(bands, *normal)) {
                assert!((f64::from(*a) - b).abs() < 1e-6, "{bands} bands: {a} against {b}");
            }
        }
    }
}

/// The quadrature's own error: the largest of a coefficient over 362 normals.
#[test]
fn the_plain_sums_error_falls_with_the_directions() {
    let mesh = sphere();
    for (count, most) in [(128, 9e-3), (512, 3e-3), (2048, 9e-4), (8192, 3e-4)] {
        let directions = Directions::new(count);
        let seen = visibility(&mesh, &directions);
        let found = vectors(&mesh, &directions, &seen, 5, Reading::Corrected, Estimate::Plain);
        let (mut largest, mut total) = (0.0_f64, 0.0);
        for (normal, found) in mesh.normals.iter().zip(found.chunks_exact(25)) {
            let exact = clamped_cosine(5, *normal);
            found.iter().zip(&exact).for_each(|(a, b)| largest = largest.max((f64::from(*a) - b).abs()));
            total += rms(found, &exact).powi(2);
        }
        let mean = (total / (mesh.normals.len() * 25) as f64).sqrt();
        println!("{count:5} directions: a coefficient is off by {mean:.1e} RMS, {largest:.1e} at most");
        assert!(largest < most, "{count} directions: {largest:e}");
    }
}
