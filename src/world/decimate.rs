//! Fewer triangles: edges are collapsed into points, the least quadric error first, after Garland and
//! Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997.
//!
//! The error of a point is the sum of its squared distances from the planes of the triangles that it stands
//! for, each weighted by the triangle's area. All is `+ − × ÷ √` in `f64`, points are rounded to `f32` before
//! they are judged, and the order of collapses is total: error, then the two vertices. So the same mesh gives
//! the same bits, and a mesh of fewer triangles is what one of more would become.
//!
//! - Vertices in one place are one, as in [`Facts`](super::mesh::Facts); unused ones go, and so do triangles
//!   with two corners in one place. What stays keeps the mesh's order.
//! - The surface keeps its kind: pieces, handles and holes stay (the link condition), so a closed solid stays
//!   closed.
//! - No vertex moves into another's place, where the two would be one.
//! - No triangle turns by more than 78° in one collapse, and none loses its area. One that has none from the
//!   start weighs nothing.
//! - A boundary counts as planes through its edges, upright on the surface, each with the weight [`BOUNDARY`]
//!   times the edge's length squared.
//! - Vertices of edges with more than two triangles stay where they are; others may be collapsed into them.
//! - On flat parts every error is 0 or rounding. There short edges go first, by [`SHAPE`].

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use glam::{DMat3, DVec3, Vec3};

use super::mesh::{Mesh, doubled_area, first_equal, in_range, key};
use crate::Error;
use crate::numeric::order::max;

/// The weight of a boundary's plane, times the square of its edge. The weight of a triangle's plane is its
/// area.
pub const BOUNDARY: f64 = 100.0;

/// The part of an edge's squared length that counts as error, as if a point were off by a thousandth of the
/// edge's length.
pub const SHAPE: f64 = 1e-6;

/// The cosine of the largest turn of a triangle.
const TURN: f64 = 0.2;

/// `mesh` with at most `most` triangles: as it is where it has no more, else with `most` or one fewer
/// (triangles with two corners in one place go before that). The normals of what was decimated are computed,
/// not interpolated.
///
/// # Errors
/// Where no further edge can go without a fold or a tear, naming how many triangles there are then.
pub fn decimate(mesh: Mesh, most: usize) -> Result<Mesh, Error> {
    if mesh.triangles.len() <= most {
        return Ok(mesh);
    }
    let mut surface = Surface::new(mesh);
    loop {
        let before = surface.living;
        surface.sweep(most);
        if surface.living <= most {
            return surface.into_mesh();
        }
        // A collapse that was refused may have become possible, since its neighbours changed.
        if surface.living == before {
            return Err(Error::new(format!(
                "the mesh cannot have fewer than {} triangles without a fold or a tear",
                surface.living
            ))
            .remedy(format!("ask for {} or more", surface.living)));
        }
    }
}

/// A sum of weighted squared distances from planes: pᵗ A p + 2 b·p + c.
#[derive(Debug, Clone, Copy)]
struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
}

impl Quadric {
    const NONE: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0 };

    /// The squared distance from the plane through `point` with a unit `normal`.
    fn plane(normal: DVec3, point: DVec3, weight: f64) -> Self {
        let (scaled, distance) = (normal * weight, -normal.dot(point));
        let a = DMat3::from_cols(scaled * normal.x, scaled * normal.y, scaled * normal.z);
        Self { a, b: scaled * distance, c: weight * distance * distance }
    }

    fn add(&mut self, other: &Self) {
        *self = Self { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c };
    }

    fn error(&self, p: DVec3) -> f64 {
        p.dot(self.a * p) + 2.0 * self.b.dot(p) + self.c
    }

    /// The sum of the weights, since the trace of each plane's matrix is its weight.
    fn weight(&self) -> f64 {
        self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z
    }

    /// Where the error is least; none where that is a line, a plane or everywhere, or nearly, or farther than
    /// `reach` from `near`.
    fn least(&self, near: DVec3, reach: f64) -> Option<DVec3> {
        let [x, y, z] = [self.a.x_axis, self.a.y_axis, self.a.z_axis];
        let adjugate = [y.cross(z), z.cross(x), x.cross(y)]; // of a symmetric matrix: rows are columns
        let (determinant, weight) = (x.dot(adjugate[0]), self.weight());
        if determinant.is_nan() || determinant <= 1e-12 * weight * weight * weight {
            return None;
        }
        let slope = self.a * near + self.b;
        let step = DVec3::from(adjugate.map(|row| -row.dot(slope) / determinant));
        (step.length() <= reach).then(|| near + step)
    }
}

