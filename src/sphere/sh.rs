//! The basis: real spherical harmonics Y_lm (Banterle and Chalmers, Eq. 7, Eq. 8 and Eq. 9).
//!
//! No Condon-Shortley phase, +sin(|m|φ) for m < 0 (the sign that Eq. 11 expects), polar axis z, order
//! l² + l + m; `bands` counts bands, so `bands = 5` means l = 0 … 4 and 25 functions. Other conventions:
//! [`super::convention`].
//!
//! Both evaluations split Y_l±m into q_lm(z) · Re or Im (x + iy)^m. The first factor is the normalised
//! associated Legendre function divided by sin^m θ, a polynomial in z that three-term recurrences give
//! stably; the second holds sin^m θ and the azimuth. So no angle, no trigonometry and no special case at the
//! poles.

use glam::Vec3;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The most bands that [`evaluate`] and [`super::rotation::Rotation`] take: l ≤ 31, 1,024 functions.
///
/// Precomputed radiance transfer stops far below (Feng et al. use 25 bands, 625 functions), and a fixed bound
/// keeps the recurrence's table small.
pub const MAX_BANDS: usize = 32;

/// The most bands that [`evaluate_fast`] takes: l ≤ 5, 36 functions, the most that a published real-time
/// technique here lights with (Nowrouzezahrai et al., "order 6").
pub const FAST_BANDS: usize = 6;

/// The position l² + l + m of Y_lm in every coefficient list.
///
/// # Panics
/// Where |m| > l.
#[inline]
pub fn index(l: usize, m: isize) -> usize {
    assert!(m.unsigned_abs() <= l, "|m| must not exceed l");
    (l * l + l).wrapping_add_signed(m)
}

/// The constants of the recurrence for q_lm: the start q_mm, and the factors of
/// q_lm = z·`up` q_{l−1,m} − `down` q_{l−2,m}.
struct Recurrence {
    sectoral: [f64; MAX_BANDS],
    /// (`up`, `down`) at `[l][m]` for m < l.
    step: [[(f64, f64); MAX_BANDS]; MAX_BANDS],
}

static RECURRENCE: LazyLock<Recurrence> = LazyLock::new(|| {
    let mut sectoral = [0.0; MAX_BANDS];
    // K_00, then √2 K_mm (2m − 1)!! (Eq. 8 and Eq. 9), each from the one before.
    sectoral[0] = (1.0 / (4.0 * PI)).sqrt();
    sectoral[1] = (3.0 / (4.0 * PI)).sqrt();
    for m in 2..MAX_BANDS {
        sectoral[m] = sectoral[m - 1] * ((2 * m + 1) as f64 / (2 * m) as f64).sqrt();
    }
    let mut step = [[(0.0, 0.0); MAX_BANDS]; MAX_BANDS];
    for (l, band) in step.iter_mut().enumerate().skip(1) {
        for (m, factors) in band[..l].iter_mut().enumerate() {
            let up = (((4 * l * l - 1) as f64) / ((l * l - m * m) as f64)).sqrt();
            // K_lm / K_{l−2,m} times the textbook factor (l + m − 1) / (l − m).
            let k = (l - 1) as f64;
            let down = up * ((k * k - (m * m) as f64) / (4.0 * k * k - 1.0)).sqrt();
            *factors = (up, if m + 1 < l { down } else { 0.0 });
        }
    }
    Recurrence { sectoral, step }
});

/// All `bands`² functions at `direction`, in `f64`, into `out` at l² + l + m.
///
/// `direction` is a unit vector; where it is not, the polynomials are evaluated as they stand. The unit of a
/// value is 1/√sr. Source: Banterle and Chalmers, Eq. 7, Eq. 8 and Eq. 9.
///
/// # Panics
/// Where `bands` exceeds [`MAX_BANDS`] or `out` has not `bands`² items.
pub fn evaluate(bands: usize, direction: [f64; 3], out: &mut [f64]) {
    assert!(bands <= MAX_BANDS, "at most {MAX_BANDS} bands");
    assert_eq!(out.len(), bands * bands, "one item for each function");
    let Recurrence { sectoral, step } = &*RECURRENCE;
    let [x, y, z] = direction;
    // (x + iy)^m
    let (mut real, mut imaginary) = (1.0, 0.0);
    for m in 0..bands {
        let (mut previous, mut q) = (0.0, sectoral[m]);
        for l in m..bands {
            if l > m {
                let (up, down) = step[l][m];
                (previous, q) = (q, up * (z * q) - down * previous);
            }
            out[l * l + l + m] = q * real;
            if m > 0 {
                out[l * l + l - m] = q * imaginary;
            }
        }
        (real, imaginary) = (x * real - y * imaginary, x * imaginary + y * real);
    }
}

