//! The mesh and the points of a bundle, in the order of their Morton codes.

use crate::numeric::order::{clamp, max, max3, min3};
use crate::world::mesh::Mesh;
use glam::Vec3;

/// The most triangles that are set up together, and the most points that one is held against at a time.
pub(super) const LANES: usize = 16;

/// A mesh and points, in an order in which neighbours in space are neighbours in memory.
pub(super) struct Bundle {
    /// Positions: the mesh's vertices, then those points that are no vertices; one list a coordinate. An
    /// index into it is a *place*.
    pub(super) places: [Vec<f32>; 3],
    /// The places of the corners of sixteen triangles, one list a corner. The last triangle is repeated to
    /// fill the last sixteen.
    pub(super) triangles: Vec<[[u32; LANES]; 3]>,
    /// The index of each of these triangles in the mesh.
    pub(super) indices: Vec<u32>,
    /// Of each point its place, its normal (one list a coordinate), and its index among the points that were
    /// given.
    pub(super) points: Vec<u32>,
    pub(super) normals: [Vec<f32>; 3],
    pub(super) order: Vec<u32>,
    /// The middle of the box around everything, and half its sides.
    pub(super) center: Vec3,
    pub(super) half: Vec3,
}

/// The Morton code of a point (Morton 1966): its coordinates from the corner `low`, ten bits each, with their
/// bits interleaved.
fn morton(point: Vec3, low: Vec3, scale: f32) -> u32 {
    let spread = |value: f32| {
        let mut bits = clamp(value * scale, 0.0, 1023.0) as u32;
        for (shift, mask) in [(16, 0x0300_00ff), (8, 0x0300_f00f), (4, 0x030c_30c3), (2, 0x0924_9249)] {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    let place = point - low;
    spread(place.x) | spread(place.y) << 1 | spread(place.z) << 2
}

impl Bundle {
    /// `normals` has one normal a point, or none where only hits are asked for.
    pub(super) fn new(mesh: &Mesh, points: &[Vec3], normals: &[Vec3]) -> Self {
        let all = || mesh.positions.iter().chain(points);
        let first = mesh.positions[0];
        let (low, high) = all().fold((first, first), |(low, high), p| (min3(low, *p), max3(high, *p)));
        let scale = 1023.0 / max((high - low).max_element(), f32::MIN_POSITIVE);
        let order = |count: usize, place: &dyn Fn(usize) -> Vec3| {
            let mut keys: Vec<(u32, u32)> =
                (0..count).map(|index| (morton(place(index), low, scale), index as u32)).collect();
            keys.sort_unstable();
            keys.into_iter().map(|(_, index)| index).collect::<Vec<u32>>()
        };
        let sorted = order(mesh.positions.len(), &|vertex| mesh.positions[vertex]);
        let mut place = vec![0; sorted.len()];
        (0..).zip(&sorted).for_each(|(new, old)| place[*old as usize] = new);
        let centroid = |triangle: usize| {
            let [a, b, c] = mesh.triangles[triangle].map(|corner| mesh.positions[corner as usize] / 3.0);
            a + b + c
        };
        let mut indices = order(mesh.triangles.len(), &centroid);
        indices.resize(indices.len().next_multiple_of(LANES), indices[indices.len() - 1]);
        let together = |some: &[u32]| {
            let mut corners = [[0; LANES]; 3];
            for (lane, old) in some.iter().enumerate() {
                for (corner, vertex) in mesh.triangles[*old as usize].iter().enumerate() {
                    corners[corner][lane] = place[*vertex as usize];
                }
            }
            corners
        };
        let triangles: Vec<_> = indices.chunks(LANES).map(together).collect();
        let mut places: Vec<Vec3> = sorted.iter().map(|old| mesh.positions[*old as usize]).collect();
        let order = order(points.len(), &|point| points[point]);
        let numbers = order.iter().map(|index| {
            let index = *index as usize;
            if mesh.positions.get(index) == Some(&points[index]) {
                return place[index];
            }
            places.push(points[index]);
            places.len() as u32 - 1
        });
        let numbers = numbers.collect();
        let lists = |of: &dyn Fn(usize) -> Vec3, count: usize| {
            [0, 1, 2].map(|axis| (0..count).map(|index| of(index)[axis]).collect::<Vec<f32>>())
        };
        Self {
            places: lists(&|index| places[index], places.len()),
            triangles,
            indices,
            points: numbers,
            normals: lists(
                &|index| normals[order[index] as usize],
                if normals.is_empty() { 0 } else { order.len() },
            ),
            order,
            center: low * 0.5 + high * 0.5,
            half: high * 0.5 - low * 0.5,
        }
    }

    pub(super) fn place(&self, index: u32) -> Vec3 {
        let ([x, y, z], index) = (&self.places, index as usize);
        Vec3::new(x[index], y[index], z[index])
    }
}
