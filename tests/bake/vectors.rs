//! Diffuse transfer vectors: the clamped cosine, the error of the sum, and symmetries.

use super::{PI, dot, knot, light, rms};
use bitlight::bake::{Directions, Estimate, vectors, visibility};
use bitlight::keys::Reading;
use bitlight::sphere::rotation::Rotation;
use bitlight::sphere::sh;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::{Mat3, Vec3};

/// A sphere: nothing blocks light above the horizon of a convex solid.
fn sphere() -> Mesh {
    shapes::sphere(6).unwrap()
}

/// y(n), each band times its factor.
fn zonal(bands: usize, normal: Vec3, factor: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut y = vec![0.0; bands * bands];
    sh::evaluate(bands, normal.as_dvec3().to_array(), &mut y);
    for l in 0..bands {
        y[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= factor(l));
    }
    y
}

/// The coefficients of max(0, n·ω)/π: A_l/π y(n), A_l by Ramamoorthi and Hanrahan 2001, Eq. 8.
fn clamped_cosine(bands: usize, normal: Vec3) -> Vec<f64> {
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    zonal(bands, normal, |l| match l {
        0 => 1.0,
        1 => 2.0 / 3.0,
        _ if l % 2 == 1 => 0.0,
        _ => {
            let sign = if l / 2 % 2 == 1 { 1.0 } else { -1.0 };
            let half = factorial(l / 2);
            2.0 * sign / ((l + 2) as f64 * (l as f64 - 1.0)) * factorial(l)
                / (2.0_f64.powi(l as i32) * half * half)
        }
    })
}

/// The coefficients of the hemisphere: 2π ∫₀¹ P_l = 2π (P_{l−1}(0) − P_{l+1}(0)) / (2l + 1).
fn hemisphere(bands: usize, normal: Vec3) -> Vec<f64> {
    let at_zero = |l: usize| match l % 2 {
        1 => 0.0,
        _ => (1..=l / 2).map(|k| -(2.0 * k as f64 - 1.0) / (2.0 * k as f64)).product(),
    };
    zonal(bands, normal, |l| match l {
        0 => 2.0 * PI,
        _ => 2.0 * PI * (at_zero(l - 1) - at_zero(l + 1)) / (2 * l + 1) as f64,
    })
}

#[test]
fn an_unshadowed_vertex_has_the_profiles_coefficients() {
    let (mesh, directions) = (sphere(), Directions::new(256));
    let seen = visibility(&mesh, &directions);
    assert!(seen.blocked.iter().all(|word| *word == 0), "a sphere blocks nothing");
    for bands in [1, 2, 3, 4, 5, 6, 10, 32] {
        for (reading, exact) in [
            (Reading::Corrected, clamped_cosine as fn(usize, Vec3) -> Vec<f64>),
            (Reading::Paper, hemisphere),
        ] {
            let found = vectors(&mesh, &directions, &seen, bands, reading, Estimate::Control);
            for (normal, found) in mesh.normals.iter().zip(found.chunks_exact(bands * bands)) {
                for (a, b) in found.iter().zip(exact(bands, *normal)) {
                    assert!((f64::from(*a) - b).abs() < 1e-6, "{reading:?}, {bands} bands: {a} against {b}");
                }
            }
        }
    }
}

#[test]
fn the_bands_hold_the_known_parts_of_the_clamped_cosines_energy() {
    let (mesh, directions) = (sphere(), Directions::new(64));
    let seen = visibility(&mesh, &directions);
    for (bands, part) in [(1, 37.5), (2, 87.5), (3, 99.22), (4, 99.22), (5, 99.80)] {
        let found = vectors(&mesh, &directions, &seen, bands, Reading::Corrected, Estimate::Control);
        let energy: f64 = found[..bands * bands].iter().map(|t| f64::from(*t).powi(2)).sum();
        // ∫ cos² over the hemisphere is 2π/3.
        let percent = 100.0 * energy * PI * PI / (2.0 * PI / 3.0);
        assert!((percent - part).abs() < 0.005, "{bands} bands hold {percent} %");
    }
}

