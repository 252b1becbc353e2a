//! Reflected light: closed rooms, white objects, form factors, lights, and two ways of drawing.

use crate::{LEVEL, agrees, estimate, square};
use bitlight::numeric::random::Sample;
use bitlight::sphere::environment::LatLong;
use bitlight::sphere::irradiance;
use bitlight::trace::Ray;
use bitlight::truth::{Estimator, Lamp, Lights, Map, Model, Normals, Sky, Sums};
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;

fn diffuse(albedo: Vec3) -> Brdf {
    Brdf { albedo, specular: Vec3::ZERO, gloss: Gloss::None }
}

fn surface(mesh: Mesh, brdf: Brdf, bounces: Option<u32>, lights: Lights) -> Estimator {
    Estimator::new(mesh, Model::Surface { brdf, bounces, normals: Normals::Face }, lights)
}

fn under(environment: Sky) -> Lights {
    Lights { skies: vec![environment], ..Lights::default() }
}

fn knot() -> Mesh {
    shapes::torus_knot(2, 3, 0.35, 100, 12).unwrap()
}

/// Rays from a sphere around the origin to points near it.
fn inward(random: &mut Sample) -> Ray {
    let [u, v] = random.pair();
    let from = bitlight::world::brdf::polar(2.0 * u - 1.0, v) * 5.0;
    let [x, y] = random.pair();
    Ray::new(from, (Vec3::new(x - 0.5, y - 0.5, 0.3) - from).normalize())
}

#[test]
fn a_closed_room_fills_with_light() {
    let (albedo, emission) = (Vec3::new(0.3, 0.5, 0.8), Vec3::new(1.0, 2.0, 0.5));
    let room = shapes::cuboid(Vec3::new(1.0, 0.7, 2.0), 3).unwrap();
    let ray = Ray::new(Vec3::new(0.1, -0.2, 0.3), Vec3::new(0.3, 0.5, -0.7).normalize());
    let scene = |bounces| {
        let mut scene = surface(room.clone(), diffuse(albedo), bounces, Lights::default());
        scene.emission = vec![emission; scene.mesh().triangles.len()];
        scene
    };
    for bounces in 0..6 {
        let scene = scene(Some(bounces));
        // e (1 − ρ^(k + 1)) / (1 − ρ), and without noise: every direction shows the same.
        let power = [0, 1, 2].map(|channel| albedo[channel].powi(bounces as i32 + 1));
        let expected = emission * (Vec3::ONE - Vec3::from_array(power)) / (Vec3::ONE - albedo);
        for number in 0..50 {
            let got = scene.along(&ray, &mut Sample::new(1, 2, number)).unwrap();
            assert!(
                (got - expected).abs().max_element() < 1e-5,
                "{bounces} bounces: {got} and not {expected}"
            );
        }
    }
    let scene = scene(None);
    let expected = (emission / (Vec3::ONE - albedo)).to_array().map(f64::from);
    let all = estimate(40_000, |random| scene.along(&ray, random).unwrap());
    agrees(&all, expected, 1e-5, "any number of bounces");
}

#[test]
fn a_white_object_vanishes_under_even_light() {
    let light = Vec3::new(0.5, 1.0, 2.0);
    let scene = surface(knot(), diffuse(Vec3::ONE), None, under(Sky::Constant(light)));
    let all = estimate(40_000, |random| {
        let ray = inward(random);
        scene.along(&ray, random).unwrap_or(light)
    });
    agrees(&all, light.to_array().map(f64::from), 1e-5, "white knot");
}

/// The part of a unit square's light that reaches a parallel one at distance 1 (Howell, Configuration C-11).
fn parallel_squares() -> f64 {
    let x: f64 = 1.0;
    let (s, t) = (1.0 + x * x, (1.0 + x * x).sqrt());
    let inner = (s * s / (1.0 + 2.0 * x * x)).ln() / 2.0 + 2.0 * x * t * (x / t).atan() - 2.0 * x * x.atan();
    2.0 / (std::f64::consts::PI * x * x) * inner
}

