//! Walks through media: optics against the reference crate and closed forms, scattering against those that
//! transport theory has.

use crate::{LEVEL, agrees, estimate};
use bitlight::numeric::random::Sample;
use bitlight::sphere::quadrature::{fibonacci, gauss_legendre};
use bitlight::trace::Ray;
use bitlight::truth::{
    Estimator, Lamp, Lights, Model, Sky, Volume, fresnel, henyey_greenstein, refract, scatter,
};
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use bitlight_reference::translucency::{dipole, optics};
use glam::Vec3;
use std::f64::consts::PI;

fn volume(scattering: [f32; 3], absorption: [f32; 3], anisotropy: f32, eta: f32) -> Volume {
    Volume { scattering, absorption, anisotropy, eta }
}

fn bright(mesh: Mesh, volume: Volume) -> Estimator {
    let lights = Lights { skies: vec![Sky::Constant(Vec3::ONE)], ..Lights::default() };
    let scene = Estimator::new(mesh, Model::Medium(volume), lights);
    scene.check().unwrap();
    scene
}

fn ball() -> Mesh {
    shapes::sphere(8).unwrap()
}

/// A ray to a point near the middle of a ball.
fn towards(random: &mut Sample) -> Ray {
    let [x, y] = random.pair();
    let from = Vec3::new(0.3, 0.1, 4.0);
    Ray::new(from, (Vec3::new(1.4 * x - 0.7, 1.4 * y - 0.7, 0.0) - from).normalize())
}

#[test]
fn fresnel_has_its_known_values() {
    for eta in [1.0_f32, 1.3, 1.5, 2.4] {
        let normal = ((eta - 1.0) / (eta + 1.0)).powi(2);
        assert!((fresnel(1.0, eta) - normal).abs() < 1e-6);
        assert!((fresnel(1.0, 1.0 / eta) - normal).abs() < 1e-6);
        if eta > 1.0 {
            assert!(fresnel(1e-5, eta) > 0.999);
            // Beyond the critical angle all is reflected, just before it not.
            let critical = (1.0 - 1.0 / (eta * eta)).sqrt();
            assert_eq!(fresnel(critical - 1e-3, 1.0 / eta), 1.0);
            assert!(fresnel(critical + 1e-2, 1.0 / eta) < 0.9);
            // At Brewster's angle one polarisation is let through, half of the other's reflectance is left.
            let brewster = 1.0 / (1.0 + eta * eta).sqrt();
            let other = ((eta * eta - 1.0) / (eta * eta + 1.0)).powi(2);
            assert!((fresnel(brewster, eta) - 0.5 * other).abs() < 1e-6);
        }
        // The same both ways.
        for cosine in [0.1_f32, 0.4, 0.9] {
            let behind = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
            assert!((fresnel(cosine, eta) - fresnel(behind, 1.0 / eta)).abs() < 1e-5);
        }
    }
    // Jensen's fit of the diffuse reflectance from inside is good to 0.01.
    for eta in [1.1, 1.3, 1.5] {
        let inside = gauss_legendre(2000).into_iter().fold(0.0, |sum, (node, weight)| {
            let cosine = 0.5 * (node + 1.0);
            sum + weight * cosine * f64::from(fresnel(cosine as f32, 1.0 / eta))
        });
        let fit = dipole::Medium { sigma_s_prime: 1.0, sigma_a: 1.0, eta: f64::from(eta) }.f_dr();
        assert!((inside - fit).abs() < 0.01, "η {eta}: {inside} and {fit}");
    }
}

#[test]
fn refraction_is_the_reference_crates_and_leads_back() {
    let normal = Vec3::new(0.2, 0.9, -0.3).normalize();
    let mut random = Sample::new(1, 1, 1);
    for _ in 0..1000 {
        let view = Vec3::from_array([0; 3].map(|_| random.unit() * 2.0 - 1.0)).normalize();
        if view.dot(normal) > -1e-3 {
            continue;
        }
        let eta = 1.0 + random.unit();
        let ours = refract(view, normal, eta).unwrap();
        let [view64, normal64] = [view, normal].map(|v| v.as_dvec3().to_array());
        let theirs = optics::refraction_vector(view64, normal64, f64::from(eta));
        assert!((ours - Vec3::from_array(theirs.map(|x| x as f32))).length() < 1e-5);
        assert!((refract(-ours, -normal, 1.0 / eta).unwrap() + view).length() < 1e-4);
    }
    assert_eq!(refract(Vec3::new(0.8, 0.0, -0.6), Vec3::Z, 1.0 / 1.5), None);
}

