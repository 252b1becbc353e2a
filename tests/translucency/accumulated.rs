//! The accumulation step and its lookup: transmit, projection, matrices, radiosity.

use bitlight_reference::translucency::cube::{FACES, texel_direction, texel_solid_angle};
use bitlight_reference::translucency::optics::schlick_transmittance;
use bitlight_reference::translucency::{
    CubemapSample, EQ11_CONSTANTS_AS_PRINTED, eq6_project_samples, eq10_radiosity, eq11_constants,
    eq11_matrix, eq11_matrix_as_printed,
};

use crate::oracle::Drawn;
use crate::world::{Rendered, all};
use crate::{U, Worst, larger};

/// Schlick's transmittance at the recorded cosine times the recorded irradiance. 1 − (F₀ + (1 − F₀) m⁵) has
/// some eight roundings of numbers up to 1.
#[test]
fn transmit() {
    for scene in all() {
        let (cubemap, transmit) = (scene.buffer("cubemap"), scene.buffer("transmit"));
        assert_eq!(transmit.shape[..4], cubemap.shape[..4]);
        let mut worst = Worst::new(format!("transmit of {}", scene.name));
        for (index, texel) in cubemap.as_f32().chunks_exact(4).enumerate() {
            let transmittance = schlick_transmittance(scene.world.eta, f64::from(texel[3]));
            for channel in 0..3 {
                let irradiance = f64::from(texel[channel]);
                let found = transmit.as_f32()[index * 3 + channel];
                worst.check(
                    found,
                    transmittance * irradiance,
                    8.0 * U * irradiance,
                    transmit.place(index * 3),
                );
            }
        }
        worst.done(1000);
    }
}

/// Eq. 6 over all texels; to the letter of Eq. 9 the functions with m < 0 have the other sign (T2). Both sums
/// are in f64, so the only rounding is that of the result.
#[test]
fn projection() {
    for scene in all() {
        let (transmit, size) = (scene.buffer("transmit"), scene.world.cubemap);
        assert_eq!(scene.buffer("projection").shape, [scene.world.lamps.len(), 9, 3]);
        let mut worst = Worst::new(format!("projection of {}", scene.name));
        for light in 0..scene.world.lamps.len() {
            for channel in 0..3 {
                let mut samples = Vec::new();
                let mut texels = transmit.slice(light).chunks_exact(3);
                for face in FACES {
                    for (row, column) in (0..size as u32).flat_map(|j| (0..size as u32).map(move |i| (j, i)))
                    {
                        samples.push(CubemapSample {
                            direction: texel_direction(face, size as u32, column, row),
                            solid_angle: texel_solid_angle(size as u32, column, row),
                            irradiance: f64::from(texels.next().unwrap()[channel]),
                        });
                    }
                }
                let magnitude: f64 =
                    samples.iter().map(|sample| sample.irradiance * sample.solid_angle).sum();
                for (i, mut expected) in eq6_project_samples(3, &samples).into_iter().enumerate() {
                    if scene.world.paper && [1, 4, 5].contains(&i) {
                        expected = -expected;
                    }
                    let found = scene.buffer("projection").slice(light)[i * 3 + channel];
                    let tolerance = 1.001 * U * expected.abs() + 1e-14 * magnitude;
                    worst.check(found, expected, tolerance, (light, i, channel));
                }
            }
        }
        worst.done(100);
    }
}

/// Eq. 11 with the constants of their definitions, or as printed (T1, T9). An entry is a rounded constant
/// times a coefficient, or two of these.
#[test]
fn matrices() {
    for scene in all() {
        let (projection, matrices) = (scene.buffer("projection"), scene.buffer("matrices"));
        assert_eq!(matrices.shape, [scene.world.lamps.len(), 3, 4, 4]);
        let mut worst = Worst::new(format!("matrices of {}", scene.name));
        for light in 0..scene.world.lamps.len() {
            for channel in 0..3 {
                let e: [f64; 9] =
                    std::array::from_fn(|i| f64::from(projection.slice(light)[i * 3 + channel]));
                let c = eq11_constants();
                let expected = match scene.world.paper {
                    true => eq11_matrix_as_printed(&e, &EQ11_CONSTANTS_AS_PRINTED),
                    false => eq11_matrix(&e, &c),
                };
                for (entry, found) in matrices.slice(light)[channel * 16..][..16].iter().enumerate() {
                    let expected = expected[entry / 4][entry % 4];
                    let terms =
                        if entry == 15 { c[3] * e[0].abs() + c[4] * e[6].abs() } else { expected.abs() };
                    worst.check(*found, expected, 3.0 * U * terms, (light, channel, entry));
                }
            }
        }
        worst.done(100);
    }
}

