//! Triangle meshes: what makes one valid, its normals, its bounds and the facts that a report names.

use glam::{DVec3, Mat3, Vec3};

use crate::Error;
use crate::numeric::{order, parallel, sum};

/// Vertices or triangles that one thread takes together.
const RUN: usize = 8192;

/// The most vertices that a mesh may have.
pub const MAX_VERTICES: usize = 1 << 26;

/// The most triangles that a mesh may have.
pub const MAX_TRIANGLES: usize = 1 << 26;

/// The largest magnitude of a coordinate: the square of a distance between two such points is still finite in
/// `f32`.
pub const MAX_COORDINATE: f32 = 1e18;

/// The normal of a vertex that no triangle with an area uses.
pub const DEFAULT_NORMAL: Vec3 = Vec3::Y;

/// A triangle mesh with one normal a vertex.
///
/// [`Mesh::new`] makes only valid ones: indices in range, finite positions, unit normals, some area.
/// Triangles without area are kept: they cover nothing, and the triangles keep the numbers of their source.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in the scene's unit.
    pub positions: Vec<Vec3>,
    /// Unit normals, one a vertex.
    pub normals: Vec<Vec3>,
    /// Three vertex indices a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// An axis-aligned box, in the unit of what it bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The corner with the lowest coordinates.
    pub low: Vec3,
    /// The corner with the highest coordinates.
    pub high: Vec3,
}

/// What a mesh is made of and whether it encloses a volume.
///
/// Edges are counted between positions, not between indices: vertices that share a position (a hard edge has
/// two normals there) are one, since light sees the surface and not its numbering. Triangles with two corners
/// in one place have no edges of their own and are left out of the counts of edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts {
    /// Vertices, unused ones included.
    pub vertices: usize,
    /// Vertices that some triangle names.
    pub used_vertices: usize,
    /// Triangles, those without area included.
    pub triangles: usize,
    /// Triangles whose corners lie on a line or in a point.
    pub zero_area_triangles: usize,
    /// Edges of exactly one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Positions − edges + triangles; 2 − 2g for a closed manifold in one piece with g handles.
    pub euler_characteristic: i64,
    /// Whether every edge is run through as often one way as the other: only then is there an inside.
    pub closed: bool,
    /// The box around the used vertices.
    pub bounds: Bounds,
    /// Surface area, in the square of the scene's unit.
    pub area: f64,
    /// Enclosed volume, in the cube of the scene's unit: negative if the triangles face inward. Of an open
    /// mesh, the volume of the cone from its rim to the centre of the bounds is included.
    pub signed_volume: f64,
}

