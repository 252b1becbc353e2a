//! A tree of boxes, eight to a node, over the triangles of a mesh.
//!
//! obvhs builds a binary tree (PLOC: Meister and Bittner 2018) with one triangle a leaf; [`Bvh::new`] pulls up the
//! largest boxes until each node has eight. A child is a node or one triangle, so a triangle's own box is tested with
//! those of its neighbours. The walk is ours: obvhs's is not conservative.

use super::triangle::{Shear, Slabs, within};
use super::{Hit, Ray};
use crate::numeric::lanes::wide;
use crate::numeric::order::{max3, min3};
use crate::world::mesh::Mesh;
use glam::Vec3;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Children of a node.
const WIDTH: usize = 8;

/// Marks a child that is a triangle.
const LEAF: u32 = 1 << 31;

/// The most entries of a walk's stack: a node leaves at most seven behind on each level.
const STACK: usize = 7 * 96;

/// Boxes and what is in them.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
struct Node {
    /// For each axis the children's low and high coordinates; an absent child has an empty box.
    bounds: [[[f32; WIDTH]; 2]; 3],
    /// A node's index, or [`LEAF`] and a triangle's.
    children: [u32; WIDTH],
}

const EMPTY: Node =
    Node { bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };

/// A mesh's triangles and a tree of boxes over them.
#[derive(Debug, Clone)]
pub struct Bvh {
    /// A node comes before the nodes below it; the root is the first.
    nodes: Vec<Node>,
    /// The corners of every triangle, in the mesh's order.
    corners: Vec<[Vec3; 3]>,
}

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize])).collect()
}

impl Bvh {
    /// The tree over a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let corners = corners(mesh);
        let boxes: Vec<_> = corners
            .iter()
            .map(|[a, b, c]| {
                let (low, high) = (min3(min3(*a, *b), *c), max3(max3(*a, *b), *c));
                obvhs::aabb::Aabb::new(low.into(), high.into())
            })
            .collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Low,
            &boxes,
            indices,
            SortPrecision::U64,
            2,
        );
        ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
        let mut bvh = Self { nodes: collapse(&binary), corners };
        bvh.enclose();
        bvh
    }

    /// Takes the corners of `mesh`, another pose with the same triangles, and keeps the tree with boxes that fit.
    /// Hits are those of a new tree; a pose far from the first makes them slower to find.
    ///
    /// # Panics
    /// Where the mesh has another number of triangles.
    pub fn refit(&mut self, mesh: &Mesh) {
        assert_eq!(mesh.triangles.len(), self.corners.len(), "a pose has the triangles of the first");
        self.corners = corners(mesh);
        self.enclose();
    }

    /// The corners of every triangle, in the mesh's order.
    pub fn corners(&self) -> &[[Vec3; 3]] {
        &self.corners
    }

    /// Fits every box to what is in it, from the leaves up.
    fn enclose(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..WIDTH {
                let node = &self.nodes[index];
                let child = node.children[lane];
                let (low, high) = if child & LEAF != 0 {
                    let [a, b, c] = self.corners[(child & !LEAF) as usize];
                    (min3(min3(a, b), c), max3(max3(a, b), c))
                } else if child != 0 {
                    let child = &self.nodes[child as usize];
                    let at = |side: usize, lane: usize| {
                        Vec3::from_array([0, 1, 2].map(|axis| child.bounds[axis][side][lane]))
                    };
                    (1..WIDTH).fold((at(0, 0), at(1, 0)), |(low, high), lane| {
                        (min3(low, at(0, lane)), max3(high, at(1, lane)))
                    })
                } else {
                    continue;
                };
                for axis in 0..3 {
                    self.nodes[index].bounds[axis][0][lane] = low[axis];
                    self.nodes[index].bounds[axis][1][lane] = high[axis];
                }
            }
        }
    }

    /// The nearest hit: the least t, and of those with equal t the lowest triangle.
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        nearest(self, ray)
    }

    /// Whether the ray meets any triangle.
    pub fn blocked(&self, ray: &Ray) -> bool {
        blocked(self, ray)
    }
}

