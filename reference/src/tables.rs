//! The published tables, digit for digit.

use crate::translucency::dipole::Medium;

/// One row of the measured materials of Jensen et al. 2001.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JensenMaterial {
    /// The material's name as in the table.
    pub name: &'static str,
    /// The reduced scattering coefficient σ'_s: red, green, blue, per millimetre.
    pub sigma_s_prime: [f64; 3],
    /// The absorption coefficient σ_a: red, green, blue, per millimetre.
    pub sigma_a: [f64; 3],
    /// The relative index of refraction η.
    pub eta: f64,
}

impl JensenMaterial {
    /// The medium of one channel (0 red, 1 green, 2 blue), per millimetre.
    pub fn medium(&self, channel: usize) -> Medium {
        Medium { sigma_s_prime: self.sigma_s_prime[channel], sigma_a: self.sigma_a[channel], eta: self.eta }
    }
}

/// The twelve materials of Jensen et al. 2001, in the table's order. Lengths are millimetres.
/// Spectralon does not absorb at all: its σ_tr is 0.
pub const JENSEN_2001: [JensenMaterial; 12] = [
    JensenMaterial {
        name: "Apple",
        sigma_s_prime: [2.29, 2.39, 1.97],
        sigma_a: [0.0030, 0.0034, 0.046],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Chicken1",
        sigma_s_prime: [0.15, 0.21, 0.38],
        sigma_a: [0.015, 0.077, 0.19],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Chicken2",
        sigma_s_prime: [0.19, 0.25, 0.32],
        sigma_a: [0.018, 0.088, 0.20],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Cream",
        sigma_s_prime: [7.38, 5.47, 3.15],
        sigma_a: [0.0002, 0.0028, 0.0163],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Ketchup",
        sigma_s_prime: [0.18, 0.07, 0.03],
        sigma_a: [0.061, 0.97, 1.45],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Marble",
        sigma_s_prime: [2.19, 2.62, 3.00],
        sigma_a: [0.0021, 0.0041, 0.0071],
        eta: 1.5,
    },
    JensenMaterial {
        name: "Potato",
        sigma_s_prime: [0.68, 0.70, 0.55],
        sigma_a: [0.0024, 0.0090, 0.12],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Skimmilk",
        sigma_s_prime: [0.70, 1.22, 1.90],
        sigma_a: [0.0014, 0.0025, 0.0142],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Skin1",
        sigma_s_prime: [0.74, 0.88, 1.01],
        sigma_a: [0.032, 0.17, 0.48],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Skin2",
        sigma_s_prime: [1.09, 1.59, 1.79],
        sigma_a: [0.013, 0.070, 0.145],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Spectralon",
        sigma_s_prime: [11.6, 20.4, 14.9],
        sigma_a: [0.00, 0.00, 0.00],
        eta: 1.3,
    },
    JensenMaterial {
        name: "Wholemilk",
        sigma_s_prime: [2.55, 3.21, 3.77],
        sigma_a: [0.0011, 0.0024, 0.014],
        eta: 1.3,
    },
];

/// The radiance of one light probe as nine spherical-harmonic coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The probe's name.
    pub name: &'static str,
    /// Radiance coefficients: first index l² + l + m for l ≤ 2, second red, green, blue; real basis
    /// without the Condon-Shortley phase.
    pub coefficients: [[f64; 3]; 9],
}

impl Probe {
    /// The nine coefficients of one channel (0 red, 1 green, 2 blue).
    pub fn channel(&self, channel: usize) -> [f64; 9] {
        self.coefficients.map(|rgb| rgb[channel])
    }
}