#[test]
fn facing_squares_see_as_much_of_each_other_as_their_form_factor() {
    assert!((parallel_squares() - 0.1998).abs() < 1e-4);
    let mut scene = surface(square(0.5, 1.0), diffuse(Vec3::ONE), Some(1), Lights::default());
    scene.emission = vec![Vec3::new(1.0, 2.0, 3.0); 2];
    let all = estimate(100_000, |random| {
        let [x, y] = random.pair();
        scene.leaving(Vec3::new(x - 0.5, y - 0.5, 0.0), Vec3::Z, Vec3::Z, random)
    });
    agrees(&all, [1.0, 2.0, 3.0].map(|e| e * parallel_squares()), 1e-6, "form factor");
}

#[test]
fn points_and_directions_light_a_square_by_cosine_and_distance_and_cast_shadows() {
    let albedo = Vec3::new(0.2, 0.4, 0.8);
    let position = Vec3::new(0.0, 3.0, 4.0);
    let intensity = Vec3::splat(10.0);
    let direction = Vec3::new(0.6, 0.0, -0.8);
    let lamps = vec![
        Lamp::Point { position, intensity },
        Lamp::Directional { direction, irradiance: Vec3::splat(2.0) },
        // From behind: nothing.
        Lamp::Directional { direction: Vec3::Z, irradiance: Vec3::splat(9.0) },
    ];
    let lights = Lights { lamps, ..Lights::default() };
    let scene = surface(square(9.0, 0.0), diffuse(albedo), None, lights.clone());
    let down = Ray::new(Vec3::new(0.0, 0.0, 7.0), Vec3::NEG_Z);
    let got = scene.along(&down, &mut Sample::new(0, 0, 0)).unwrap();
    let irradiance = 10.0 * 0.8 / 25.0 + 2.0 * 0.8;
    let expected = albedo * (irradiance / std::f32::consts::PI);
    assert!((got - expected).abs().max_element() < 1e-6, "{got} and not {expected}");
    // A small square at z = 1 stands in the direction's way, which comes through (−0.75, 0, 1).
    let mut both = square(9.0, 0.0);
    let small = square(0.2, 1.0);
    let count = both.positions.len() as u32;
    both.positions.extend(small.positions.iter().map(|p| *p - Vec3::new(0.75, 0.0, 0.0)));
    both.normals.extend(small.normals);
    both.triangles.extend(small.triangles.iter().map(|t| t.map(|corner| corner + count)));
    let scene = surface(both, diffuse(albedo), Some(1), lights);
    let got = scene.along(&down, &mut Sample::new(0, 0, 0)).unwrap();
    let expected = albedo * (10.0 * 0.8 / 25.0 / std::f32::consts::PI);
    assert!((got - expected).abs().max_element() < 1e-6, "{got} and not {expected}");
}

/// Dim but for one texel: the hardest for draws from the surface.
fn spot() -> LatLong {
    let texels = (0..64 * 32).map(|i| match i {
        653 => Vec3::new(90.0, 60.0, 30.0),
        _ => Vec3::new(0.1, 0.2, 0.3) * (1.0 + (i % 7) as f32 / 7.0),
    });
    LatLong::new(64, 32, texels.collect()).unwrap()
}

#[test]
fn drawing_from_a_map_as_well_changes_noise_alone() {
    for gloss in [Gloss::None, Gloss::Phong { exponent: 12.0 }, Gloss::CookTorrance { roughness: 0.3 }] {
        let brdf = Brdf { albedo: Vec3::new(0.5, 0.4, 0.3), specular: Vec3::splat(0.3), gloss };
        let run = |draw: bool| {
            let lights = Lights { draw, ..under(Sky::Map(Map::new(spot(), 2.0))) };
            let scene = surface(knot(), brdf, Some(2), lights);
            estimate(60_000, |random| {
                let ray = inward(random);
                scene.along(&ray, random).unwrap_or_default()
            })
        };
        let (with, without) = (run(true), run(false));
        for channel in 0..3 {
            let off = with.mean(0)[channel] - without.mean(0)[channel];
            let deviation = (with.variance(0)[channel] + without.variance(0)[channel]).sqrt();
            assert!(off.abs() < LEVEL * deviation, "{gloss:?}: {off:.2e}, deviation {deviation:.2e}");
        }
        assert!(with.variance(0)[0] < 0.5 * without.variance(0)[0], "{gloss:?}: it pays");
    }
}