impl Mesh {
    /// A valid mesh of `positions` (scene's unit), `normals` (one a vertex, of any length) and `triangles`.
    ///
    /// Given normals are normalised. Where they are absent, zero or not finite, the normal is that of the
    /// triangles around the vertex weighted by area (their cross products, summed in triangle order), or
    /// [`DEFAULT_NORMAL`] where these have no area or cancel.
    ///
    /// # Errors
    /// If there is no triangle, none with an area, more than [`MAX_VERTICES`] or [`MAX_TRIANGLES`], a corner
    /// that is not a vertex, a coordinate that is not finite or beyond [`MAX_COORDINATE`], or a number of
    /// normals other than that of the vertices.
    pub fn new(
        positions: Vec<Vec3>,
        normals: Option<Vec<Vec3>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, Error> {
        if triangles.is_empty() {
            return Err(Error::new("the mesh has no triangle").remedy("give it at least one face"));
        }
        for (count, most, things) in
            [(positions.len(), MAX_VERTICES, "vertices"), (triangles.len(), MAX_TRIANGLES, "triangles")]
        {
            if count > most {
                return Err(Error::new(format!("the mesh has {count} {things}, more than {most}"))
                    .remedy("simplify it or split it"));
            }
        }
        if let Some(vertex) = positions.iter().position(|&p| !in_range(p)) {
            return Err(Error::new(format!("vertex {vertex} lies at {}", positions[vertex]))
                .remedy(format!("every coordinate must be a number within ±{MAX_COORDINATE:e}")));
        }
        for (index, triangle) in triangles.iter().enumerate() {
            if let Some(corner) = triangle.iter().find(|&&corner| corner as usize >= positions.len()) {
                return Err(Error::new(format!(
                    "triangle {index} names vertex {corner}, but there are {}",
                    positions.len()
                ))
                .remedy("vertices count from 0"));
            }
        }
        if triangles.iter().all(|&triangle| doubled_area(&positions, triangle) == DVec3::ZERO) {
            return Err(Error::new("no triangle of the mesh has an area")
                .remedy("give at least one face three corners that are not on a line"));
        }
        let normals = match normals {
            None => area_weighted_normals(&positions, &triangles),
            Some(given) if given.len() != positions.len() => {
                return Err(Error::new(format!(
                    "the mesh has {} normals and {} vertices",
                    given.len(),
                    positions.len()
                ))
                .remedy("give one normal a vertex, or none at all"));
            }
            Some(given) => {
                let mut units = given;
                parallel::for_each_chunk(&mut units, RUN, |_, normals| {
                    for normal in normals {
                        // A zero marks one that has no direction.
                        *normal = unit(DVec3::from(*normal)).unwrap_or_default();
                    }
                });
                if units.contains(&Vec3::ZERO) {
                    let computed = area_weighted_normals(&positions, &triangles);
                    for (unit, computed) in units.iter_mut().zip(computed) {
                        if *unit == Vec3::ZERO {
                            *unit = computed;
                        }
                    }
                }
                units
            }
        };
        Ok(Self { positions, normals, triangles })
    }

    /// The positions of the vertices that triangles use, each once, in the mesh's order.
    pub fn used_positions(&self) -> impl Iterator<Item = Vec3> {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&corner| used[corner as usize] = true);
        self.positions.iter().zip(used).filter_map(|(position, used)| used.then_some(*position))
    }

    /// The box around the vertices that triangles use: unused ones are often strays far away.
    pub fn bounds(&self) -> Bounds {
        let around = |triangles: &[[u32; 3]]| {
            let first = self.positions[triangles[0][0] as usize];
            let (mut low, mut high) = (first, first);
            for corner in triangles.as_flattened() {
                let position = self.positions[*corner as usize];
                (low, high) = (order::min3(low, position), order::max3(high, position));
            }
            Bounds { low, high }
        };
        let parts: Vec<_> = self.triangles.chunks(RUN).collect();
        let parts = parallel::map(parts.len(), |part| around(parts[part]));
        parts.iter().fold(parts[0], |bounds, part| bounds.around(*part))
    }

