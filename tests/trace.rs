//! `trace/` against a loop over all triangles that shares no code with it, and against facts about closed
//! meshes.
#![allow(clippy::disallowed_methods, reason = "an oracle may use the standard library")]
#![allow(clippy::print_stdout, reason = "figures of a test")]

use bitlight::numeric::{parallel, random::unit};
use bitlight::store::file;
use bitlight::trace::{Bvh, Hit, Ray, bundle};
use bitlight::world::deform::Wave;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;
use std::io::Write;

/// In which t a ray is in the box of a triangle, widened by a part of 5 · 10⁻⁷ as contract 6 has it.
fn in_box([a, b, c]: [Vec3; 3], ray: &Ray) -> (f32, f32) {
    let (mut near, mut far) = (0.0_f32, f32::INFINITY);
    for axis in 0..3 {
        let (inverse, origin) = (1.0 / ray.direction[axis], ray.origin[axis]);
        let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
        let (first, second) = if inverse < 0.0 { (high, low) } else { (low, high) };
        // `f32::max` and `f32::min` return the other where one is no number.
        near = near.max((first - origin) * inverse);
        far = far.min((second - origin) * inverse);
    }
    (near * (1.0 - 5e-7), far * (1.0 + 5e-7))
}

/// The nearest hit by the text of Woop, Benthin and Wald 2013 in `f64`, over all triangles; `boxed` adds the
/// triangles' own boxes to what a hit is.
fn plain(mesh: &Mesh, ray: &Ray, boxed: bool) -> Option<Hit> {
    let d = ray.direction.as_dvec3().to_array();
    let mut kz = 0;
    for axis in 1..3 {
        if d[axis].abs() > d[kz].abs() {
            kz = axis;
        }
    }
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let (sx, sy, sz) = (d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]);
    let shear = |p: Vec3| {
        let p = p.as_dvec3().to_array();
        [p[kx] - sx * p[kz], p[ky] - sy * p[kz], p[kz] * sz]
    };
    let o = shear(ray.origin);
    let mut best: Option<Hit> = None;
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.map(|corner| mesh.positions[corner as usize]);
        let (near, far) = if boxed { in_box(corners, ray) } else { (0.0, f32::INFINITY) };
        if near > far {
            continue;
        }
        let [a, b, c] = corners.map(|corner| {
            let p = shear(corner);
            [p[0] - o[0], p[1] - o[1], p[2] - o[2]]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let negative = [u, v, w].iter().any(|x| *x < 0.0);
        let positive = [u, v, w].iter().any(|x| *x > 0.0);
        let sum = u + v + w;
        if (negative && positive) || sum == 0.0 {
            continue;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / sum;
        let held = if (t as f32) < near { near } else { far.min(t as f32) };
        let hit = Hit { triangle: index as u32, t: held, u: (v / sum) as f32, v: (w / sum) as f32 };
        if t > 0.0 && hit.t > 0.0 && hit.t <= ray.far && best.is_none_or(|best| hit.t < best.t) {
            best = Some(hit);
        }
    }
    best
}

fn bits(hit: Option<Hit>) -> Option<[u32; 4]> {
    hit.map(|hit| [hit.triangle, hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits()])
}

fn random(element: u64, dimension: u64) -> f32 {
    2.0 * unit(11, element, 0, dimension) - 1.0
}

fn random3(element: u64, dimension: u64) -> Vec3 {
    Vec3::new(random(element, dimension), random(element, dimension + 1), random(element, dimension + 2))
}

/// Rays that are hard for a mesh: by turns random, axis-parallel, within a plane of a box, through a corner,
/// through an edge's middle, grazing, from a corner, from within a triangle, from far away.
fn ray(mesh: &Mesh, number: u64) -> Ray {
    let bounds = mesh.bounds();
    let (center, radius) = (bounds.center(), bounds.radius());
    let pick = |dimension: u64, count: usize| (unit(5, number, 0, dimension) * count as f32) as usize;
    let triangle = mesh.triangles[pick(1, mesh.triangles.len())];
    let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
    let outside = center + random3(number, 2) * (2.0 * radius);
    let axis = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z][pick(3, 6)];
    let (origin, direction) = match number % 12 {
        0 => (outside, random3(number, 5)),
        1 => (center + random3(number, 6) * radius, axis),
        2 => (a - axis * radius, axis),
        3 => (outside, a - outside),
        4 => (outside, (a + b) * 0.5 - outside),
        5 => (outside, (a + b + c) / 3.0 - outside),
        6 => (a, random3(number, 5)),
        7 => ((a + b + c) / 3.0, random3(number, 5)),
        8 => (a, b - a),
        9 => (a + (b - a) * 4.0, (c - b) + (b - a) * random(number, 4)),
        10 => (center + random3(number, 6) * (1000.0 * radius), center - a),
        _ => ((a + b) * 0.5, c - b),
    };
    let direction = if direction.abs().max_element() < 1e-15 { axis } else { direction };
    let far = if number.is_multiple_of(5) { unit(7, number, 0, 0) * radius } else { f32::INFINITY };
    Ray { origin, direction, far }
}

