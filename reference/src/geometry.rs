//! Rays against triangles in plain `f64`: the oracle for visibility, and for the first and the
//! second depth layer.

use crate::vector::{Vec3, add, cross, dot, normalize, scale, sub};

/// A triangle: its three corners in order.
pub type Triangle = [Vec3; 3];

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The distance along the ray in lengths of its direction.
    pub t: f64,
    /// The barycentric weight of the triangle's second corner.
    pub u: f64,
    /// The barycentric weight of the triangle's third corner; the first has 1 − u − v.
    pub v: f64,
    /// The triangle's index in the list.
    pub triangle: usize,
}

/// The crossing (t, u, v) of the line origin + t · direction with one triangle, for any sign of t,
/// from either side, the border included; `None` where it misses, is parallel, or the triangle has
/// no area. Möller and Trumbore 1997.
pub fn intersect(origin: Vec3, direction: Vec3, triangle: &Triangle) -> Option<(f64, f64, f64)> {
    let edge1 = sub(triangle[1], triangle[0]);
    let edge2 = sub(triangle[2], triangle[0]);
    let p = cross(direction, edge2);
    let determinant = dot(edge1, p);
    if determinant == 0.0 {
        return None;
    }
    let s = sub(origin, triangle[0]);
    let u = dot(s, p) / determinant;
    let q = cross(s, edge1);
    let v = dot(direction, q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    inside.then(|| (dot(edge2, q) / determinant, u, v))
}

/// Every hit with t_min < t < t_max, by ascending t, ties by ascending triangle index. The first
/// and the second entry are the first and the second depth layer.
pub fn all_hits(origin: Vec3, direction: Vec3, triangles: &[Triangle], t_min: f64, t_max: f64) -> Vec<Hit> {
    let mut hits = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some((t, u, v)) = intersect(origin, direction, triangle)
            && t > t_min
            && t < t_max
        {
            hits.push(Hit { t, u, v, triangle: index });
        }
    }
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
    hits
}

/// The hit with the smallest t in t_min < t < t_max, ties to the lowest triangle index.
pub fn nearest_hit(
    origin: Vec3,
    direction: Vec3,
    triangles: &[Triangle],
    t_min: f64,
    t_max: f64,
) -> Option<Hit> {
    all_hits(origin, direction, triangles, t_min, t_max).first().copied()
}

/// The unit normal of a triangle whose corners run counter-clockwise seen from outside.
pub fn face_normal(triangle: &Triangle) -> Vec3 {
    normalize(cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0])))
}

/// The area of a triangle, in its unit squared.
pub fn area(triangle: &Triangle) -> f64 {
    crate::vector::length(cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0]))) / 2.0
}

/// The point (or any attribute) of a triangle at the barycentric weights u of its second and v of
/// its third corner.
pub fn interpolate(corners: &[Vec3; 3], u: f64, v: f64) -> Vec3 {
    add(add(scale(1.0 - u - v, corners[0]), scale(u, corners[1])), scale(v, corners[2]))
}

/// The interpolated corner normal at (u, v), as a unit vector.
pub fn interpolate_normal(normals: &[Vec3; 3], u: f64, v: f64) -> Vec3 {
    normalize(interpolate(normals, u, v))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

    fn at_height(z: f64) -> Triangle {
        FLAT.map(|p| [p[0], p[1], z])
    }

    #[test]
    fn hits_from_both_sides_and_only_inside() {
        for (z, dz) in [(3.0, -1.0), (-3.0, 1.0)] {
            let (t, u, v) = intersect([0.5, 0.25, z], [0.0, 0.0, dz], &FLAT).unwrap();
            assert_eq!((t, u, v), (3.0, 0.25, 0.125));
            assert_eq!(intersect([1.5, 1.0, z], [0.0, 0.0, dz], &FLAT), None);
        }
        assert_eq!(intersect([-1.0, 0.5, 0.0], [1.0, 0.0, 0.0], &FLAT), None, "parallel");
        assert_eq!(intersect([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], &[[0.0; 3]; 3]), None, "no area");
        assert!((area(&FLAT) - 2.0).abs() < 1e-15);
        assert_eq!(face_normal(&FLAT), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn layers_come_in_order_with_ties_to_the_lowest_index() {
        let list = [at_height(1.0), at_height(4.0), at_height(-2.0), at_height(4.0)];
        let hits = all_hits([0.5, 0.5, 10.0], [0.0, 0.0, -1.0], &list, 0.0, f64::INFINITY);
        let order: Vec<(f64, usize)> = hits.iter().map(|h| (h.t, h.triangle)).collect();
        assert_eq!(order, [(6.0, 1), (6.0, 3), (9.0, 0), (12.0, 2)]);
        let nearest = nearest_hit([0.5, 0.5, 10.0], [0.0, 0.0, -1.0], &list, 6.0, 12.0).unwrap();
        assert_eq!(nearest.triangle, 0, "both bounds are exclusive");
        assert_eq!(nearest_hit([0.5, 0.5, 10.0], [0.0, 0.0, 1.0], &list, 0.0, 100.0), None);
    }

    #[test]
    fn interpolation_meets_the_hit_point() {
        let triangle = [[1.0, 0.5, -2.0], [3.0, 1.0, 0.0], [0.0, 2.0, 1.0]];
        let (origin, direction) = ([1.2, 5.0, -0.3], [0.05, -1.0, 0.02]);
        let (t, u, v) = intersect(origin, direction, &triangle).unwrap();
        let along = add(origin, scale(t, direction));
        for (a, b) in along.iter().zip(interpolate(&triangle, u, v)) {
            assert!((a - b).abs() < 1e-14);
        }
        let normals = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let n = interpolate_normal(&normals, 0.5, 0.5);
        assert!((n[1] - 0.5f64.sqrt()).abs() < 1e-15 && n[0] == 0.0);
    }
}
