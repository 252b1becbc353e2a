//! Transfer and BRDF matrices: what is known without shadows, and with them by another route.

use super::{PI, knot, light};
use bitlight::bake::{
    Directions, Estimate, Matrices, brdf, frame, matrices, vectors, visibility, visibility_bands,
};
use bitlight::keys::Reading;
use bitlight::sphere::quadrature::gauss_legendre;
use bitlight::sphere::rotation::Rotation;
use bitlight::sphere::sh;
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::shapes;
use glam::Vec3;

const NORMALS: [[f32; 3]; 6] = [
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 0.0, 0.0],
    [0.6, -0.64, -0.48],
    [-0.6, 0.0, 0.8],
    [0.0, -1.0, 0.0],
];

fn y(bands: usize, direction: [f64; 3]) -> Vec<f64> {
    let mut y = vec![0.0; bands * bands];
    sh::evaluate(bands, direction, &mut y);
    y
}

/// A direction of the world in a frame.
fn to_local(frame: [[f64; 3]; 3], d: [f64; 3]) -> [f64; 3] {
    frame.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
}

#[test]
fn frames_are_right_handed_with_the_normal_last() {
    for normal in NORMALS {
        let [t, b, n] = frame(Vec3::from_array(normal)).map(glam::DVec3::from_array);
        assert!((t.cross(b) - n).length() < 1e-14 && (t.length() - 1.0).abs() < 1e-14, "{normal:?}");
        assert!((n - Vec3::from_array(normal).as_dvec3()).length() < 1e-6);
    }
    assert_eq!(frame(Vec3::Z), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
}

#[test]
fn where_all_is_visible_the_matrix_is_the_rotation() {
    for bands in [1, 2, 3, 5, 6, 10] {
        let (functions, wide) = (bands * bands, visibility_bands(bands));
        let mut all = vec![0.0; wide * wide];
        all[0] = (4.0 * PI).sqrt();
        let made = Matrices::new(bands);
        for normal in NORMALS.map(Vec3::from_array) {
            let matrix = made.matrix(&all, normal);
            let rotation = Rotation::new(bands, frame(normal)).unwrap();
            for j in 0..functions {
                let mut one = vec![0.0; functions];
                one[j] = 1.0;
                for (i, entry) in rotation.rotate(&one).into_iter().enumerate() {
                    let found = matrix[i * functions + j];
                    assert!((found - entry).abs() < 1e-12, "{bands} bands, ({i}, {j}): {found} and {entry}");
                }
            }
        }
    }
}

#[test]
fn without_shadows_the_matrix_is_the_hemispheres_turned() {
    let (mesh, directions) = (shapes::sphere(2).unwrap(), Directions::new(128));
    let seen = visibility(&mesh, &directions);
    for bands in [3, 6] {
        let functions = bands * bands;
        let found = matrices(&mesh, &directions, &seen, bands, Estimate::Control, 3..9);
        for (vertex, found) in (3..9).zip(found.chunks_exact(functions * functions)) {
            let rows = frame(mesh.normals[vertex]);
            let mut exact = vec![0.0; functions * functions];
            for (node, weight) in gauss_legendre(16) {
                let z = 0.5 * (node + 1.0);
                let across = (1.0 - z * z).sqrt();
                for azimuth in 0..32 {
                    let phi = 2.0 * PI * f64::from(azimuth) / 32.0;
                    let local = [across * phi.cos(), across * phi.sin(), z];
                    let world = [0, 1, 2].map(|c| (0..3).map(|r| rows[r][c] * local[r]).sum());
                    let (local, world) = (y(bands, local), y(bands, world));
                    for i in 0..functions {
                        for j in 0..functions {
                            exact[i * functions + j] += 0.5 * weight * 2.0 * PI / 32.0 * local[i] * world[j];
                        }
                    }
                }
            }
            for (entry, (a, b)) in found.iter().zip(&exact).enumerate() {
                assert!((f64::from(*a) - b).abs() < 1e-6, "{bands} bands, entry {entry}: {a} and {b}");
            }
        }
    }
}

/// Each entry is the sum over directions that it stands for, though none was summed.
#[test]
fn every_entry_is_its_own_sum_over_directions() {
    let (mesh, directions) = (knot(), Directions::new(300));
    let seen = visibility(&mesh, &directions);
    let bands = 6;
    let vertices = 100..104;
    let found = matrices(&mesh, &directions, &seen, bands, Estimate::Plain, vertices.clone());
    for (vertex, found) in vertices.zip(found.chunks_exact(1296)) {
        let mut exact = vec![0.0; 1296];
        for (index, direction) in directions.exact.iter().enumerate() {
            if seen.of(vertex).0[index / 32] >> (index % 32) & 1 == 1 {
                let local = y(bands, to_local(frame(mesh.normals[vertex]), *direction));
                let world = y(bands, *direction);
                for i in 0..36 {
                    for j in 0..36 {
                        exact[i * 36 + j] += directions.weight() * local[i] * world[j];
                    }
                }
            }
        }
        for (entry, (a, b)) in found.iter().zip(&exact).enumerate() {
            assert!((f64::from(*a) - b).abs() < 1e-6, "vertex {vertex}, entry {entry}: {a} and {b}");
        }
    }
}

/// The cosine is linear in the function (1, 0) of the local frame, so that row of M is the diffuse vector.
#[test]
fn a_row_of_the_matrix_is_the_diffuse_vector() {
    let (mesh, directions) = (knot(), Directions::new(512));
    let seen = visibility(&mesh, &directions);
    let all = 0..mesh.positions.len();
    let found = matrices(&mesh, &directions, &seen, 4, Estimate::Plain, all);
    let diffuse = vectors(&mesh, &directions, &seen, 4, Reading::Corrected, Estimate::Plain);
    let printed = vectors(&mesh, &directions, &seen, 4, Reading::Paper, Estimate::Plain);
    for (vertex, matrix) in found.chunks_exact(256).enumerate() {
        for j in 0..16 {
            let cosine = f64::from(matrix[2 * 16 + j]) * (4.0 * PI / 3.0).sqrt() / PI;
            let expected = f64::from(diffuse[vertex * 16 + j]);
            assert!((cosine - expected).abs() < 1e-6, "vertex {vertex}, {j}: {cosine} and {expected}");
            // Row 0 is the visibility times a constant: the printed vector.
            let constant = f64::from(matrix[j]) * (4.0 * PI).sqrt();
            assert!((constant - f64::from(printed[vertex * 16 + j])).abs() < 2e-6);
        }
    }
}

#[test]
fn a_lambertian_row_is_the_clamped_cosine() {
    let lambert = Brdf { albedo: Vec3::new(0.2, 0.5, 1.0), specular: Vec3::ZERO, gloss: Gloss::None };
    let rows = brdf::rows(&lambert, 4, &[Vec3::Z, Vec3::new(0.6, 0.0, 0.8), -Vec3::Z]);
    for exit in 0..2 {
        for (i, rgb) in rows[exit * 16..(exit + 1) * 16].iter().enumerate() {
            // ρ/π ∫ cos y_i: zonal, A_l √((2l + 1)/4π)
            let exact = match i {
                0 => 0.5 / PI.sqrt(),
                2 => (1.0 / (3.0 * PI)).sqrt(),
                6 => 0.25 * (5.0 / (4.0 * PI)).sqrt(),
                _ => 0.0,
            };
            for (found, albedo) in rgb.iter().zip([0.2, 0.5, 1.0]) {
                assert!((f64::from(*found) - albedo * exact).abs() < 1e-6, "exit {exit}, {i}: {found}");
            }
        }
    }
    assert!(rows[32..].iter().all(|rgb| *rgb == [0.0; 3]), "below the surface nothing leaves");
}

/// Beside a sum over many more directions, close about the mirror direction of the exit, where the lobe is.
#[test]
fn rows_of_sharp_lobes_are_the_integral() {
    let phong = |exponent| Gloss::Phong { exponent };
    let facets = |roughness| Gloss::CookTorrance { roughness };
    for gloss in
        [phong(60.0), phong(1000.0), phong(3000.0), phong(1e4), facets(0.1), facets(0.03), facets(0.01)]
    {
        let brdf = Brdf { albedo: Vec3::ZERO, specular: Vec3::splat(0.9), gloss };
        let mut worst = 0.0_f64;
        for exit in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.8, 0.6]] {
            let row = brdf::rows(&brdf, 3, &[Vec3::from_array(exit.map(|c| c as f32))]);
            let mirror = [-exit[0], -exit[1], exit[2]];
            let across = if exit[0] == 0.0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let beside = bitlight_reference::vector::cross(mirror, across);
            let mut sums = [0.0; 9];
            let (rings, steps) = (2000, 96);
            for ring in 0..rings {
                // Finer towards the middle.
                let share = |ring: f64| PI * (ring / f64::from(rings)).powi(2);
                let (inner, outer) = (share(f64::from(ring)), share(f64::from(ring + 1)));
                let theta = 0.5 * (inner + outer);
                for step in 0..steps {
                    let phi = 2.0 * PI * (f64::from(step) + 0.5) / f64::from(steps);
                    let (x, y) = (theta.sin() * phi.cos(), theta.sin() * phi.sin());
                    let light = [0, 1, 2]
                        .map(|axis| theta.cos() * mirror[axis] + x * across[axis] + y * beside[axis]);
                    let solid_angle = (inner.cos() - outer.cos()) * 2.0 * PI / f64::from(steps);
                    let [i, o] = [light, exit].map(|d| Vec3::from_array(d.map(|c| c as f32)));
                    let value = f64::from(brdf.value(i, o).x) * light[2].max(0.0) * solid_angle;
                    for (sum, basis) in sums.iter_mut().zip(self::y(3, light)) {
                        *sum += value * basis;
                    }
                }
            }
            for (found, sum) in row.iter().zip(sums) {
                worst = worst.max((f64::from(found[0]) - sum).abs());
                assert!((f64::from(found[0]) - sum).abs() < 1e-3, "{gloss:?}, {exit:?}: {found:?} and {sum}");
            }
        }
        println!("{gloss:?}: {worst:.1e}");
    }
}

