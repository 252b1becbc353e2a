//! Procedural shapes: closed meshes that face outward, at any resolution, from arithmetic and `numeric`
//! alone, so with the same bits on every processor.
//!
//! Each is about one unit in radius around the origin: [`Mesh::apply`] puts it into a scene.

mod genus3;

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

pub use genus3::{MAX_GENUS3_RESOLUTION, genus3};

use super::mesh::Mesh;
use crate::Error;
use crate::numeric::double;

/// The finest [`sphere`] and [`cuboid`].
pub const MAX_RESOLUTION: usize = 1024;

/// The most vertices of a [`torus_knot`] along its curve.
pub const MAX_ALONG: usize = 1 << 14;

/// The most vertices of a [`torus_knot`] around its tube.
pub const MAX_AROUND: usize = 1 << 9;

/// Distance of the torus's core circle, around which a [`torus_knot`] winds, from the axis.
const KNOT_MAJOR: f64 = 1.0;

/// Distance of a [`torus_knot`] from that circle.
const KNOT_MINOR: f64 = 0.45;

/// The unit sphere: an icosahedron with every edge in `resolution` parts, projected from the centre.
///
/// 10 n² + 2 vertices and 20 n² triangles; none degenerate, the largest at most 2.2 times the smallest. The
/// normals are exact. (A cube's faces would be stretched more, and meridians meet in slivers.)
///
/// # Errors
/// If `resolution` is not in 1 to [`MAX_RESOLUTION`].
pub fn sphere(resolution: usize) -> Result<Mesh, Error> {
    check("sphere's resolution", resolution, 1, MAX_RESOLUTION)?;
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corners: Vec<DVec3> = [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)])
        .collect();
    // The twenty triples of corners at the least distance, 2, each turned outward.
    let near = |a: usize, b: usize| (corners[a] - corners[b]).length_squared() < 4.5;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = corners[a].cross(corners[b]).dot(corners[c]) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|corner| corner as u32));
                }
            }
        }
    }
    let (points, triangles) = subdivide(&corners, &faces, resolution);
    let normals: Vec<Vec3> = points.into_iter().map(|point| (point / point.length()).as_vec3()).collect();
    Mesh::new(normals.clone(), Some(normals), triangles)
}

/// A box with the given half extents and hard edges: a cube, a thin sheet, a beam.
///
/// Each face is a grid of `resolution`² rectangles with vertices of its own: 6 (n + 1)² vertices, 12 n²
/// triangles; faces in the order −x, +x, −y, +y, −z, +z.
///
/// # Errors
/// If `resolution` is not in 1 to [`MAX_RESOLUTION`] or a half extent is not a positive number.
pub fn cuboid(half_extents: Vec3, resolution: usize) -> Result<Mesh, Error> {
    check("cuboid's resolution", resolution, 1, MAX_RESOLUTION)?;
    if !half_extents.to_array().iter().all(|&half| half > 0.0 && half.is_finite()) {
        return Err(Error::new(format!("a cuboid of half extents {half_extents}"))
            .remedy("give three positive numbers"));
    }
    let side = resolution as u32 + 1;
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for face in 0..6 {
        let (axis, sign) = (face / 2, if face % 2 == 0 { -1.0 } else { 1.0 });
        let (u, v) =
            if sign > 0.0 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
        let first = positions.len() as u32;
        // A rim vertex is ±1 exactly, so that the faces meet without a gap.
        let at = |i: u32| (2.0 * i as f32 - resolution as f32) / resolution as f32;
        for j in 0..side {
            for i in 0..side {
                let mut unit = [0.0; 3];
                (unit[axis], unit[u], unit[v]) = (sign, at(i), at(j));
                positions.push(Vec3::from(unit) * half_extents);
                normals.push(Vec3::AXES[axis] * sign);
                if i < side - 1 && j < side - 1 {
                    let corner = first + j * side + i;
                    triangles.push([corner, corner + 1, corner + side + 1]);
                    triangles.push([corner, corner + side + 1, corner + side]);
                }
            }
        }
    }
    Mesh::new(positions, Some(normals), triangles)
}

