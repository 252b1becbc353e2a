//! Conventions of real spherical harmonics, and coefficients from one to another.
//!
//! Every convention here keeps the order l² + l + m (the ambisonic channel number, ACN), the polar axis z and
//! +sin(|m|φ) for m < 0 up to the sign stated; they differ by a factor for each (l, m). Axes are not touched:
//! x, y and z keep their letters, so where "up" is another axis, rotate first ([`super::rotation`]).
//!
//! Below, P_lm is the associated Legendre function without the Condon-Shortley phase and t_m is cos(mφ) for
//! m ≥ 0, sin(|m|φ) for m < 0; N_lm = √((2 − δ_m0) (l − |m|)! / (l + |m|)!).

use crate::Error;
use crate::unknown;
use std::f64::consts::PI;

/// A convention of real spherical harmonics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// `bitlight`: orthonormal, no phase: Y_lm = √((2l + 1) / 4π) N_lm P_l|m| t_m, and f = Σ c_lm Y_lm. Thus
    /// Y_1−1, Y_10, Y_11 = 0.4886 (y, z, x). Also Ramamoorthi and Hanrahan 2001, and Banterle and Chalmers.
    Bitlight,
    /// `condon-shortley`: orthonormal with the phase: (−1)^m times ours, so Y_1−1, Y_10, Y_11 = 0.4886 (−y,
    /// z, −x), and f = Σ c_lm Y_lm. The code of Green 2003 ("Spherical Harmonic Lighting: The Gritty
    /// Details", whose P(l, m, x) starts from (−1)^m), Sloan 2008 ("Stupid SH Tricks", appendix A2) and 2013,
    /// DirectXMath's XMSHEvalDirection and its forerunner D3DXSHEvalDirection, Unreal's SHBasisFunction3.
    CondonShortley,
    /// `4pi`: geodesy's, with mean square 1 over the sphere and no phase: Y_lm = √(2l + 1) N_lm P_l|m| t_m,
    /// √(4π) times ours, and f = Σ c_lm Y_lm, so c_00 is the mean of f. The default of SHTOOLS ("Real
    /// spherical harmonics"), whose arrays `[i][l][m]` hold m ≥ 0 at i = 0 and m < 0 at i = 1.
    Geodesy,
    /// `n3d`: ambisonic channels of full normalisation, a_lm = ∫ f Y_lm dω with Y_lm = √(2l + 1) N_lm P_l|m|
    /// t_m: a source of gain 1 in direction d gives Y_lm(d), channels 0 to 3 being 1, √3 y, √3 z, √3 x. A
    /// channel is a projection and no factor in a sum, hence the difference from `4pi`. x front, y left, z
    /// up. Daniel 2000.
    N3d,
    /// `sn3d`: as `n3d` with the semi-normalised Y_lm = N_lm P_l|m| t_m (Schmidt's), channels 0 to 3 being
    /// 1, y, z, x. The AmbiX format (Nachbar, Zotter, Deleflie and Sontacchi 2011), scaled so that the
    /// omnidirectional channel is 1, as files in that format are.
    Sn3d,
}

impl Convention {
    /// Every convention, in the order in which messages list them.
    pub const ALL: [Self; 5] = [Self::Bitlight, Self::CondonShortley, Self::Geodesy, Self::N3d, Self::Sn3d];

    /// The name by which [`Self::from_name`] finds it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bitlight => "bitlight",
            Self::CondonShortley => "condon-shortley",
            Self::Geodesy => "4pi",
            Self::N3d => "n3d",
            Self::Sn3d => "sn3d",
        }
    }

    /// The convention called `name`.
    ///
    /// # Errors
    /// Where there is none; the message suggests the nearest name and lists all.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|convention| convention.name() == name);
        found.ok_or_else(|| unknown("convention of spherical harmonics", name, &Self::ALL.map(Self::name)))
    }

    /// What a coefficient of ours is multiplied by to be one of this convention.
    fn scale(self, l: usize, m: isize) -> f64 {
        match self {
            Self::Bitlight => 1.0,
            Self::CondonShortley if m % 2 != 0 => -1.0,
            Self::CondonShortley => 1.0,
            Self::Geodesy => 1.0 / (4.0 * PI).sqrt(),
            Self::N3d => (4.0 * PI).sqrt(),
            Self::Sn3d => (4.0 * PI / (2 * l + 1) as f64).sqrt(),
        }
    }
}

