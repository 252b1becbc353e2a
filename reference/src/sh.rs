//! Real spherical harmonics: Banterle and Chalmers, Eq. 6 to Eq. 9.
//!
//! The basis has no Condon-Shortley phase, its polar axis is z, and the function (l, m) sits at
//! index l² + l + m. `bands` counts bands: `bands = 3` means l = 0, 1, 2 and nine functions.

use crate::vector::Vec3;
use std::f64::consts::PI;

/// What Banterle and Chalmers, Eq. 9 is taken to mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eq9Reading {
    /// +sin(|m|φ) for m < 0 and no Condon-Shortley phase: the basis that the constants of Eq. 11
    /// expect (Y_1−1 ∝ +y, Y_11 ∝ +x).
    Corrected,
    /// The letter of Eq. 7 and Eq. 9 with P_l^|m| free of the phase: √2 Im(e^{imφ}) for m < 0 is
    /// −sin(|m|φ), so every function with m < 0 has the wrong sign.
    Literal,
    /// The letter of Eq. 7 and Eq. 9 with (−1)^m inside P_l^|m|: the functions with odd m > 0 and
    /// with even m < 0 have the wrong sign.
    LiteralWithPhase,
}

/// The position l² + l + m of the function (l, m) in every coefficient list. |m| ≤ l.
pub fn index(l: u32, m: i32) -> usize {
    assert!(m.unsigned_abs() <= l, "|m| must not exceed l");
    (i64::from(l) * i64::from(l) + i64::from(l) + i64::from(m)) as usize
}

/// The associated Legendre function P_l^m of cos θ for 0 ≤ m ≤ l, without the Condon-Shortley
/// phase, by the recurrence of the textbooks (upwards in l from P_m^m).
///
/// sin θ ≥ 0 is passed beside cos θ because √(1 − cos²θ) loses half of the digits at the poles.
pub fn associated_legendre(l: u32, m: u32, cos_theta: f64, sin_theta: f64) -> f64 {
    assert!(m <= l, "m must not exceed l");
    // P_m^m = (2m − 1)!! sin^m θ
    let mut current = 1.0;
    for i in 1..=m {
        current *= f64::from(2 * i - 1) * sin_theta;
    }
    let mut previous = 0.0;
    for i in m + 1..=l {
        // (i − m) P_i^m = (2i − 1) cos θ P_{i−1}^m − (i + m − 1) P_{i−2}^m
        let next =
            (f64::from(2 * i - 1) * cos_theta * current - f64::from(i + m - 1) * previous) / f64::from(i - m);
        previous = current;
        current = next;
    }
    current
}

/// The normalisation K_lm of Banterle and Chalmers, Eq. 8. It depends on |m| alone.
pub fn k(l: u32, m: i32) -> f64 {
    let m = m.unsigned_abs();
    assert!(m <= l, "|m| must not exceed l");
    // (l + |m|)! / (l − |m|)! as the product of the factors that do not cancel
    let mut ratio = 1.0;
    for i in l - m + 1..=l + m {
        ratio *= f64::from(i);
    }
    (f64::from(2 * l + 1) / (4.0 * PI * ratio)).sqrt()
}

/// The complex harmonic K_lm e^{imφ} P_l^|m|(cos θ) of Banterle and Chalmers, Eq. 7, as
/// (real, imaginary) parts; P without the Condon-Shortley phase. `direction` is a unit vector.
///
/// The print lacks the parentheses about the argument of P.
pub fn eq7_complex(l: u32, m: i32, direction: Vec3) -> (f64, f64) {
    let [x, y, z] = direction;
    let sin_theta = (x * x + y * y).sqrt();
    let phi = libm::atan2(y, x);
    let radius = k(l, m) * associated_legendre(l, m.unsigned_abs(), z, sin_theta);
    let angle = f64::from(m) * phi;
    (radius * libm::cos(angle), radius * libm::sin(angle))
}

/// The real harmonic of Banterle and Chalmers, Eq. 9, in the chosen reading, at a unit vector.
pub fn eq9_real(reading: Eq9Reading, l: u32, m: i32, direction: Vec3) -> f64 {
    let (re, im) = eq7_complex(l, m, direction);
    let literal = match m {
        0 => re,
        1.. => 2f64.sqrt() * re,
        _ => 2f64.sqrt() * im,
    };
    match reading {
        Eq9Reading::Literal => literal,
        Eq9Reading::LiteralWithPhase if m % 2 != 0 => -literal,
        Eq9Reading::LiteralWithPhase => literal,
        Eq9Reading::Corrected if m < 0 => -literal,
        Eq9Reading::Corrected => literal,
    }
}

