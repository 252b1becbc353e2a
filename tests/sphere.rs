//! Contracts of `bitlight::sphere` over its public interface, against the independent equations of
//! `bitlight-reference`.

use bitlight::numeric::double::{cos, sin};
use bitlight::sphere::environment::LatLong;
use bitlight::sphere::probes::PROBES;
use bitlight::sphere::{irradiance, quadrature, sh};
use bitlight::store::file;
use bitlight_reference::{sh as reference, translucency};
use glam::Vec3;
use std::f64::consts::PI;
use std::io::Write;
use std::path::PathBuf;

fn basis(bands: usize, direction: [f64; 3]) -> Vec<f64> {
    let mut values = vec![0.0; bands * bands];
    sh::evaluate(bands, direction, &mut values);
    values
}

/// The path of an asset, or `None` with a line that says why the test is skipped: past the harness, which
/// would keep what a passing test prints to itself.
fn asset(name: &str) -> Option<PathBuf> {
    let mut screen = std::io::stderr();
    let Some(folder) = std::env::var_os("BITLIGHT_ASSETS") else {
        writeln!(screen, "skipped: BITLIGHT_ASSETS is not set, so there is no {name}").unwrap();
        return None;
    };
    let path = PathBuf::from(folder).join(name);
    if !path.is_file() {
        writeln!(screen, "skipped: there is no {}", path.display()).unwrap();
        return None;
    }
    Some(path)
}

/// Unit directions in f32: a cover of the sphere, with the axes and their neighbourhood.
fn directions() -> Vec<Vec3> {
    let mut list: Vec<Vec3> =
        quadrature::fibonacci(20_000).iter().map(|d| Vec3::from_array(d.map(|c| c as f32))).collect();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for near in [Vec3::ZERO, Vec3::ONE * 1e-20, Vec3::ONE * 1e-6, Vec3::new(1e-3, -1e-5, 1e-4)] {
            list.extend([(axis + near).normalize(), (near - axis).normalize()]);
        }
    }
    list
}

#[test]
fn basis_is_orthonormal_to_ten_bands() {
    let mut gram = vec![0.0; 100 * 100];
    for (direction, weight) in quadrature::product(18) {
        let values = basis(10, direction);
        for (i, a) in values.iter().enumerate() {
            for (j, b) in values.iter().enumerate() {
                gram[i * 100 + j] += weight * a * b;
            }
        }
    }
    for (at, entry) in gram.iter().enumerate() {
        let expected = if at / 100 == at % 100 { 1.0 } else { 0.0 };
        assert!((entry - expected).abs() < 1e-12, "({}, {}): {entry}", at / 100, at % 100);
    }
}

#[test]
fn basis_is_the_textbook_recurrence() {
    for direction in quadrature::fibonacci(1000).into_iter().chain([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]) {
        for (bands, tolerance) in [(10, 1e-13), (sh::MAX_BANDS, 1e-11)] {
            for (i, (a, b)) in
                basis(bands, direction).iter().zip(reference::eval(bands as u32, direction)).enumerate()
            {
                assert!((a - b).abs() < tolerance, "function {i} at {direction:?}: {a} against {b}");
            }
        }
    }
}

#[test]
fn fast_basis_is_the_textbook_recurrence() {
    for direction in directions() {
        let mut fast = [0.0; 36];
        sh::evaluate_fast(6, direction, &mut fast);
        // The textbook takes a unit vector, which one in f32 is only to 1e-7; the difference grows with l.
        let d = direction.to_array().map(f64::from);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let exact = reference::eval(6, d.map(|c| c / length));
        for (i, (a, b)) in fast.iter().zip(exact).enumerate() {
            assert!((f64::from(*a) - b).abs() < 1e-6, "function {i} at {direction}: {a} against {b}");
        }
    }
}

/// Nine coefficients, to five decimals, of the light of Green 2003 that fur is lit with.
#[test]
fn light_of_green_has_the_known_coefficients() {
    let light = |[x, y, z]: [f64; 3]| {
        // max(0, 5 cos θ − 4) + max(0, −4 sin(θ − π) cos(φ − 2.5) − 3)
        let toward = x * cos(2.5) + y * sin(2.5);
        let (sky, lamp) = (5.0 * z - 4.0, 4.0 * toward - 3.0);
        (if sky > 0.0 { sky } else { 0.0 }) + (if lamp > 0.0 { lamp } else { 0.0 })
    };
    let directions = quadrature::fibonacci(1 << 20);
    let mut coefficients = [0.0; 9];
    for d in &directions {
        let radiance = light(*d);
        for (c, y) in coefficients.iter_mut().zip(basis(3, *d)) {
            *c += 4.0 * PI / directions.len() as f64 * radiance * y;
        }
    }
    let known = [0.39880, 0.21052, 0.28653, -0.28182, -0.31499, 0.0, 0.13138, 0.0, 0.09318];
    for (c, k) in coefficients.iter().zip(known) {
        assert!((c - k).abs() < 1e-5, "{coefficients:?}");
    }
}

