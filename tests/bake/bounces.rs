//! Interreflection: energy, closed rooms and form factors.

use super::{PI, grid, inverted, knot};
use bitlight::bake::{Directions, Estimate, diffuse_bounces, gather, meetings, vectors, visibility};
use bitlight::keys::Reading;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;

/// What the sky's part and the mesh's part of each hemisphere are, for a sky and surfaces of radiance 1.
fn parts(mesh: &Mesh, count: usize, estimate: Estimate) -> (Vec<f32>, Vec<f32>) {
    let directions = Directions::new(count);
    let seen = visibility(mesh, &directions);
    let met = meetings(mesh, &directions, &seen);
    let sky = vectors(mesh, &directions, &seen, 1, Reading::Corrected, estimate);
    let sky = sky.iter().map(|t| t * (4.0 * PI).sqrt() as f32).collect();
    (sky, gather(mesh, &directions, &met, estimate, &vec![1.0; mesh.positions.len()], 1))
}

#[test]
fn sky_and_surfaces_share_the_hemisphere() {
    let room = inverted(&shapes::sphere(5).unwrap());
    for (vertex, (sky, rest)) in {
        let (sky, rest) = parts(&room, 256, Estimate::Control);
        sky.into_iter().zip(rest).enumerate()
    } {
        assert!((sky + rest - 1.0).abs() < 1e-6, "vertex {vertex}: {sky} and {rest}");
        assert!(rest > 0.95, "a room sees itself: {rest}");
    }
}

/// After k bounces a closed room of emission e and albedo ρ has radiance e (1 − ρ^(k+1))/(1 − ρ). A vertex of
/// a polyhedron has directions above its horizon and outside of the faces around it; so ρ is less by what
/// little of the sky each sees.
#[test]
fn a_closed_room_fills_with_light() {
    let room = inverted(&shapes::sphere(8).unwrap());
    let directions = Directions::new(256);
    let seen = visibility(&room, &directions);
    let met = meetings(&room, &directions, &seen);
    let (sky, _) = parts(&room, 256, Estimate::Control);
    let (least, most) = sky.iter().fold((1.0_f32, 0.0_f32), |(a, b), s| (a.min(*s), b.max(*s)));
    assert!(most < 0.02, "{most} of the sky");
    let (emission, albedo) = (0.7, 0.8);
    let mut term = vec![emission; room.positions.len()];
    let mut total = term.clone();
    for bounce in 1..=12 {
        term = gather(&room, &directions, &met, Estimate::Control, &term, 1);
        term.iter_mut().for_each(|t| *t *= albedo);
        total.iter_mut().zip(&term).for_each(|(sum, t)| *sum += t);
        let [low, high] = [most, least].map(|leak| {
            let q = albedo * (1.0 - leak);
            emission * (1.0 - q.powi(bounce + 1)) / (1.0 - q)
        });
        for radiance in &total {
            assert!(
                *radiance > low - 1e-5 && *radiance < high + 1e-5,
                "bounce {bounce}: {radiance} is not in {low} to {high}"
            );
        }
        assert!(high / low < 1.08, "the closed form says little: {low} to {high}");
    }
}

#[test]
fn a_white_concave_solid_tends_to_the_light_around_it() {
    let (mesh, directions) = (knot(), Directions::new(512));
    let seen = visibility(&mesh, &directions);
    let met = meetings(&mesh, &directions, &seen);
    let direct = vectors(&mesh, &directions, &seen, 1, Reading::Corrected, Estimate::Control);
    let mut before = 0.0;
    for bounces in [0, 1, 2, 4, 30] {
        let all =
            diffuse_bounces(&mesh, &directions, &met, Estimate::Control, &direct, 1, Vec3::ONE, bounces);
        let radiance: Vec<f64> = all.iter().map(|t| f64::from(*t) * (4.0 * PI).sqrt()).collect();
        let (least, most) = radiance.iter().fold((2.0_f64, 0.0_f64), |(a, b), r| (a.min(*r), b.max(*r)));
        let mean = radiance.iter().sum::<f64>() / radiance.len() as f64;
        println!("{bounces:2} bounces: {least:.4} to {most:.4}, {mean:.4} on average");
        assert!(mean > before && most < 1.0 + 1e-6, "{bounces} bounces: {mean} after {before}, {most}");
        before = mean;
        // Directions that enter between a vertex's horizon and its faces meet the knot from behind: these are
        // lost.
        assert!(bounces > 0 || least < 0.6);
        assert!(bounces < 30 || least > 0.95, "{least}");
    }
}

