//! Meshes that are no solids, and the same bits whatever the threads.

use super::knot;
use bitlight::bake::{
    Directions, Estimate, Meetings, SingleScattering, Visibility, brdf, diffuse_bounces, gather,
    glossy_bounces, irradiance, matrices, meetings, multiple_scattering, single_scattering, vectors,
    visibility,
};
use bitlight::keys::Reading;
use bitlight::trace::Bvh;
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::medium::Medium;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;

/// A name, items a vertex, and the items.
type Result = (&'static str, usize, Vec<f32>);

/// Everything that a bake gives for a mesh, each with its items a vertex.
fn all(mesh: &Mesh) -> (Visibility, Meetings, Vec<Result>) {
    let directions = Directions::new(100);
    let bvh = Bvh::new(mesh);
    let seen = visibility(mesh, &directions);
    let met = meetings(mesh, &directions, &seen);
    let medium = Medium::new([0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3, 10.0);
    let control = Estimate::Control;
    let direct = vectors(mesh, &directions, &seen, 3, Reading::Corrected, control);
    let entering = irradiance(mesh, &directions, &seen, 3, &medium, control);
    let matrix = matrices(mesh, &directions, &seen, 2, control, 0..mesh.positions.len());
    let gloss = Brdf { albedo: Vec3::splat(0.5), specular: Vec3::X, gloss: Gloss::Phong { exponent: 4.0 } };
    let gloss = brdf::matrix(&gloss, 2);
    let single = SingleScattering { anisotropy: 0.3, points: 3 };
    let results = vec![
        ("printed", 9, vectors(mesh, &directions, &seen, 3, Reading::Paper, Estimate::Plain)),
        ("plain", 9, vectors(mesh, &directions, &seen, 3, Reading::Corrected, Estimate::Plain)),
        ("bounced", 27, diffuse_bounces(mesh, &directions, &met, control, &direct, 3, Vec3::splat(0.5), 2)),
        ("glossy", 48, glossy_bounces(mesh, &directions, &met, control, &matrix, 2, &gloss, 1)),
        ("gathered", 9, gather(mesh, &directions, &met, control, &direct, 9)),
        ("scattered", 27, multiple_scattering(mesh, &entering, 9, &medium, 0.1)),
        ("single", 27, single_scattering(mesh, &bvh, &directions, &medium, single, 3, &mesh.normals)),
        ("direct", 9, direct),
        ("entering", 9, entering),
        ("matrix", 16, matrix),
    ];
    (seen, met, results)
}

/// A mesh and more of it.
fn and(mesh: &Mesh, positions: &[Vec3], triangles: &[[u32; 3]]) -> Mesh {
    let count = mesh.positions.len() as u32;
    let mut all = mesh.clone();
    all.positions.extend(positions);
    all.triangles.extend(triangles.iter().map(|t| t.map(|corner| corner + count)));
    Mesh::new(all.positions, None, all.triangles).unwrap()
}

#[test]
fn an_unused_vertex_has_nothing() {
    let mesh = knot();
    let more = and(&mesh, &[Vec3::new(0.0, 3.0, 0.0), Vec3::splat(1e6)], &[]);
    let (seen, met, results) = all(&more);
    for vertex in [mesh.positions.len(), mesh.positions.len() + 1] {
        let (visible, blocked) = seen.of(vertex);
        assert!(visible.iter().chain(blocked).all(|word| *word == 0) && met.of(vertex).is_empty());
        for (name, width, values) in &results {
            assert!(values[vertex * width..(vertex + 1) * width].iter().all(|x| *x == 0.0), "{name}");
        }
    }
    // And the others do not feel it.
    let recomputed = Mesh::new(mesh.positions.clone(), None, mesh.triangles.clone()).unwrap();
    let (_, _, alone) = all(&recomputed);
    for ((name, width, with), (_, _, without)) in results.iter().zip(&alone) {
        // The box of the mesh bounds the used vertices alone, so even the octree is the same.
        assert_eq!(with[..mesh.positions.len() * width], without[..], "{name}");
    }
}

#[test]
fn a_vertex_inside_sees_nothing_and_gets_nothing() {
    let outer = shapes::sphere(4).unwrap();
    let inner = shapes::sphere(1).unwrap();
    let small: Vec<Vec3> = inner.positions.iter().map(|p| *p * 0.2).collect();
    let (seen, met, results) = all(&and(&outer, &small, &inner.triangles));
    for vertex in outer.positions.len()..outer.positions.len() + small.len() {
        let (visible, blocked) = seen.of(vertex);
        assert!(visible.iter().all(|word| *word == 0) && blocked.iter().any(|word| *word != 0));
        assert!(met.of(vertex).is_empty(), "the sphere around it shows its back");
        for (name, width, values) in &results {
            // Light that scatters within the outer sphere may reach it.
            if !name.contains("scattered") && *name != "single" {
                assert!(values[vertex * width..(vertex + 1) * width].iter().all(|x| *x == 0.0), "{name}");
            }
        }
    }
}

#[test]
fn open_and_non_manifold_meshes_and_slivers_stay_finite() {
    let mut open = knot();
    open.triangles.truncate(open.triangles.len() / 3);
    let fan = Mesh::new(
        vec![Vec3::ZERO, Vec3::Z, Vec3::X, Vec3::Y, -Vec3::X, Vec3::new(0.0, 0.0, 0.5)],
        None,
        // Three triangles about one edge, one without area, and one twice.
        vec![[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 5, 1], [0, 1, 3]],
    )
    .unwrap();
    for mesh in [open, fan] {
        let (_, _, results) = all(&mesh);
        for (name, _, values) in results {
            assert!(values.iter().all(|x| x.is_finite()), "{name}");
            assert!(
                name == "glossy" || name == "gathered" || values.iter().any(|x| *x != 0.0),
                "{name} is empty"
            );
        }
    }
}

#[test]
fn visibility_is_rebuilt_from_its_bits() {
    let (mesh, directions) = (knot(), Directions::new(100));
    let seen = visibility(&mesh, &directions);
    assert_eq!(Visibility::from_bits(&mesh, &directions, seen.visible.clone()), seen);
    for vertex in 0..mesh.positions.len() {
        let (visible, blocked) = seen.of(vertex);
        let bits = |words: &[u32]| words.iter().map(|word| word.count_ones()).sum::<u32>();
        let above = directions.rays.iter().filter(|ray| mesh.normals[vertex].dot(**ray) > 0.0).count();
        assert_eq!(bits(visible) + bits(blocked), above as u32);
    }
}

#[cfg(feature = "threads")]
#[test]
fn threads_change_no_bit() {
    let bits = |threads| {
        let mesh = shapes::torus_knot(2, 3, 0.3, 40, 7).unwrap();
        let (seen, _, results) = bitlight::numeric::parallel::with_threads(threads, || all(&mesh)).unwrap();
        let values: Vec<u32> = results.iter().flat_map(|(_, _, v)| v.iter().map(|x| x.to_bits())).collect();
        (seen, values)
    };
    let one = bits(1);
    assert!(bits(2) == one && bits(3) == one);
}