/// B with more and more bands gives the radiance towards an exit that a sum over the light's directions
/// gives.
#[test]
fn a_row_times_the_matrix_shades_as_the_sum_over_directions_does() {
    let (mesh, directions) = (knot(), Directions::new(2048));
    let seen = visibility(&mesh, &directions);
    let glossy = Brdf {
        albedo: Vec3::new(0.3, 0.1, 0.0),
        specular: Vec3::new(0.2, 0.4, 0.6),
        gloss: Gloss::Phong { exponent: 6.0 },
    };
    let exit = Vec3::new(0.48, 0.36, 0.8);
    let coefficients = light(3);
    let mut errors = Vec::new();
    for bands in [3, 5, 8] {
        let functions = bands * bands;
        let row = brdf::rows(&glossy, bands, &[exit]);
        let found = matrices(&mesh, &directions, &seen, bands, Estimate::Plain, 0..40);
        let mut largest = 0.0_f64;
        for (vertex, matrix) in found.chunks_exact(functions * functions).enumerate() {
            let mut exact = glam::DVec3::ZERO;
            for (index, direction) in directions.exact.iter().enumerate() {
                if seen.of(vertex).0[index / 32] >> (index % 32) & 1 == 1 {
                    let local = to_local(frame(mesh.normals[vertex]), *direction);
                    let radiance: f64 = y(3, *direction).iter().zip(&coefficients).map(|(y, l)| y * l).sum();
                    let value = glossy.value(Vec3::from_array(local.map(|c| c as f32)), exit).as_dvec3();
                    exact += value * (local[2] * radiance * directions.weight());
                }
            }
            for channel in 0..3 {
                let radiance: f64 = (0..functions)
                    .map(|i| {
                        let arriving: f64 =
                            (0..9).map(|j| f64::from(matrix[i * functions + j]) * coefficients[j]).sum();
                        f64::from(row[i][channel]) * arriving
                    })
                    .sum();
                largest = largest.max((radiance - exact[channel]).abs());
            }
        }
        errors.push(largest);
    }
    println!("largest error with 3, 5 and 8 bands of the local frame: {errors:?}");
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 2e-3, "{errors:?}");
}