/// The basis of [`evaluate`] to the letter of Eq. 9 with a P_l^|m| that is free of the Condon-Shortley phase:
/// √2 Im(e^{imφ}) for m < 0 is −sin(|m|φ), so those functions have the other sign (errata T2).
///
/// # Panics
/// As [`evaluate`].
pub fn evaluate_as_printed(bands: usize, direction: [f64; 3], out: &mut [f64]) {
    evaluate(bands, direction, out);
    for l in 0..bands {
        out[l * l..l * l + l].iter_mut().for_each(|value| *value = -*value);
    }
}

/// All `bands`² functions at `direction`, in `f32`, into `out` at l² + l + m: [`evaluate`]'s polynomials
/// written out.
///
/// Each value is within 4 ULP of [`evaluate`]'s, and within 7e-7. The ULP is that of the largest monomial in
/// x, y and z in the value's sum, since no more can be asked where terms cancel. `direction` is a unit
/// vector, `bands` counts to [`FAST_BANDS`]. Source: Banterle and Chalmers, Eq. 7, Eq. 8 and Eq. 9; the
/// factoring is Sloan's ("Efficient Spherical Harmonic Evaluation", JCGT 2013) without his phase.
///
/// # Panics
/// Where `bands` exceeds [`FAST_BANDS`] or `out` has not `bands`² items.
#[inline]
pub fn evaluate_fast(bands: usize, direction: Vec3, out: &mut [f32]) {
    #[inline(always)]
    fn fixed<const COUNT: usize>(bands: usize, direction: Vec3, out: &mut [f32]) {
        let out: &mut [f32; COUNT] = out.try_into().expect("one item for each function");
        polynomials(bands, direction.x, direction.y, direction.z, |function, value| out[function] = value);
    }
    match bands {
        0 => fixed::<0>(0, direction, out),
        1 => fixed::<1>(1, direction, out),
        2 => fixed::<4>(2, direction, out),
        3 => fixed::<9>(3, direction, out),
        4 => fixed::<16>(4, direction, out),
        5 => fixed::<25>(5, direction, out),
        6 => fixed::<36>(6, direction, out),
        _ => panic!("at most {FAST_BANDS} bands"),
    }
}

/// Directions that [`evaluate_lanes`] takes at a time.
pub const LANES: usize = 8;

/// [`evaluate_fast`] at eight directions at once: the same bits, each direction three to four times faster.
///
/// `x`, `y` and `z` hold the components; `out[l² + l + m][lane]` receives the values.
///
/// # Panics
/// Where `bands` exceeds [`FAST_BANDS`] or `out` has not `bands`² items.
#[inline]
pub fn evaluate_lanes(
    bands: usize,
    x: &[f32; LANES],
    y: &[f32; LANES],
    z: &[f32; LANES],
    out: &mut [[f32; LANES]],
) {
    #[inline(always)]
    fn fixed<const COUNT: usize>(bands: usize, [x, y, z]: [&[f32; LANES]; 3], out: &mut [[f32; LANES]]) {
        let out: &mut [[f32; LANES]; COUNT] = out.try_into().expect("one item for each function");
        for lane in 0..LANES {
            polynomials(bands, x[lane], y[lane], z[lane], |function, value| out[function][lane] = value);
        }
    }
    match bands {
        0 => fixed::<0>(0, [x, y, z], out),
        1 => fixed::<1>(1, [x, y, z], out),
        2 => fixed::<4>(2, [x, y, z], out),
        3 => fixed::<9>(3, [x, y, z], out),
        4 => fixed::<16>(4, [x, y, z], out),
        5 => fixed::<25>(5, [x, y, z], out),
        6 => fixed::<36>(6, [x, y, z], out),
        _ => panic!("at most {FAST_BANDS} bands"),
    }
}

