//! Decimation against what must hold of any surface with fewer triangles. Everything is counted and measured
//! here from positions alone, by none of the code that decimates.

use bitlight::store::file;
use std::collections::BTreeMap;
use std::io::Write;

use bitlight::numeric::order::{max, min};
use bitlight::world::decimate::decimate;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::{DVec3, Vec3};
use proptest::prelude::*;

/// What a surface is, by the places of its corners. Triangles with two corners in one place are left out.
#[derive(Debug, PartialEq)]
struct Kind {
    /// Places − edges + triangles.
    euler: i64,
    pieces: usize,
    /// Edges by their number of triangles: one, and more than two.
    boundary: usize,
    crossings: usize,
    /// Places with more than two boundary edges.
    pinches: usize,
    /// Whether each edge is run through as often one way as the other.
    closed: bool,
}

fn kind(mesh: &Mesh) -> Kind {
    let mut names = BTreeMap::new();
    let mut name = |corner: u32| {
        let place = mesh.positions[corner as usize].to_array().map(|x| (x + 0.0).to_bits());
        let next = names.len();
        *names.entry(place).or_insert(next)
    };
    let triangles: Vec<[usize; 3]> = mesh.triangles.iter().map(|corners| corners.map(&mut name)).collect();
    let whole = |t: &&[usize; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let (mut edges, mut piece) = (BTreeMap::<_, Vec<_>>::new(), BTreeMap::new());
    let mut count = 0;
    for t in triangles.iter().filter(whole) {
        count += 1;
        for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry((from.min(to), from.max(to))).or_default().push(from < to);
            piece.insert(from, from);
        }
    }
    // Names of pieces spread along edges until nothing changes.
    loop {
        let mut spread = false;
        for &(a, b) in edges.keys() {
            let least = piece[&a].min(piece[&b]);
            for end in [a, b] {
                spread |= piece.insert(end, least) != Some(least);
            }
        }
        if !spread {
            break;
        }
    }
    let mut rim = BTreeMap::<_, usize>::new();
    for (&(a, b), _) in edges.iter().filter(|(_, uses)| uses.len() == 1) {
        [a, b].into_iter().for_each(|end| *rim.entry(end).or_default() += 1);
    }
    Kind {
        euler: piece.len() as i64 - edges.len() as i64 + count,
        pieces: piece.iter().filter(|(vertex, piece)| vertex == piece).count(),
        boundary: edges.values().filter(|uses| uses.len() == 1).count(),
        crossings: edges.values().filter(|uses| uses.len() > 2).count(),
        pinches: rim.values().filter(|edges| **edges > 2).count(),
        closed: edges.values().all(|uses| 2 * uses.iter().filter(|way| **way).count() == uses.len()),
    }
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|corner| DVec3::from(mesh.positions[corner as usize])))
}

/// Surface and enclosed volume.
fn extents(mesh: &Mesh) -> [f64; 2] {
    let area = corners(mesh).map(|[a, b, c]| (b - a).cross(c - b).length() / 2.0).sum();
    [area, corners(mesh).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()]
}

fn close(found: f64, expected: f64, part: f64) {
    assert!((found - expected).abs() <= part * expected.abs(), "{found}, not {expected}");
}

/// What holds of every result: no more than `most`, and no fewer than one less; every vertex used; no
/// triangle folded onto its neighbour, or without an area; unit normals that are those of a mesh without.
fn decimated(mesh: &Mesh, most: usize) -> Mesh {
    let fewer = decimate(mesh.clone(), most).unwrap();
    assert!([most, most - 1].contains(&fewer.triangles.len()), "{} of {most}", fewer.triangles.len());
    let again = Mesh::new(fewer.positions.clone(), None, fewer.triangles.clone()).unwrap();
    assert_eq!(again, fewer);
    assert_eq!(fewer.used_positions().count(), fewer.positions.len());
    assert!(corners(&fewer).all(|[a, b, c]| (b - a).cross(c - a) != DVec3::ZERO));
    fewer
}

/// The plain x, y of a grid of `columns` × `rows` rectangles, and its triangles.
fn grid(columns: u32, rows: u32, at: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for y in 0..=rows {
        for x in 0..=columns {
            positions.push(at(x as f32 / columns as f32, y as f32 / rows as f32));
            if x < columns && y < rows {
                let corner = y * (columns + 1) + x;
                triangles.push([corner, corner + 1, corner + columns + 2]);
                triangles.push([corner, corner + columns + 2, corner + columns + 1]);
            }
        }
    }
    Mesh::new(positions, None, triangles).unwrap()
}