#[test]
fn scattering_has_the_mean_cosine_and_the_density_of_its_phase_function() {
    let before = Vec3::new(0.48, -0.6, 0.64);
    for g in [-0.7, 0.0, 0.0005, 0.5, 0.9] {
        let total: f64 = gauss_legendre(400)
            .into_iter()
            .map(|(cosine, weight)| 2.0 * PI * weight * f64::from(henyey_greenstein(g, cosine as f32)))
            .sum();
        assert!((total - 1.0).abs() < 1e-4, "g {g}: {total}");
        // P_1 and P_2 of the cosine: g and g².
        let moments = estimate(60_000, |random| {
            let after = scatter(g, before, random.pair());
            let c = after.dot(before);
            Vec3::new(c, 1.5 * c * c - 0.5, after.length())
        });
        let g = f64::from(g);
        agrees(&moments, [g, g * g, 1.0], 6e-4, &format!("g {g}"));
    }
}

#[test]
fn without_absorption_a_solid_vanishes_under_even_light() {
    for (g, eta) in [(0.0, 1.5), (0.8, 1.3), (-0.3, 1.0)] {
        let scene = bright(ball(), volume([1.0, 3.0, 6.0], [0.0; 3], g, eta));
        let all = estimate(12_000, |random| {
            let ray = towards(random);
            scene.along(&ray, random).unwrap()
        });
        agrees(&all, [1.0; 3], 1e-5, &format!("g {g}, η {eta}"));
        assert!(all.variance(0)[0] > 0.0, "three colours make noise");
        // One colour makes none: every walk comes out, and counts 1.
        let scene = bright(shapes::torus_knot(2, 3, 0.3, 60, 8).unwrap(), volume([4.0; 3], [0.0; 3], g, eta));
        for number in 0..300 {
            let mut random = Sample::new(7, 7, number);
            let ray = towards(&mut random);
            if let Some(got) = scene.along(&ray, &mut random) {
                assert!((got - Vec3::ONE).abs().max_element() < 1e-5, "{got}");
            }
        }
    }
}

#[test]
fn what_is_inside_is_told_from_what_is_outside() {
    let scene = bright(shapes::torus_knot(2, 3, 0.3, 60, 8).unwrap(), volume([1.0; 3], [0.0; 3], 0.0, 1.3));
    let mesh = scene.mesh();
    let (mut middles, mut outside) = (0, 0);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
        assert!(scene.encloses(middle - normal * 0.05) && !scene.encloses(middle + normal * 0.05));
        middles += 1;
        outside += usize::from(!scene.encloses(middle + Vec3::splat(9.0)));
    }
    assert!(middles > 900 && outside == middles, "{outside} of {middles}");
}

#[test]
fn what_only_absorbs_dims_exponentially() {
    let scene = bright(
        shapes::cuboid(Vec3::new(2.0, 2.0, 0.5), 2).unwrap(),
        volume([0.0; 3], [0.3, 1.0, 2.0], 0.0, 1.0),
    );
    let ray = Ray::new(Vec3::new(0.1, 0.2, 3.0), Vec3::NEG_Z);
    let all = estimate(60_000, |random| scene.along(&ray, random).unwrap());
    agrees(&all, [0.3_f64, 1.0, 2.0].map(|a| (-a).exp()), 1e-6, "Beer");
}

/// Chandrasekhar's H function for isotropic scattering of albedo ω, at `cosine`, by iterating its equation
/// 1/H(μ) = √(1 − ω) + ω/2 ∫ μ' H(μ') / (μ + μ') dμ' (Radiative Transfer, §38).
fn chandrasekhar(albedo: f64, cosine: f64) -> f64 {
    let rule: Vec<(f64, f64)> =
        gauss_legendre(64).into_iter().map(|(node, weight)| (0.5 * (node + 1.0), 0.5 * weight)).collect();
    let next = |h: &[f64], at: f64| {
        let integral: f64 = rule.iter().zip(h).map(|((mu, weight), h)| weight * mu * h / (at + mu)).sum();
        1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * integral)
    };
    let mut h = vec![1.0; rule.len()];
    for _ in 0..200 {
        h = rule.iter().map(|(mu, _)| next(&h, *mu)).collect();
    }
    next(&h, cosine)
}

