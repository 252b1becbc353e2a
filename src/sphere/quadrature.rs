//! Directions and weights that integrate over the sphere. The polar axis is z, as for the basis.

use crate::numeric::double::{cos, sin};
use std::f64::consts::PI;

/// `count` unit vectors spread evenly over the sphere; each stands for 4π / `count` steradians.
///
/// Spherical Fibonacci points (Keinert, Innmann, Sänger and Stamminger 2015) with the half-step offset: z_i =
/// 1 − (2i + 1) / N, φ_i = 2π frac(i / Φ) with the golden ratio Φ, for i = 0 … N − 1. No point lies at a
/// pole, Σ z = 0, and z descends.
pub fn fibonacci(count: usize) -> Vec<[f64; 3]> {
    /// 1 / Φ = (√5 − 1) / 2
    const INVERSE_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let phi = 2.0 * PI * (i as f64 * INVERSE_GOLDEN_RATIO).fract();
        let sin_theta = ((1.0 - z) * (1.0 + z)).sqrt();
        [sin_theta * cos(phi), sin_theta * sin(phi), z]
    };
    (0..count).map(point).collect()
}

/// The `count` nodes, ascending, and weights of the Gauss-Legendre rule on [−1, 1]: exact for polynomials to
/// degree 2 `count` − 1, and mirror-symmetric to the bit.
///
/// Newton's method on P_n by its recurrence, from Tricomi's estimate (Press et al., Numerical Recipes, §4.6).
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let mut rule = vec![(0.0, 0.0); count];
    for i in 0..count.div_ceil(2) {
        // The i-th root from above; the middle one of an odd rule is 0 by symmetry.
        let middle = 2 * i + 1 == count;
        let mut x = if middle { 0.0 } else { cos(PI * (i as f64 + 0.75) / (n + 0.5)) };
        let mut slope = 0.0;
        // Newton doubles the digits: four steps from 1e-3 or better reach the last bit, the fifth gives the
        // slope.
        for _ in 0..5 {
            let (mut below, mut value) = (0.0, 1.0);
            for k in 1..=count {
                let k = k as f64;
                (below, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * below) / k);
            }
            slope = n * (below - x * value) / ((1.0 - x) * (1.0 + x));
            if !middle {
                x -= value / slope;
            }
        }
        let weight = 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope);
        rule[i] = (-x, weight);
        rule[count - 1 - i] = (x, weight);
    }
    rule
}

/// Unit vectors and weights in steradians (their sum is 4π) that integrate every polynomial in x, y, z to
/// `degree` exactly: Gauss-Legendre in z times equal steps in φ.
///
/// A product of two functions of n bands has degree 2n − 2.
pub fn product(degree: usize) -> Vec<([f64; 3], f64)> {
    let azimuths = degree + 1;
    let step = 2.0 * PI / azimuths as f64;
    let circle: Vec<_> = (0..azimuths).map(|j| (cos(step * j as f64), sin(step * j as f64))).collect();
    let mut rule = Vec::with_capacity((degree / 2 + 1) * azimuths);
    for (z, weight) in gauss_legendre(degree / 2 + 1) {
        let sin_theta = ((1.0 - z) * (1.0 + z)).sqrt();
        rule.extend(circle.iter().map(|(c, s)| ([sin_theta * c, sin_theta * s, z], weight * step)));
    }
    rule
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power(x: f64, exponent: usize) -> f64 {
        (0..exponent).fold(1.0, |product, _| product * x)
    }

    #[test]
    fn gauss_legendre_is_exact_to_its_degree_and_no_further() {
        for count in [1, 2, 3, 4, 7, 16, 33, 64] {
            let rule = gauss_legendre(count);
            let error = |degree: usize| {
                let exact = if degree.is_multiple_of(2) { 2.0 / (degree + 1) as f64 } else { 0.0 };
                (rule.iter().map(|(x, w)| w * power(*x, degree)).fold(0.0, |a, b| a + b) - exact).abs()
            };
            for degree in 0..2 * count {
                assert!(error(degree) < 1e-14, "{count} nodes, degree {degree}: {:e}", error(degree));
            }
            assert!(count > 7 || error(2 * count) > 1e-9, "{count} nodes");
            assert!(rule.is_sorted_by(|a, b| a.0 < b.0));
        }
    }

    #[test]
    fn two_and_three_nodes_are_the_textbook_values() {
        let third = (1.0_f64 / 3.0).sqrt();
        let outer = (3.0_f64 / 5.0).sqrt();
        let expected =
            [(-third, 1.0), (third, 1.0), (-outer, 5.0 / 9.0), (0.0, 8.0 / 9.0), (outer, 5.0 / 9.0)];
        let found = [gauss_legendre(2), gauss_legendre(3)].concat();
        for (a, b) in found.iter().zip(expected) {
            assert!((a.0 - b.0).abs() < 1e-15 && (a.1 - b.1).abs() < 1e-15, "{a:?} {b:?}");
        }
    }

    /// ∫ x^a y^b z^c dω = 4π (a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!! for even a, b, c, else 0.
    #[test]
    fn product_rule_is_exact_to_its_degree() {
        fn odd_factorial(n: usize) -> f64 {
            (0..n).filter(|k| k % 2 == 1).fold(1.0, |product, k| product * k as f64)
        }
        for degree in [0, 1, 2, 5, 8, 18] {
            let rule = product(degree);
            for a in 0..=degree {
                for b in 0..=degree - a {
                    for c in 0..=degree - a - b {
                        let term =
                            |(d, w): &([f64; 3], f64)| w * power(d[0], a) * power(d[1], b) * power(d[2], c);
                        let found = rule.iter().map(term).fold(0.0, |sum, t| sum + t);
                        let even = a % 2 + b % 2 + c % 2 == 0;
                        let ratio = odd_factorial(a) * odd_factorial(b) * odd_factorial(c)
                            / odd_factorial(a + b + c + 2);
                        let exact = if even { 4.0 * PI * ratio } else { 0.0 };
                        assert!((found - exact).abs() < 1e-13, "degree {degree}: x^{a} y^{b} z^{c}");
                    }
                }
            }
        }
    }

    #[test]
    fn fibonacci_directions_are_unit_and_integrate_low_polynomials() {
        assert!(fibonacci(0).is_empty());
        assert_eq!(fibonacci(1)[0][2], 0.0);
        let directions = fibonacci(4096);
        let mean =
            |f: &dyn Fn([f64; 3]) -> f64| directions.iter().map(|d| f(*d)).fold(0.0, |a, b| a + b) / 4096.0;
        for d in &directions {
            assert!((d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1.0).abs() < 1e-15);
        }
        // For polynomials in z alone this is the midpoint rule, whose error is known: mean z² = 1/3 − 1/(3
        // N²).
        assert!((mean(&|d| d[2] * d[2]) - 1.0 / 3.0 + 1.0 / (3.0 * 4096.0 * 4096.0)).abs() < 1e-14);
        for axis in 0..3 {
            assert!(mean(&|d| d[axis]).abs() < 2e-5, "axis {axis}");
            assert!((mean(&|d| d[axis] * d[axis]) - 1.0 / 3.0).abs() < 2e-5, "axis {axis}");
        }
    }
}
