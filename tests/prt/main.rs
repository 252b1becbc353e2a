//! The passes of precomputed radiance transfer against the reference crate: the same sums over the same
//! directions, by brute force in `f64` over all triangles of a small knot.
#![allow(clippy::disallowed_methods, reason = "an oracle may use the standard library")]

mod lit;
mod transfer;

use bitlight::pass::{Buffer, Kept};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight::world::mesh::Mesh;
use bitlight_reference::geometry::Triangle;
use bitlight_reference::vector::Vec3;
use std::sync::Arc;

const PI: f64 = std::f64::consts::PI;

const DIRECTIONS: usize = 96;

/// A knot that shadows itself, off the origin and bent, so that nothing stands for anything else.
const SCENE: &str = r#"technique = "prt"
unit = "mm"
time = 0.2
image = { width = 24, height = 20, background = [0.25, 0.5, 0.125] }
camera = { position = [1, 9, 26], target = [1, 0.5, 0], fov = 30, up = [0.1, 1, 0] }
solid = { shape = "torus-knot", resolution = 5, size = 10, center = [1, 0.5, -0.25] }
bend = { angle = 20, length = 10 }
material = { name = "Skin1" }
surface = { albedo = [0.8, 0.5, 0.25], specular = [0.5, 0.25, 0.75], exponent = 7, roughness = 0.4 }
prt = { bands = 3, directions = 96, method = "quadrature" }
[[light]]
kind = "environment"
probe = "uffizi"
[[light]]
kind = "directional"
direction = [-1, -2, 0.5]
irradiance = [3, 2, 1]
"#;

/// Every pass of the scene under some settings, and its solid.
struct Rendered {
    scene: Scene,
    mesh: Arc<Mesh>,
    kept: Kept,
}

impl Rendered {
    fn new(set: &[&str]) -> Self {
        let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
        let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
        let all = scene.technique.wanted("all").unwrap();
        let loaded = run::Loaded::new(&scene, &Assets::default(), &all).unwrap();
        let mut kept = Kept::default();
        loaded.render(&scene, &all, &mut kept).unwrap();
        Self { mesh: loaded.posed(&scene).unwrap(), scene, kept }
    }

    fn buffer(&self, pass: &str) -> &Buffer {
        self.kept.get(&format!("prt.{pass}")).unwrap_or_else(|| panic!("{pass} has not run"))
    }

    /// A vertex's items of a pass.
    fn row(&self, pass: &str, vertex: usize) -> &[f32] {
        self.buffer(pass).slice(vertex)
    }

    fn position(&self, vertex: usize) -> Vec3 {
        double(self.mesh.positions[vertex])
    }

    fn normal(&self, vertex: usize) -> Vec3 {
        double(self.mesh.normals[vertex])
    }

    fn triangles(&self) -> Vec<Triangle> {
        let corners = self.mesh.triangles.iter();
        corners.map(|triangle| triangle.map(|corner| self.position(corner as usize))).collect()
    }
}

fn double(v: glam::Vec3) -> Vec3 {
    v.to_array().map(f64::from)
}

/// The directions of the bake, each with its solid angle.
fn rule() -> Vec<(Vec3, f64)> {
    let directions = bitlight::sphere::quadrature::fibonacci(DIRECTIONS);
    directions.into_iter().map(|direction| (direction, 4.0 * PI / DIRECTIONS as f64)).collect()
}

/// Every value within `tolerance` of the greatest.
#[track_caller]
fn assert_near(found: &[f32], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let most = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(most > 0.0, "{what}: nothing is compared");
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        let off = (f64::from(*found) - expected).abs();
        assert!(
            off <= tolerance * most,
            "{what} at {index}: {found} for {expected}, off by {off:e} of {most}"
        );
    }
}
