//! How much of each texel a hair covers: Klotzli and Olano, §2.1, Eq. 1, Eq. 2 and the four cases of fig. 2.
//!
//! A hair cuts a plane in a circle, at most one texel wide, so that it meets at most the four texels around
//! one corner of the grid. Those are numbered clockwise from the upper left: 1, 2 (right), 3 (lower right), 4
//! (below). Lengths are in texels, so that areas are shares of a texel. x runs to the right and y downward,
//! and the corner is given as seen from the circle's centre.
//!
//! The fourth case is printed as a second "Case 2" (errata F1).

use std::f64::consts::PI;

/// Eq. 1: the area of the part of a circle of radius `r` beyond a chord, `d` deep. The print claims an error
/// of at most 0.8 %, which holds for d ≤ r; beyond, the error grows without bound as d → 2r (errata F3).
pub fn eq1_chord(d: f64, r: f64) -> f64 {
    let m = (d * (2.0 * r - d)).sqrt();
    4.0 / 3.0 * d * m + d * d * d / (4.0 * m)
}

/// Eq. 1 kept within its bound: beyond the radius, the circle without the other part (errata F3). No depth
/// gives 0, a depth of at least 2r the circle. At d = r it jumps by 0.8 % of the circle.
pub fn eq1_chord_corrected(d: f64, r: f64) -> f64 {
    if d <= 0.0 {
        0.0
    } else if d <= r {
        eq1_chord(d, r)
    } else if d < 2.0 * r {
        PI * r * r - eq1_chord(2.0 * r - d, r)
    } else {
        PI * r * r
    }
}

/// The area beyond a chord in closed form, for any depth: r² acos((r − d)/r) − (r − d) m.
pub fn chord_exact(d: f64, r: f64) -> f64 {
    if d <= 0.0 {
        return 0.0;
    }
    if d >= 2.0 * r {
        return PI * r * r;
    }
    let m = (d * (2.0 * r - d)).sqrt();
    r * r * libm::atan2(m, r - d) - (r - d) * m
}

/// Eq. 2: the area of the wedge in texel 3 by the lengths of its two sides, as the quarter of a circle of
/// their mean. The print gives no bound (errata F4).
pub fn eq2_wedge(s1: f64, s2: f64) -> f64 {
    let radius = (s1 + s2) / 2.0;
    0.25 * PI * radius * radius
}

/// The two sides of the wedge at the corner (u, v): along the vertical edge and along the horizontal one.
/// They are positive where the corner is inside of the circle.
fn sides([u, v]: [f64; 2], r: f64) -> [f64; 2] {
    [(r * r - u * u).sqrt() - v, (r * r - v * v).sqrt() - u]
}

/// The area of the circle in texel 3 in closed form: where x > u and y > v.
pub fn wedge_exact([u, v]: [f64; 2], r: f64) -> f64 {
    if u * u + v * v < r * r {
        // Around the corner, along the horizontal edge, the arc and the vertical edge: half of Σ x dy − y dx.
        let (across, down) = ((r * r - v * v).sqrt(), (r * r - u * u).sqrt());
        let arc = libm::atan2(down, u) - libm::atan2(v, across);
        return 0.5 * (v * (u - across) + u * (v - down) + r * r * arc);
    }
    // The corner is outside: each edge cuts off a whole part of the circle, or nothing.
    let (right, below) = (chord_exact(r - u, r), chord_exact(r - v, r));
    match (u < 0.0, v < 0.0) {
        (true, true) => right + below - PI * r * r,
        (true, false) => below,
        (false, true) => right,
        (false, false) => 0.0,
    }
}

/// The areas in texels 1 to 4 by the print's cases: the corner (u, v), where both edges are crossed, is taken
/// to be inside of the circle (errata F2), and texel 1 is the upper left one wherever the centre is (errata
/// F4). Texels 2 and 4 can come out negative (errata F5).
pub fn cases_as_printed([u, v]: [f64; 2], r: f64) -> [f64; 4] {
    let circle = PI * r * r;
    let (right, below) = (u.abs() < r, v.abs() < r);
    let [vertical, horizontal] = [u, v].map(|edge| if edge < r { eq1_chord(r - edge, r) } else { 0.0 });
    match (right, below) {
        (false, false) => [circle, 0.0, 0.0, 0.0],
        (true, false) => [circle - vertical, vertical, 0.0, 0.0],
        (false, true) => [circle - horizontal, 0.0, 0.0, horizontal],
        (true, true) => {
            let [s1, s2] = sides([u, v], r);
            let wedge = eq2_wedge(s1, s2);
            [circle - (vertical + horizontal - wedge), vertical - wedge, wedge, horizontal - wedge]
        }
    }
}