/// A turn about the normal of light and exit together changes nothing, so B couples equal orders alone; and
/// it is as the double sum has it.
#[test]
fn the_brdf_matrix_is_the_double_integral() {
    let glossy = Brdf {
        albedo: Vec3::new(0.3, 0.1, 0.0),
        specular: Vec3::new(0.2, 0.4, 0.6),
        gloss: Gloss::Phong { exponent: 6.0 },
    };
    let found = brdf::matrix(&glossy, 3);
    for channel in 0..3 {
        let value = |i: [f64; 3], o: [f64; 3]| {
            let [i, o] = [i, o].map(|d| Vec3::from_array(d.map(|c| c as f32)));
            f64::from(glossy.value(i, o)[channel])
        };
        let mut hemisphere = Vec::new();
        for (node, weight) in gauss_legendre(24) {
            let z = 0.5 * (node + 1.0);
            let across = (1.0 - z * z).sqrt();
            for azimuth in 0..32 {
                let phi = 2.0 * PI * (f64::from(azimuth) + 0.25) / 32.0;
                hemisphere
                    .push(([across * phi.cos(), across * phi.sin(), z], 0.5 * weight * 2.0 * PI / 32.0));
            }
        }
        let exact = bitlight_reference::transfer::brdf_matrix(value, 3, &hemisphere);
        for (entry, (a, b)) in found.iter().zip(&exact).enumerate() {
            assert!(
                (f64::from(a[channel]) - b).abs() < 2e-4,
                "channel {channel}, {entry}: {} and {b}",
                a[channel]
            );
        }
    }
}