/// Small meshes, each bad in its way.
fn adversaries() -> Vec<(&'static str, Mesh)> {
    let triangles = |corners: Vec<Vec3>| {
        let count = corners.len() as u32 / 3;
        Mesh::new(corners, None, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap()
    };
    let soup = |count: u64, size: f32| {
        let corner = |i: u64| random3(i / 3, 20) + random3(i, 30) * size;
        triangles((0..3 * count).map(corner).collect())
    };
    let scaled = |mesh: &Mesh, scale: f32, shift: Vec3| {
        let positions = mesh.positions.iter().map(|p| *p * scale + shift).collect();
        Mesh::new(positions, None, mesh.triangles.clone()).unwrap()
    };
    let ball = shapes::sphere(4).unwrap();
    let grid = |n: usize| {
        // On whole coordinates, all in one plane and twice over: every hit is a tie.
        let mut corners = Vec::new();
        for k in 0..2 * n * n {
            let (x, y) = ((k % n) as f32, (k / n % n) as f32);
            let at = |dx: f32, dy: f32| Vec3::new(x + dx, 1.0, y + dy);
            corners.extend([
                at(0.0, 0.0),
                at(1.0, 0.0),
                at(0.0, 1.0),
                at(1.0, 0.0),
                at(1.0, 1.0),
                at(0.0, 1.0),
            ]);
        }
        triangles(corners)
    };
    vec![
        ("one triangle", triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y])),
        ("a box", shapes::cuboid(Vec3::ONE, 1).unwrap()),
        ("a divided box", shapes::cuboid(Vec3::new(1.0, 0.25, 3.0), 4).unwrap()),
        ("a sheet", shapes::cuboid(Vec3::new(1.0, 1e-5, 1.0), 3).unwrap()),
        ("a sphere", ball.clone()),
        ("a huge sphere", scaled(&ball, 1e16, Vec3::ZERO)),
        ("a tiny sphere", scaled(&ball, 1e-18, Vec3::ZERO)),
        ("a sphere far away", scaled(&ball, 1.0, Vec3::new(3e4, -2e4, 1e5))),
        ("soup", soup(60, 0.5)),
        ("slivers", soup(60, 1e-4)),
        ("a plane twice", grid(4)),
        ("needles", {
            let corner =
                |i: u64| random3(i / 3, 20) + random3(i / 3, 40) * random(i, 50) + random3(i, 30) * 1e-7;
            triangles((0..180).map(corner).collect())
        }),
    ]
}