/// The real harmonic Y_lm at a unit vector: Banterle and Chalmers, Eq. 7 to Eq. 9 in the corrected
/// reading ([`Eq9Reading::Corrected`]).
pub fn y(l: u32, m: i32, direction: Vec3) -> f64 {
    eq9_real(Eq9Reading::Corrected, l, m, direction)
}

/// All bands² functions at a unit vector, in the order l² + l + m.
pub fn eval(bands: u32, direction: Vec3) -> Vec<f64> {
    let mut values = Vec::new();
    for l in 0..bands {
        for m in -(l as i32)..=l as i32 {
            values.push(y(l, m, direction));
        }
    }
    values
}

/// The function with the given coefficients (order l² + l + m, a square number of them) at a unit
/// vector: Σ c_lm Y_lm.
pub fn reconstruct(coefficients: &[f64], direction: Vec3) -> f64 {
    let bands = (coefficients.len() as f64).sqrt() as u32;
    assert_eq!((bands * bands) as usize, coefficients.len(), "not a whole number of bands");
    let basis = eval(bands, direction);
    let mut sum = 0.0;
    for (c, b) in coefficients.iter().zip(&basis) {
        sum += c * b;
    }
    sum
}

/// Nodes and weights of the n-point Gauss-Legendre rule on [−1, 1], nodes ascending; exact for
/// polynomials up to degree 2n − 1.
pub fn gauss_legendre(n: u32) -> Vec<(f64, f64)> {
    assert!(n > 0, "a rule needs a node");
    let count = f64::from(n);
    let mut rule = Vec::new();
    for i in 0..n {
        // Tricomi's first guess; Newton then converges quadratically to the i-th largest root.
        let mut x = libm::cos(PI * (f64::from(i) + 0.75) / (count + 0.5));
        let mut slope = 0.0;
        for _ in 0..100 {
            let value = associated_legendre(n, 0, x, 0.0);
            let below = associated_legendre(n - 1, 0, x, 0.0);
            slope = count * (below - x * value) / ((1.0 - x) * (1.0 + x));
            let step = value / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        rule.push((x, 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope)));
    }
    rule.reverse();
    rule
}

/// Directions and weights (steradians, sum 4π) of a product rule on the sphere that is exact for
/// polynomials in x, y, z up to `degree`: Gauss-Legendre in z times equal steps in φ.
pub fn sphere_rule(degree: u32) -> Vec<(Vec3, f64)> {
    let azimuths = degree + 1;
    let mut rule = Vec::new();
    for (z, weight) in gauss_legendre(degree / 2 + 1) {
        let sin_theta = ((1.0 - z) * (1.0 + z)).sqrt();
        for j in 0..azimuths {
            let phi = 2.0 * PI * f64::from(j) / f64::from(azimuths);
            let direction = [sin_theta * libm::cos(phi), sin_theta * libm::sin(phi), z];
            rule.push((direction, weight * 2.0 * PI / f64::from(azimuths)));
        }
    }
    rule
}