#[test]
fn bounces_are_powers_of_the_albedo() {
    let (mesh, directions) = (knot(), Directions::new(256));
    let seen = visibility(&mesh, &directions);
    let met = meetings(&mesh, &directions, &seen);
    let direct = vectors(&mesh, &directions, &seen, 3, Reading::Corrected, Estimate::Control);
    let albedo = Vec3::new(0.25, 0.5, 1.0);
    let found = diffuse_bounces(&mesh, &directions, &met, Estimate::Control, &direct, 3, albedo, 2);
    let once = gather(&mesh, &directions, &met, Estimate::Control, &direct, 9);
    let twice = gather(&mesh, &directions, &met, Estimate::Control, &once, 9);
    for (index, rgb) in found.chunks_exact(3).enumerate() {
        for (found, rho) in rgb.iter().zip(albedo.to_array()) {
            let expected = rho * (direct[index] + rho * (once[index] + rho * twice[index]));
            assert!((found - expected).abs() < 1e-6, "{index}: {found} and {expected}");
        }
    }
}

/// Two unit squares that face each other at distance 1 exchange 0.199825; from the middle of one, the other
/// fills 0.239 by the formula of a rectangle's corner.
#[test]
fn facing_squares_have_the_known_form_factors() {
    let cells = 8;
    let (mut positions, mut triangles) = grid(cells, 1.0, 0.0, true);
    let count = positions.len();
    let (above, facing) = grid(cells, 1.0, 1.0, false);
    positions.extend(above);
    triangles.extend(facing.iter().map(|t| t.map(|corner| corner + count as u32)));
    let mesh = Mesh::new(positions, None, triangles).unwrap();
    let directions = Directions::new(16_384);
    let seen = visibility(&mesh, &directions);
    let met = meetings(&mesh, &directions, &seen);
    let upper: Vec<f32> = (0..2 * count).map(|vertex| if vertex < count { 0.0 } else { 1.0 }).collect();
    let found = gather(&mesh, &directions, &met, Estimate::Control, &upper, 1);
    assert!(found[count..].iter().all(|factor| *factor == 0.0), "the upper square does not see itself");
    let corner = |a: f64| {
        let s = (1.0 + a * a).sqrt();
        2.0 * a / s * (a / s).atan() / (2.0 * PI)
    };
    let middle = f64::from(found[cells / 2 * (cells + 1) + cells / 2]);
    assert!((middle - 4.0 * corner(0.5)).abs() < 1e-3, "{middle} and {}", 4.0 * corner(0.5));
    assert!((f64::from(found[0]) - corner(1.0)).abs() < 1e-3, "{} and {}", found[0], corner(1.0));
    // Simpson's rule over the vertices.
    let simpson = |i: usize| if i == 0 || i == cells { 1.0 } else { [2.0, 4.0][i % 2] };
    let mut mean = 0.0;
    for j in 0..=cells {
        for i in 0..=cells {
            mean += simpson(i) * simpson(j) * f64::from(found[j * (cells + 1) + i]);
        }
    }
    mean /= (3 * cells * 3 * cells) as f64;
    println!("form factor {mean:.5}");
    assert!((mean - 0.199_825).abs() < 3e-4, "{mean}");
}

/// A wall that shows its back is dark.
#[test]
fn light_does_not_leave_backs() {
    let (mut positions, mut triangles) = grid(1, 1.0, 0.0, true);
    let (above, facing) = grid(1, 1.0, 1.0, true);
    positions.extend(above);
    triangles.extend(facing.iter().map(|t| t.map(|corner| corner + 4)));
    let mesh = Mesh::new(positions, None, triangles).unwrap();
    let (sky, rest) = parts(&mesh, 1024, Estimate::Control);
    assert!(rest.iter().all(|factor| *factor == 0.0), "{rest:?}");
    assert!(sky[..4].iter().all(|sky| *sky < 0.9), "yet it blocks: {sky:?}");
}
