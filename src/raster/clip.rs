//! Clipping in homogeneous coordinates against the near plane and the guard band (Sutherland and Hodgman
//! 1974).
//!
//! Two triangles that share an edge must find the same point where a plane cuts it, to the bit, or pixels of
//! the edge would be drawn twice or missed. So [`cut`] first orders the edge's ends by their coordinates.

use super::view::View;
use std::cmp::Ordering;

/// A vertex in clip space: x, y, z, w.
pub(super) type Vertex = [f32; 4];

/// Planes as weights of (x, y, z, w): a vertex is inside where the weighted sum is ≥ 0.
pub(super) fn planes(view: &View) -> [Vertex; 5] {
    let [guard_x, guard_y] = view.guard();
    [
        [0.0, 0.0, -1.0, 1.0], // z ≤ w: beyond the near plane, depth being reversed
        [1.0, 0.0, 0.0, guard_x],
        [-1.0, 0.0, 0.0, guard_x],
        [0.0, 1.0, 0.0, guard_y],
        [0.0, -1.0, 0.0, guard_y],
    ]
}

/// Signed distance from a plane, up to the plane's scale.
#[inline]
pub(super) fn distance(plane: Vertex, v: Vertex) -> f32 {
    plane[0] * v[0] + plane[1] * v[1] + plane[2] * v[2] + plane[3] * v[3]
}

/// The part of a triangle inside all `planes`: a convex polygon of up to eight corners, or none.
pub(super) fn clip(triangle: [Vertex; 3], planes: &[Vertex; 5]) -> Vec<Vertex> {
    let mut polygon = triangle.to_vec();
    for plane in planes {
        let before = std::mem::take(&mut polygon);
        for (index, &a) in before.iter().enumerate() {
            let b = before[(index + 1) % before.len()];
            let (da, db) = (distance(*plane, a), distance(*plane, b));
            if da >= 0.0 {
                polygon.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                polygon.push(cut(a, da, b, db));
            }
        }
    }
    polygon
}

/// Where the edge between `a` and `b`, on two sides of a plane, crosses it: the same bits for (b, a).
fn cut(a: Vertex, da: f32, b: Vertex, db: f32) -> Vertex {
    let order = a.iter().zip(&b).map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne());
    let ((a, da), (b, db)) =
        if order == Some(Ordering::Greater) { ((b, db), (a, da)) } else { ((a, da), (b, db)) };
    let t = da / (da - db);
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;

    #[test]
    fn both_directions_of_an_edge_are_cut_at_the_same_bits() {
        for i in 0..1000 {
            let vertex = |n| -> Vertex { std::array::from_fn(|k| unit(1, i, n, k as u64) * 4.0 - 2.0) };
            let (a, b) = (vertex(0), vertex(1));
            let plane = [0.3, -0.7, 0.2, 0.1];
            let (da, db) = (distance(plane, a), distance(plane, b));
            if (da >= 0.0) != (db >= 0.0) {
                let (forth, back) = (cut(a, da, b, db), cut(b, db, a, da));
                assert_eq!(forth.map(f32::to_bits), back.map(f32::to_bits));
                assert!(distance(plane, forth).abs() < 1e-5);
            }
        }
    }
}