/// Eq. 10 where the refracted ray leaves the box; to the letter it may be negative. The refracted direction
/// is exact to some [`U`] in each component and the point of exit to some [`U`] of the box: the tolerance is
/// what that changes, and the rounding of a sum of sixteen. At vertices it is that of the three corners, and
/// what the rounding of the place on the triangle changes of their mean.
#[test]
fn radiosity() {
    for scene in all() {
        let mut worst = Worst::new(format!("radiosity of {}", scene.name));
        let mut lit = 0;
        let (width, drawn) = (scene.world.camera.size[0], Drawn::new(&scene.world, &scene.world.camera));
        for light in 0..scene.world.lamps.len() {
            let matrices = scene.buffer("matrices").slice(light);
            for index in 0..scene.pixels() {
                let found = &scene.buffer("radiosity").slice(light)[index * 3..][..3];
                let Some((point, normal)) = scene.pixel(index) else {
                    assert_eq!(found, [0.0; 3]);
                    continue;
                };
                for channel in 0..3 {
                    let entries = &matrices[channel * 16..][..16];
                    let matrix: [[f64; 4]; 4] =
                        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(entries[i * 4 + j])));
                    let (expected, tolerance) = match scene.world.per_vertex {
                        true => {
                            let triangle = scene.buffer("vbuffer").as_u32()[index] as usize;
                            let place = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
                            let at = |point, normal| radiosity_at(scene, &matrix, point, normal);
                            interpolated(scene, &drawn, at, triangle, place)
                        }
                        false => radiosity_at(scene, &matrix, point, normal),
                    };
                    lit += usize::from(expected > 0.0);
                    worst.check(found[channel], expected, tolerance, (light, index, channel));
                }
            }
        }
        assert!(lit > 1000, "{}: {lit}", scene.name);
        worst.done(1000);
    }
}

fn radiosity_at(scene: &Rendered, matrix: &[[f64; 4]; 4], point: [f64; 3], normal: [f64; 3]) -> (f64, f64) {
    let bounds = &scene.world.viewed;
    let r = scene.world.refracted(point, normal);
    // Without the cure of fig. 7a every ray starts in the centre.
    let from = |point| if scene.world.shift_cure { point } else { bounds.centre() };
    let at = |point, r| eq10_radiosity(matrix, bounds.lookup_direction(from(point), r));
    let here = at(point, r);
    let terms: f64 = matrix.iter().flatten().map(|entry| entry.abs()).sum();
    let mut tolerance = 16.0 * U * terms;
    for axis in 0..3 {
        let mut turned = r;
        turned[axis] += 8.0 * U;
        tolerance += (at(point, turned) - here).abs();
        let mut moved = point;
        moved[axis] += 4.0 * U * larger(bounds.max[axis].abs(), bounds.min[axis].abs());
        tolerance += (at(moved, r) - here).abs();
    }
    (if scene.world.paper { here } else { larger(here, 0.0) }, tolerance)
}

/// The radiosity of a triangle's corners at a place of the image, with its tolerance; `at` gives both at a
/// corner.
pub(crate) fn interpolated(
    scene: &Rendered,
    drawn: &Drawn<'_>,
    at: impl Fn([f64; 3], [f64; 3]) -> (f64, f64),
    triangle: usize,
    (x, y): (f64, f64),
) -> (f64, f64) {
    let (corners, normals) = (&scene.world.triangles[triangle], &scene.world.normals[triangle]);
    let at_corner = [0, 1, 2].map(|i| at(corners[i], normals[i]));
    let mean = |x: f64, y: f64, held: bool| {
        let shares = drawn.shares(triangle, x, y, held);
        let sum = |of: [f64; 3]| shares[0] * of[0] + shares[1] * of[1] + shares[2] * of[2];
        (sum(at_corner.map(|corner| corner.0)), sum(at_corner.map(|corner| corner.1)))
    };
    let ((expected, tolerance), step) = (mean(x, y, true), 1e-3);
    let moved = scene.world.camera.rounding(drawn.surface(triangle, x, y, true).0) / step;
    let here = mean(x, y, false).0;
    let spread = (mean(x + step, y, false).0 - here).abs() + (mean(x, y + step, false).0 - here).abs();
    let size: f64 = at_corner.iter().map(|corner| corner.0.abs()).sum();
    (expected, tolerance + spread * moved + 8.0 * U * size)
}

/// Fig. 6: where a pixel's centre is a vertex the two evaluations agree; elsewhere they differ. The camera is
/// placed so that the vertices of the front fall on every second pixel.
#[test]
fn per_vertex_is_per_pixel_at_the_vertices() {
    let text = r#"
technique = "translucency"
unit = "mm"
image = { width = 33, height = 33 }
camera = { position = [0, 0, 17.5], fov = 90 }
solid = { shape = "cuboid", resolution = 4, extents = [8, 8, 2] }
[[light]]
kind = "point"
position = [-12, 9, -14]
intensity = [900, 900, 900]
"#;
    let pixel = Rendered::new("per pixel", text, &[]);
    let vertex = Rendered::new("per vertex", text, &["translucency.evaluation=vertex"]);
    let (a, b) = (pixel.buffer("radiosity").as_f32(), vertex.buffer("radiosity").as_f32());
    let mut at_vertices = Worst::new("radiosity at vertices");
    let (mut between, mut most) = (0.0, 0.0);
    for index in (0..pixel.pixels()).filter(|index| pixel.pixel(*index).is_some()) {
        let (found, expected) = (b[index * 3], f64::from(a[index * 3]));
        most = larger(most, expected);
        // Millimetres from the middle, which is a vertex.
        if (index % 33).is_multiple_of(2) && (index / 33).is_multiple_of(2) {
            at_vertices.check(found, expected, 64.0 * U * expected, (index % 33, index / 33));
        } else {
            between = larger(between, (f64::from(found) - expected).abs());
        }
    }
    eprintln!("between vertices they differ by up to {:.1e} of the brightest", between / most);
    assert!(between > 1e-3 * most, "{between} of {most}");
    at_vertices.done(16);
}
