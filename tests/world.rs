//! The OBJ reader against garbage, against a plainer reader, and on real models.

use bitlight::store::file;
use std::io::Write;
use std::path::PathBuf;

use bitlight::world::mesh::{Facts, MAX_COORDINATE, Mesh};
use bitlight::world::obj;
use glam::Vec3;
use proptest::prelude::*;

/// What every mesh promises, whatever file it came from.
fn check(mesh: &Mesh) {
    assert!(!mesh.triangles.is_empty());
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    assert!(mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < mesh.positions.len()));
    assert!(mesh.positions.iter().all(|p| p.to_array().iter().all(|c| c.abs() <= MAX_COORDINATE)));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    let facts = mesh.facts();
    assert!(facts.area > 0.0 && facts.area.is_finite() && facts.signed_volume.is_finite());
    assert!(facts.bounds.radius().is_finite());
}

fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        8 => (-3i8..8).prop_map(|n| n.to_string()),
        2 => any::<f32>().prop_map(|x| x.to_string()),
        1 => prop::sample::select(vec![
            "nan", "-inf", "1e39", "1e-45", "1e18", "-1e18", "18446744073709551616", "-9223372036854775808",
            "4294967297", "x", "\\", "#", "+1", "1.", "-0",
        ]).prop_map(str::to_string),
    ]
}

fn corner() -> impl Strategy<Value = String> {
    prop_oneof![
        6 => (1u8..6).prop_map(|n| n.to_string()),
        2 => (1u8..6, 1u8..4).prop_map(|(v, n)| format!("{v}//{n}")),
        2 => prop::collection::vec(number(), 1..5).prop_map(|fields| fields.join("/")),
    ]
}

fn line() -> impl Strategy<Value = String> {
    let numbers = |count| prop::collection::vec(number(), count).prop_map(|words| words.join(" "));
    prop_oneof![
        6 => numbers(3..5).prop_map(|rest| format!("v {rest}")),
        2 => numbers(3..4).prop_map(|rest| format!("vn {rest}")),
        1 => numbers(0..4).prop_map(|rest| format!("vt {rest}")),
        6 => prop::collection::vec(corner(), 3..6).prop_map(|words| format!("f {}", words.join(" "))),
        1 => prop::sample::select(vec!["o a", "g", "usemtl", "mtllib /", "l 1 2 3", "f 1", "# f", "", "v"])
            .prop_map(str::to_string),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(mesh) = obj::parse(&bytes, "random.obj") {
            check(&mesh);
        }
    }

    #[test]
    fn nearly_right_files_give_a_valid_mesh_or_an_error_with_a_remedy(
        good in 3usize..6,
        lines in prop::collection::vec(line(), 0..6),
    ) {
        // Enough good vertices that many of the faces hold.
        let mut text: String = (0..good).map(|i| format!("v {i} {} {}\nvn 0 {i} 0\n", i * i, i % 2)).collect();
        text.push_str("f 1 2 3\n");
        text.push_str(&lines.join("\n"));
        match obj::parse(text.as_bytes(), "soup.obj") {
            Ok(mesh) => check(&mesh),
            Err(error) => {
                prop_assert!(error.file.is_some() && error.remedy.is_some(), "{error}");
            }
        }
    }
}

/// The real model, or nothing and a line that says why.
fn asset(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("BITLIGHT_ASSETS") else {
        return skip(name, "BITLIGHT_ASSETS does not name the folder of the real models");
    };
    let path = PathBuf::from(folder).join(name);
    if !path.is_file() {
        return skip(name, "it is not in the folder that BITLIGHT_ASSETS names");
    }
    Some(path)
}

/// Says so past the test harness, which would keep the output of a passing test to itself.
fn skip(name: &str, why: &str) -> Option<PathBuf> {
    let mut screen = std::io::stderr();
    writeln!(screen, "skipped the test of {name}: {why}").unwrap();
    None
}

/// Reads a model, holds the place of every corner against what a reader of the plainest files sees, and
/// returns its facts.
fn read(path: &PathBuf) -> Facts {
    let mesh = file::read_obj(path).unwrap();
    check(&mesh);
    let (mut positions, mut corners) = (Vec::new(), Vec::new());
    for line in std::fs::read_to_string(path).unwrap().lines() {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["v", x, y, z] => positions.push(Vec3::from([x, y, z].map(|number| number.parse().unwrap()))),
            ["f", a, b, c] => corners
                .extend([a, b, c].map(|vertex| {
                    positions[vertex.split('/').next().unwrap().parse::<usize>().unwrap() - 1]
                })),
            _ => {}
        }
    }
    assert!(mesh.triangles.iter().flatten().map(|&corner| mesh.positions[corner as usize]).eq(corners));
    let facts = mesh.facts();
    assert_eq!(facts.vertices, facts.used_vertices);
    facts
}

#[test]
fn the_bunny_has_its_known_holes_and_loses_its_strays() {
    let Some(path) = asset("stanford/stanford-bunny.obj") else { return };
    let facts = read(&path);
    assert_eq!((facts.vertices, facts.triangles), (34_834, 69_451));
    assert_eq!((facts.boundary_edges, facts.non_manifold_edges), (223, 0));
    assert!(!facts.closed);
}

#[test]
fn the_buddha_has_its_known_non_manifold_edges() {
    let Some(path) = asset("stanford/buddha.obj") else { return };
    let facts = read(&path);
    assert_eq!((facts.vertices, facts.triangles), (49_950, 100_000));
    assert_eq!(facts.non_manifold_edges, 50);
}

#[test]
fn the_armadillo_is_a_closed_manifold() {
    let Some(path) = asset("stanford/armadillo.obj") else { return };
    let facts = read(&path);
    assert_eq!((facts.vertices, facts.triangles), (43_243, 86_482));
    assert_eq!((facts.boundary_edges, facts.non_manifold_edges), (0, 0));
    assert_eq!(facts.euler_characteristic, 2);
    assert!(facts.closed && facts.signed_volume > 0.0);
}