/// Ways to collapse an edge: the bits of the error, which order as the error does, and the point. `u64::MAX`
/// where there is no way.
type Ways = [(u64, Vec3); 4];

/// An edge that may go: error, lower and higher vertex, which of its ways, and the sum of the vertices'
/// versions, which tells whether the edge has changed since.
type Candidate = Reverse<(u64, u32, u32, usize, u64)>;

/// A mesh that loses edges.
struct Surface {
    positions: Vec<Vec3>,
    /// The places of vertices, as keys.
    places: BTreeSet<[u32; 3]>,
    quadrics: Vec<Quadric>,
    /// All triangles, those that are gone included.
    triangles: Vec<[u32; 3]>,
    gone: Vec<bool>,
    living: usize,
    /// The living triangles of each vertex.
    around: Vec<Vec<u32>>,
    /// Whether it has an edge whose triangles are not two.
    on_rim: Vec<bool>,
    /// Whether it has an edge of more than two triangles.
    locked: Vec<bool>,
    versions: Vec<u64>,
    heap: BinaryHeap<Candidate>,
}

impl Surface {
    fn new(mesh: Mesh) -> Self {
        let count = mesh.positions.len();
        let place = first_equal(&mesh.positions);
        let mut triangles: Vec<_> =
            mesh.triangles.iter().map(|corners| corners.map(|corner| place[corner as usize])).collect();
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        let mut surface = Self {
            places: place.iter().map(|&first| key(mesh.positions[first as usize])).collect(),
            positions: mesh.positions,
            quadrics: vec![Quadric::NONE; count],
            gone: vec![false; triangles.len()],
            living: triangles.len(),
            triangles,
            around: vec![Vec::new(); count],
            on_rim: vec![false; count],
            locked: vec![false; count],
            versions: vec![0; count],
            heap: BinaryHeap::new(),
        };
        for index in 0..surface.triangles.len() {
            let [a, b, c] = surface.triangles[index];
            [a, b, c].into_iter().for_each(|corner| surface.around[corner as usize].push(index as u32));
            if let Some((normal, area)) = surface.plane(index as u32) {
                surface.weigh(&[a, b, c], normal, area);
            }
        }
        for (a, b, uses) in surface.edges() {
            for corner in [a, b].map(|corner| corner as usize) {
                surface.on_rim[corner] |= uses != 2;
                surface.locked[corner] |= uses > 2;
            }
            if uses == 1 {
                let only = surface.shared(a, b).next().and_then(|(triangle, _)| surface.plane(triangle));
                let edge = surface.point(b) - surface.point(a);
                if let Some(upright) = only.and_then(|(normal, _)| edge.cross(normal).try_normalize()) {
                    surface.weigh(&[a, b], upright, BOUNDARY * edge.length_squared());
                }
            }
        }
        surface
    }

    fn point(&self, vertex: u32) -> DVec3 {
        DVec3::from(self.positions[vertex as usize])
    }

    /// The unit normal and the area of a triangle that has one.
    fn plane(&self, triangle: u32) -> Option<(DVec3, f64)> {
        let doubled = doubled_area(&self.positions, self.triangles[triangle as usize]);
        let length = doubled.length();
        (length > 0.0).then(|| (doubled / length, 0.5 * length))
    }

    /// Adds the plane through the first of `vertices` to the errors of all of them.
    fn weigh(&mut self, vertices: &[u32], normal: DVec3, weight: f64) {
        let plane = Quadric::plane(normal, self.point(vertices[0]), weight);
        vertices.iter().for_each(|&vertex| self.quadrics[vertex as usize].add(&plane));
    }

