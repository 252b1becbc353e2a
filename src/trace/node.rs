//! What a tree of boxes is made of: nodes of eight boxes, and blocks of triangles.

use super::triangle::ends;
use crate::numeric::order::{max3, min3};
use glam::Vec3;
use std::ops::Range;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// The most triangles of a block, and the most vertices that they have.
pub(super) const BLOCK_TRIANGLES: usize = 6;
pub(super) const BLOCK_VERTICES: usize = 8;

/// The most levels of nodes of a tree.
pub(super) const LEVELS: usize = 64;

/// The bits of a node's two words that count children; the other bits are the index of the first.
const COUNT: u32 = 15;

/// Up to eight boxes and what is in them, the children: first nodes, then blocks. A child's *place* is its
/// number among them.
#[derive(Debug, Clone)]
#[repr(C, align(16))]
pub(super) struct Node {
    /// For each axis the low and high planes of the children's boxes, in steps from the origin. They are
    /// rounded so that the planes that [`Self::plane`] computes enclose the children.
    pub(super) steps: [[[u8; WIDTH]; 2]; 3],
    pub(super) origin: [f32; 3],
    /// The length of a step.
    pub(super) step: [f32; 3],
    /// For nodes and for blocks, the index of the first child times ([`COUNT`] + 1), plus how many there are.
    first: [u32; 2],
}

impl Node {
    /// A node of no children.
    pub(super) const EMPTY: Self =
        Self { steps: [[[0; WIDTH]; 2]; 3], origin: [0.0; 3], step: [0.0; 3], first: [0; 2] };

    /// Takes children: the indices of the first node and block and how many there are of each.
    pub(super) fn adopt(&mut self, first: [usize; 2], count: [usize; 2]) {
        self.first = [0, 1].map(|kind| first[kind] as u32 * (COUNT + 1) + count[kind] as u32);
    }

    /// How many children are nodes.
    #[inline(always)]
    pub(super) fn inner(&self) -> usize {
        (self.first[0] & COUNT) as usize
    }

    /// How many children there are.
    #[inline(always)]
    pub(super) fn count(&self) -> usize {
        self.inner() + (self.first[1] & COUNT) as usize
    }

    /// The index of a child that is a node, by its place.
    #[inline(always)]
    pub(super) fn node(&self, place: usize) -> usize {
        (self.first[0] / (COUNT + 1)) as usize + place
    }

    /// The index of a child that is a block, by its place.
    #[inline(always)]
    pub(super) fn block(&self, place: usize) -> usize {
        ((self.first[1] / (COUNT + 1)) as usize + place).wrapping_sub(self.inner())
    }

    /// The indices of the children that are nodes.
    pub(super) fn nodes(&self) -> Range<usize> {
        self.node(0)..self.node(self.inner())
    }

    /// The plane of an axis that is so many steps from the origin.
    #[inline(always)]
    pub(super) fn plane(&self, axis: usize, steps: u8) -> f32 {
        self.origin[axis] + f32::from(steps) * self.step[axis]
    }

    /// Fits the boxes around those of the children and returns their hull.
    pub(super) fn enclose(&mut self, boxes: &[(Vec3, Vec3)]) -> (Vec3, Vec3) {
        let hull = hull(boxes);
        self.origin = hull.0.to_array();
        for axis in 0..3 {
            let (low, high) = (hull.0[axis], hull.1[axis]);
            // In `f64`, since a difference may exceed the range of `f32`.
            let above = |end: f32| f64::from(end) - f64::from(low);
            self.step[axis] = (above(high) / 255.0) as f32;
            while self.plane(axis, 255) < high {
                self.step[axis] = self.step[axis].next_up();
            }
            for (place, ends) in boxes.iter().enumerate() {
                let steps = |end: f32| (above(end) / f64::from(self.step[axis])) as u8;
                let [mut first, mut last] = [steps(ends.0[axis]), steps(ends.1[axis])];
                while self.plane(axis, first) > ends.0[axis] {
                    first -= 1;
                }
                while self.plane(axis, last) < ends.1[axis] {
                    last += 1;
                }
                (self.steps[axis][0][place], self.steps[axis][1][place]) = (first, last);
            }
        }
        hull
    }
}

/// Triangles that share vertices.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// For each axis the vertices' coordinates.
    pub(super) vertices: [[f32; BLOCK_VERTICES]; 3],
    /// Which of `vertices` each corner is, three bits each: all first corners, then all second ones, then all
    /// third ones. The highest four bits are how many triangles there are.
    pub(super) corners: u64,
    /// The triangles; 0 where there are fewer.
    pub(super) triangles: [u32; BLOCK_TRIANGLES],
}

impl Block {
    /// The block of these triangles, which have at most [`BLOCK_VERTICES`] vertices, with no coordinates yet.
    pub(super) fn of(held: &[u32], triangles: &[[u32; 3]]) -> Self {
        let mut block = Self {
            vertices: [[0.0; BLOCK_VERTICES]; 3],
            corners: (held.len() as u64) << 60,
            triangles: [0; BLOCK_TRIANGLES],
        };
        let mut vertices = Vec::with_capacity(BLOCK_VERTICES);
        for (place, triangle) in held.iter().enumerate() {
            block.triangles[place] = *triangle;
            for (corner, vertex) in triangles[*triangle as usize].iter().enumerate() {
                let known = vertices.iter().position(|known| known == vertex);
                let number = known.unwrap_or(vertices.len());
                vertices.extend(known.is_none().then_some(*vertex));
                block.corners |= (number as u64) << (3 * (corner * BLOCK_TRIANGLES + place));
            }
        }
        block
    }