#[test]
fn a_half_space_reflects_even_light_as_chandrasekhar_says() {
    // A box of 400 by 400 by 200 mean free paths; what crosses it is below e^-90.
    let scene = bright(
        shapes::cuboid(Vec3::new(200.0, 200.0, 100.0), 1).unwrap(),
        volume([0.5, 0.8, 0.95], [0.5, 0.2, 0.05], 0.0, 1.0),
    );
    for cosine in [1.0_f64, 0.4] {
        let sine = (1.0 - cosine * cosine).sqrt();
        let towards = Vec3::new(sine as f32, 0.0, cosine as f32);
        let ray = Ray::new(Vec3::new(3.0, 2.0, 100.0) + towards * 10.0, -towards);
        let all = estimate(40_000, |random| scene.along(&ray, random).unwrap());
        let expected = [0.5_f64, 0.8, 0.95].map(|w| 1.0 - (1.0 - w).sqrt() * chandrasekhar(w, cosine));
        agrees(&all, expected, 1e-5, &format!("cosine {cosine}"));
    }
}

#[test]
fn three_colours_of_one_walk_are_those_of_three_walks() {
    let (scattering, absorption) = ([2.0, 3.0, 5.0], [0.05, 0.3, 1.0]);
    let run = |volume| {
        let scene = bright(ball(), volume);
        estimate(30_000, |random| {
            let ray = towards(random);
            scene.along(&ray, random).unwrap()
        })
    };
    let together = run(volume(scattering, absorption, 0.3, 1.4));
    for channel in 0..3 {
        let alone = run(volume([scattering[channel]; 3], [absorption[channel]; 3], 0.3, 1.4));
        let off = together.mean(0)[channel] - alone.mean(0)[channel];
        let deviation = (together.variance(0)[channel] + alone.variance(0)[channel]).sqrt();
        assert!(off.abs() < LEVEL * deviation, "channel {channel}: {off:.2e}, deviation {deviation:.2e}");
    }
}

#[test]
fn directions_are_joined_to_walks_where_nothing_refracts() {
    // 200 directions, spread evenly, are even light but for what passes unscattered.
    let lamps: Vec<Lamp> = fibonacci(200)
        .into_iter()
        .map(|d| Lamp::Directional {
            direction: Vec3::from_array(d.map(|x| x as f32)),
            irradiance: Vec3::splat((4.0 * PI / 200.0) as f32),
        })
        .collect();
    let lights = Lights { lamps, ..Lights::default() };
    let scattering = [0.5, 1.0, 2.0];
    let model = Model::Medium(volume(scattering, [0.0; 3], 0.2, 1.0));
    let scene = Estimator::new(shapes::cuboid(Vec3::splat(0.5), 1).unwrap(), model, lights);
    scene.check().unwrap();
    let ray = Ray::new(Vec3::new(0.1, 0.2, 3.0), Vec3::NEG_Z);
    let all = estimate(3_000, |random| scene.along(&ray, random).unwrap());
    agrees(&all, scattering.map(|s| 1.0 - (-f64::from(s)).exp()), 3e-3, "joined");
}

#[test]
fn what_a_walk_cannot_find_is_refused() {
    let lights = Lights {
        lamps: vec![Lamp::Point { position: Vec3::splat(9.0), intensity: Vec3::ONE }],
        ..Lights::default()
    };
    let check = |mesh: Mesh, volume: Volume| {
        let scene = Estimator::new(mesh, Model::Medium(volume), lights.clone());
        scene.check().map_err(|error| error.to_string())
    };
    let glassy = volume([1.0; 3], [0.0; 3], 0.0, 1.5);
    assert!(check(ball(), glassy).unwrap_err().contains("never meets"));
    assert!(check(crate::square(1.0, 0.0), glassy).unwrap_err().contains("not closed"));
    assert!(check(ball(), volume([0.0; 3], [0.0; 3], 0.0, 1.0)).unwrap_err().contains("neither"));
    assert_eq!(check(ball(), volume([1.0; 3], [0.0; 3], 0.0, 1.0)), Ok(()));
}
