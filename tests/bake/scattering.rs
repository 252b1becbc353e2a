//! Subsurface scattering on half-spaces, where closed forms are known.

use super::{PI, grid, knot, rms};
use bitlight::bake::{
    Directions, Estimate, SingleScattering, irradiance, multiple_scattering, single_scattering, visibility,
};
use bitlight::trace::Bvh;
use bitlight::world::medium::Medium;
use bitlight::world::mesh::Mesh;
use bitlight_reference::sh::gauss_legendre;
use bitlight_reference::tables::material;
use bitlight_reference::transfer;
use glam::Vec3;

const SKIN: ([f32; 3], [f32; 3]) = ([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]);

/// Under even irradiance the middle of a large sheet returns R_d: where the grid resolves the kernel, where
/// its cells are about one mean free path, and where all stays within a vertex's own disc.
#[test]
fn a_flat_sheet_returns_the_total_reflectance() {
    let medium = Medium::new(SKIN.0, SKIN.1, 1.3, 1.0);
    for (side, tolerance) in [(16.0, 0.07), (40.0, 0.08), (80.0, 0.12), (640.0, 0.05), (60_000.0, 1e-3)] {
        let (positions, triangles) = grid(48, side, 0.0, true);
        let mesh = Mesh::new(positions, None, triangles).unwrap();
        let lit = vec![1.0; mesh.positions.len()];
        let middle = mesh.positions.len() / 2;
        let [exact, tree] = [0.0, 0.1].map(|spread| {
            let found = multiple_scattering(&mesh, &lit, 1, &medium, spread);
            [0, 1, 2].map(|channel| f64::from(found[middle * 3 + channel]) * PI)
        });
        let whole = medium.dipoles.map(|dipole| f64::from(dipole.reflectance()));
        println!(
            "sheet of {side} mm, cells of {} mm: {exact:.4?} of {whole:.4?}, tree {tree:.4?}",
            side / 48.0
        );
        for channel in 0..3 {
            let error = (exact[channel] / whole[channel] - 1.0).abs();
            assert!(error < tolerance, "side {side}, channel {channel}: {error}");
            assert!(
                (tree[channel] / exact[channel] - 1.0).abs() < 1e-2,
                "side {side}: {tree:?} and {exact:?}"
            );
        }
    }
}

#[test]
fn the_octree_is_near_the_sum_over_all_pairs() {
    let (mesh, directions) = (knot(), Directions::new(256));
    let medium = Medium::new(SKIN.0, SKIN.1, 1.3, 10.0);
    let seen = visibility(&mesh, &directions);
    let entering = irradiance(&mesh, &directions, &seen, 3, &medium, Estimate::Control);
    let exact = multiple_scattering(&mesh, &entering, 9, &medium, 0.0);
    let size = rms(&exact, &vec![0.0; exact.len()]);
    let mut before = 0.0;
    for spread in [0.01, 0.1, 1.0] {
        let error = rms(&multiple_scattering(&mesh, &entering, 9, &medium, spread), &exact) / size;
        println!("spread {spread}: {:.4} % RMS", 100.0 * error);
        assert!(error >= before && error < 0.1 * f64::from(spread), "spread {spread}: {error}");
        before = error;
    }
    assert!(before > 0.0, "a wide spread is not exact");
}

/// The irradiance that enters an unshadowed vertex under constant light is π times the mean transmittance.
#[test]
fn constant_light_enters_as_the_mean_transmittance_says() {
    let mesh = bitlight::world::shapes::sphere(2).unwrap();
    let directions = Directions::new(64);
    let medium = Medium::new(SKIN.0, SKIN.1, 1.5, 1.0);
    let seen = visibility(&mesh, &directions);
    let found = irradiance(&mesh, &directions, &seen, 4, &medium, Estimate::Control);
    // Schlick: 1 − F0 − (1 − F0)/21
    let mean = (1.0 - 0.04) * (20.0 / 21.0);
    for vertex in found.chunks_exact(16) {
        assert!((f64::from(vertex[0]) * (4.0 * PI).sqrt() - PI * mean).abs() < 1e-5, "{}", vertex[0]);
    }
}

/// A sheet so large that no ray from its middle vertex, the first, passes it.
fn sheet(height: f32, up: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let far = 1e5;
    let corners = [[0.0, 0.0], [far, far], [-far, far], [-far, -far], [far, -far]];
    let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
    let turn = |[a, b, c]: [u32; 3]| if up { [a, b, c] } else { [a, c, b] };
    (corners.map(|[x, y]| Vec3::new(x, y, height)).to_vec(), triangles.map(turn).to_vec())
}