#[test]
fn a_map_that_is_constant_is_a_constant() {
    let map = LatLong::new(9, 5, vec![Vec3::new(1.0, 2.0, 3.0); 45]).unwrap();
    let lights = Lights { draw: true, ..under(Sky::Map(Map::new(map, 1.0))) };
    let scene = surface(knot(), diffuse(Vec3::ONE), None, lights);
    let all = estimate(40_000, |random| {
        let ray = inward(random);
        scene.along(&ray, random).unwrap_or(Vec3::new(1.0, 2.0, 3.0))
    });
    agrees(&all, [1.0, 2.0, 3.0], 1e-5, "constant map");
}

/// Coefficients with lobes of both signs.
fn lobes(bands: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Sample::new(seed, 0, 0);
    (0..bands * bands).map(|_| [0, 1, 2].map(|_| random.unit() * 2.0 - 1.0)).collect()
}

#[test]
fn light_of_either_sign_adds_up_sample_by_sample() {
    for bands in [3, 6, 9] {
        let (a, b) = (lobes(bands, 1), lobes(bands, 2));
        let sum: Vec<[f32; 3]> = a.iter().zip(&b).map(|(a, b)| [0, 1, 2].map(|c| a[c] + b[c])).collect();
        let brdf = Brdf {
            albedo: Vec3::splat(0.6),
            specular: Vec3::splat(0.3),
            gloss: Gloss::Phong { exponent: 20.0 },
        };
        let [a, b, sum] = [a, b, sum]
            .map(|coefficients| surface(knot(), brdf, None, under(Sky::Harmonics { bands, coefficients })));
        let mut negative = 0;
        for number in 0..500 {
            let [a, b, sum] = [&a, &b, &sum].map(|scene| {
                let random = &mut Sample::new(3, 4, number);
                let ray = inward(random);
                scene.along(&ray, random).unwrap_or_default()
            });
            assert!((a + b - sum).abs().max_element() < 2e-5, "{bands} bands: {a} + {b} and not {sum}");
            negative += u32::from(sum.min_element() < 0.0);
        }
        assert!(negative > 20, "{negative} of 500 are below 0");
    }
}

#[test]
fn vertices_of_a_sphere_reflect_the_irradiance_of_nine_coefficients() {
    let mesh = shapes::sphere(5).unwrap();
    let coefficients = lobes(3, 5);
    let nine: [[f32; 3]; 9] = coefficients.clone().try_into().unwrap();
    let matrices = irradiance::matrix(&nine);
    let albedo = Vec3::new(0.3, 0.6, 0.9);
    let scene =
        surface(mesh.clone(), diffuse(albedo), None, under(Sky::Harmonics { bands: 3, coefficients }));
    let mut sums = Sums::new(mesh.positions.len());
    scene.vertices(&mut sums, 500);
    for vertex in 0..mesh.positions.len() {
        let normal = mesh.normals[vertex];
        let (mean, variance) = (sums.mean(vertex), sums.variance(vertex));
        for channel in 0..3 {
            let expected = albedo[channel] * irradiance::evaluate(&matrices[channel], normal);
            let off = mean[channel] - f64::from(expected) / std::f64::consts::PI;
            assert!(
                off.abs() <= LEVEL * variance[channel].sqrt() + 1e-5,
                "vertex {vertex}: off by {off:.2e}"
            );
        }
    }
}