/// How many of `count` rays hit, and how many hit otherwise than by the triangles alone, without their boxes.
fn compare(name: &str, mesh: &Mesh, bvh: &Bvh, count: u64) -> [u64; 2] {
    let one = |number: usize| {
        let ray = ray(mesh, number as u64);
        let (found, expected) = (bvh.nearest(&ray), plain(mesh, &ray, true));
        assert_eq!(
            bits(found),
            bits(expected),
            "{name}, ray {number}: {ray:?} finds {found:?}, not {expected:?}"
        );
        assert_eq!(bvh.blocked(&ray), expected.is_some(), "{name}, ray {number}: {ray:?}");
        let small = mesh.triangles.len() < 1000;
        let otherwise = small && bits(plain(mesh, &ray, false)) != bits(expected);
        [u64::from(expected.is_some()), u64::from(otherwise)]
    };
    let counts = parallel::map(count as usize, one);
    counts.into_iter().fold([0; 2], |sums, [hits, boxes]| [sums[0] + hits, sums[1] + boxes])
}

/// All adversaries, with `count` rays each.
fn adversaries_agree(count: u64) {
    for (name, mesh) in adversaries() {
        let [hits, boxes] = compare(name, &mesh, &Bvh::new(&mesh), count);
        println!("{name}: {hits} of {count} rays hit, {boxes} otherwise without boxes");
        assert!(hits * 10 > count, "{name}: {hits} of {count} rays hit");
        // Rays that start within a triangle, or pass one in its own plane: a third of all are made to.
        assert!(boxes * 30 < count, "{name}: {boxes} of {count} rays hit otherwise without boxes");
    }
}

#[test]
fn the_tree_finds_what_a_loop_over_all_triangles_finds() {
    adversaries_agree(if cfg!(debug_assertions) { 5_000 } else { 84_000 });
}

#[test]
#[ignore = "the sweep: minutes in release"]
fn the_tree_finds_what_a_loop_over_all_triangles_finds_at_length() {
    adversaries_agree(2_000_000);
    assets_agree(100_000);
}

/// Every asset, with `count` rays each; without the folder of assets it says so.
fn assets_agree(count: u64) {
    let Some(assets) = std::env::var_os("BITLIGHT_ASSETS") else {
        // Past the harness, which would keep it to itself.
        let mut screen = std::io::stderr().lock();
        writeln!(screen, "skipped the rays through assets: BITLIGHT_ASSETS is not set").unwrap();
        return;
    };
    for name in ["stanford-bunny", "armadillo", "buddha"] {
        let mesh =
            file::read_obj(std::path::Path::new(&assets).join(format!("stanford/{name}.obj"))).unwrap();
        let [hits, _] = compare(name, &mesh, &Bvh::new(&mesh), count);
        println!("{name}: {hits} of {count} rays hit");
        assert!(hits * 2 > count, "{name}: {hits} of {count} rays hit");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "10⁴ rays through 10⁵ triangles each: in release")]
fn the_tree_finds_what_a_loop_over_all_triangles_of_assets_finds() {
    assets_agree(10_000);
}

/// A tree that was built for one pose and fitted to another finds that one's hits.
#[test]
fn a_tree_fitted_to_another_pose_finds_that_poses_hits() {
    let rest = shapes::torus_knot(2, 3, 0.35, 96, 12).unwrap();
    let mut bvh = Bvh::new(&rest);
    for time in [0.3, 1.7] {
        let wave = Wave { amplitude: 0.8, length: 2.0, period: 3.0 };
        let posed = wave.apply(&rest, time).unwrap();
        bvh.refit(&posed);
        let [hits, _] = compare("a posed knot", &posed, &bvh, 2_000);
        assert!(hits > 500);
    }
}