/// A map with a sun and a gradient.
fn synthetic(width: usize, height: usize) -> LatLong {
    let texel = |i: usize| {
        let (u, v) = ((i % width) as f32 / width as f32, (i / width) as f32 / height as f32);
        let sun = if (u - 0.3).abs() < 0.02 && (v - 0.2).abs() < 0.04 { 1000.0 } else { 0.0 };
        Vec3::new(sun + v, sun + u * v, 0.25 + u)
    };
    LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap()
}

/// The projection as a plain sum in f64 with the textbook's basis.
fn plain_projection(map: &LatLong, bands: usize) -> Vec<[f64; 3]> {
    let cosine = |edge: usize| cos(PI * edge as f64 / map.height() as f64);
    let mut sums = vec![[0.0; 3]; bands * bands];
    for row in 0..map.height() {
        let solid_angle = 2.0 * PI / map.width() as f64 * (cosine(row) - cosine(row + 1));
        for column in 0..map.width() {
            let theta = PI * (row as f64 + 0.5) / map.height() as f64;
            let phi = 2.0 * PI * (column as f64 + 0.5) / map.width() as f64;
            let direction = [sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)];
            let rgb = map.texels()[row * map.width() + column].to_array();
            for (sum, y) in sums.iter_mut().zip(reference::eval(bands as u32, direction)) {
                for channel in 0..3 {
                    sum[channel] += f64::from(rgb[channel]) * solid_angle * y;
                }
            }
        }
    }
    sums
}

fn assert_projects_as_the_plain_sum(map: &LatLong, bands: usize) {
    let plain = plain_projection(map, bands);
    let size = plain[0].iter().fold(0.0, |sum, c| sum + c);
    for (i, (a, b)) in map.project(bands).iter().zip(&plain).enumerate() {
        for channel in 0..3 {
            let (a, b) = (f64::from(a[channel]), b[channel]);
            // Coefficients that vanish are rounding alone.
            assert!(
                (a - b).abs() <= 1e-5 * b.abs() + 1e-13 * size,
                "function {i}, channel {channel}: {a} against {b}"
            );
        }
    }
}

#[test]
fn projection_is_the_plain_sum() {
    assert_projects_as_the_plain_sum(&synthetic(62, 31), 6);
}

#[test]
fn grace_projects_as_the_plain_sum() {
    let Some(path) = asset("envmaps/grace.hdr") else { return };
    let map = file::read_hdr(path).unwrap();
    assert_eq!((map.width(), map.height()), (256, 128));
    assert_projects_as_the_plain_sum(&map, 5);
}

/// What evaluating the basis at texel centres costs: the map against itself with every texel split in 8 × 8.
#[test]
fn texel_centres_cost_what_is_stated() {
    let Some(path) = asset("envmaps/grace.hdr") else { return };
    let map = file::read_hdr(path).unwrap();
    let (width, height) = (8 * map.width(), 8 * map.height());
    let split = (0..width * height).map(|i| map.texels()[i / width / 8 * map.width() + i % width / 8]);
    let exact = LatLong::new(width, height, split.collect()).unwrap().project(6);
    let found = map.project(6);
    let step = PI / map.height() as f64;
    for l in 0..6_usize {
        let band = l * l..(l + 1) * (l + 1);
        for channel in 0..3 {
            let difference = |i: usize| f64::from(found[i][channel]) - f64::from(exact[i][channel]);
            let error = band.clone().map(|i| difference(i) * difference(i)).fold(0.0, |a, b| a + b).sqrt();
            let stated = (l * (l + 1)) as f64 * step * step / 8.0 * f64::from(exact[0][channel]);
            assert!(error <= stated + 1e-6, "band {l}: {error} against {stated}");
        }
    }
}

#[cfg(feature = "threads")]
#[test]
fn projection_has_the_same_bits_on_any_number_of_threads() {
    let map = synthetic(128, 77);
    let bits = |threads| {
        let coefficients = bitlight::numeric::parallel::with_threads(threads, || map.project(6)).unwrap();
        coefficients.as_flattened().iter().map(|c| c.to_bits()).collect::<Vec<_>>()
    };
    for threads in [2, 3, 7] {
        assert_eq!(bits(1), bits(threads), "{threads} threads");
    }
}