    /// How many triangles there are.
    #[inline(always)]
    pub(super) fn count(&self) -> usize {
        (self.corners >> 60) as usize
    }

    /// Which of the block's vertices a triangle's corner is.
    #[inline(always)]
    fn vertex(&self, corner: usize, place: usize) -> usize {
        (self.corners >> (3 * (corner * BLOCK_TRIANGLES + place))) as usize % BLOCK_VERTICES
    }

    /// The corners of a triangle.
    #[inline(always)]
    pub(super) fn corners(&self, place: usize) -> [Vec3; 3] {
        let corner = |corner: usize| {
            let vertex = self.vertex(corner, place);
            Vec3::new(self.vertices[0][vertex], self.vertices[1][vertex], self.vertices[2][vertex])
        };
        [corner(0), corner(1), corner(2)]
    }

    /// Copies the coordinates from the corners of all triangles of the mesh, and returns the box around the
    /// block's own.
    ///
    /// # Panics
    /// Where triangles no longer share the vertices that they shared.
    pub(super) fn fill(&mut self, corners: &[[Vec3; 3]]) -> (Vec3, Vec3) {
        let mut boxes = [(Vec3::ZERO, Vec3::ZERO); BLOCK_TRIANGLES];
        let count = self.count();
        for place in 0..count {
            let triangle = &corners[self.triangles[place] as usize];
            for (corner, from) in triangle.iter().enumerate() {
                let vertex = self.vertex(corner, place);
                for axis in 0..3 {
                    self.vertices[axis][vertex] = from[axis];
                }
            }
            boxes[place] = ends(triangle);
        }
        let same = |place: usize| self.corners(place) == corners[self.triangles[place] as usize];
        assert!((0..count).all(same), "a pose has the triangles of the first");
        hull(&boxes[..count])
    }
}

/// The box around boxes.
fn hull(boxes: &[(Vec3, Vec3)]) -> (Vec3, Vec3) {
    boxes[1..].iter().fold(boxes[0], |hull, ends| (min3(hull.0, ends.0), max3(hull.1, ends.1)))
}

/// A tree: its nodes, each before those below it and the root first, and its blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
}

impl Parts {
    /// Gives a node its children: so many new nodes, and these blocks. Returns the index of the first new
    /// node.
    pub(super) fn give(&mut self, to: usize, nodes: usize, blocks: impl Iterator<Item = Block>) -> usize {
        let first = [self.nodes.len(), self.blocks.len()];
        self.nodes.resize(first[0] + nodes, Node::EMPTY);
        self.blocks.extend(blocks);
        self.nodes[to].adopt(first, [nodes, self.blocks.len() - first[1]]);
        first[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;

    /// At any scale, also where `f32` cannot resolve a step, and where the hull is a plane or a point.
    #[test]
    fn planes_in_steps_enclose_what_they_are_made_for_closely() {
        let number = |at: u64, which: u64| unit(3, at, 0, which) * 2.0 - 1.0;
        let three = |at: u64, which: u64| Vec3::from_array([0, 1, 2].map(|axis| number(at, which + axis)));
        for case in 0..20_000 {
            let size = [1.0, 1e-3, 1e-30, 1e-38, 3e-45, 1e30, 3.4e38, 0.0][case as usize % 8];
            let shift = [0.0, 1.0, 3e4, 1e-40][case as usize / 8 % 4];
            let scale = Vec3::from_array([size, if case % 3 == 0 { 0.0 } else { size }, size * 1e-4]);
            let boxes: Vec<_> = (0..1 + case % 8)
                .map(|child| {
                    let [a, b] =
                        [0, 3].map(|which| three(8 * case + child, which) * scale + Vec3::splat(shift));
                    (min3(a, b), max3(a, b))
                })
                .collect();
            let mut node = Node::EMPTY;
            let (low, high) = node.enclose(&boxes);
            for axis in 0..3 {
                for (place, ends) in boxes.iter().enumerate() {
                    let [first, last] = [0, 1].map(|side| node.steps[axis][side][place]);
                    assert!(node.plane(axis, first) <= ends.0[axis], "{boxes:?}");
                    assert!(node.plane(axis, last) >= ends.1[axis], "{boxes:?}");
                    let step = f64::from(node.step[axis]);
                    let apart = |a: f32, b: f32| (f64::from(a) - f64::from(b)).abs();
                    if (high[axis] - low[axis]).is_infinite() {
                        continue;
                    }
                    // Where `f32` cannot resolve a step, the nearest plane that it can.
                    let most = 2.0 * step + apart(low[axis], low[axis].next_up());
                    let most = most + apart(high[axis], high[axis].next_down());
                    assert!(apart(node.plane(axis, first), ends.0[axis]) <= most, "{boxes:?}");
                    assert!(apart(node.plane(axis, last), ends.1[axis]) <= most, "{boxes:?}");
                }
            }
        }
    }
}
