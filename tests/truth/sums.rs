//! Sums do not depend on threads or pauses, and rays on nothing but the pixel.

use bitlight::numeric::parallel::with_threads;
use bitlight::numeric::random::Sample;
use bitlight::raster;
use bitlight::truth::{Estimator, Filter, Lights, Model, Normals, Sensor, Sky, Sums};
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::camera::Camera;
use bitlight::world::shapes;
use glam::Vec3;

fn view(filter: Filter) -> Sensor {
    let camera = Camera { position: Vec3::new(1.0, 2.0, 4.0), target: Vec3::ZERO, up: Vec3::Y, fov: 40.0 };
    Sensor { camera, size: [13, 9], background: Vec3::new(0.25, 0.5, 0.75), filter }
}

fn knot() -> Estimator {
    let brdf =
        Brdf { albedo: Vec3::splat(0.7), specular: Vec3::splat(0.2), gloss: Gloss::Phong { exponent: 9.0 } };
    let model = Model::Surface { brdf, bounces: None, normals: Normals::Interpolated };
    let lights = Lights { skies: vec![Sky::Constant(Vec3::ONE)], ..Lights::default() };
    Estimator::new(shapes::torus_knot(2, 3, 0.3, 60, 8).unwrap(), model, lights)
}

#[test]
fn pauses_and_threads_leave_no_trace() {
    let scene = knot();
    let view = view(Filter::Box);
    let run = |threads: usize, stops: &[u64]| {
        with_threads(threads, || {
            let mut sums = Sums::new(13 * 9);
            for stop in stops {
                scene.pixels(&view, &mut sums, *stop, &mut |_| {});
            }
            sums
        })
        .unwrap()
    };
    let whole = run(1, &[24]);
    assert!(whole.mean(4 * 13 + 6)[0] > 0.3, "the knot is in the middle of the picture");
    for (threads, stops) in [(2, vec![24]), (3, vec![1, 2, 16, 24]), (7, vec![5, 24])] {
        assert_eq!(run(threads, &stops), whole, "{threads} threads, stops at {stops:?}");
    }
}

#[test]
fn a_pixel_whose_samples_share_a_ray_has_the_samples_of_that_ray() {
    let (scene, view) = (knot(), view(Filter::Point));
    let mut sums = Sums::new(13 * 9);
    let mut told = Vec::new();
    scene.pixels(&view, &mut sums, 8, &mut |pixels| told.push(pixels));
    assert_eq!(told, [13 * 9]);
    let mut rays = Sums::new(13 * 9);
    let scene = &scene;
    let of = |pixel| {
        let ray = view.rays().through(pixel, [0.5; 2]);
        move |random: &mut Sample| scene.along(&ray, random).unwrap_or(view.background)
    };
    rays.advance(8, of, &mut |_| {});
    assert_eq!(sums, rays);
}

#[test]
fn rays_go_through_the_pixels_of_the_passes() {
    let view = view(Filter::Point);
    let camera = view.camera;
    let axes = raster::Axes::looking(camera.target - camera.position, camera.up);
    let tangents = camera.tangents(13, 9);
    let passes = raster::View::perspective(camera.position, axes, tangents, 0.1, [13, 9]);
    for pixel in 0..13 * 9 {
        let ray = view.rays().through(pixel, [0.5; 2]);
        let at = passes.pixel(passes.project(ray.at(5.0)));
        assert!(
            (at[0] - (pixel % 13) as f32 - 0.5).abs() < 1e-3
                && (at[1] - (pixel / 13) as f32 - 0.5).abs() < 1e-3
        );
    }
}

#[test]
fn the_variance_is_that_of_the_mean() {
    // Uniform numbers have a variance of 1/12; of constants there is none, though their squares round.
    let mut sums = Sums::new(2);
    let of = |element| {
        move |random: &mut Sample| {
            let unit = random.unit();
            if element == 0 { Vec3::new(unit, 3.0 * unit, 0.1) } else { Vec3::ZERO }
        }
    };
    sums.advance(50_000, of, &mut |_| {});
    let variance = sums.variance(0).map(|variance| variance * 50_000.0 * 12.0);
    assert!((variance[0] - 1.0).abs() < 0.02 && (variance[1] / 9.0 - 1.0).abs() < 0.02, "{variance:?}");
    assert!(variance[2] < 1e-9 && sums.variance(1) == [0.0; 3]);
    let mut two = Sums::new(1);
    let of = |_| |random: &mut Sample| Vec3::splat(random.unit());
    two.advance(2, of, &mut |_| {});
    let [a, b] = [0, 1].map(|number| {
        let mut one = Sums::new(1);
        one.advance(number + 1, of, &mut |_| {});
        one.values[0][0]
    });
    let (a, b) = (a, b - a);
    assert!((two.variance(0)[0] - (a - b) * (a - b) / 4.0).abs() < 1e-15);
}