    /// Scales by `scale` about the origin, turns by `rotation`, then moves by `translation` (scene's unit).
    ///
    /// # Errors
    /// If `scale` is not a positive number, `rotation` is not a rotation (to within 1e-4), or a vertex leaves
    /// ±[`MAX_COORDINATE`] or the mesh loses its last area; the mesh is then as it was.
    pub fn apply(&mut self, scale: f32, rotation: Mat3, translation: Vec3) -> Result<(), Error> {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Error::new(format!("a scale of {scale}")).remedy("give a positive number"));
        }
        let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
        let skew = [x.dot(x) - 1.0, y.dot(y) - 1.0, z.dot(z) - 1.0, x.dot(y), y.dot(z), z.dot(x)];
        if !(skew.iter().all(|deviation| deviation.abs() <= 1e-4) && x.cross(y).dot(z) > 0.0) {
            return Err(Error::new(
                "the rotation's axes are not three right-handed, perpendicular unit vectors",
            )
            .remedy("normalise it; a mirror image is not a rotation"));
        }
        let positions = self.positions.iter().map(|&p| rotation * (p * scale) + translation).collect();
        let normals = self.normals.iter().map(|&n| rotation * n).collect();
        *self = Self::new(positions, Some(normals), self.triangles.clone())?;
        Ok(())
    }

    /// Counts, extents and topology, summed in a fixed order.
    pub fn facts(&self) -> Facts {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&corner| used[corner as usize] = true);
        let bounds = self.bounds();
        let centre = DVec3::from(bounds.center());
        let mut areas = Vec::with_capacity(self.triangles.len());
        let mut volumes = Vec::with_capacity(self.triangles.len());
        for &triangle in &self.triangles {
            let doubled = doubled_area(&self.positions, triangle);
            areas.push(doubled.length() * 0.5);
            volumes.push((DVec3::from(self.positions[triangle[0] as usize]) - centre).dot(doubled) / 6.0);
        }
        let topology = self.topology(&used);
        Facts {
            vertices: self.positions.len(),
            used_vertices: used.iter().filter(|&&used| used).count(),
            triangles: self.triangles.len(),
            zero_area_triangles: areas.iter().filter(|&&area| area == 0.0).count(),
            boundary_edges: topology.boundary_edges,
            non_manifold_edges: topology.non_manifold_edges,
            euler_characteristic: topology.euler_characteristic,
            closed: topology.closed,
            bounds,
            area: sum::sum(&areas),
            signed_volume: sum::sum(&volumes),
        }
    }

    fn topology(&self, used: &[bool]) -> Topology {
        let place = first_equal(&self.positions);
        let mut occupied = vec![false; self.positions.len()];
        (0..used.len()).filter(|&vertex| used[vertex]).for_each(|v| occupied[place[v] as usize] = true);
        let mut triangles = 0;
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| place[corner as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            triangles += 1;
            edges.extend(
                [(a, b), (b, c), (c, a)].map(
                    |(from, to)| {
                        if from < to { (from, to, true) } else { (to, from, false) }
                    },
                ),
            );
        }
        edges.sort_unstable();
        let (mut count, mut boundary_edges, mut non_manifold_edges, mut closed) = (0, 0, 0, true);
        for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            count += 1;
            boundary_edges += usize::from(uses.len() == 1);
            non_manifold_edges += usize::from(uses.len() > 2);
            closed &= 2 * uses.iter().filter(|(_, _, forward)| *forward).count() == uses.len();
        }
        let places = occupied.iter().filter(|&&occupied| occupied).count();
        Topology {
            boundary_edges,
            non_manifold_edges,
            closed,
            euler_characteristic: places as i64 - i64::from(count) + i64::from(triangles),
        }
    }
}

struct Topology {
    boundary_edges: usize,
    non_manifold_edges: usize,
    closed: bool,
    euler_characteristic: i64,
}

impl Bounds {
    /// The box around this one and another.
    #[inline]
    fn around(self, other: Self) -> Self {
        Self { low: order::min3(self.low, other.low), high: order::max3(self.high, other.high) }
    }

    /// The middle of the box.
    pub fn center(self) -> Vec3 {
        self.low * 0.5 + self.high * 0.5
    }

    /// Half the length of each side.
    pub fn half_extents(self) -> Vec3 {
        self.high * 0.5 - self.low * 0.5
    }

    /// Half the diagonal: the radius of the sphere through the corners.
    pub fn radius(self) -> f32 {
        DVec3::from(self.half_extents()).length() as f32
    }
}

/// Bits that equal values have in common; −0 equals +0.
pub(super) fn key(value: Vec3) -> [u32; 3] {
    (value + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// For each value the lowest index of an equal one.
pub(super) fn first_equal(values: &[Vec3]) -> Vec<u32> {
    let mut keyed: Vec<([u32; 3], u32)> = (0u32..).zip(values).map(|(i, &v)| (key(v), i)).collect();
    keyed.sort_unstable();
    let mut first = vec![0; values.len()];
    for equal in keyed.chunk_by(|a, b| a.0 == b.0) {
        equal.iter().for_each(|&(_, index)| first[index as usize] = equal[0].1);
    }
    first
}

/// Whether a vertex may lie at `position`.
pub(super) fn in_range(position: Vec3) -> bool {
    position.to_array().iter().all(|coordinate| coordinate.abs() <= MAX_COORDINATE) // false for NaN
}

/// The cross product of two edges: along the normal, as long as twice the area. In `f64` the products of
/// neighbouring `f32` coordinates are exact, so corners on a line give exactly zero.
pub(super) fn doubled_area(positions: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|corner| DVec3::from(positions[corner as usize]));
    (b - a).cross(c - a)
}

fn area_weighted_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for &triangle in triangles {
        let doubled = doubled_area(positions, triangle);
        triangle.iter().for_each(|&corner| sums[corner as usize] += doubled);
    }
    sums.into_iter().map(|sum| unit(sum).unwrap_or(DEFAULT_NORMAL)).collect()
}