/// Turns `coefficients`, of the same function and in the order l² + l + m, from one convention to another.
///
/// To the same convention nothing changes; there and back returns every coefficient to within 2 ULP.
///
/// # Errors
/// Where the number of coefficients is no square, so no whole number of bands.
pub fn convert(from: Convention, to: Convention, coefficients: &mut [f64]) -> Result<(), Error> {
    let bands = coefficients.len().isqrt();
    if bands * bands != coefficients.len() {
        return Err(Error::new(format!("{} coefficients are no whole number of bands", coefficients.len()))
            .remedy("give 1, 4, 9, 16, … of them, each band complete"));
    }
    for l in 0..bands {
        for m in -(l as isize)..=l as isize {
            coefficients[super::sh::index(l, m)] *= to.scale(l, m) / from.scale(l, m);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{quadrature, sh};
    use super::*;

    /// Each convention's basis to l = 2, written out as its source prints it.
    fn polynomials(convention: Convention, [x, y, z]: [f64; 3]) -> [f64; 9] {
        let (s3, s5, s15) = (3.0_f64.sqrt(), 5.0_f64.sqrt(), 15.0_f64.sqrt());
        match convention {
            Convention::Bitlight => [
                0.5 / PI.sqrt(),
                s3 * y / (2.0 * PI.sqrt()),
                s3 * z / (2.0 * PI.sqrt()),
                s3 * x / (2.0 * PI.sqrt()),
                s15 * x * y / (2.0 * PI.sqrt()),
                s15 * y * z / (2.0 * PI.sqrt()),
                s5 * (3.0 * z * z - 1.0) / (4.0 * PI.sqrt()),
                s15 * x * z / (2.0 * PI.sqrt()),
                s15 * (x * x - y * y) / (4.0 * PI.sqrt()),
            ],
            Convention::CondonShortley => [
                0.282_094_791_773_878_14,
                -0.488_602_511_902_919_9 * y,
                0.488_602_511_902_919_9 * z,
                -0.488_602_511_902_919_9 * x,
                1.092_548_430_592_079_2 * x * y,
                -1.092_548_430_592_079_2 * y * z,
                0.946_174_695_757_56 * z * z - 0.315_391_565_252_520_05,
                -1.092_548_430_592_079_2 * x * z,
                0.546_274_215_296_039_6 * (x * x - y * y),
            ],
            Convention::Geodesy | Convention::N3d => [
                1.0,
                s3 * y,
                s3 * z,
                s3 * x,
                s15 * x * y,
                s15 * y * z,
                s5 * (3.0 * z * z - 1.0) / 2.0,
                s15 * x * z,
                s15 * (x * x - y * y) / 2.0,
            ],
            Convention::Sn3d => [
                1.0,
                y,
                z,
                x,
                s3 * x * y,
                s3 * y * z,
                (3.0 * z * z - 1.0) / 2.0,
                s3 * x * z,
                s3 * (x * x - y * y) / 2.0,
            ],
        }
    }

    #[test]
    fn converted_coefficients_give_the_same_function() {
        let ours: Vec<f64> = (0..9).map(|i| f64::from((7 * i + 3) % 11) - 5.0).collect();
        for to in [Convention::Bitlight, Convention::CondonShortley, Convention::Geodesy] {
            let mut theirs = ours.clone();
            convert(Convention::Bitlight, to, &mut theirs).unwrap();
            for d in quadrature::fibonacci(40) {
                let mut basis = [0.0; 9];
                sh::evaluate(3, d, &mut basis);
                let sum = |c: &[f64], y: [f64; 9]| c.iter().zip(y).fold(0.0, |s, (c, y)| s + c * y);
                let (expected, found) = (sum(&ours, basis), sum(&theirs, polynomials(to, d)));
                assert!((expected - found).abs() < 1e-14, "{}: {expected} against {found}", to.name());
            }
        }
    }

    /// A source of gain 1 in direction d has the coefficients Y_lm(d) here.
    #[test]
    fn an_ambisonic_source_has_its_polynomials_as_channels() {
        for to in [Convention::N3d, Convention::Sn3d] {
            for d in quadrature::fibonacci(40) {
                let mut channels = [0.0; 9];
                sh::evaluate(3, d, &mut channels);
                convert(Convention::Bitlight, to, &mut channels).unwrap();
                for (found, expected) in channels.iter().zip(polynomials(to, d)) {
                    assert!((found - expected).abs() < 1e-15, "{}", to.name());
                }
            }
        }
    }

    #[test]
    fn there_and_back_is_the_same_and_the_same_is_untouched() {
        let coefficients: Vec<f64> = (0..36).map(|i| f64::from(i) - 17.3).collect();
        for from in Convention::ALL {
            for to in Convention::ALL {
                let mut again = coefficients.clone();
                convert(from, to, &mut again).unwrap();
                assert_eq!(again == coefficients, from == to);
                convert(to, from, &mut again).unwrap();
                for (a, b) in again.iter().zip(&coefficients) {
                    assert!((a - b).abs() <= 2.0 * f64::EPSILON * b.abs());
                }
            }
        }
    }

    #[test]
    fn names_are_found_and_errors_say_what_there_is() {
        for convention in Convention::ALL {
            assert_eq!(Convention::from_name(convention.name()), Ok(convention));
        }
        let message = Convention::from_name("condon-shortly").unwrap_err().to_string();
        assert_eq!(
            message,
            "there is no convention of spherical harmonics \"condon-shortly\"; did you mean \"condon-shortley\"? \
             there are bitlight, condon-shortley, 4pi, n3d, sn3d"
        );
        assert!(convert(Convention::N3d, Convention::Sn3d, &mut [0.0; 10]).is_err());
    }
}