    /// Every edge of the living triangles, lower vertex first, in order, and how many triangles it has.
    fn edges(&self) -> Vec<(u32, u32, usize)> {
        let living = self.triangles.iter().zip(&self.gone).filter(|(_, gone)| !**gone);
        let mut edges: Vec<_> = living
            .flat_map(|(&[a, b, c], _)| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| if a < b { (a, b) } else { (b, a) })
            .collect();
        edges.sort_unstable();
        edges.chunk_by(|a, b| a == b).map(|uses| (uses[0].0, uses[0].1, uses.len())).collect()
    }

    /// The triangles of the edge from `a` to `b`, each with its third corner.
    fn shared(&self, a: u32, b: u32) -> impl Iterator<Item = (u32, u32)> {
        self.around[a as usize].iter().filter_map(move |&triangle| {
            let corners = self.triangles[triangle as usize];
            let third = corners.into_iter().find(|&corner| corner != a && corner != b)?;
            corners.contains(&b).then_some((triangle, third))
        })
    }

    /// The vertices that share a triangle with `vertex`, in order.
    fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let corners = self.around[vertex as usize].iter().flat_map(|&index| self.triangles[index as usize]);
        let mut neighbours: Vec<_> = corners.filter(|&corner| corner != vertex).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    /// Collapses edges, the cheapest first, until `most` triangles live or none is left to try.
    fn sweep(&mut self, most: usize) {
        self.heap.clear();
        for (a, b, _) in self.edges() {
            self.push(a, b, 0);
        }
        while self.living > most {
            let Some(Reverse((_, a, b, way, version))) = self.heap.pop() else { return };
            if version != self.version(a, b) {
                continue;
            }
            let (_, point) = self.ways(a, b)[way];
            if !self.keeps_its_kind(a, b) {
                continue;
            }
            if self.meets_another(a, b, point) || self.folds(a, b, point) || self.folds(b, a, point) {
                self.push(a, b, way + 1);
            } else {
                self.collapse(a, b, point);
            }
        }
    }

    fn version(&self, a: u32, b: u32) -> u64 {
        self.versions[a as usize] + self.versions[b as usize]
    }

    fn push(&mut self, a: u32, b: u32, way: usize) {
        match self.ways(a, b).get(way) {
            None | Some((u64::MAX, _)) => {}
            Some((error, _)) => self.heap.push(Reverse((*error, a, b, way, self.version(a, b)))),
        }
    }

    /// To the point of least error, the middle or the ends, in the order of their errors.
    fn ways(&self, a: u32, b: u32) -> Ways {
        let mut quadric = self.quadrics[a as usize];
        quadric.add(&self.quadrics[b as usize]);
        let (from, to) = (self.point(a), self.point(b));
        let (middle, length) = ((from + to) * 0.5, (to - from).length());
        let shape = SHAPE * quadric.weight() * length * length;
        let way = |point: Option<DVec3>, allowed: bool| {
            let point = point.filter(|_| allowed).map(|point| point.as_vec3());
            point.filter(|&point| in_range(point)).map_or((u64::MAX, Vec3::ZERO), |point| {
                // Not negative, so its bits order as it does.
                ((max(0.0, quadric.error(DVec3::from(point))) + shape).to_bits(), point)
            })
        };
        let [a, b] = [a, b].map(|vertex| self.locked[vertex as usize]);
        let mut ways = [
            way(quadric.least(middle, length), !a && !b),
            way(Some(middle), !a && !b),
            way(Some(from), !b),
            way(Some(to), !a),
        ];
        ways.sort_by_key(|way| way.0);
        ways
    }