/// A tube of radius `tube` along the torus knot that runs `p` times around the y axis while it winds `q`
/// times around the core circle: (2, 3) and (3, 2) are trefoils, (1, 0) a plain ring.
///
/// The curve ((1 + 0.45 cos qt) cos pt, 0.45 sin qt, (1 + 0.45 cos qt) sin pt) lies on a torus; that torus's
/// normal, perpendicular to the curve everywhere, is the first axis of the tube's frame, so the frame closes
/// without a twist or a seam. `along` × `around` vertices with exact normals, twice as many triangles.
///
/// Strands run into each other where `tube` is above half their distance: 0.44 for (2, 3), 0.38 for (3, 2),
/// less for longer knots; that is not refused.
///
/// # Errors
/// If `p` is 0, `p` and `q` have a common divisor (the curve would run over itself) or exceed 16, `tube` is
/// not above 0 and below 0.45, or `along` and `around` are not in 8 (p + q) to [`MAX_ALONG`] and 3 to
/// [`MAX_AROUND`].
pub fn torus_knot(p: u32, q: u32, tube: f32, along: usize, around: usize) -> Result<Mesh, Error> {
    if p == 0 || p > 16 || q > 16 || (2..=p).any(|d| p.is_multiple_of(d) && q.is_multiple_of(d)) {
        return Err(Error::new(format!("a torus knot ({p}, {q})"))
            .remedy("give two numbers up to 16 without a common divisor, such as 2 and 3"));
    }
    check("torus knot's resolution along", along, 8 * (p + q) as usize, MAX_ALONG)?;
    check("torus knot's resolution around", around, 3, MAX_AROUND)?;
    if !(tube > 0.0 && tube < KNOT_MINOR as f32) {
        return Err(Error::new(format!("a torus knot with a tube of radius {tube}"))
            .remedy(format!("give a number above 0 and below {KNOT_MINOR}")));
    }
    let turn = |part: usize, whole: usize| std::f64::consts::TAU * part as f64 / whole as f64;
    let circle: Vec<(f64, f64)> =
        (0..around).map(|j| turn(j, around)).map(|angle| (double::cos(angle), double::sin(angle))).collect();
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in 0..along {
        // Whole turns are taken off in integers, so that an angle's error does not grow along the curve.
        let [(cos_p, sin_p), (cos_q, sin_q)] = [p, q].map(|times| {
            let angle = turn(i * times as usize % along, along);
            (double::cos(angle), double::sin(angle))
        });
        let normal = DVec3::new(cos_q * cos_p, sin_q, cos_q * sin_p);
        let curve = DVec3::new(cos_p, 0.0, sin_p) * KNOT_MAJOR + normal * KNOT_MINOR;
        let around_core = DVec3::new(-sin_q * cos_p, cos_q, -sin_q * sin_p) * (KNOT_MINOR * f64::from(q));
        let around_axis = DVec3::new(-sin_p, 0.0, cos_p) * ((KNOT_MAJOR + KNOT_MINOR * cos_q) * f64::from(p));
        let tangent = around_core + around_axis;
        let binormal = (tangent / tangent.length()).cross(normal);
        for (cos, sin) in &circle {
            let outward = normal * *cos + binormal * *sin;
            positions.push((curve + outward * f64::from(tube)).as_vec3());
            normals.push(outward.as_vec3());
        }
    }
    let vertex = |i: usize, j: usize| (i % along * around + j % around) as u32;
    let mut triangles = Vec::with_capacity(2 * along * around);
    for i in 0..along {
        for j in 0..around {
            let (a, b, c, d) = (vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Mesh::new(positions, Some(normals), triangles)
}

/// Every edge of the faces in `parts` equal parts, every face in `parts`² triangles of the same sense;
/// vertices on an edge are shared by its faces. The corners keep their numbers; then come those on edges,
/// then inner ones.
fn subdivide(corners: &[DVec3], faces: &[[u32; 3]], parts: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut points = corners.to_vec();
    let mut edges = BTreeMap::new();
    for &[a, b, c] in faces {
        for (from, to) in [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to))) {
            edges.entry((from, to)).or_insert_with(|| {
                let first = points.len() as u32;
                let (start, end) = (corners[from as usize], corners[to as usize]);
                points.extend((1..parts).map(|k| start + (end - start) * (k as f64 / parts as f64)));
                first
            });
        }
    }
    // The k-th of `parts` − 1 inner vertices on the edge, from 1, counted from `from`.
    let on_edge = |from: u32, to: u32, k: usize| {
        let first = edges[&(from.min(to), from.max(to))];
        first + if from < to { k - 1 } else { parts - 1 - k } as u32
    };
    let mut triangles = Vec::with_capacity(faces.len() * parts * parts);
    for &[a, b, c] in faces {
        let inner = points.len() as u32;
        let [start, to_b, to_c] = {
            let [a, b, c] = [a, b, c].map(|corner| corners[corner as usize]);
            [a, (b - a) / parts as f64, (c - a) / parts as f64]
        };
        for j in 1..parts {
            points.extend((1..parts - j).map(|i| start + to_b * i as f64 + to_c * j as f64));
        }
        // i steps towards b and j towards c.
        let vertex = |i: usize, j: usize| match (i, j) {
            (0, 0) => a,
            _ if i == parts => b,
            _ if j == parts => c,
            (_, 0) => on_edge(a, b, i),
            (0, _) => on_edge(a, c, j),
            _ if i + j == parts => on_edge(b, c, j),
            // Rows of parts − 2, parts − 3, … inner vertices lie before row j.
            _ => inner + ((j - 1) * (2 * parts - 2 - j) / 2 + i - 1) as u32,
        };
        for j in 0..parts {
            for i in 0..parts - j {
                triangles.push([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                if i + j + 1 < parts {
                    triangles.push([vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
                }
            }
        }
    }
    (points, triangles)
}

fn check(what: &str, given: usize, least: usize, most: usize) -> Result<(), Error> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    Err(Error::new(format!("the {what} is {given}")).remedy(format!("give a number from {least} to {most}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::order;

    /// Closed, outward, one normal for each vertex that agrees with the faces around it, no degenerate
    /// triangle.
    #[track_caller]
    pub(super) fn check_shape(mesh: &Mesh, euler_characteristic: i64, agreement: f32) {
        let facts = mesh.facts();
        assert!(facts.closed && facts.signed_volume > 0.0, "{facts:?}");
        assert_eq!((facts.boundary_edges, facts.non_manifold_edges, facts.zero_area_triangles), (0, 0, 0));
        assert_eq!(facts.euler_characteristic, euler_characteristic);
        assert_eq!(facts.used_vertices, facts.vertices);
        for &triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let face = (b - a).cross(c - a).normalize();
            for corner in triangle {
                let normal = mesh.normals[corner as usize];
                assert!((normal.length() - 1.0).abs() < 1e-6);
                assert!(normal.dot(face) > agreement, "{triangle:?}: {}", normal.dot(face));
            }
        }
    }

    #[test]
    fn spheres_are_closed_even_and_round() {
        for resolution in [1, 2, 3, 7, 16] {
            let mesh = sphere(resolution).unwrap();
            check_shape(&mesh, 2, 0.79);
            assert_eq!(mesh.positions.len(), 10 * resolution * resolution + 2);
            assert_eq!(mesh.triangles.len(), 20 * resolution * resolution);
            assert!(mesh.positions.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
        }
        let fine = sphere(24).unwrap();
        let facts = fine.facts();
        assert!((facts.area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{}", facts.area);
        assert!((facts.signed_volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 3e-3);
        let areas = fine.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|corner| fine.positions[corner as usize]);
            (b - a).cross(c - a).length()
        });
        let (low, high) =
            areas.fold((f32::MAX, 0.0), |(low, high), area| (order::min(low, area), order::max(high, area)));
        assert!(high / low < 2.2, "{}", high / low);
    }

    #[test]
    fn cuboids_have_hard_edges_and_exact_extents() {
        let cube = cuboid(Vec3::ONE, 1).unwrap();
        assert_eq!((cube.positions.len(), cube.triangles.len()), (24, 12));
        for (half, resolution) in [(Vec3::ONE, 1), (Vec3::new(1.0, 0.01, 0.3), 5), (Vec3::splat(0.1), 3)] {
            let mesh = cuboid(half, resolution).unwrap();
            check_shape(&mesh, 2, 0.9999);
            let facts = mesh.facts();
            assert_eq!((facts.bounds.low, facts.bounds.high), (-half, half));
            let volume = 8.0 * f64::from(half.x) * f64::from(half.y) * f64::from(half.z);
            assert!((facts.signed_volume / volume - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn torus_knots_close_without_a_seam() {
        for (p, q, along, around) in
            [(2, 3, 40, 3), (2, 3, 256, 24), (3, 2, 255, 17), (1, 0, 64, 16), (3, 7, 500, 9)]
        {
            let mesh = torus_knot(p, q, 0.1, along, around).unwrap();
            // The coarsest is closed too, but its faces are too long and skew to keep to the normals.
            check_shape(&mesh, 0, if around == 3 { -1.0 } else { 0.8 });
            assert_eq!(mesh.triangles.len(), 2 * along * around);
        }
        // A ring has a volume of 2 π² R r².
        let ring = torus_knot(1, 0, 0.2, 400, 200).unwrap().facts().signed_volume;
        assert!(
            (ring / (2.0 * std::f64::consts::PI * std::f64::consts::PI * 1.45 * 0.04) - 1.0).abs() < 1e-3,
            "{ring}"
        );
    }

    #[test]
    fn subdivision_shares_the_vertices_of_edges() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE].map(DVec3::from);
        let (points, triangles) = subdivide(&corners, &[[0, 1, 2], [2, 1, 3]], 4);
        assert_eq!((points.len(), triangles.len()), (25, 32));
        let area: f64 = triangles
            .iter()
            .map(|t| t.map(|corner| points[corner as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
            .sum();
        assert!((area - (0.5 + 0.75_f64.sqrt())).abs() < 1e-12, "{area}");
    }

    #[test]
    fn resolutions_and_sizes_out_of_range_are_refused() {
        for error in [
            sphere(0),
            sphere(usize::MAX),
            cuboid(Vec3::ONE, 0),
            cuboid(Vec3::ONE, MAX_RESOLUTION + 1),
            cuboid(Vec3::new(1.0, 0.0, 1.0), 1),
            cuboid(Vec3::new(1.0, f32::NAN, 1.0), 1),
            genus3(0),
            genus3(MAX_GENUS3_RESOLUTION + 1),
            torus_knot(0, 1, 0.1, 100, 10),
            torus_knot(2, 4, 0.1, 100, 10),
            torus_knot(2, 0, 0.1, 100, 10),
            torus_knot(2, u32::MAX, 0.1, 100, 10),
            torus_knot(2, 3, 0.45, 100, 10),
            torus_knot(2, 3, f32::NAN, 100, 10),
            torus_knot(2, 3, 0.1, 39, 10),
            torus_knot(2, 3, 0.1, 100, 2),
            torus_knot(2, 3, 0.1, MAX_ALONG + 1, MAX_AROUND),
            torus_knot(2, 3, 0.1, MAX_ALONG, MAX_AROUND + 1),
        ] {
            assert!(error.is_err_and(|error| error.remedy.is_some()));
        }
    }
}