#[test]
fn irradiance_is_the_corrected_quadratic_form() {
    for (name, probe) in &PROBES {
        for (channel, matrix) in irradiance::matrix(probe).iter().enumerate() {
            let coefficients = probe.map(|rgb| f64::from(rgb[channel]));
            let exact = translucency::eq11_matrix(&coefficients, &translucency::eq11_constants());
            for direction in directions().into_iter().step_by(37) {
                let radiosity = translucency::eq10_radiosity(&exact, direction.to_array().map(f64::from));
                let found = f64::from(irradiance::evaluate(matrix, direction));
                assert!((found - radiosity).abs() < 1e-6, "{name}: {found} against {radiosity}");
            }
        }
    }
}

/// The root mean square over all normals, alike likely, of the difference of two irradiances, over the
/// first's mean; the rule is exact for the square of a form of second degree.
fn relative_rms(truth: &[[f32; 4]; 4], other: &[[f32; 4]; 4]) -> f64 {
    let (mut mean, mut square) = (0.0, 0.0);
    for (normal, weight) in quadrature::product(4) {
        let normal = Vec3::from_array(normal.map(|c| c as f32));
        let of = |matrix| f64::from(irradiance::evaluate(matrix, normal));
        mean += weight / (4.0 * PI) * of(truth);
        square += weight / (4.0 * PI) * (of(other) - of(truth)) * (of(other) - of(truth));
    }
    square.sqrt() / mean
}

/// On the red of the published Grace probe T1's misprint changes irradiance by 28 % of its mean, T2's letter
/// by 69 %, and T9's constants by 10⁻⁶.
#[test]
fn the_letter_changes_the_irradiance_of_grace_as_published() {
    let grace = &PROBES.iter().find(|(name, _)| name.eq_ignore_ascii_case("grace")).unwrap().1;
    let (truth, printed) = (irradiance::matrix(grace)[0], irradiance::matrix_as_printed(grace)[0]);
    let error = relative_rms(&truth, &printed);
    assert!((error - 0.2784).abs() < 5e-5, "T1 and T9: {error}");
    let mut row = printed;
    row[3] = truth[3];
    let error = relative_rms(&truth, &row);
    assert!((1e-7..3e-6).contains(&error), "T9: {error}");

    // The probe's radiance projected anew, by the corrected basis and by the letter's.
    for (evaluate, expected) in
        [(sh::evaluate as fn(usize, [f64; 3], &mut [f64]), 0.0), (sh::evaluate_as_printed, 0.6914)]
    {
        let mut projected = [[0.0_f64; 3]; 9];
        for (direction, weight) in quadrature::product(4) {
            let corrected = basis(3, direction);
            let mut values = [0.0; 9];
            evaluate(3, direction, &mut values);
            for channel in 0..3 {
                let terms = corrected.iter().zip(grace).map(|(y, e)| y * f64::from(e[channel]));
                let radiance = terms.fold(0.0, |sum, term| sum + term);
                for (coefficient, y) in projected.iter_mut().zip(values) {
                    coefficient[channel] += weight * radiance * y;
                }
            }
        }
        let error = relative_rms(&truth, &irradiance::matrix(&projected.map(|rgb| rgb.map(|c| c as f32)))[0]);
        assert!((error - expected).abs() < 5e-5, "T2: {error} for {expected}");
    }
}

/// A map's irradiance through nine coefficients stays within 9 % of its peak of the cosine sum over the
/// texels (the maximum that Ramamoorthi and Hanrahan 2001 give).
#[test]
fn irradiance_of_a_map_is_near_the_sum_over_its_texels() {
    let map = synthetic(64, 32);
    let matrices = irradiance::matrix(map.project(3)[..].try_into().unwrap());
    let (mut worst, mut peak) = (Vec3::ZERO, Vec3::ZERO);
    for normal in quadrature::fibonacci(100) {
        let normal = Vec3::from_array(normal.map(|c| c as f32));
        let mut sum = Vec3::ZERO;
        for row in 0..32 {
            for column in 0..64 {
                let cosine = Vec3::from_array(map.direction(column, row).map(|c| c as f32)).dot(normal);
                if cosine > 0.0 {
                    sum += map.texels()[row * 64 + column] * cosine * map.solid_angle(row) as f32;
                }
            }
        }
        let found = Vec3::from_array(matrices.map(|m| irradiance::evaluate(&m, normal)));
        worst = worst.max((found - sum).abs());
        peak = peak.max(sum);
    }
    assert!((worst / peak).max_element() < 0.09, "{worst} of {peak}");
}