/// The quadrature's own error over 362 normals, of what is π T, the irradiance's coefficients.
#[test]
fn the_plain_sums_error_falls_with_the_directions() {
    let mesh = sphere();
    for (count, most) in [(128, 1.2e-2), (512, 1.6e-3), (2048, 2.6e-4), (8192, 4e-5)] {
        let directions = Directions::new(count);
        let seen = visibility(&mesh, &directions);
        let found = vectors(&mesh, &directions, &seen, 5, Reading::Corrected, Estimate::Plain);
        let (mut largest, mut square) = (0.0_f64, 0.0);
        for (normal, found) in mesh.normals.iter().zip(found.chunks_exact(25)) {
            for (a, b) in found.iter().zip(clamped_cosine(5, *normal)) {
                let error = PI * (f64::from(*a) - b).abs();
                (largest, square) = (largest.max(error), square + error * error);
            }
        }
        let mean = (square / mesh.normals.len() as f64).sqrt();
        println!(
            "{count:5} directions: a vector is off by {mean:.1e} RMS, a coefficient by {largest:.1e} at most"
        );
        assert!(largest < most, "{count} directions: {largest:e}");
    }
}

/// What shadows leave of the control variate's gain: their edges are most of the error of a concave mesh, and
/// no part of it.
#[test]
fn the_control_variate_is_no_further_than_the_plain_sum() {
    let mesh = knot();
    let of = |count: usize| {
        let directions = Directions::new(count);
        let seen = visibility(&mesh, &directions);
        [Reading::Corrected, Reading::Paper].map(|reading| {
            [Estimate::Plain, Estimate::Control]
                .map(|estimate| vectors(&mesh, &directions, &seen, 5, reading, estimate))
        })
    };
    let exact = of(32_768).map(|[_, control]| control);
    for count in [128, 512, 2048] {
        for (reading, (found, exact)) in ["corrected", "printed"].iter().zip(of(count).iter().zip(&exact)) {
            let [plain, control] = [0, 1].map(|estimate| rms(&found[estimate], exact));
            println!("{reading}, {count:5} directions: {plain:.2e} RMS plain, {control:.2e} with control");
            assert!(control < 1.001 * plain, "{reading}, {count} directions: {control:e} against {plain:e}");
        }
    }
}

#[test]
fn a_white_convex_solid_under_constant_light_shows_that_light() {
    let (mesh, directions) = (shapes::cuboid(Vec3::new(1.0, 2.0, 0.5), 4).unwrap(), Directions::new(512));
    let seen = visibility(&mesh, &directions);
    let found = vectors(&mesh, &directions, &seen, 1, Reading::Corrected, Estimate::Control);
    for (vertex, t) in found.iter().enumerate() {
        let radiance = f64::from(*t) * (4.0 * PI).sqrt();
        assert!((radiance - 1.0).abs() < 1e-6, "vertex {vertex}: {radiance}");
    }
}

#[test]
fn turning_mesh_and_light_together_changes_nothing() {
    let (mesh, directions) = (knot(), Directions::new(8192));
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, -2.0, 0.5).normalize(), 1.1);
    let mut turned = mesh.clone();
    turned.apply(1.0, turn, Vec3::ZERO).unwrap();
    let rows = [0, 1, 2].map(|row| [0, 1, 2].map(|column| f64::from(turn.col(column)[row])));
    let there = Rotation::new(4, rows).unwrap().rotate(&light(4));
    let [a, b] = [&mesh, &turned].map(|mesh| {
        vectors(mesh, &directions, &visibility(mesh, &directions), 4, Reading::Corrected, Estimate::Control)
    });
    for (vertex, (a, b)) in a.chunks_exact(16).zip(b.chunks_exact(16)).enumerate() {
        let (a, b) = (dot(a, &light(4)), dot(b, &there));
        assert!((a - b).abs() < 4e-3, "vertex {vertex}: {a} and {b}");
    }
}

#[test]
fn a_mirrored_mesh_has_mirrored_vectors() {
    let (mesh, directions) = (knot(), Directions::new(8192));
    let mirror = |v: &Vec3| Vec3::new(-v.x, v.y, v.z);
    let mirrored = Mesh::new(
        mesh.positions.iter().map(mirror).collect(),
        Some(mesh.normals.iter().map(mirror).collect()),
        mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect(),
    )
    .unwrap();
    let [a, b] = [&mesh, &mirrored].map(|mesh| {
        vectors(mesh, &directions, &visibility(mesh, &directions), 4, Reading::Corrected, Estimate::Control)
    });
    for (index, (a, b)) in a.iter().zip(&b).enumerate() {
        // x → −x turns φ into π − φ: cos mφ gains (−1)^m, sin |m|φ (−1)^(m+1).
        let function = index % 16;
        let l = function.isqrt();
        let m = function as isize - (l * l + l) as isize;
        let sign = if (m % 2 != 0) ^ (m < 0) { -1.0 } else { 1.0 };
        assert!((a - sign * b).abs() < 4e-3, "vertex {}, function {function}: {a} and {b}", index / 16);
    }
}
