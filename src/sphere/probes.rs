//! Published nine-coefficient light probes.

use crate::Error;
use crate::unknown;

/// A probe's name and the coefficients L_lm of its radiance.
pub type Probe = (&'static str, [[f32; 3]; 9]);

/// Radiance of eight captured environments, projected on three bands: RGB, order l² + l + m, real basis
/// without Condon-Shortley phase and with polar axis z, in each probe's own axes and arbitrary unit.
///
/// Source: Rost, "OpenGL Shading Language", 2nd edition, 2005, who computed them from Debevec's light probes
/// by the method of Ramamoorthi and Hanrahan 2001.
#[allow(clippy::excessive_precision, reason = "the digits as published")]
pub const PROBES: [Probe; 8] = [
    (
        "grace",
        [
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
    ),
    (
        "eucalyptus",
        [
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
    ),
    (
        "stpeters",
        [
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
    ),
    (
        "uffizi",
        [
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
    ),
    (
        "galileo",
        [
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
    ),
    (
        "kitchen",
        [
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
    ),
    (
        "campus",
        [
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
    ),
    (
        "beach",
        [
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
    ),
];

/// The coefficients of the probe called `name` in [`PROBES`].
///
/// # Errors
/// Where there is none; the message suggests the nearest name and lists all.
pub fn probe(name: &str) -> Result<&'static [[f32; 3]; 9], Error> {
    let found = PROBES.iter().find(|(known, _)| *known == name);
    found
        .map(|(_, coefficients)| coefficients)
        .ok_or_else(|| unknown("probe", name, &PROBES.map(|(known, _)| known)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_are_found_by_name() {
        for (name, coefficients) in &PROBES {
            assert_eq!(probe(name).unwrap(), coefficients);
        }
        assert!(probe("Grace").unwrap_err().to_string().contains("did you mean \"grace\"?"));
    }

    /// The mean radiance of a real environment is positive, and Grace's numbers are the ones everybody
    /// quotes.
    #[test]
    fn table_is_the_published_one() {
        assert!(PROBES.iter().all(|(_, c)| c[0].iter().all(|&l00| l00 > 0.0)));
        let grace = probe("grace").unwrap();
        assert_eq!((grace[0], grace[8]), ([0.78908, 0.43710, 0.54161], [0.21205, -0.05432, -0.30374]));
        // Radiance is nowhere negative, so no band's norm exceeds √(2l + 1) c_00.
        for (name, c) in &PROBES {
            for channel in 0..3 {
                let power = |range: std::ops::Range<usize>| {
                    c[range].iter().fold(0.0, |s, v| s + v[channel] * v[channel])
                };
                let mean = power(0..1);
                assert!(power(1..4) <= 3.0 * mean && power(4..9) <= 5.0 * mean, "{name}");
            }
        }
    }
}