/// `vector` at length one; none where it has no direction. The square of no `f32` leaves the range of `f64`.
fn unit(vector: DVec3) -> Option<Vec3> {
    let length = vector.length();
    (length > 0.0 && length.is_finite()).then(|| (vector / length).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Vec<Vec3> {
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]
    }

    /// Four faces around the origin's corner of the unit cube.
    fn tetrahedron() -> Vec<[u32; 3]> {
        vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    }

    fn refusal(positions: Vec<Vec3>, normals: Option<Vec<Vec3>>, triangles: Vec<[u32; 3]>) -> String {
        Mesh::new(positions, normals, triangles).unwrap_err().to_string()
    }

    #[test]
    fn refuses_what_is_no_mesh_and_says_where() {
        assert!(refusal(vec![], None, vec![]).contains("no triangle"));
        let error = refusal(corner(), None, vec![[0, 1, 2], [1, 2, 4]]);
        assert!(error.contains("triangle 1 names vertex 4"), "{error}");
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e18] {
            let mut positions = corner();
            positions[3].y = bad; // unused, and still refused
            let error = refusal(positions, None, vec![[0, 1, 2]]);
            assert!(error.contains("vertex 3 lies at"), "{error}");
        }
        let line = vec![Vec3::ZERO, Vec3::splat(0.1), Vec3::splat(0.2)];
        assert!(refusal(line, None, vec![[0, 1, 2], [1, 1, 2]]).contains("has an area"));
        assert!(refusal(corner(), Some(vec![Vec3::X]), tetrahedron()).contains("1 normals and 4 vertices"));
    }

    #[test]
    fn computed_normals_are_weighted_by_area() {
        // A wall (area 1/2) and a floor four times as large share the edge 0–1.
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::new(0.0, -4.0, 0.0), Vec3::ONE];
        let mesh = Mesh::new(positions, None, vec![[0, 1, 2], [0, 3, 1]]).unwrap();
        let expected = Vec3::new(0.0, -1.0, 4.0) / 17.0_f32.sqrt();
        assert!(mesh.normals[0].distance(expected) < 1e-6, "{}", mesh.normals[0]);
        assert_eq!(mesh.normals[2], -Vec3::Y);
        assert_eq!(mesh.normals[3], Vec3::Z);
        assert_eq!(mesh.normals[4], DEFAULT_NORMAL); // unused
    }

    #[test]
    fn given_normals_are_normalised_and_useless_ones_computed() {
        let given = vec![Vec3::X * 1e-30, Vec3::ZERO, Vec3::NAN, Vec3::Z * 1e30];
        let mesh = Mesh::new(corner(), Some(given), vec![[0, 1, 2]]).unwrap();
        assert_eq!(mesh.normals, [Vec3::X, Vec3::Z, Vec3::Z, Vec3::Z]);
    }

    #[test]
    fn tiny_and_huge_triangles_have_an_area() {
        for size in [1e-30, 1e-6, 1e6, 1e18] {
            let positions = corner().into_iter().map(|p| p * size).collect();
            let mesh = Mesh::new(positions, None, tetrahedron()).unwrap();
            assert_eq!(mesh.normals[1], Vec3::X); // −z and −y of two walls, (1, 1, 1) of the slope
            assert_eq!(mesh.facts().zero_area_triangles, 0);
        }
    }

    #[test]
    fn bounds_ignore_unused_vertices() {
        let mut positions = corner();
        positions.push(Vec3::splat(100.0));
        let mesh = Mesh::new(positions, None, tetrahedron()).unwrap();
        assert_eq!(mesh.used_positions().collect::<Vec<_>>(), corner());
        let bounds = mesh.bounds();
        assert_eq!(bounds, Bounds { low: Vec3::ZERO, high: Vec3::ONE });
        assert_eq!(bounds.center(), Vec3::splat(0.5));
        assert_eq!(bounds.half_extents(), Vec3::splat(0.5));
        assert!((bounds.radius() - 0.75_f32.sqrt()).abs() < 1e-7);
    }

    #[test]
    fn facts_of_a_tetrahedron_closed_open_and_inside_out() {
        let closed = Mesh::new(corner(), None, tetrahedron()).unwrap().facts();
        assert!(closed.closed);
        assert_eq!((closed.boundary_edges, closed.non_manifold_edges), (0, 0));
        assert_eq!(closed.euler_characteristic, 2);
        assert!((closed.signed_volume - 1.0 / 6.0).abs() < 1e-15, "{}", closed.signed_volume);
        assert!((closed.area - (1.5 + 0.75_f64.sqrt())).abs() < 1e-15, "{}", closed.area);

        let open = Mesh::new(corner(), None, tetrahedron()[1..].to_vec()).unwrap().facts();
        assert!(!open.closed);
        assert_eq!((open.boundary_edges, open.non_manifold_edges), (3, 0));

        let inside_out = tetrahedron().into_iter().map(|[a, b, c]| [a, c, b]).collect();
        let inside_out = Mesh::new(corner(), None, inside_out).unwrap().facts();
        assert!(inside_out.closed);
        assert!((inside_out.signed_volume + 1.0 / 6.0).abs() < 1e-15);

        let mut one_turned = tetrahedron();
        one_turned[3].swap(0, 1);
        assert!(!Mesh::new(corner(), None, one_turned).unwrap().facts().closed);
    }

    #[test]
    fn facts_count_fins_strays_and_triangles_without_area() {
        let mut positions = corner();
        positions.extend([Vec3::ONE, Vec3::NEG_ONE, Vec3::X * -0.0]); // the last is vertex 0 again
        let mut triangles = tetrahedron();
        triangles.extend([[1, 2, 4], [0, 6, 1], [3, 3, 3]]);
        let facts = Mesh::new(positions, None, triangles).unwrap().facts();
        assert_eq!((facts.vertices, facts.used_vertices), (7, 6));
        assert_eq!((facts.triangles, facts.zero_area_triangles), (7, 2));
        assert_eq!((facts.boundary_edges, facts.non_manifold_edges), (2, 1));
        assert!(!facts.closed);
    }

    #[test]
    fn applying_a_turn_moves_positions_and_turns_normals() {
        let mut mesh = Mesh::new(corner(), None, vec![[0, 1, 2]]).unwrap();
        let quarter = Mat3::from_cols(Vec3::Y, -Vec3::X, Vec3::Z); // about z: x to y
        mesh.apply(2.0, quarter, Vec3::Z).unwrap();
        assert_eq!(mesh.positions[1], Vec3::new(0.0, 2.0, 1.0));
        assert_eq!(mesh.normals[1], Vec3::Z);
        let before = mesh.clone();
        let mirror = Mat3::from_cols(Vec3::X, Vec3::Y, -Vec3::Z);
        for (scale, rotation, translation) in [
            (0.0, quarter, Vec3::ZERO),
            (f32::NAN, quarter, Vec3::ZERO),
            (1.0, quarter * 1.01, Vec3::ZERO),
            (1.0, mirror, Vec3::ZERO),
            (1.0, Mat3::NAN, Vec3::ZERO),
            (1e20, quarter, Vec3::ZERO),
            (1.0, quarter, Vec3::NAN),
        ] {
            assert!(mesh.apply(scale, rotation, translation).is_err());
            assert_eq!(mesh, before);
        }
    }
}
