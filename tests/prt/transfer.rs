//! What a vertex makes of light: visibility, vectors, matrices, bounces, scattering.

use super::{PI, Rendered, assert_near, rule};
use bitlight_reference::transfer::{self, Vertices};
use bitlight_reference::translucency::dipole::Medium;
use bitlight_reference::vector::{Vec3, dot};
use bitlight_reference::{geometry, sh, tables};

/// Every so many vertices are compared: brute force takes its time.
const STEP: usize = 7;

fn some(rendered: &Rendered) -> impl Iterator<Item = usize> {
    (0..rendered.mesh.positions.len()).step_by(STEP)
}

fn frames(rendered: &Rendered) -> Vec<[Vec3; 3]> {
    rendered.mesh.normals.iter().map(|normal| bitlight::bake::frame(*normal)).collect()
}

#[test]
fn visibility_is_that_of_all_triangles_one_by_one() {
    let rendered = Rendered::new(&[]);
    let triangles = rendered.triangles();
    let words = rendered.buffer("visibility").as_u32();
    let (mut seen, mut blocked) = (0, 0);
    for vertex in some(&rendered) {
        for (index, (direction, _)) in rule().iter().enumerate() {
            let bit = words[vertex * 3 + index / 32] >> (index % 32) & 1;
            let cosine = dot(rendered.normal(vertex), *direction);
            let exact = transfer::visibility(
                rendered.position(vertex),
                rendered.normal(vertex),
                *direction,
                &triangles,
            );
            assert!(f64::from(bit) == exact || cosine.abs() < 1e-6, "vertex {vertex}, direction {index}");
            seen += bit;
            blocked += u32::from(cosine > 0.0) - bit;
        }
    }
    assert!(seen > 200 && blocked > 200, "{seen} seen, {blocked} blocked");
}

#[test]
fn vectors_are_the_corrected_integral_or_the_printed_one() {
    let ours = Rendered::new(&[]);
    let printed = Rendered::new(&["prt.reading=paper", "prt.bounces=3"]);
    let triangles = ours.triangles();
    for vertex in some(&ours) {
        let (position, normal) = (ours.position(vertex), ours.normal(vertex));
        let white = transfer::vector(position, normal, 1.0, 3, &rule(), &triangles);
        let coloured: Vec<_> = white.iter().flat_map(|t| [0.8, 0.5, 0.25].map(|albedo| albedo * t)).collect();
        assert_near(ours.row("vectors", vertex), &coloured, 1e-6, "corrected");
        let letter = transfer::vector_as_printed(position, normal, 3, &rule(), &triangles);
        let letter: Vec<_> = letter.iter().flat_map(|t| [*t; 3]).collect();
        assert_near(printed.row("vectors", vertex), &letter, 1e-6, "printed");
    }
}

#[test]
fn a_control_makes_vertices_without_shadows_exact() {
    let set = ["prt.method=control", "solid.shape=sphere", "prt.directions=32"];
    let rendered = Rendered::new(&[&set[..], &["bend.angle=0"]].concat());
    let sums = Rendered::new(&[&set[1..], &["bend.angle=0"]].concat());
    let mut worst = 0.0_f64;
    for vertex in some(&rendered) {
        let y = sh::eval(3, rendered.normal(vertex));
        // (1/π) ∫ max(0, n·ω) y dω: 1, 2/3 and 1/4 of the band (Ramamoorthi and Hanrahan 2001).
        let exact: Vec<f64> = (0..9)
            .flat_map(|i: usize| [0.8, 0.5, 0.25].map(|rho| rho * y[i] * [1.0, 2.0 / 3.0, 0.25][i.isqrt()]))
            .collect();
        assert_near(rendered.row("vectors", vertex), &exact, 1e-6, "control");
        let off = |(found, exact): (&f32, &f64)| (f64::from(*found) - exact).abs();
        worst = worst.max(sums.row("vectors", vertex).iter().zip(&exact).map(off).fold(0.0, f64::max));
    }
    assert!(worst > 1e-3, "plain sums over so few directions are off: {worst}");
}

#[test]
fn a_diffuse_bounce_is_gathered_from_what_blocks() {
    let rendered = Rendered::new(&["prt.bounces=1"]);
    let direct = Rendered::new(&[]);
    let (triangles, frames) = (rendered.triangles(), frames(&rendered));
    let positions: Vec<_> = (0..rendered.mesh.positions.len()).map(|v| rendered.position(v)).collect();
    let corners: Vec<_> = rendered.mesh.triangles.iter().map(|t| t.map(|corner| corner as usize)).collect();
    let mesh = Vertices { corners: &corners, triangles: &triangles, positions: &positions, frames: &frames };
    // Function 2 of red: the direct part of all vertices is the source of the bounce.
    let source: Vec<_> = (0..positions.len()).map(|v| f64::from(direct.row("vectors", v)[2 * 3])).collect();
    let vertices: Vec<_> = some(&rendered).collect();
    let found: Vec<_> = vertices.iter().map(|v| rendered.row("vectors", *v)[2 * 3]).collect();
    let expected: Vec<_> = vertices
        .iter()
        .map(|v| source[*v] + 0.8 * transfer::diffuse_bounce(&mesh, *v, &source, &rule()))
        .collect();
    assert_near(&found, &expected, 1e-6, "one bounce");
    let most =
        found.iter().zip(&vertices).map(|(f, v)| (f64::from(*f) - source[*v]).abs()).fold(0.0, f64::max);
    assert!(most > 0.02, "the bounce brings {most}");
}

