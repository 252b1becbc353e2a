//! Sums do not depend on threads or pauses, and rays on nothing but the pixel.

use bitlight::numeric::parallel::with_threads;
use bitlight::numeric::random::Sample;
use bitlight::raster;
use bitlight::truth::{Environment, Filter, Lights, Model, Normals, Scene, Sums, View};
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::camera::Camera;
use bitlight::world::shapes;
use glam::Vec3;

fn view(filter: Filter) -> View {
    let camera = Camera { position: Vec3::new(1.0, 2.0, 4.0), target: Vec3::ZERO, up: Vec3::Y, fov: 40.0 };
    View { camera, size: [13, 9], background: Vec3::new(0.25, 0.5, 0.75), filter }
}

#[test]
fn pauses_and_threads_leave_no_trace() {
    let brdf =
        Brdf { albedo: Vec3::splat(0.7), specular: Vec3::splat(0.2), gloss: Gloss::Phong { exponent: 9.0 } };
    let model = Model::Surface { brdf, bounces: None, normals: Normals::Interpolated };
    let lights = Lights { environments: vec![Environment::Constant(Vec3::ONE)], ..Lights::default() };
    let scene = Scene::new(shapes::torus_knot(2, 3, 0.3, 60, 8).unwrap(), model, lights);
    let view = view(Filter::Box);
    let run = |threads: usize, stops: &[u64]| {
        with_threads(threads, || {
            let mut sums = Sums::new(13 * 9);
            for stop in stops {
                sums.advance(*stop, |pixel, random| scene.pixel(&view, pixel, random));
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
fn rays_go_through_the_pixels_of_the_passes() {
    let view = view(Filter::Point);
    let camera = view.camera;
    let axes = raster::Axes::looking(camera.target - camera.position, camera.up);
    let tangents = camera.tangents(13, 9);
    let passes = raster::View::perspective(camera.position, axes, tangents, 0.1, [13, 9]);
    for pixel in 0..13 * 9 {
        let ray = view.ray(pixel, &mut Sample::new(0, 0, 0));
        let at = passes.pixel(passes.project(ray.at(5.0)));
        assert!(
            (at[0] - (pixel % 13) as f32 - 0.5).abs() < 1e-3
                && (at[1] - (pixel / 13) as f32 - 0.5).abs() < 1e-3
        );
    }
}