#[test]
fn a_flat_sheet_keeps_its_plane_its_rim_and_its_corners() {
    let sheet = grid(40, 30, |x, y| Vec3::new(0.7 * x, 0.3, 1.3 * y));
    for most in [2399, 1000, 101, 20, 2] {
        let fewer = decimated(&sheet, most);
        assert!(fewer.positions.iter().all(|p| p.y == 0.3));
        assert!(fewer.normals.iter().all(|n| *n == -Vec3::Y));
        close(extents(&fewer)[0], f64::from(0.7_f32) * f64::from(1.3_f32), 1e-12);
        for corner in [[0.0, 0.0], [0.7, 0.0], [0.0, 1.3], [0.7, 1.3]] {
            let corner = Vec3::new(corner[0], 0.3, corner[1]);
            assert!(fewer.positions.iter().any(|p| p.distance(corner) < 1e-12), "{most}: {corner}");
        }
        let on_rim = |p: &DVec3| {
            let on = |x: f64, length: f32| x.abs() < 1e-12 || x == f64::from(length);
            on(p.x, 0.7) || on(p.z, 1.3)
        };
        let whole = kind(&fewer);
        assert_eq!((whole.euler, whole.pieces, whole.crossings), (1, 1, 0));
        let rim: std::collections::BTreeSet<_> =
            corners(&fewer).flatten().filter(on_rim).map(|p| p.to_array().map(f64::to_bits)).collect();
        assert_eq!(whole.boundary, rim.len(), "the rim is one ring");
    }
}

#[test]
fn a_finely_divided_cuboid_keeps_its_faces_down_to_twelve_triangles() {
    let half = Vec3::new(1.0, 0.3, 0.77);
    let cuboid = shapes::cuboid(half, 24).unwrap();
    let exact = extents(&shapes::cuboid(half, 1).unwrap());
    for most in [6000, 1001, 100, 12] {
        let fewer = decimated(&cuboid, most);
        for (found, exact) in extents(&fewer).into_iter().zip(exact) {
            close(found, exact, 1e-12);
        }
        assert!(fewer.positions.iter().all(|p| (p.abs().cmpeq(half)).any()), "every vertex is on a face");
        let on_corners = fewer.positions.iter().filter(|p| p.abs() == half).count();
        assert_eq!(on_corners, 8);
        assert_eq!(
            kind(&fewer),
            Kind { euler: 2, pieces: 1, boundary: 0, crossings: 0, pinches: 0, closed: true }
        );
    }
}

#[test]
fn flat_parts_get_even_triangles_and_not_a_fan() {
    let fewer = decimated(&shapes::cuboid(Vec3::ONE, 32).unwrap(), 600);
    let mut around = vec![0; fewer.positions.len()];
    fewer.triangles.iter().flatten().for_each(|&corner| around[corner as usize] += 1);
    assert!(around.iter().all(|triangles| *triangles <= 12), "{around:?}");
    let area = extents(&fewer)[0];
    let largest = corners(&fewer).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).fold(0.0, max);
    assert!(largest < 8.0 * area / 600.0, "{largest}");
}

#[test]
fn a_closed_solid_stays_closed_with_its_handles() {
    let solids = [
        (shapes::sphere(12).unwrap(), 2, 4),
        (shapes::torus_knot(2, 3, 0.35, 96, 12).unwrap(), 0, 30),
        (shapes::genus3(1).unwrap(), -4, 80),
    ];
    for (solid, euler, least) in solids {
        let [area, volume] = extents(&solid);
        for most in [1000, 301, least] {
            let fewer = decimated(&solid, most);
            assert_eq!(
                kind(&fewer),
                Kind { euler, pieces: 1, boundary: 0, crossings: 0, pinches: 0, closed: true }
            );
            if most > 900 {
                close(extents(&fewer)[0], area, 0.02);
                close(extents(&fewer)[1], volume, 0.03);
            }
        }
    }
}