/// From within a closed mesh every ray meets it, and from outside it meets the mesh an even number of times
/// unless it touches an edge: no ray slips between two triangles.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    let count = if cfg!(debug_assertions) { 20_000 } else { 200_000 };
    let ball = shapes::sphere(6).unwrap();
    let knot = shapes::cuboid(Vec3::new(1.0, 2.0, 0.5), 5).unwrap();
    for (name, mesh) in [("a sphere", ball), ("a box", knot)] {
        for (scale, shift) in
            [(1.0, Vec3::ZERO), (1e-12, Vec3::ZERO), (1e12, Vec3::ZERO), (1.0, Vec3::splat(3e4))]
        {
            let positions = mesh.positions.iter().map(|p| *p * scale + shift).collect();
            let mesh = Mesh::new(positions, None, mesh.triangles.clone()).unwrap();
            let bvh = Bvh::new(&mesh);
            for number in 0..count {
                // Through vertices and through edges' middles, besides any direction.
                let triangle = mesh.triangles[number as usize / 3 % mesh.triangles.len()];
                let [a, b, _] = triangle.map(|corner| mesh.positions[corner as usize]);
                let origin = shift + random3(number, 2) * (0.2 * scale);
                let direction = match number % 3 {
                    0 => random3(number, 5) * scale,
                    1 => a - origin,
                    _ => (a + b) * 0.5 - origin,
                };
                let ray = Ray::new(origin, direction);
                assert!(bvh.nearest(&ray).is_some(), "{name} at scale {scale}: {ray:?} leaves it");
            }
        }
    }
}

/// The bits of every mesh's vertices for some directions, against single rays in a loop over all triangles.
#[test]
fn a_bundle_of_parallel_rays_sees_what_single_rays_see() {
    let axes = [Vec3::X, Vec3::Y, -Vec3::Z];
    let fibonacci = bitlight::sphere::quadrature::fibonacci(61);
    let fibonacci = fibonacci.iter().map(|d| Vec3::from_array(d.map(|c| c as f32)));
    let directions: Vec<Vec3> = axes.into_iter().chain(fibonacci).collect();
    let mut meshes = adversaries();
    meshes.push(("a knot", shapes::torus_knot(2, 3, 0.35, 96, 12).unwrap()));
    let mut hits = 0;
    for (name, mesh) in meshes {
        // Vertices, with the normals of the mesh, and points within triangles that look both ways.
        let mut points = mesh.positions.clone();
        let mut normals = mesh.normals.clone();
        for triangle in mesh.triangles.iter().take(200) {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            points.extend([(a + b + c) / 3.0, (a + b) * 0.5]);
            normals.extend([(b - a).cross(c - a), (c - a).cross(b - a)]);
        }
        let found = bundle::visibility(&mesh, &points, &normals, &directions);
        let words = directions.len().div_ceil(32);
        let mut seen = 0;
        for (p, (point, normal)) in points.iter().zip(&normals).enumerate() {
            for (d, direction) in directions.iter().enumerate() {
                let sees = normal.dot(*direction) > 0.0
                    && plain(&mesh, &Ray::new(*point, *direction), true).is_none();
                let bit = found[p * words + d / 32] >> (d % 32) & 1;
                assert_eq!(bit, u32::from(sees), "{name}: point {p} {point} along {d} {direction}");
                seen += u64::from(sees);
            }
        }
        println!("{name}: {seen} of {} rays see the sky", points.len() * directions.len());
        assert!(seen > 0);
        // What some of the rays meet, seen or not.
        let wanted: Vec<u32> = found.iter().map(|bits| !bits & 0x0812_4225).collect();
        let (starts, met) = bundle::nearest(&mesh, &points, &directions, &wanted);
        let (count, mut met) = (met.len(), met.into_iter());
        for (p, point) in points.iter().enumerate() {
            assert_eq!(starts[p], count - met.len(), "{name}: point {p}");
            for (d, direction) in directions.iter().enumerate() {
                if wanted[p * words + d / 32] >> (d % 32) & 1 == 1 {
                    let hit = plain(&mesh, &Ray::new(*point, *direction), true);
                    assert_eq!(met.next(), Some(hit), "{name}: point {p} {point} along {d} {direction}");
                    hits += usize::from(hit.is_some());
                }
            }
        }
        assert!(met.next().is_none());
    }
    assert!(hits > 10_000, "{hits}");
}
