//! A lower bound of the distance of a point from a mesh: a walk whose next step is shorter meets nothing and
//! needs no ray.
//!
//! A grid of cubes covers the mesh's box. Cubes that a triangle's box touches are occupied. Every cube has
//! the distance between it and the nearest occupied one, rounded down, so the bound holds for every point of
//! the cube. The squared distance of two cubes is the sum over the axes of max(|steps| − 1, 0)², so the least
//! is found axis by axis.

use crate::numeric::order::{clamp, max, max3, min, min3};
use crate::numeric::parallel;
use crate::world::mesh::Bounds;
use glam::Vec3;

/// Cubes along the longest side.
const CELLS: f32 = 96.0;

/// Parts of a cube's side in which distances are counted.
const PARTS: f32 = 2.0;

/// The grid.
#[derive(Debug, Clone)]
pub(super) struct Clearance {
    low: Vec3,
    /// Cubes a unit of length.
    scale: f32,
    size: [usize; 3],
    /// In `unit`s, x fastest.
    steps: Vec<u8>,
    unit: f32,
}

impl Clearance {
    /// The grid over triangles in a box.
    pub(super) fn new(corners: &[[Vec3; 3]], bounds: &Bounds) -> Self {
        let extent = bounds.high - bounds.low;
        let side = extent.max_element() / CELLS;
        // A border of one cube, so that rounding near the box does not lead out of the grid.
        let low = bounds.low - Vec3::splat(side);
        let size = (extent / side).to_array().map(|cells| cells as usize + 3);
        let mut grid = Self {
            low,
            scale: 1.0 / side,
            size,
            steps: vec![0; size.iter().product()],
            // A thousandth less than a part, which is more than the rounding of a cube's place.
            unit: side / PARTS * 0.999,
        };
        let mut far = vec![f32::INFINITY; grid.steps.len()];
        for [a, b, c] in corners {
            // A thousandth of a cube around the box, for rounding's sake.
            let around = Vec3::splat(side * 1e-3);
            let first = grid.cell(min3(min3(*a, *b), *c) - around);
            let last = grid.cell(max3(max3(*a, *b), *c) + around);
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    let row = (z * size[1] + y) * size[0];
                    far[row + first[0]..=row + last[0]].fill(0.0);
                }
            }
        }
        for axis in 0..3 {
            far = spread(&far, size, axis);
        }
        for (steps, squared) in grid.steps.iter_mut().zip(&far) {
            *steps = min(squared.sqrt() * PARTS, 255.0) as u8;
        }
        grid
    }

    fn cell(&self, point: Vec3) -> [usize; 3] {
        let at = (point - self.low) * self.scale;
        [0, 1, 2].map(|axis| clamp(at[axis] as usize, 0, self.size[axis] - 1))
    }

    /// A distance from a point of the box within which there is no triangle.
    #[inline]
    pub(super) fn at(&self, point: Vec3) -> f32 {
        let [x, y, z] = self.cell(point);
        f32::from(self.steps[(z * self.size[1] + y) * self.size[0] + x]) * self.unit
    }
}

/// For each cube the least sum, over all cubes in its row along an axis, of their value and the squared
/// distance to them.
fn spread(far: &[f32], size: [usize; 3], axis: usize) -> Vec<f32> {
    let stride: usize = size[..axis].iter().product();
    let count = size[axis];
    let planes = parallel::map(far.len() / (stride * count), |plane| {
        let block = &far[plane * stride * count..][..stride * count];
        let mut least = vec![f32::INFINITY; block.len()];
        for (to, row) in least.chunks_exact_mut(stride).enumerate() {
            for (from, other) in block.chunks_exact(stride).enumerate() {
                let apart = max(to.abs_diff(from) as f32 - 1.0, 0.0);
                let apart = apart * apart;
                for (least, other) in row.iter_mut().zip(other) {
                    *least = min(*least, other + apart);
                }
            }
        }
        least
    });
    planes.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;
    use crate::world::shapes;

    #[test]
    fn no_triangle_is_nearer_and_the_middle_of_a_ball_is_known_to_be_clear() {
        for (mesh, middle) in [
            (shapes::sphere(9).unwrap(), 0.8),
            (shapes::torus_knot(2, 3, 0.3, 80, 9).unwrap(), 0.0),
            (shapes::cuboid(Vec3::new(1.0, 0.001, 0.3), 2).unwrap(), 0.0),
        ] {
            let corners: Vec<[Vec3; 3]> =
                mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize])).collect();
            let bounds = mesh.bounds();
            let grid = Clearance::new(&corners, &bounds);
            assert!(grid.at(bounds.center()) >= middle);
            for i in 0..2000 {
                let part = Vec3::from_array([0, 1, 2].map(|axis| unit(1, i, axis, 0)));
                let point = bounds.low + (bounds.high - bounds.low) * part;
                let clear = grid.at(point);
                // Points of triangles, dense enough to come near the nearest.
                for corners in &corners {
                    for k in 0..4 {
                        let [u, v] = [unit(2, i, k, 0), unit(2, i, k, 1)];
                        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                        let on = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                        assert!((on - point).length() >= clear, "{point}");
                    }
                }
            }
        }
    }
}