/// The polynomials of [`evaluate_fast`], handed to `put` one by one. Inlined with a constant `bands`, no
/// branch is left.
#[inline(always)]
fn polynomials(bands: usize, x: f32, y: f32, z: f32, mut put: impl FnMut(usize, f32)) {
    if bands == 0 {
        return;
    }
    put(0, 0.2820948);
    if bands == 1 {
        return;
    }
    let q10 = 0.48860252 * z;
    put(1, 0.48860252 * y);
    put(2, q10);
    put(3, 0.48860252 * x);
    if bands == 2 {
        return;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (c2, s2) = (xx - yy, 2.0 * (x * y));
    let q20 = 0.9461747 * zz - 0.31539157;
    let q21 = 1.0925485 * z;
    put(4, 0.54627424 * s2);
    put(5, q21 * y);
    put(6, q20);
    put(7, q21 * x);
    put(8, 0.54627424 * c2);
    if bands == 3 {
        return;
    }
    let (c3, s3) = (x * (xx - 3.0 * yy), y * (3.0 * xx - yy));
    let q30 = z * (1.8658817 * zz - 1.119529);
    let q31 = 2.285229 * zz - 0.4570458;
    let q32 = 1.4453057 * z;
    put(9, 0.5900436 * s3);
    put(10, q32 * s2);
    put(11, q31 * y);
    put(12, q30);
    put(13, q31 * x);
    put(14, q32 * c2);
    put(15, 0.5900436 * c3);
    if bands == 4 {
        return;
    }
    // From here on (x + iy)^m cancels too much for f32: its parts are rounded once, from f64.
    let (x64, y64) = (f64::from(x), f64::from(y));
    let (xx64, yy64) = (x64 * x64, y64 * y64);
    let (c4, s4) = ((xx64 * (xx64 - 6.0 * yy64) + yy64 * yy64) as f32, 2.0 * (s2 * c2));
    let q40 = 1.9843135 * (z * q30) - 1.0062306 * q20;
    let q41 = z * (4.683326 * zz - 2.0071397);
    let q42 = 3.3116114 * zz - 0.47308734;
    let q43 = 1.7701308 * z;
    put(16, 0.6258357 * s4);
    put(17, q43 * s3);
    put(18, q42 * s2);
    put(19, q41 * y);
    put(20, q40);
    put(21, q41 * x);
    put(22, q42 * c2);
    put(23, q43 * c3);
    put(24, 0.6258357 * c4);
    if bands == 5 {
        return;
    }
    let cross = 10.0 * (xx64 * yy64);
    let c5 = (x64 * (xx64 * xx64 - cross + 5.0 * (yy64 * yy64))) as f32;
    let s5 = (y64 * (5.0 * (xx64 * xx64) - cross + yy64 * yy64)) as f32;
    let q50 = 1.9899749 * (z * q40) - 1.002853 * q30;
    let q51 = 2.0310097 * (z * q41) - 0.9910312 * q31;
    let q52 = z * (7.190305 * zz - 2.3967683);
    let q53 = 4.403145 * zz - 0.4892383;
    let q54 = 2.0756624 * z;
    put(25, 0.6563821 * s5);
    put(26, q54 * s4);
    put(27, q53 * s3);
    put(28, q52 * s2);
    put(29, q51 * y);
    put(30, q50);
    put(31, q51 * x);
    put(32, q52 * c2);
    put(33, q53 * c3);
    put(34, q54 * c4);
    put(35, 0.6563821 * c5);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sphere::quadrature;

    #[test]
    fn bands_stand_one_after_the_other() {
        let mut expected = 0;
        for l in 0..MAX_BANDS {
            for m in -(l as isize)..=l as isize {
                assert_eq!(index(l, m), expected);
                expected += 1;
            }
        }
    }

    /// Unit directions in `f32`: a dense cover of the sphere, the poles, the axes and their close neighbours.
    fn directions() -> Vec<Vec3> {
        let mut list: Vec<Vec3> = Vec::new();
        for signs in 0..27_i32 {
            let corner = [signs % 3 - 1, signs / 3 % 3 - 1, signs / 9 - 1].map(|s| s as f32);
            for tilt in [0.0, 1e-30, 1e-7, 1e-4, 1e-2, 1.0] {
                for axis in 0..3 {
                    let mut components = corner.map(|c| c * tilt);
                    components[axis] = corner[axis];
                    let direction = Vec3::from_array(components);
                    if direction.length_squared() > 0.0 {
                        list.push(direction.normalize());
                    }
                }
            }
        }
        list.extend(quadrature::fibonacci(100_000).iter().map(|d| Vec3::from_array(d.map(|c| c as f32))));
        list
    }

    /// The largest monomial in x, y and z of each function, multiplied out.
    fn largest_terms(bands: usize, direction: Vec3) -> Vec<f64> {
        let [x, y, z] = direction.to_array().map(f64::from);
        let power = |base: f64, exponent: usize| (0..exponent).fold(1.0, |product, _| product * base);
        let larger = |a: f64, b: f64| crate::numeric::order::max(a, b.abs());
        let mut terms = vec![0.0; bands * bands];
        for m in 0..bands {
            // (x + iy)^m by the binomial theorem: even powers of y are real, odd ones imaginary.
            let mut azimuth = [0.0, 0.0];
            let mut binomial = 1.0;
            for k in 0..=m {
                azimuth[k % 2] = larger(azimuth[k % 2], binomial * power(x, m - k) * power(y, k));
                binomial *= (m - k) as f64 / (k + 1) as f64;
            }
            // The coefficients of q_lm by powers of z.
            let (mut previous, mut q) = (vec![0.0; bands], vec![0.0; bands]);
            q[0] = RECURRENCE.sectoral[m];
            for l in m..bands {
                if l > m {
                    let (up, down) = RECURRENCE.step[l][m];
                    let next =
                        (0..bands).map(|j| up * if j > 0 { q[j - 1] } else { 0.0 } - down * previous[j]);
                    (previous, q) = (q.clone(), next.collect());
                }
                let largest = q.iter().enumerate().map(|(j, c)| c * power(z, j)).fold(0.0, larger);
                terms[index(l, m as isize)] = largest * azimuth[0];
                if m > 0 {
                    terms[index(l, -(m as isize))] = largest * azimuth[1];
                }
            }
        }
        terms
    }

    /// The distance from |x| to the next `f32` above.
    fn ulp(x: f64) -> f64 {
        let x = (x as f32).abs();
        f64::from(f32::from_bits(x.to_bits() + 1)) - f64::from(x)
    }

    #[test]
    fn fast_is_within_its_ulp_of_the_largest_monomial() {
        let mut worst = [0.0; 36];
        let mut greatest = 0.0;
        for direction in directions() {
            let mut exact = [0.0; 36];
            let mut fast = [0.0; 36];
            evaluate(6, direction.to_array().map(f64::from), &mut exact);
            evaluate_fast(6, direction, &mut fast);
            for (i, term) in largest_terms(6, direction).into_iter().enumerate() {
                let error = (f64::from(fast[i]) - exact[i]).abs();
                greatest = crate::numeric::order::max(greatest, error);
                worst[i] = crate::numeric::order::max(worst[i], error / ulp(term));
            }
        }
        assert!(worst.iter().all(|&w| w <= 4.0), "worst ULP {worst:.2?}");
        assert!(greatest < 7e-7, "greatest error {greatest:e}");
    }

    #[test]
    fn fewer_bands_and_lanes_give_the_same_bits() {
        let directions = directions();
        for eight in directions.chunks_exact(LANES) {
            let [x, y, z] = [0, 1, 2].map(|axis| std::array::from_fn(|lane| eight[lane][axis]));
            let mut all = vec![[0.0; LANES]; 36];
            evaluate_lanes(FAST_BANDS, &x, &y, &z, &mut all);
            for bands in 0..=FAST_BANDS {
                let mut lanes = vec![[0.0; LANES]; bands * bands];
                evaluate_lanes(bands, &x, &y, &z, &mut lanes);
                assert_eq!(lanes[..], all[..bands * bands]);
                for (lane, &direction) in eight.iter().enumerate() {
                    let mut one = vec![0.0; bands * bands];
                    evaluate_fast(bands, direction, &mut one);
                    for (function, value) in one.iter().enumerate() {
                        assert_eq!(value.to_bits(), lanes[function][lane].to_bits());
                    }
                }
            }
        }
    }
}