/// Eight children a node from two: of a node's children the one with the largest box is replaced by its own two until
/// there are eight.
fn collapse(binary: &Bvh2) -> Vec<Node> {
    let mut nodes = vec![EMPTY];
    let mut open = vec![(0_usize, 0_usize)]; // a binary node and the node that it becomes
    while let Some((from, to)) = open.pop() {
        let root = &binary.nodes[from];
        let mut children = if root.is_leaf() {
            vec![from]
        } else {
            vec![root.first_index as usize, root.first_index as usize + 1]
        };
        while children.len() < WIDTH {
            let area = |child: &usize| binary.nodes[*child].aabb().half_area();
            let inner = (0..children.len()).filter(|lane| !binary.nodes[children[*lane]].is_leaf());
            let Some(widest) = inner.max_by(|a, b| area(&children[*a]).total_cmp(&area(&children[*b])))
            else {
                break;
            };
            let first = binary.nodes[children[widest]].first_index as usize;
            children[widest] = first;
            children.push(first + 1);
        }
        for (lane, child) in children.into_iter().enumerate() {
            let node = &binary.nodes[child];
            nodes[to].children[lane] = if node.is_leaf() {
                LEAF | binary.primitive_indices[node.first_index as usize]
            } else {
                nodes.push(EMPTY);
                open.push((child, nodes.len() - 1));
                nodes.len() as u32 - 1
            };
        }
    }
    nodes
}

/// Tests a ray against the eight boxes of a node: where it enters each, and a bit for each that it meets up to `most`.
#[inline(always)]
fn enter(node: &Node, slabs: &Slabs, most: f32, near: &mut [f32; WIDTH], far: &mut [f32; WIDTH]) -> u32 {
    let first: [&[f32; WIDTH]; 3] =
        std::array::from_fn(|axis| &node.bounds[axis][usize::from(slabs.high_first[axis])]);
    let second: [&[f32; WIDTH]; 3] =
        std::array::from_fn(|axis| &node.bounds[axis][usize::from(!slabs.high_first[axis])]);
    let mut mask = 0;
    for lane in 0..WIDTH {
        let interval =
            slabs.interval([0, 1, 2].map(|axis| first[axis][lane]), [0, 1, 2].map(|axis| second[axis][lane]));
        [near[lane], far[lane]] = interval;
    }
    for lane in 0..WIDTH {
        mask |= u32::from(near[lane] <= far[lane] && near[lane] <= most) << lane;
    }
    mask
}

wide! {
    fn nearest(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
        let (slabs, shear) = (Slabs::new(ray), Shear::new(ray.direction));
        let origin = shear.apply(ray.origin);
        let mut best: Option<Hit> = None;
        let mut most = ray.far;
        let (mut near, mut far) = ([0.0; WIDTH], [0.0; WIDTH]);
        // What is yet to be looked at, the nearest last: child, and the interval of its box.
        let mut stack = [(0_u32, 0.0_f32, 0.0_f32); STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (child, enters, leaves) = stack[depth];
            if enters > most {
                continue;
            }
            if child & LEAF != 0 {
                let triangle = child & !LEAF;
                let corners = &bvh.corners[triangle as usize];
                let hit = within(&shear, origin, corners, triangle, [enters, leaves], most);
                let nearer = |hit: &Hit| best.is_none_or(|best| hit.t < best.t || triangle < best.triangle);
                if let Some(hit) = hit.filter(nearer) {
                    best = Some(hit);
                    most = hit.t;
                }
                continue;
            }
            let node = &bvh.nodes[child as usize];
            let mut mask = enter(node, &slabs, most, &mut near, &mut far);
            let bottom = depth;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
                mask &= mask - 1;
                let mut at = depth;
                depth += 1;
                while at > bottom && stack[at - 1].1 < near[lane] {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (node.children[lane], near[lane], far[lane]);
            }
        }
        best
    }
}

wide! {
    fn blocked(bvh: &Bvh, ray: &Ray) -> bool {
        let (slabs, shear) = (Slabs::new(ray), Shear::new(ray.direction));
        let origin = shear.apply(ray.origin);
        let (mut near, mut far) = ([0.0; WIDTH], [0.0; WIDTH]);
        let mut stack = [0_u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = &bvh.nodes[stack[depth] as usize];
            let mut mask = enter(node, &slabs, ray.far, &mut near, &mut far);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
                mask &= mask - 1;
                let child = node.children[lane];
                if child & LEAF == 0 {
                    stack[depth] = child;
                    depth += 1;
                    continue;
                }
                let corners = &bvh.corners[(child & !LEAF) as usize];
                if within(&shear, origin, corners, 0, [near[lane], far[lane]], ray.far).is_some() {
                    return true;
                }
            }
        }
        false
    }
}