/// The same corrected: texels are relabelled so that the centre is in texel 1, the wedge is 0 where the
/// corner is outside of the circle, and at most each of the chords. So nothing is negative, and the four sum
/// to the circle.
pub fn cases_corrected([u, v]: [f64; 2], r: f64) -> [f64; 4] {
    let circle = PI * r * r;
    let [right, below] = [u, v].map(|edge| eq1_chord_corrected(r - edge.abs(), r));
    let mut wedge = 0.0;
    if u * u + v * v < r * r {
        let [s1, s2] = sides([u.abs(), v.abs()], r);
        wedge = libm::fmin(eq2_wedge(s1, s2), libm::fmin(right, below));
    }
    let [one, two, three, four] = [circle - (right + below - wedge), right - wedge, wedge, below - wedge];
    match (u < 0.0, v < 0.0) {
        (false, false) => [one, two, three, four],
        (true, false) => [two, one, four, three],
        (false, true) => [four, three, two, one],
        (true, true) => [three, four, one, two],
    }
}

/// The same in closed form.
pub fn exact([u, v]: [f64; 2], r: f64) -> [f64; 4] {
    let circle = PI * r * r;
    let (right, below, wedge) = (chord_exact(r - u, r), chord_exact(r - v, r), wedge_exact([u, v], r));
    [circle - (right + below - wedge), right - wedge, wedge, below - wedge]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area of the unit circle where `inside` holds, by its rows.
    fn counted(inside: impl Fn(f64, f64) -> bool) -> f64 {
        let n = 2000;
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
        let mut count = 0;
        for i in -n..n {
            for j in -n..n {
                let (x, y) = (at(i), at(j));
                count += u32::from(x * x + y * y < 1.0 && inside(x, y));
            }
        }
        f64::from(count) / f64::from(n * n)
    }

    #[test]
    fn closed_forms_are_areas() {
        for d in [0.0, 0.2, 0.7, 1.0, 1.4, 1.9, 2.0] {
            let counted = counted(|x, _| x > 1.0 - d);
            assert!((chord_exact(d, 1.0) - counted).abs() < 5e-4, "{d}: {counted}");
        }
        for corner in
            [[0.0, 0.0], [0.3, 0.5], [0.9, 0.9], [-0.4, 0.2], [-0.9, 0.8], [0.6, -0.9], [-0.8, -0.7]]
        {
            let [u, v] = corner;
            let counted = counted(|x, y| x > u && y > v);
            assert!((wedge_exact(corner, 1.0) - counted).abs() < 5e-4, "{corner:?}: {counted}");
        }
    }

    #[test]
    fn errors_of_eq1_are_those_of_errata_f3() {
        let error = |d: f64| eq1_chord(d, 1.0) / chord_exact(d, 1.0) - 1.0;
        let most = (1..=1000).map(|i| error(f64::from(i) / 1000.0).abs()).fold(0.0, libm::fmax);
        assert!((most - 0.00798).abs() < 1e-5 && (error(1.0).abs() - most).abs() < 1e-9, "{most}");
        assert!((error(1.5) - 0.071).abs() < 5e-4 && (error(1.75) - 0.22).abs() < 5e-3);
        assert!((error(1.999) - 13.3).abs() < 0.05, "14.3 times as much");
        let corrected = |d: f64| (eq1_chord_corrected(d, 1.0) / chord_exact(d, 1.0) - 1.0).abs();
        assert!((1..2000).all(|i| corrected(f64::from(i) / 1000.0) <= most + 1e-9));
        let jump = (eq1_chord_corrected(1.0 + 1e-12, 1.0) - eq1_chord_corrected(1.0, 1.0)) / PI;
        assert!((jump.abs() - 0.0080).abs() < 1e-4, "{jump}");
    }

    #[test]
    fn errors_of_eq2_are_those_of_errata_f4_and_f5() {
        let mut worst = (0.0, [0.0; 2]);
        for i in 0..1000 {
            for j in 0..1000 {
                let corner = [f64::from(i) / 1000.0, f64::from(j) / 1000.0];
                if corner[0] * corner[0] + corner[1] * corner[1] < 1.0 {
                    let [s1, s2] = sides(corner, 1.0);
                    let error = (eq2_wedge(s1, s2) - wedge_exact(corner, 1.0)) / PI;
                    assert!(error > -1e-12, "{corner:?} underestimates");
                    if error > worst.0 {
                        worst = (error, corner);
                    }
                }
            }
        }
        assert!((worst.0 - 0.0190).abs() < 5e-5, "{worst:?}");
        let apart = (worst.1[0] - 0.0).abs() + (worst.1[1] - 0.546).abs();
        let mirrored = (worst.1[0] - 0.546).abs() + (worst.1[1] - 0.0).abs();
        assert!(apart < 0.01 || mirrored < 0.01, "{worst:?}");
        // Exact with the corner at the centre.
        let [s1, s2] = sides([0.0; 2], 1.0);
        assert!((eq2_wedge(s1, s2) - wedge_exact([0.0; 2], 1.0)).abs() < 1e-15);
        // F5: a sliver of a chord under a longer wedge.
        let negative = cases_as_printed([0.989, 0.0], 1.0);
        assert!((eq1_chord(0.011, 1.0) - 0.0022).abs() < 5e-5 && (negative[2] - 0.0050).abs() < 5e-5);
        assert!(negative[1] < -0.0027, "{negative:?}");
        // With the centre in another texel the print is off by up to 31.8 % of the circle.
        let mut most = 0.0_f64;
        for i in -999..1000 {
            for j in -999..1000 {
                let corner = [f64::from(i) / 1000.0, f64::from(j) / 1000.0];
                if corner[0] * corner[0] + corner[1] * corner[1] < 1.0 {
                    let [s1, s2] = sides(corner, 1.0);
                    let under = (wedge_exact(corner, 1.0) - eq2_wedge(s1, s2)) / PI;
                    most = if under > most { under } else { most };
                }
            }
        }
        assert!((most - 1.0 / PI).abs() < 0.002, "{most}"); // 0.318
    }

    #[test]
    fn corrected_and_exact_texels_sum_to_the_circle_and_are_symmetric() {
        for r in [0.5, 0.31, 1e-3] {
            for i in -12..=12 {
                for j in -12..=12 {
                    let corner @ [u, v] = [f64::from(i) * r / 10.0, f64::from(j) * r / 10.0];
                    for all in [cases_corrected(corner, r), exact(corner, r)] {
                        let sum: f64 = all.iter().sum();
                        assert!((sum / (PI * r * r) - 1.0).abs() < 1e-12, "{corner:?}: {sum}");
                        assert!(all.iter().all(|area| *area > -1e-15 * r * r), "{corner:?}: {all:?}");
                    }
                    for cases in [cases_corrected, exact] {
                        let [one, two, three, four] = cases(corner, r);
                        let near = |a: [f64; 4], b: [f64; 4]| {
                            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12 * r * r)
                        };
                        assert!(near(cases([v, u], r), [one, four, three, two]), "{corner:?} across");
                        // An edge through the centre belongs to one side.
                        if i != 0 && j != 0 {
                            assert!(near(cases([-u, v], r), [two, one, four, three]), "{corner:?} in x");
                            assert!(near(cases([u, -v], r), [four, three, two, one]), "{corner:?} in y");
                        }
                    }
                    let off = cases_corrected(corner, r).into_iter().zip(exact(corner, r));
                    // The wedge's bound, and that of the chords.
                    let most = off.map(|(a, b)| (a - b).abs()).fold(0.0, libm::fmax) / (PI * r * r);
                    assert!(most < 0.0235, "{corner:?}: {most}");
                }
            }
        }
    }
}