#[test]
fn a_narrow_neck_is_not_pinched() {
    for across in [1, 2, 3] {
        let neck = |x: f32| 1e-5 + (x - 0.5) * (x - 0.5);
        // The rows crowd towards one side.
        let sheet = grid(20, across, |x, y| Vec3::new(x, y.sqrt() * neck(x), 0.0));
        for most in [38 * across as usize, 31, 10, 4] {
            let found = kind(&decimated(&sheet, most));
            assert_eq!((found.euler, found.pieces, found.crossings, found.pinches), (1, 1, 0, 0));
        }
    }
}

#[test]
fn two_pieces_stay_two() {
    let mut two = shapes::sphere(6).unwrap();
    let count = two.positions.len() as u32;
    two.positions.extend(two.positions.clone().iter().map(|p| *p + 3.0 * Vec3::X));
    two.triangles.extend(two.triangles.clone().iter().map(|t| t.map(|corner| corner + count)));
    let two = Mesh::new(two.positions, None, two.triangles).unwrap();
    for most in [500, 50, 8] {
        let found = kind(&decimated(&two, most));
        assert_eq!(found, Kind { euler: 4, pieces: 2, boundary: 0, crossings: 0, pinches: 0, closed: true });
    }
    assert!(decimate(two, 7).is_err());
}

/// The vertices of an upright sheet stand on the middles of a level one's edges.
#[test]
fn no_vertex_moves_into_the_place_of_another() {
    let mut two = grid(8, 8, |x, y| Vec3::new(16.0 * x, 16.0 * y, 0.0));
    let upright = grid(4, 2, |x, z| Vec3::new(16.0 * x - 1.0, 8.0, 8.0 * z - 4.0));
    let count = two.positions.len() as u32;
    two.positions.extend(upright.positions);
    two.triangles.extend(upright.triangles.iter().map(|t| t.map(|corner| corner + count)));
    let two = Mesh::new(two.positions, None, two.triangles).unwrap();
    for most in (6..143).step_by(9) {
        let found = kind(&decimated(&two, most));
        assert_eq!((found.euler, found.pieces, found.crossings, found.pinches), (2, 2, 0, 0), "{most}");
    }
}

/// N equal triangles on the unit sphere have an area of 4π/N each; equilateral ones then have corners at
/// r² = 16π / (3√3 N) from their middles, which lie 1 − √(1 − r²) below the sphere.
fn chord(triangles: usize) -> f64 {
    let r2 = 16.0 * std::f64::consts::PI / (3.0 * 3.0_f64.sqrt() * triangles as f64);
    1.0 - (1.0 - r2).sqrt()
}

#[test]
fn a_sphere_loses_no_more_than_the_chord_of_its_triangles() {
    let sphere = shapes::sphere(32).unwrap();
    for most in [10_000, 2000, 500, 100, 20] {
        let (fewer, chord) = (decimated(&sphere, most), chord(most));
        let heights = fewer.positions.iter().map(|p| DVec3::from(*p).length() - 1.0);
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        heights.for_each(|height| (low, high) = (min(low, height), max(high, height)));
        assert!(low > -0.1 * chord && high < chord, "{most}: {low} to {high} of {chord}");
        let deepest = corners(&fewer).map(|[a, b, c]| 1.0 - ((a + b + c) / 3.0).length()).fold(0.0, max);
        assert!(deepest < 2.0 * chord, "{most}: {deepest} of {chord}");
        // Triangles with their corners on the sphere are 3/4 of the chord below it on average.
        let [_, volume] = extents(&fewer);
        let loss = 1.0 - volume / (4.0 / 3.0 * std::f64::consts::PI);
        assert!(loss > 0.0 && loss < 3.0 * 0.75 * chord, "{most}: {loss} of {chord}");
    }
}

#[test]
fn three_sheets_that_meet_keep_their_common_line() {
    // Wings at three angles around the z axis, each 16 × 16.
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for way in [Vec3::X, Vec3::new(-0.5, 0.75, 0.0), Vec3::new(-0.5, -0.75, 0.0)] {
        let wing = grid(16, 16, |x, y| x * way + y * Vec3::Z);
        let first = positions.len() as u32;
        triangles.extend(wing.triangles.iter().map(|t| t.map(|corner| corner + first)));
        positions.extend(wing.positions);
    }
    let wings = Mesh::new(positions, None, triangles).unwrap();
    let area = extents(&wings)[0];
    for most in [1000, 200, 51] {
        let fewer = decimated(&wings, most);
        let found = kind(&fewer);
        assert_eq!((found.euler, found.pieces, found.crossings), (1, 1, 16), "{most}");
        for step in 0..=16 {
            assert!(fewer.positions.contains(&Vec3::new(0.0, 0.0, step as f32 / 16.0)), "{most}: {step}");
        }
        close(extents(&fewer)[0], area, 1e-6);
    }
    // A triangle on each of 16 edges of the line in each wing, and one more at each far corner but the fans'
    // ends.
    let least = decimate(wings.clone(), 1).unwrap_err().remedy.unwrap();
    let least = least.strip_prefix("ask for ").unwrap().strip_suffix(" or more").unwrap().parse().unwrap();
    assert!((48..=51).contains(&least), "{least}");
    assert_eq!(kind(&decimated(&wings, least)).crossings, 16);
}

