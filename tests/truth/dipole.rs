//! The dipole's integral: against the total reflectance, and against a sum over all triangles.

use crate::{LEVEL, agrees, estimate, square};
use bitlight::sphere::environment::LatLong;
use bitlight::trace::Ray;
use bitlight::truth::{Estimator, Lamp, Lights, Map, Model, Normals, Sky};
use bitlight::world::medium::Medium;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use bitlight_reference::tables::material;
use bitlight_reference::translucency::{dipole, optics};
use glam::{Mat3, Vec3};
use std::f64::consts::PI;

fn scene(mesh: Mesh, medium: Medium, lights: Lights) -> Estimator {
    Estimator::new(mesh, Model::Dipole { medium, normals: Normals::Face }, lights)
}

/// Jensen's marble in millimetres, and what the reference crate makes of it.
fn marble() -> (Medium, [dipole::Medium; 3]) {
    let known = material("Marble").unwrap();
    let [s, a] = [known.sigma_s_prime, known.sigma_a].map(|rgb| rgb.map(|x| x as f32));
    (Medium::new(s, a, known.eta as f32, 1.0), [0, 1, 2].map(|channel| known.medium(channel)))
}

#[test]
fn a_wide_sheet_reflects_the_total_reflectance() {
    let (medium, theirs) = marble();
    // Slanting, where Fresnel's transmittance is 0.78 and not 0.96.
    let direction = Vec3::new(0.96, 0.0, -0.28);
    let lamps = vec![Lamp::Directional { direction, irradiance: Vec3::splat(3.0) }];
    let even = Sky::Constant(Vec3::ONE);
    // 400 mm: beyond 200 mm from the middle lies less than e^-20 of the kernel.
    let by_direction = scene(square(200.0, 0.0), medium, Lights { lamps, ..Lights::default() });
    let by_all = scene(square(200.0, 0.0), medium, Lights { skies: vec![even], ..Lights::default() });
    let towards = Vec3::new(0.0, 0.96, 0.28);
    let ray = Ray::new(Vec3::new(0.3, -0.2, 0.0) + towards * 50.0, -towards);
    let eta = f64::from(medium.eta);
    let out = optics::schlick_transmittance(eta, 0.28) / PI;
    let entering = 3.0 * 0.28 * optics::schlick_transmittance(eta, 0.28);
    let diffuse = PI * (1.0 - optics::schlick_hemispherical_reflectance(eta));
    for (scene, irradiance, what) in [(by_direction, entering, "direction"), (by_all, diffuse, "even light")]
    {
        let all = estimate(60_000, |random| scene.along(&ray, random).unwrap());
        let expected = theirs.map(|medium| out * irradiance * medium.total_r_d());
        agrees(&all, expected, 1e-6, what);
    }
}

#[test]
fn a_small_ball_shines_as_the_sum_over_its_triangles() {
    let (medium, theirs) = marble();
    let mut mesh = shapes::sphere(12).unwrap();
    mesh.apply(2.5, Mat3::IDENTITY, Vec3::new(0.4, 0.0, -0.3)).unwrap();
    let light = Vec3::new(-3.0, 6.0, -8.0);
    let lamps = vec![Lamp::Point { position: light, intensity: Vec3::splat(100.0) }];
    let ball = scene(mesh.clone(), medium, Lights { lamps, ..Lights::default() });
    // From the lit side and from the dark one.
    for eye in [Vec3::new(-4.0, 9.0, -2.0), Vec3::new(1.0, 1.0, 12.0)] {
        let ray = Ray::new(eye, (Vec3::new(0.9, 0.4, -0.1) - eye).normalize());
        let all = estimate(100_000, |random| ball.along(&ray, random).unwrap());
        // The point that is seen, by a loop over all triangles.
        let hit = bitlight::trace::Bvh::new(&mesh).nearest(&ray).unwrap();
        let (seen, face) = (ray.at(hit.t).as_dvec3(), face(&mesh, hit.triangle as usize));
        let eta = f64::from(medium.eta);
        let leaving = optics::schlick_transmittance(eta, face.dot(-ray.direction.as_dvec3())) / PI;
        let mut sum = [0.0; 3];
        for triangle in 0..mesh.triangles.len() {
            let normal = self::face(&mesh, triangle);
            for (y, area) in pieces(&mesh, triangle, 6) {
                let to = light.as_dvec3() - y;
                let cosine = normal.dot(to) / to.length();
                if cosine > 0.0 {
                    // A ball shadows no point that faces the light.
                    let irradiance =
                        100.0 * cosine / to.length_squared() * optics::schlick_transmittance(eta, cosine);
                    let distance = (y - seen).length();
                    (0..3).for_each(|c| sum[c] += leaving * irradiance * area * theirs[c].r_d(distance));
                }
            }
        }
        let least = sum.into_iter().fold(f64::INFINITY, f64::min);
        agrees(&all, sum, 0.004 * least, "ball");
    }
}

#[test]
fn drawing_from_a_map_as_well_changes_noise_alone() {
    let mut texels = vec![Vec3::splat(0.2); 18 * 9];
    texels[2 * 18 + 5] = Vec3::new(60.0, 40.0, 20.0);
    let map = Map::new(LatLong::new(18, 9, texels).unwrap(), 1.5);
    let mut mesh = shapes::torus_knot(2, 3, 0.35, 100, 12).unwrap();
    mesh.apply(4.0, Mat3::IDENTITY, Vec3::ZERO).unwrap();
    let run = |draw: bool| {
        let lights = Lights { skies: vec![Sky::Map(map.clone())], draw, ..Lights::default() };
        let knot = scene(mesh.clone(), marble().0, lights);
        let eye = Vec3::new(3.0, 9.0, 12.0);
        estimate(60_000, |random| {
            let [x, y] = random.pair();
            let target = Vec3::new(8.0 * x - 4.0, 8.0 * y - 4.0, 0.0);
            knot.along(&Ray::new(eye, (target - eye).normalize()), random).unwrap_or_default()
        })
    };
    let (with, without) = (run(true), run(false));
    assert!(with.mean(0)[0] > 0.05, "{:?}", with.mean(0));
    for channel in 0..3 {
        let off = with.mean(0)[channel] - without.mean(0)[channel];
        let deviation = (with.variance(0)[channel] + without.variance(0)[channel]).sqrt();
        assert!(off.abs() < LEVEL * deviation, "{off:.2e}, deviation {deviation:.2e}");
    }
    assert!(with.variance(0)[0] < 0.7 * without.variance(0)[0], "it pays");
}

fn face(mesh: &Mesh, triangle: usize) -> glam::DVec3 {
    let [a, b, c] = mesh.triangles[triangle].map(|corner| mesh.positions[corner as usize].as_dvec3());
    (b - a).cross(c - a).normalize()
}

/// The middles and areas of the `parts`² triangles into which one is divided.
fn pieces(mesh: &Mesh, triangle: usize, parts: usize) -> Vec<(glam::DVec3, f64)> {
    let [a, b, c] = mesh.triangles[triangle].map(|corner| mesh.positions[corner as usize].as_dvec3());
    let (u, v) = ((b - a) / parts as f64, (c - a) / parts as f64);
    let area = u.cross(v).length() / 2.0;
    let mut all = Vec::new();
    for i in 0..parts {
        for j in 0..parts - i {
            let corner = a + u * i as f64 + v * j as f64;
            all.push((corner + (u + v) / 3.0, area));
            if i + j + 1 < parts {
                all.push((corner + (u + v) * (2.0 / 3.0), area));
            }
        }
    }
    all
}
