//! Nodes of eight children and blocks of triangles, from obvhs's binary tree.

use super::node::{BLOCK_TRIANGLES, BLOCK_VERTICES, Block, Node, Parts, WIDTH};
use crate::numeric::order::max;
use obvhs::bvh2::Bvh2;

/// What a walk through a subtree costs, and the triangles and vertices in it as long as one block can hold
/// them.
#[derive(Clone, Copy)]
struct Subtree {
    /// The least cost if the subtree becomes up to k children of a node, for each k from 1.
    costs: [f32; WIDTH],
    /// Number of triangles; more than [`BLOCK_TRIANGLES`] also where a block cannot hold the vertices.
    triangles: usize,
    vertices: [u32; BLOCK_VERTICES],
    /// Number of different vertices.
    different: usize,
}

impl Subtree {
    fn leaf(area: f32, triangle: [u32; 3]) -> Self {
        let mut leaf =
            Self { costs: [area; WIDTH], triangles: 1, vertices: [0; BLOCK_VERTICES], different: 0 };
        triangle.into_iter().for_each(|vertex| leaf.add(vertex));
        leaf
    }

    /// Adds a vertex that is not there yet.
    fn add(&mut self, vertex: u32) {
        if self.vertices[..self.different].contains(&vertex) {
            return;
        }
        match self.vertices.get_mut(self.different) {
            Some(next) => (*next, self.different) = (vertex, self.different + 1),
            None => self.triangles = BLOCK_TRIANGLES + 1,
        }
    }

    /// The triangles and vertices of both.
    fn join(&self, other: &Self) -> Self {
        let mut joined = Self { triangles: self.triangles + other.triangles, ..*self };
        if joined.triangles <= BLOCK_TRIANGLES {
            other.vertices[..other.different].iter().for_each(|vertex| joined.add(*vertex));
        }
        joined
    }
}

/// Makes nodes of eight and blocks of a binary tree, at the least expected cost for a ray (Ylitie, Karras and
/// Laine 2017, §3.1). As up to k children, a subtree costs the least over all ways to divide k between its
/// two halves. As one child it costs its box's area and, unless a block holds it, the cost of its halves as
/// eight children. `triangles` are the mesh's.
pub(super) fn collapse(binary: &Bvh2, triangles: &[[u32; 3]]) -> Parts {
    let children = |node: usize| {
        let first = binary.nodes[node].first_index as usize;
        [first, first + 1]
    };
    let triangle = |leaf: usize| binary.primitive_indices[binary.nodes[leaf].first_index as usize];
    // Parents before children, and all of one half before the other.
    let (mut order, mut open) = (Vec::with_capacity(binary.nodes.len()), vec![0]);
    while let Some(node) = open.pop() {
        order.push(node);
        if !binary.nodes[node].is_leaf() {
            open.extend(children(node));
        }
    }
    // For one child: whether the subtree becomes a block. For up to k children: how many of them the first
    // half becomes, or 0 where one child fewer costs no more.
    let mut plans = vec![[1; WIDTH]; binary.nodes.len()];
    let mut done: Vec<Subtree> = vec![];
    for node in order.into_iter().rev() {
        let area = binary.nodes[node].aabb().half_area();
        if binary.nodes[node].is_leaf() {
            done.push(Subtree::leaf(area, triangles[triangle(node) as usize]));
            continue;
        }
        let (Some(b), Some(a)) = (done.pop(), done.pop()) else {
            unreachable!("halves come before the whole")
        };
        let mut whole = a.join(&b);
        for count in 2..=WIDTH {
            let divided =
                (1..count).map(|first| (a.costs[first - 1] + b.costs[count - first - 1], first as u8));
            let best =
                divided.fold((f32::INFINITY, 0), |best, next| if next.0 < best.0 { next } else { best });
            let fewer = whole.costs[count - 2];
            (whole.costs[count - 1], plans[node][count - 1]) =
                if count > 2 && fewer <= best.0 { (fewer, 0) } else { best };
        }
        let block = whole.triangles <= BLOCK_TRIANGLES;
        whole.costs[0] = if block { area } else { area + whole.costs[WIDTH - 1] };
        plans[node][0] = u8::from(block);
        done.push(whole);
    }
    let mut parts = Parts { nodes: vec![Node::EMPTY], ..Parts::default() };
    let mut open = vec![(0, 0)]; // a binary node and the node that it becomes
    while let Some((from, to)) = open.pop() {
        let (mut nodes, mut blocks) = (vec![], vec![]);
        // Subtrees, and up to how many children each may become.
        let mut subtrees = vec![(from, WIDTH)];
        while let Some((node, mut count)) = subtrees.pop() {
            while count > 2 && plans[node][count - 1] == 0 {
                count -= 1;
            }
            if binary.nodes[node].is_leaf() || (count == 1 && node != from) {
                if plans[node][0] == 1 { &mut blocks } else { &mut nodes }.push(node);
            } else {
                let first = usize::from(plans[node][count - 1]);
                let [a, b] = children(node);
                subtrees.extend([(b, count - first), (a, first)]);
            }
        }
        let block = |node: usize| {
            let (mut held, mut subtrees) = (vec![], vec![node]);
            while let Some(node) = subtrees.pop() {
                if binary.nodes[node].is_leaf() {
                    held.push(triangle(node));
                } else {
                    subtrees.extend(children(node));
                }
            }
            Block::of(&held, triangles)
        };
        let first = parts.give(to, nodes.len(), blocks.into_iter().map(block));
        open.extend(nodes.into_iter().zip(first..));
    }
    parts
}

/// How many levels of nodes a tree has.
pub(super) fn levels(nodes: &[Node]) -> usize {
    let mut below = vec![1; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        for child in node.nodes() {
            below[index] = max(below[index], 1 + below[child]);
        }
    }
    below[0]
}

/// A tree over triangles in this order, two to a block, with the fewest levels. It is for meshes whose own
/// tree is too deep for a walk's stack. (No such mesh is known, but obvhs gives no bound.)
pub(super) fn balanced(order: &[u32], triangles: &[[u32; 3]]) -> Parts {
    let mut parts = Parts { nodes: vec![Node::EMPTY], ..Parts::default() };
    let mut open = vec![(order, 0)];
    while let Some((order, to)) = open.pop() {
        if order.len() <= 2 * WIDTH {
            parts.give(to, 0, order.chunks(2).map(|held| Block::of(held, triangles)));
        } else {
            let part = order.len().div_ceil(WIDTH);
            let first = parts.give(to, order.len().div_ceil(part), std::iter::empty());
            open.extend(order.chunks(part).zip(first..));
        }
    }
    parts
}
