//! The tightest rectangle around points of a plane.

use crate::numeric::order::{max, min};

/// A rectangle of any direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    /// The unit direction of its first side, at most 45° from the plane's own first axis; the second side is
    /// a quarter turn counter-clockwise from it.
    pub(super) direction: [f64; 2],
    /// Its middle, along the two sides.
    pub(super) middle: [f64; 2],
    /// Half its extents along the two sides.
    pub(super) half: [f64; 2],
}

/// The rectangle of least area around `points`, of equal ones the first along the hull; `None` for fewer than
/// two different points.
///
/// One side of it lies on an edge of the convex hull (Freeman and Shapira 1975), so the directions of the
/// hull's edges are tried one by one. Rounding decides between nearly equal ones, but alike on every
/// processor, since there is nothing but `+ − × ÷ √` and comparisons.
pub(super) fn tightest(points: Vec<[f64; 2]>) -> Option<Rectangle> {
    let hull = hull(points);
    let mut best: Option<(f64, Rectangle)> = None;
    for (index, a) in hull.iter().enumerate().filter(|_| hull.len() > 1) {
        let b = hull[(index + 1) % hull.len()];
        let rectangle = along(&hull, direction([b[0] - a[0], b[1] - a[1]]));
        let area = rectangle.half[0] * rectangle.half[1];
        if best.is_none_or(|(least, _)| area < least) {
            best = Some((area, rectangle));
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

/// An edge's direction at length one, turned by quarters until it is nearest to the first axis: the same
/// rectangle.
fn direction([x, y]: [f64; 2]) -> [f64; 2] {
    let [x, y] = if y.abs() > x.abs() { [y, -x] } else { [x, y] };
    let length = (x * x + y * y).sqrt() * if x < 0.0 { -1.0 } else { 1.0 };
    [x / length, y / length]
}

/// The rectangle around `points` whose first side has the unit `direction`.
fn along(points: &[[f64; 2]], direction: [f64; 2]) -> Rectangle {
    let [c, s] = direction;
    let (mut low, mut high) = ([f64::MAX; 2], [-f64::MAX; 2]);
    for [x, y] in points {
        for (side, at) in [c * x + s * y, c * y - s * x].into_iter().enumerate() {
            low[side] = min(low[side], at);
            high[side] = max(high[side], at);
        }
    }
    Rectangle {
        direction,
        middle: [0, 1].map(|side| 0.5 * (low[side] + high[side])),
        half: [0, 1].map(|side| 0.5 * (high[side] - low[side])),
    }
}

/// The corners of the convex hull, counter-clockwise from the lowest x (Andrew 1979).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                let left = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
                if left > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop(); // the other half begins with it
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;

    fn area(rectangle: &Rectangle) -> f64 {
        4.0 * rectangle.half[0] * rectangle.half[1]
    }

    #[test]
    fn no_direction_gives_a_smaller_rectangle() {
        for case in 0..60 {
            // A cloud, drawn out and sheared.
            let number = 3 + case as usize * 2;
            let points: Vec<[f64; 2]> = (0..number as u64)
                .map(|i| {
                    let [x, y] = [0, 1].map(|k| f64::from(unit(3, case, i, k)) - 0.5);
                    [x + 3.0 * y + 0.7, 0.2 * y + case as f64 * 0.05 * x]
                })
                .collect();
            let found = tightest(points.clone()).unwrap();
            let least = (0..9000)
                .map(|step| f64::from(step) * (std::f64::consts::FRAC_PI_2 / 9000.0))
                .map(|angle| {
                    let turn = [crate::numeric::double::cos(angle), crate::numeric::double::sin(angle)];
                    area(&along(&points, turn))
                })
                .fold(f64::MAX, min);
            assert!(area(&found) <= least * (1.0 + 1e-12), "{case}: {} for {least}", area(&found));
            assert!(area(&found) > 0.99 * least || area(&found) > least - 0.01, "{case}");
            // It holds every point, not only the hull's.
            let around = along(&points, found.direction);
            assert!((0..2).all(|i| (around.half[i] - found.half[i]).abs() < 1e-12), "{case}");
            let [c, s] = found.direction;
            assert!(c >= s.abs() - 1e-12 && (c * c + s * s - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn points_on_a_line_have_a_rectangle_without_width_and_one_point_has_none() {
        let line: Vec<_> = (0..5).map(|i| [f64::from(i), 0.5 * f64::from(i) + 1.0]).collect();
        let rectangle = tightest(line).unwrap();
        assert!((rectangle.half[0] - 5.0_f64.sqrt()).abs() < 1e-12 && rectangle.half[1] < 1e-12);
        assert_eq!(tightest(vec![[1.0, 2.0]; 4]), None);
        assert_eq!(tightest(vec![]), None);
    }
}