/// A rule over the directions above the surface alone, so that the horizon costs no accuracy.
pub(super) fn hemisphere() -> Vec<(Vec3, f64)> {
    let mut rule = Vec::new();
    for (node, weight) in sh::gauss_legendre(16) {
        let z = 0.5 * (node + 1.0);
        for azimuth in 0..24 {
            let phi = 2.0 * PI * (f64::from(azimuth) + 0.5) / 24.0;
            let across = (1.0 - z * z).sqrt();
            rule.push(([across * phi.cos(), across * phi.sin(), z], 0.5 * weight * 2.0 * PI / 24.0));
        }
    }
    rule
}

#[test]
fn matrices_the_brdf_and_a_glossy_bounce_are_those_of_eq_5() {
    let rendered = Rendered::new(&["surface.highlight=phong", "prt.bounces=1"]);
    let (triangles, frames) = (rendered.triangles(), frames(&rendered));
    for vertex in some(&rendered) {
        let exact = transfer::matrix(rendered.position(vertex), frames[vertex], 3, &rule(), &triangles);
        assert_near(rendered.row("matrices", vertex), &exact, 1e-6, "M");
    }
    let phong = |light: Vec3, exit: Vec3| {
        let cosine = exit[2] * light[2] - exit[0] * light[0] - exit[1] * light[1];
        let above = light[2] > 0.0 && exit[2] > 0.0;
        let lobe = if cosine > 0.0 { cosine.powi(7) } else { 0.0 };
        // Green: albedo 0.5, specular 0.25.
        if above { 0.5 / PI + 0.25 * 9.0 / (2.0 * PI) * lobe } else { 0.0 }
    };
    let brdf = transfer::brdf_matrix(phong, 3, &hemisphere());
    let found: Vec<f32> = rendered.buffer("brdf").as_f32().iter().skip(1).step_by(3).copied().collect();
    assert_near(&found, &brdf, 2e-4, "B");

    let positions: Vec<_> = (0..rendered.mesh.positions.len()).map(|v| rendered.position(v)).collect();
    let corners: Vec<_> = rendered.mesh.triangles.iter().map(|t| t.map(|corner| corner as usize)).collect();
    let mesh = Vertices { corners: &corners, triangles: &triangles, positions: &positions, frames: &frames };
    let widen = |row: &[f32]| row.iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let before: Vec<_> = (0..positions.len()).map(|v| widen(rendered.row("matrices", v))).collect();
    for vertex in some(&rendered).step_by(4) {
        let bounce = transfer::glossy_bounce(&mesh, vertex, &before, &widen(&found), 3, &rule());
        let expected: Vec<_> =
            before[vertex].iter().zip(bounce).map(|(direct, bounce)| direct + bounce).collect();
        let green: Vec<f32> = rendered.row("bounced", vertex).iter().skip(1).step_by(3).copied().collect();
        assert_near(&green, &expected, 2e-6, "one bounce");
    }
}

#[test]
fn scattering_is_the_dipole_over_all_vertices() {
    let rendered = Rendered::new(&["prt.subsurface=dipole"]);
    let triangles = rendered.triangles();
    let skin = tables::material("Skin1").unwrap();
    let count = rendered.mesh.positions.len();
    let positions: Vec<_> = (0..count).map(|v| rendered.position(v)).collect();
    let mut areas = vec![0.0; count];
    for (corners, triangle) in rendered.mesh.triangles.iter().zip(&triangles) {
        corners.iter().for_each(|corner| areas[*corner as usize] += geometry::area(triangle) / 3.0);
    }
    // Function 0: irradiance through Schlick's surface.
    let r0 = ((1.3_f64 - 1.0) / 2.3).powi(2);
    let entering: Vec<f64> = (0..count)
        .map(|v| {
            let (position, normal) = (positions[v], rendered.normal(v));
            let terms = rule().into_iter().map(|(direction, weight)| {
                let cosine = dot(normal, direction);
                let through = 1.0 - r0 - (1.0 - r0) * (1.0 - cosine).powi(5);
                let seen = transfer::visibility(position, normal, direction, &triangles);
                if seen > 0.0 { weight * cosine * through * sh::y(0, 0, direction) } else { 0.0 }
            });
            terms.sum()
        })
        .collect();
    for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let medium: Medium = skin.medium(channel);
        let vertices: Vec<_> = some(&rendered).collect();
        let found: Vec<_> = vertices.iter().map(|v| rendered.row("scattered", *v)[channel]).collect();
        let exact: Vec<_> = vertices
            .iter()
            .map(|v| transfer::multiple_scattering(&positions, &areas, &entering, &medium, *v))
            .collect();
        assert_near(&found, &exact, 1e-2, name); // far vertices are taken together
    }
}

#[test]
fn what_is_not_asked_for_is_empty() {
    let empty = |set: &[&str]| {
        let rendered = Rendered::new(set);
        let names = rendered.kept.0.iter().filter(|(.., buffer)| buffer.data.is_empty());
        names.map(|(info, ..)| info.name).collect::<Vec<_>>()
    };
    assert_eq!(empty(&[]), ["prt.matrices", "prt.brdf", "prt.bounced", "prt.exits", "prt.scattered"]);
    assert_eq!(
        empty(&["surface.highlight=phong"]),
        ["prt.vectors", "prt.brdf", "prt.bounced", "prt.scattered"]
    );
    let all = ["surface.highlight=cook-torrance", "prt.bounces=1", "prt.subsurface=dipole"];
    assert_eq!(empty(&all), ["prt.vectors"]);
}
