//! The reference crate's equations by brute force over all triangles, at some vertices of a concave mesh.

use super::knot;
use bitlight::bake::{
    Directions, Estimate, brdf, diffuse_bounces, frame, glossy_bounces, matrices, meetings,
    multiple_scattering, vectors, visibility,
};
use bitlight::keys::Reading;
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::medium::Medium;
use bitlight::world::mesh::Mesh;
use bitlight_reference::geometry::Triangle;
use bitlight_reference::tables::material;
use bitlight_reference::transfer::{self, Vertices};
use glam::Vec3;

/// What the reference needs of a mesh.
struct Twin {
    positions: Vec<[f64; 3]>,
    corners: Vec<[usize; 3]>,
    triangles: Vec<Triangle>,
    frames: Vec<[[f64; 3]; 3]>,
    rule: Vec<([f64; 3], f64)>,
}

impl Twin {
    fn new(mesh: &Mesh, directions: &Directions) -> Self {
        let positions: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.as_dvec3().to_array()).collect();
        let corners: Vec<[usize; 3]> = mesh.triangles.iter().map(|t| t.map(|c| c as usize)).collect();
        Self {
            triangles: corners.iter().map(|t| t.map(|c| positions[c])).collect(),
            positions,
            corners,
            frames: mesh.normals.iter().map(|n| frame(*n)).collect(),
            rule: directions.exact.iter().map(|d| (*d, directions.weight())).collect(),
        }
    }

    fn vertices(&self) -> Vertices<'_> {
        Vertices {
            corners: &self.corners,
            triangles: &self.triangles,
            positions: &self.positions,
            frames: &self.frames,
        }
    }
}

fn near(found: &[f32], exact: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), exact.len());
    for (i, (a, b)) in found.iter().zip(exact).enumerate() {
        assert!((f64::from(*a) - b).abs() < tolerance, "{what}, {i}: {a} and {b}");
    }
}

#[test]
fn vectors_and_matrices() {
    let (mesh, directions) = (knot(), Directions::new(200));
    let twin = Twin::new(&mesh, &directions);
    let seen = visibility(&mesh, &directions);
    let corrected = vectors(&mesh, &directions, &seen, 4, Reading::Corrected, Estimate::Plain);
    let printed = vectors(&mesh, &directions, &seen, 4, Reading::Paper, Estimate::Plain);
    for vertex in (0..mesh.positions.len()).step_by(61) {
        let (origin, frame) = (twin.positions[vertex], twin.frames[vertex]);
        let exact = transfer::vector(origin, frame[2], 1.0, 4, &twin.rule, &twin.triangles);
        near(&corrected[vertex * 16..(vertex + 1) * 16], &exact, 1e-6, "corrected");
        let exact = transfer::vector_as_printed(origin, frame[2], 4, &twin.rule, &twin.triangles);
        near(&printed[vertex * 16..(vertex + 1) * 16], &exact, 2e-6, "printed");
        let found = matrices(&mesh, &directions, &seen, 3, Estimate::Plain, vertex..vertex + 1);
        let exact = transfer::matrix(origin, frame, 3, &twin.rule, &twin.triangles);
        near(&found, &exact, 1e-6, "matrix");
    }
}

#[test]
fn bounces() {
    let (mesh, directions) = (knot(), Directions::new(150));
    let twin = Twin::new(&mesh, &directions);
    let seen = visibility(&mesh, &directions);
    let met = meetings(&mesh, &directions, &seen);
    let direct = vectors(&mesh, &directions, &seen, 2, Reading::Corrected, Estimate::Plain);
    let rho = Vec3::splat(0.6);
    let once = diffuse_bounces(&mesh, &directions, &met, Estimate::Plain, &direct, 2, rho, 1);
    for vertex in (0..mesh.positions.len()).step_by(97) {
        for i in 0..4 {
            let source: Vec<f64> = direct.chunks_exact(4).map(|t| f64::from(t[i])).collect();
            let bounced = transfer::diffuse_bounce(&twin.vertices(), vertex, &source, &twin.rule);
            let exact = 0.6 * (f64::from(direct[vertex * 4 + i]) + 0.6 * bounced);
            near(&once[(vertex * 4 + i) * 3..][..3], &[exact; 3], 1e-6, "diffuse");
        }
    }
    let gloss = Brdf {
        albedo: Vec3::new(0.1, 0.3, 0.0),
        specular: Vec3::new(0.8, 0.4, 0.2),
        gloss: Gloss::Phong { exponent: 3.0 },
    };
    let brdf = brdf::matrix(&gloss, 3);
    let first = matrices(&mesh, &directions, &seen, 3, Estimate::Plain, 0..mesh.positions.len());
    let second = glossy_bounces(&mesh, &directions, &met, Estimate::Plain, &first, 3, &brdf, 1);
    let third = glossy_bounces(&mesh, &directions, &met, Estimate::Plain, &first, 3, &brdf, 2);
    for channel in 0..3 {
        let brdf: Vec<f64> = brdf.iter().map(|rgb| f64::from(rgb[channel])).collect();
        let before: Vec<Vec<f64>> =
            first.chunks_exact(81).map(|m| m.iter().map(|x| f64::from(*x)).collect()).collect();
        // What the second bounce starts from: what the first added.
        let added: Vec<Vec<f64>> = (0..mesh.positions.len())
            .map(|v| (0..81).map(|e| f64::from(second[(v * 81 + e) * 3 + channel]) - before[v][e]).collect())
            .collect();
        for vertex in (5..mesh.positions.len()).step_by(233) {
            let of =
                |all: &[f32]| (0..81).map(|e| all[(vertex * 81 + e) * 3 + channel]).collect::<Vec<f32>>();
            let one = transfer::glossy_bounce(&twin.vertices(), vertex, &before, &brdf, 3, &twin.rule);
            let exact: Vec<f64> = before[vertex].iter().zip(&one).map(|(a, b)| a + b).collect();
            near(&of(&second), &exact, 3e-6, "glossy");
            let two = transfer::glossy_bounce(&twin.vertices(), vertex, &added, &brdf, 3, &twin.rule);
            let exact: Vec<f64> = exact.iter().zip(&two).map(|(a, b)| a + b).collect();
            near(&of(&third), &exact, 3e-6, "glossy twice");
            assert!(one.iter().any(|x| x.abs() > 1e-3), "vertex {vertex} meets nothing");
        }
    }
}

#[test]
fn scattering() {
    let mesh = knot();
    let medium = Medium::new([0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3, 10.0);
    let mut areas = vec![0.0; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|c| mesh.positions[c as usize].as_dvec3().to_array());
        triangle
            .iter()
            .for_each(|c| areas[*c as usize] += bitlight_reference::geometry::area(&corners) / 3.0);
    }
    let positions: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.as_dvec3().to_array()).collect();
    let lit: Vec<f32> = mesh.normals.iter().map(|n| 1.0 + n.y).collect();
    let exact_lit: Vec<f64> = lit.iter().map(|e| f64::from(*e)).collect();
    let found = multiple_scattering(&mesh, &lit, 1, &medium, 0.0);
    let skin = material("Skin1").unwrap();
    for channel in 0..3 {
        // Ten millimetres to the unit.
        let medium = skin.medium(channel).with_unit(0.1);
        for vertex in (0..mesh.positions.len()).step_by(100) {
            let exact = transfer::multiple_scattering(&positions, &areas, &exact_lit, &medium, vertex);
            let found = f64::from(found[vertex * 3 + channel]);
            assert!(
                (found / exact - 1.0).abs() < 1e-4,
                "channel {channel}, vertex {vertex}: {found}, {exact}"
            );
        }
    }
}