/// Eight light probes projected as in Ramamoorthi and Hanrahan 2001, with the digits printed in
/// Rost's OpenGL Shading Language. They are coefficients of radiance: the clamped cosine is not in
/// them, but in the constants of Banterle and Chalmers, Eq. 11.
pub const PROBES: [Probe; 8] = [
    Probe {
        name: "grace",
        coefficients: [
            [0.78908, 0.43710, 0.54161],
            [0.39499, 0.34989, 0.60488],
            [-0.33974, -0.18236, -0.26940],
            [-0.29213, -0.05562, 0.00944],
            [-0.11141, -0.05090, -0.12231],
            [-0.26240, -0.22401, -0.47479],
            [-0.15570, -0.09471, -0.14733],
            [0.56014, 0.21444, 0.13915],
            [0.21205, -0.05432, -0.30374],
        ],
    },
    Probe {
        name: "eucalyptus",
        coefficients: [
            [0.3783264, 0.4260425, 0.4504587],
            [0.2887813, 0.3586803, 0.4147053],
            [0.0379030, 0.0295216, 0.0098567],
            [-0.1033028, -0.1031690, -0.0884924],
            [-0.0621750, -0.0554432, -0.0396779],
            [0.0077820, -0.0148312, -0.0471301],
            [-0.0935561, -0.1254260, -0.1525629],
            [-0.0572703, -0.0502192, -0.0363410],
            [0.0203348, -0.0044201, -0.0452180],
        ],
    },
    Probe {
        name: "stpeters",
        coefficients: [
            [0.3623915, 0.2624130, 0.2326261],
            [0.1759130, 0.1436267, 0.1260569],
            [-0.0247311, -0.0101253, -0.0010745],
            [0.0346500, 0.0223184, 0.0101350],
            [0.0198140, 0.0144073, 0.0043987],
            [-0.0469596, -0.0254485, -0.0117786],
            [-0.0898667, -0.0760911, -0.0740964],
            [0.0050194, 0.0038841, 0.0001374],
            [-0.0818750, -0.0321501, 0.0033399],
        ],
    },
    Probe {
        name: "uffizi",
        coefficients: [
            [0.3168843, 0.3073441, 0.3495361],
            [0.3711289, 0.3682168, 0.4292092],
            [-0.0034406, -0.0031891, -0.0039797],
            [-0.0084237, -0.0087049, -0.0116718],
            [-0.0190313, -0.0192164, -0.0250836],
            [-0.0110002, -0.0102972, -0.0119522],
            [-0.2787319, -0.2752035, -0.3184335],
            [0.0011448, 0.0009613, 0.0008975],
            [-0.2419374, -0.2410955, -0.2842899],
        ],
    },
    Probe {
        name: "galileo",
        coefficients: [
            [1.0351604, 0.7603549, 0.7074635],
            [0.4442150, 0.3430402, 0.3403777],
            [-0.2247797, -0.1828517, -0.1705181],
            [0.7110400, 0.5423169, 0.5587956],
            [0.6430452, 0.4971454, 0.5156357],
            [-0.1150112, -0.0936603, -0.0839287],
            [-0.3742487, -0.2755962, -0.2875017],
            [-0.1694954, -0.1343096, -0.1335315],
            [0.5515260, 0.4222179, 0.4162488],
        ],
    },
    Probe {
        name: "kitchen",
        coefficients: [
            [0.6396604, 0.6740969, 0.7286833],
            [0.2828940, 0.3159227, 0.3313502],
            [0.4200835, 0.5994586, 0.7748295],
            [-0.0474917, -0.0372616, -0.0199377],
            [-0.0984616, -0.0765437, -0.0509038],
            [0.2496256, 0.3935312, 0.5333141],
            [0.3813504, 0.5424832, 0.7141644],
            [0.0583734, 0.0066377, -0.0234326],
            [-0.0325933, -0.0239167, -0.0330796],
        ],
    },
    Probe {
        name: "campus",
        coefficients: [
            [0.7870665, 0.9379944, 0.9799986],
            [0.4376419, 0.5579443, 0.7024107],
            [-0.1020717, -0.1824865, -0.2749662],
            [0.4543814, 0.3750162, 0.1968642],
            [0.1841687, 0.1396696, 0.0491580],
            [-0.1417495, -0.2186370, -0.3132702],
            [-0.3890121, -0.4033574, -0.3639718],
            [0.0872238, 0.0744587, 0.0353051],
            [0.6662600, 0.6706794, 0.5246173],
        ],
    },
    Probe {
        name: "beach",
        coefficients: [
            [0.6841148, 0.6929004, 0.7069543],
            [0.3173355, 0.3694407, 0.4406839],
            [-0.1747193, -0.1737154, -0.1657420],
            [-0.4496467, -0.4155184, -0.3416573],
            [-0.1690202, -0.1703022, -0.1525870],
            [-0.0837808, -0.0940454, -0.1027518],
            [-0.0319670, -0.0214051, -0.0147691],
            [0.1641816, 0.1377558, 0.1010403],
            [0.3697189, 0.3097930, 0.2029923],
        ],
    },
];

/// The material with this name in [`JENSEN_2001`].
pub fn material(name: &str) -> Option<JensenMaterial> {
    JENSEN_2001.into_iter().find(|m| m.name == name)
}

/// The probe with this name in [`PROBES`].
pub fn probe(name: &str) -> Option<Probe> {
    PROBES.into_iter().find(|p| p.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{reconstruct, sphere_rule};

    /// A slip of sign or order in the constants would show as a sum that moves.
    #[test]
    fn sums_are_those_of_the_source() {
        let mut s = 0.0;
        let mut a = 0.0;
        for m in JENSEN_2001 {
            for c in 0..3 {
                s += m.sigma_s_prime[c];
                a += m.sigma_a[c];
            }
        }
        assert!((s - 101.52).abs() < 1e-12 && (a - 4.231).abs() < 1e-12, "{s} {a}");
        let mut weighted = 0.0;
        for p in PROBES {
            for (i, rgb) in p.coefficients.iter().enumerate() {
                for (j, x) in rgb.iter().enumerate() {
                    weighted += (1.0 + i as f64) * (1.0 + j as f64) * x;
                }
            }
        }
        assert!((weighted - 87.3983219).abs() < 1e-9, "{weighted}");
    }

    /// Radiance coefficients of a real environment give no negative mean.
    #[test]
    fn probes_have_positive_mean_radiance() {
        for p in PROBES {
            for c in 0..3 {
                let mut mean = 0.0;
                for (d, w) in sphere_rule(2) {
                    mean += w * reconstruct(&p.channel(c), d);
                }
                assert!(mean > 0.0, "{} channel {c}", p.name);
            }
        }
    }

    #[test]
    fn rows_are_found_by_name() {
        assert_eq!(material("Marble").unwrap().medium(1).sigma_s_prime, 2.62);
        assert_eq!(probe("grace").unwrap().channel(0)[1], 0.39499);
        assert!(material("marble").is_none());
    }
}
