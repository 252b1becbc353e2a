//! Transfer against truth: diffuse shading by vectors beside the path tracer at the same vertices.
//!
//! Under the very light that is projected, n bands of it, nothing is truncated: what differs is the tracer's
//! noise, whose variance is known and taken off, and the sum over directions. Under the whole map the bands
//! that are left out are added.

use super::{PI, dot, knot};
use bitlight::bake::{Directions, Estimate, Visibility, vectors};
use bitlight::keys::Reading;
use bitlight::numeric::random::Sample;
use bitlight::sphere::environment::LatLong;
use bitlight::store::file;
use bitlight::trace::bundle;
use bitlight::truth::{Estimator, Lights, Map, Model, Normals, Sky, Sums};
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::mesh::Mesh;
use glam::Vec3;

/// Vectors of some vertices, `[vertices][bands²]`.
fn some_vectors(mesh: &Mesh, vertices: &[usize], count: usize, bands: usize) -> Vec<f32> {
    let directions = Directions::new(count);
    let pick = |of: &[Vec3]| vertices.iter().map(|vertex| of[*vertex]).collect::<Vec<_>>();
    let (positions, normals) = (pick(&mesh.positions), pick(&mesh.normals));
    let bits = bundle::visibility(mesh, &positions, &normals, &directions.rays);
    // A mesh of these vertices alone, each used: what is above their horizons and not visible is blocked.
    let triangles = (0..vertices.len() as u32).map(|vertex| [vertex, 0, 1]).collect();
    let points = Mesh::new(positions, Some(normals), triangles).unwrap();
    let seen = Visibility::from_bits(&points, &directions, bits);
    vectors(&points, &directions, &seen, bands, Reading::Corrected, Estimate::Control)
}

/// Mean radiance of the truth at some vertices and the variance of each mean, RGB.
fn truth(mesh: &Mesh, vertices: &[usize], environment: Sky, samples: u64) -> Vec<[[f64; 3]; 2]> {
    let brdf = Brdf { albedo: Vec3::ONE, specular: Vec3::ZERO, gloss: Gloss::None };
    let model = Model::Surface { brdf, bounces: Some(1), normals: Normals::Interpolated };
    let lights = Lights { lamps: Vec::new(), skies: vec![environment], draw: true };
    let scene = Estimator::new(mesh.clone(), model, lights);
    let mut sums = Sums::new(vertices.len());
    let of = |element: usize| {
        let (position, normal) = (mesh.positions[vertices[element]], mesh.normals[vertices[element]]);
        let scene = &scene;
        move |random: &mut Sample| scene.leaving(position, normal, normal, random)
    };
    sums.advance(samples, of, &mut |_| {});
    (0..vertices.len()).map(|element| [sums.mean(element), sums.variance(element)]).collect()
}

/// The RMS difference over vertices and channels as a part of the mean radiance, its noise taken off; and the
/// noise.
fn difference(vectors: &[f32], light: &[[f32; 3]], truth: &[[[f64; 3]; 2]]) -> (f64, f64) {
    let (mut square, mut noise, mut mean) = (0.0, 0.0, 0.0);
    for (vector, [radiance, variance]) in vectors.chunks_exact(light.len()).zip(truth) {
        for channel in 0..3 {
            let light: Vec<f64> = light.iter().map(|rgb| f64::from(rgb[channel])).collect();
            square += (dot(vector, &light) - radiance[channel]).powi(2);
            noise += variance[channel];
            mean += radiance[channel];
        }
    }
    let count = (3 * truth.len()) as f64;
    let mean = mean / count;
    ((square - noise).max(0.0).sqrt() / count.sqrt() / mean, (noise / count).sqrt() / mean)
}

/// Both charts of a mesh: errors under 4 projected bands for each number of directions, and under the map for
/// 1 to 6 bands.
fn chart(mesh: &Mesh, vertices: &[usize], map: &LatLong, counts: &[usize], samples: u64) -> [Vec<f64>; 2] {
    let light = map.project(4);
    let harmonics = Sky::Harmonics { bands: 4, coefficients: light.clone() };
    let exact = truth(mesh, vertices, harmonics, samples);
    let mut by_directions = Vec::new();
    for count in counts {
        let (error, noise) = difference(&some_vectors(mesh, vertices, *count, 4), &light, &exact);
        println!(
            "4 bands of light, {count:5} directions: {:.3} % RMS, noise {:.3} %",
            100.0 * error,
            100.0 * noise
        );
        by_directions.push(error);
    }
    let exact = truth(mesh, vertices, Sky::Map(Map::new(map.clone(), 1.0)), samples);
    let mut by_bands = Vec::new();
    for bands in 1..=6 {
        let found = some_vectors(mesh, vertices, counts[counts.len() - 1], bands);
        let (error, noise) = difference(&found, &map.project(bands), &exact);
        println!("the whole map, {bands} bands: {:.2} % RMS, noise {:.2} %", 100.0 * error, 100.0 * noise);
        by_bands.push(error);
    }
    [by_directions, by_bands]
}

/// A dim sky with a broad sun.
fn sky() -> LatLong {
    let (width, height) = (64, 32);
    let texel = |i: usize| {
        let theta = PI * ((i / width) as f64 + 0.5) / height as f64;
        let phi = 2.0 * PI * ((i % width) as f64 + 0.5) / width as f64;
        let towards = theta.sin() * phi.cos() * 0.6 + theta.cos() * 0.8;
        let sun = if towards > 0.95 { 20.0 } else { 0.0 };
        Vec3::new(0.5 + sun as f32, 0.6 + 0.8 * sun as f32, 0.6 + 0.5 * theta.cos() as f32 + 0.5 * sun as f32)
    };
    LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap()
}

#[test]
fn vectors_shade_as_the_path_tracer_does() {
    let mesh = knot();
    let vertices: Vec<usize> = (0..mesh.positions.len()).step_by(8).collect();
    let [by_directions, by_bands] = chart(&mesh, &vertices, &sky(), &[64, 256, 1024], 8192);
    // Each fourfold number of directions takes half of the error or more, until the noise hides it.
    assert!(by_directions[1] < 0.6 * by_directions[0] && by_directions[2] < 0.01, "{by_directions:?}");
    // A diffuse surface hardly sees the fourth band and the sixth.
    assert!(by_bands[1] < 0.6 * by_bands[0] && by_bands[2] < 0.6 * by_bands[1], "{by_bands:?}");
    assert!(by_bands[5] < by_bands[2], "{by_bands:?}");
}

/// The same of a scan under a probe:
/// `BITLIGHT_MESH=… BITLIGHT_MAP=… cargo test --release --test bake -- --ignored --nocapture a_scan`, an OBJ
/// and a Radiance file.
#[test]
#[ignore = "needs files, and minutes"]
fn a_scan_under_a_probe() {
    let [mesh, map] = ["BITLIGHT_MESH", "BITLIGHT_MAP"].map(|name| std::env::var(name).expect(name));
    let mesh = file::read_obj(mesh).unwrap();
    let map = file::read_hdr(map).unwrap();
    let step = mesh.positions.len() / 200;
    let vertices: Vec<usize> = (0..mesh.positions.len()).step_by(step).collect();
    chart(&mesh, &vertices, &map, &[128, 256, 512, 1024, 2048, 4096], 65_536);
}