#[test]
fn strays_doubles_and_triangles_without_area_do_no_harm() {
    let plain = grid(12, 12, |x, y| Vec3::new(x, y, 0.0));
    let (mut positions, mut triangles) = (plain.positions.clone(), plain.triangles.clone());
    positions.splice(0..0, [Vec3::splat(1e9), Vec3::splat(-1e9)]);
    triangles.iter_mut().for_each(|t| *t = t.map(|corner| corner + 2));
    let again = positions.len() as u32;
    positions.extend(plain.positions.iter().map(|p| *p * -1.0 * -1.0));
    // One triangle by the doubles of its corners, one with two corners in one place, a needle on a rim edge.
    triangles[40] = plain.triangles[40].map(|corner| corner + again);
    triangles.push([2, again, 3]);
    positions.push(Vec3::new(0.5 / 12.0, 0.0, 0.0));
    triangles.push([2, positions.len() as u32 - 1, 3]);
    let mesh = Mesh::new(positions, None, triangles).unwrap();
    for most in [200, 50, 3] {
        let fewer = decimate(mesh.clone(), most).unwrap();
        assert!([most, most - 1].contains(&fewer.triangles.len()));
        assert_eq!(fewer.bounds(), plain.bounds());
        close(extents(&fewer)[0], 1.0, 1e-12);
        assert_eq!(kind(&fewer).euler, kind(&mesh).euler);
    }
}

#[test]
fn what_has_no_more_is_left_as_it_is_and_too_few_is_refused() {
    let sphere = shapes::sphere(3).unwrap();
    for most in [180, 181, usize::MAX] {
        assert_eq!(decimate(sphere.clone(), most).unwrap(), sphere, "with its exact normals");
    }
    for most in [0, 1, 3] {
        let error = decimate(sphere.clone(), most).unwrap_err().to_string();
        assert!(error.contains("fewer than 4 triangles") && error.ends_with("ask for 4 or more"), "{error}");
    }
    let one = Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], None, vec![[0, 1, 2]]).unwrap();
    assert!(decimate(one, 0).is_err());
    assert_eq!(decimated(&sphere, 4).positions.len(), 4);
}