/// Two sheets.
fn sheets(
    (mut positions, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>),
    other: (Vec<Vec3>, Vec<[u32; 3]>),
) -> Mesh {
    positions.extend(other.0);
    triangles.extend(other.1.iter().map(|t| t.map(|corner| corner + 5)));
    Mesh::new(positions, None, triangles).unwrap()
}

#[test]
fn single_scattering_in_slabs_is_the_closed_form() {
    let skin = material("Skin1").unwrap();
    let medium = Medium::new(SKIN.0, SKIN.1, 1.3, 1.0);
    let directions = Directions::new(4096);
    let scattering = SingleScattering { anisotropy: 0.0, points: 8 };
    let (half_space, slab) = (sheet(0.0, true), sheets(sheet(0.0, true), sheet(-0.7, false)));
    let half_space = Mesh::new(half_space.0, None, half_space.1).unwrap();
    for (mesh, thickness) in [(half_space, f64::INFINITY), (slab, 0.7)] {
        let bvh = Bvh::new(&mesh);
        for exit in [Vec3::Z, Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.0, -0.98, 0.199)] {
            let exit = exit.normalize();
            let exits = vec![exit; mesh.positions.len()];
            let found = single_scattering(&mesh, &bvh, &directions, &medium, scattering, 3, &exits);
            let mut rule = Vec::new();
            for (node, weight) in gauss_legendre(32) {
                let z: f64 = 0.5 * (node + 1.0);
                let across = (1.0 - z * z).sqrt();
                for azimuth in 0..8 {
                    let phi = 2.0 * PI * f64::from(azimuth) / 8.0;
                    for z in [z, -z] {
                        let direction = [across * phi.cos(), across * phi.sin(), z];
                        rule.push((direction, 0.5 * weight * 2.0 * PI / 8.0));
                    }
                }
            }
            for channel in 0..3 {
                let exact = transfer::slab_single_scattering(
                    &skin.medium(channel),
                    thickness,
                    |cosine| f64::from(medium.transmittance(cosine as f32)),
                    f64::from(exit.z),
                    3,
                    &rule,
                );
                for (i, exact) in exact.iter().enumerate() {
                    let found = f64::from(found[i * 3 + channel]);
                    let what = format!("thickness {thickness}, exit {exit}, channel {channel}, {i}");
                    assert!((found - exact).abs() < 1e-4, "{what}: {found} and {exact}");
                }
            }
            assert!(found[0] > 0.01, "something leaves: {}", found[0]);
        }
    }
}

/// A sheet above the half-space, far enough for the step off the surface, keeps all light from it.
#[test]
fn what_stands_outside_shadows_single_scattering() {
    let medium = Medium::new(SKIN.0, SKIN.1, 1.3, 1.0);
    let mesh = sheets(sheet(0.0, true), sheet(1000.0, true));
    let scattering = SingleScattering { anisotropy: 0.0, points: 4 };
    let exits = vec![Vec3::Z; 10];
    let found =
        single_scattering(&mesh, &Bvh::new(&mesh), &Directions::new(256), &medium, scattering, 2, &exits);
    // The middle of the lower sheet; the upper one is itself open to the sky.
    let lit: f32 = found[60..72].iter().map(|x| x.abs()).sum();
    let shadowed: f32 = found[..12].iter().map(|x| x.abs()).sum();
    assert!(lit > 0.01 && shadowed < 1e-3 * lit, "{shadowed} and {lit}");
}

/// What forward scattering takes from light that comes from behind the eye it gives to light that comes
/// against it.
#[test]
fn anisotropy_moves_light_forward() {
    let mesh = bitlight::world::shapes::sphere(6).unwrap();
    let (bvh, directions) = (Bvh::new(&mesh), Directions::new(512));
    let of = |anisotropy| {
        // σs is kept: Medium's σs' is the reduced one.
        let medium = Medium::new([0.5 * (1.0 - anisotropy); 3], [0.01; 3], 1.3, 1.0);
        let scattering = SingleScattering { anisotropy, points: 6 };
        let found = single_scattering(&mesh, &bvh, &directions, &medium, scattering, 2, &mesh.normals);
        // Along the normal: the light of the band 1 from −n less that from n.
        let n = mesh.normals[0];
        f64::from(-(found[3] * n.y + found[6] * n.z + found[9] * n.x) / found[0])
    };
    let [back, even, forward] = [-0.6, 0.0, 0.6].map(of);
    assert!(back < even && even < forward, "{back}, {even}, {forward}");
}