/// The coefficients E_lm of Banterle and Chalmers, Eq. 6 for a function on the sphere, by a
/// quadrature that is exact where f · Y_lm is a polynomial up to `degree`; order l² + l + m, the
/// unit is f's times √steradian.
pub fn project(bands: u32, f: impl Fn(Vec3) -> f64, degree: u32) -> Vec<f64> {
    let mut coefficients = vec![0.0; (bands * bands) as usize];
    for (direction, weight) in sphere_rule(degree) {
        let value = f(direction);
        for (c, b) in coefficients.iter_mut().zip(eval(bands, direction)) {
            *c += weight * value * b;
        }
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{dot, normalize};

    const DIRECTIONS: [Vec3; 6] = [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [0.6, -0.8, 0.0],
        [-0.48, 0.6, 0.64],
        [0.36, 0.48, -0.8],
    ];

    #[test]
    fn orthonormal_to_ten_bands() {
        let bands = 10;
        let mut gram = vec![vec![0.0; 100]; 100];
        for (direction, weight) in sphere_rule(18) {
            let basis = eval(bands, direction);
            for (row, a) in gram.iter_mut().zip(&basis) {
                for (entry, b) in row.iter_mut().zip(&basis) {
                    *entry += weight * a * b;
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((entry - expected).abs() < 1e-12, "({i}, {j}): {entry}");
            }
        }
    }

    /// Ramamoorthi and Hanrahan 2001, Eq. 3, to their six digits.
    #[test]
    fn first_three_bands_are_the_published_polynomials() {
        for d in DIRECTIONS {
            let [x, y, z] = d;
            let explicit = [
                0.282095,
                0.488603 * y,
                0.488603 * z,
                0.488603 * x,
                1.092548 * x * y,
                1.092548 * y * z,
                0.315392 * (3.0 * z * z - 1.0),
                1.092548 * x * z,
                0.546274 * (x * x - y * y),
            ];
            for (i, (a, b)) in eval(3, d).iter().zip(explicit).enumerate() {
                assert!((a - b).abs() < 2e-6, "function {i} at {d:?}: {a} against {b}");
            }
        }
    }

    #[test]
    fn addition_theorem() {
        for a in DIRECTIONS {
            for b in DIRECTIONS {
                let cosine = dot(a, b);
                for l in 0..10 {
                    let mut sum = 0.0;
                    for m in -(l as i32)..=l as i32 {
                        sum += y(l, m, a) * y(l, m, b);
                    }
                    let legendre = associated_legendre(l, 0, cosine, 0.0);
                    let expected = f64::from(2 * l + 1) / (4.0 * PI) * legendre;
                    assert!((sum - expected).abs() < 1e-13, "band {l}: {sum} against {expected}");
                }
            }
        }
    }

    /// Which functions the literal readings of Eq. 9 turn round, up to the band that Eq. 11 uses.
    #[test]
    fn literal_readings_flip_the_named_functions() {
        let d = normalize([0.3, 0.5, 0.7]);
        let flipped = |reading| -> Vec<(u32, i32)> {
            let mut list = Vec::new();
            for l in 0..3 {
                for m in -(l as i32)..=l as i32 {
                    let ratio = eq9_real(reading, l, m, d) / y(l, m, d);
                    assert!((ratio.abs() - 1.0).abs() < 1e-15);
                    if ratio < 0.0 {
                        list.push((l, m));
                    }
                }
            }
            list
        };
        assert_eq!(flipped(Eq9Reading::Corrected), []);
        assert_eq!(flipped(Eq9Reading::Literal), [(1, -1), (2, -2), (2, -1)]);
        assert_eq!(flipped(Eq9Reading::LiteralWithPhase), [(1, 1), (2, -2), (2, 1)]);
    }

    /// ∫ x^a y^b z^c dω = 4π (a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!! for even a, b, c, else 0.
    #[test]
    fn sphere_rule_is_exact_to_its_degree() {
        fn double_factorial(n: i32) -> f64 {
            if n <= 0 { 1.0 } else { f64::from(n) * double_factorial(n - 2) }
        }
        fn power(x: f64, n: i32) -> f64 {
            (0..n).fold(1.0, |p, _| p * x)
        }
        for degree in [0, 1, 2, 5, 8, 13] {
            let rule = sphere_rule(degree);
            let degree = degree as i32;
            for a in 0..=degree {
                for b in 0..=degree - a {
                    for c in 0..=degree - a - b {
                        let mut sum = 0.0;
                        for (d, w) in &rule {
                            sum += w * power(d[0], a) * power(d[1], b) * power(d[2], c);
                        }
                        let even = a % 2 == 0 && b % 2 == 0 && c % 2 == 0;
                        let numerator =
                            double_factorial(a - 1) * double_factorial(b - 1) * double_factorial(c - 1);
                        let expected =
                            if even { 4.0 * PI * numerator / double_factorial(a + b + c + 1) } else { 0.0 };
                        assert!((sum - expected).abs() < 1e-12, "{degree}: x^{a} y^{b} z^{c}");
                    }
                }
            }
        }
    }

    #[test]
    fn projection_returns_the_coefficients_of_its_own_reconstruction() {
        let coefficients: Vec<f64> = (0..25).map(|i| f64::from((i * 7 + 3) % 11) - 5.0).collect();
        let again = project(5, |d| reconstruct(&coefficients, d), 8);
        for (a, b) in coefficients.iter().zip(&again) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