#[test]
fn the_same_mesh_gives_the_same_bits() {
    let knot = shapes::torus_knot(2, 3, 0.35, 96, 12).unwrap();
    let fewer = decimated(&knot, 700);
    assert_eq!(decimated(&knot, 700), fewer);
    let mut digest = blake3::Hasher::new();
    for number in fewer.positions.iter().flat_map(|p| p.to_array()) {
        digest.update(&number.to_le_bytes());
    }
    for corner in fewer.triangles.iter().flatten() {
        digest.update(&corner.to_le_bytes());
    }
    assert_eq!(digest.finalize().to_hex()[..16], *"354c1271ad081f00");
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => (-3i8..4).prop_map(f32::from),
        1 => prop::sample::select(vec![1e18, -1e18, 1e-45, -1e-40, 1e-20, 0.1, -0.0, 1e9]),
        1 => -1.0f32..1.0,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn garbage_becomes_fewer_of_the_same_kind_or_an_error_with_a_remedy(
        positions in prop::collection::vec([coordinate(), coordinate(), coordinate()], 3..14),
        corners in prop::collection::vec([0u32..14, 0u32..14, 0u32..14], 1..40),
        most in 0usize..40,
    ) {
        let count = positions.len() as u32;
        let positions = positions.into_iter().map(Vec3::from).collect();
        let triangles = corners.into_iter().map(|t| t.map(|corner| corner % count)).collect();
        let Ok(mesh) = Mesh::new(positions, None, triangles) else { return Ok(()) };
        match decimate(mesh.clone(), most) {
            Ok(fewer) => {
                prop_assert!(fewer.triangles.len() <= most);
                let (found, was) = (kind(&fewer), kind(&mesh));
                prop_assert_eq!((found.euler, found.pieces, found.crossings), (was.euler, was.pieces, was.crossings));
                // A triangle that is turned over may go with its flaw.
                prop_assert!(found.closed >= was.closed && found.pinches <= was.pinches);
                prop_assert!(found.boundary <= was.boundary && (found.boundary > 0) == (was.boundary > 0));
            }
            Err(error) => prop_assert!(error.remedy.is_some(), "{error}"),
        }
    }

    #[test]
    fn crumpled_sheets_stay_sheets_and_do_not_fold(
        heights in prop::collection::vec(-0.1f32..0.1, 81),
        most in 2usize..128,
    ) {
        let sheet = grid(8, 8, |x, y| Vec3::new(8.0 * x, 8.0 * y, heights[(x * 8.0 + y * 72.0) as usize]));
        if let Ok(fewer) = decimate(sheet.clone(), most) {
            prop_assert!([most, most - 1].contains(&fewer.triangles.len()) );
            let found = kind(&fewer);
            prop_assert_eq!((found.euler, found.pieces, found.crossings, found.pinches), (1, 1, 0, 0));
            // Seen from above, hardly any of it is turned over: needles may be, by several collapses (the
            // most seen is 1.6).
            let seen = corners(&fewer).map(|[a, b, c]| (b - a).cross(c - a).z / 2.0);
            let over: f64 = seen.filter(|area| *area < 0.0).sum();
            prop_assert!(over > -3.2, "{over} of 64");
        }
    }
}

/// The real model, or nothing and a line that says why.
fn asset(name: &str) -> Option<Mesh> {
    let path = std::env::var_os("BITLIGHT_ASSETS").map(|folder| std::path::Path::new(&folder).join(name));
    let Some(path) = path.filter(|path| path.is_file()) else {
        let mut screen = std::io::stderr(); // past the test harness
        writeln!(screen, "skipped the test of {name}: BITLIGHT_ASSETS does not lead to it").unwrap();
        return None;
    };
    Some(file::read_obj(path).unwrap())
}

/// Surface and volume keep to `part`, and a sample of the vertices is near to what was there.
fn resembles(fewer: &Mesh, mesh: &Mesh, part: f64) {
    for (found, expected) in extents(fewer).into_iter().zip(extents(mesh)) {
        close(found, expected, part);
    }
    let radius = mesh.bounds().radius();
    for position in fewer.positions.iter().step_by(97) {
        let near = mesh.positions.iter().map(|p| p.distance(*position)).fold(f32::MAX, min);
        assert!(near < 0.01 * radius, "{position} is {near} from the nearest vertex");
    }
}

#[test]
fn the_buddha_at_the_sizes_of_the_paper() {
    let Some(buddha) = asset("stanford/buddha.obj") else { return };
    let was = kind(&buddha);
    assert_eq!((was.euler, was.pieces, was.boundary, was.crossings), (1, 1, 0, 50));
    for (most, part) in [(67_000, 0.0005), (15_000, 0.005)] {
        let fewer = decimated(&buddha, most);
        assert_eq!(kind(&fewer), was);
        resembles(&fewer, &buddha, part);
    }
}

#[test]
fn the_armadillo_stays_closed_and_the_bunny_keeps_its_five_holes() {
    let Some(armadillo) = asset("stanford/armadillo.obj") else { return };
    let fewer = decimated(&armadillo, 47_000);
    assert_eq!(
        kind(&fewer),
        Kind { euler: 2, pieces: 1, boundary: 0, crossings: 0, pinches: 0, closed: true }
    );
    resembles(&fewer, &armadillo, 0.001);
    let Some(bunny) = asset("stanford/stanford-bunny.obj") else { return };
    let was = kind(&bunny);
    assert_eq!((was.euler, was.pieces, was.boundary), (-3, 1, 223));
    let fewer = decimated(&bunny, 15_000);
    let found = kind(&fewer);
    assert_eq!((found.euler, found.pieces, found.crossings), (-3, 1, 0));
    assert!((150..=223).contains(&found.boundary), "{}", found.boundary);
    resembles(&fewer, &bunny, 0.001);
}