    /// The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999): a neighbour of both ends is one of the
    /// edge. The rim, which is boundaries and locked edges, counts as one more vertex, a neighbour of all
    /// that are on it.
    fn keeps_its_kind(&self, a: u32, b: u32) -> bool {
        let thirds: Vec<u32> = self.shared(a, b).map(|(_, third)| third).collect();
        let theirs = self.neighbours(b);
        let common = self.neighbours(a).into_iter().filter(|one| theirs.binary_search(one).is_ok()).count();
        let triangle = |a, b, c| self.shared(a, b).any(|(_, third)| third == c);
        // Two edges become one. At least one of them must be inside: the new edge is then on the rim if the
        // other was.
        let inner = |a, b| self.shared(a, b).count() == 2;
        common == thirds.len()
            && thirds.iter().all(|&third| inner(a, third) || inner(b, third))
            && match thirds[..] {
                [_] => true,
                [c, d] => {
                    let across = self.on_rim[a as usize] && self.on_rim[b as usize];
                    c != d && !across && !(triangle(a, c, d) && triangle(b, c, d))
                }
                _ => false,
            }
    }

    /// Whether a vertex that is neither `a` nor `b` is at `point`.
    fn meets_another(&self, a: u32, b: u32, point: Vec3) -> bool {
        let own = [a, b].iter().any(|vertex| self.positions[*vertex as usize] == point);
        !own && self.places.contains(&key(point))
    }

    /// Whether a triangle of `vertex` that is not one of `other` folds, or loses its area, if `vertex` moves
    /// to `point`.
    fn folds(&self, vertex: u32, other: u32, point: Vec3) -> bool {
        self.around[vertex as usize].iter().any(|&index| {
            let corners = self.triangles[index as usize];
            if corners.contains(&other) {
                return false;
            }
            let place = |corner: u32| if corner == vertex { point } else { self.positions[corner as usize] };
            let old = doubled_area(&self.positions, corners);
            let new = doubled_area(&corners.map(place), [0, 1, 2]);
            old != DVec3::ZERO && (new == DVec3::ZERO || old.dot(new) < TURN * (old.length() * new.length()))
        })
    }

    /// Makes `b` one with `a`, at `point`.
    fn collapse(&mut self, a: u32, b: u32, point: Vec3) {
        let vanishing: Vec<(u32, u32)> = self.shared(a, b).collect();
        for &(index, third) in &vanishing {
            self.gone[index as usize] = true;
            self.around[third as usize].retain(|&other| other != index);
        }
        self.living -= vanishing.len();
        let [one, other] = [a, b].map(|vertex| std::mem::take(&mut self.around[vertex as usize]));
        for &index in &other {
            for corner in self.triangles[index as usize].iter_mut().filter(|corner| **corner == b) {
                *corner = a;
            }
        }
        let fan = one.into_iter().chain(other).filter(|&index| !self.gone[index as usize]).collect();
        let [a_, b_] = [a as usize, b as usize];
        self.around[a_] = fan;
        [a_, b_].iter().for_each(|vertex| _ = self.places.remove(&key(self.positions[*vertex])));
        self.places.insert(key(point));
        self.positions[a_] = point;
        let joined = self.quadrics[b_];
        self.quadrics[a_].add(&joined);
        self.on_rim[a_] |= self.on_rim[b_];
        self.locked[a_] |= self.locked[b_];
        [a_, b_].into_iter().for_each(|vertex| self.versions[vertex] += 1);
        for neighbour in self.neighbours(a) {
            let (low, high) = if a < neighbour { (a, neighbour) } else { (neighbour, a) };
            self.push(low, high, 0);
        }
    }

    fn into_mesh(self) -> Result<Mesh, Error> {
        let mut number = vec![0; self.positions.len()];
        let mut positions = Vec::new();
        for (vertex, position) in self.positions.iter().enumerate() {
            number[vertex] = positions.len() as u32;
            if !self.around[vertex].is_empty() {
                positions.push(*position);
            }
        }
        let living = self.triangles.iter().zip(&self.gone).filter(|(_, gone)| !**gone);
        let triangles = living.map(|(corners, _)| corners.map(|corner| number[corner as usize])).collect();
        Mesh::new(positions, None, triangles)
    }
}
