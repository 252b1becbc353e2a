//! The lights of a scene: points, directions and environments. Every environment tells its radiance from any
//! direction; directions can be drawn from those that are maps.

use super::alias::Alias;
use crate::numeric::order::{clamp, max};
use crate::numeric::random::Sample;
use crate::numeric::turns::sin_cos;
use crate::sphere::environment::LatLong;
use crate::sphere::sh;
use glam::Vec3;

/// A light that comes from one point or direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lamp {
    /// A point that shines alike in all directions.
    Point {
        /// In the scene's unit.
        position: Vec3,
        /// Radiant intensity, RGB.
        intensity: Vec3,
    },
    /// Parallel light.
    Directional {
        /// The unit direction in which it travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, RGB.
        irradiance: Vec3,
    },
}

/// Radiance from far away.
#[derive(Debug, Clone)]
pub enum Sky {
    /// The same from everywhere, RGB.
    Constant(Vec3),
    /// A projection as it is, negative lobes included: directions are never drawn from it.
    Harmonics {
        /// How many bands.
        bands: usize,
        /// RGB coefficients in order l² + l + m, `bands`² of them.
        coefficients: Vec<[f32; 3]>,
    },
    /// A map, looked up bilinearly.
    Map(Map),
}

/// A map and a table by which its directions are drawn.
#[derive(Debug, Clone)]
pub struct Map {
    radiance: LatLong,
    /// Factor on it.
    scale: f32,
    /// Draws texels. A texel's weight is the greatest sum of the channels that a bilinear look-up in it can
    /// meet, times its solid angle, so that none is drawn too rarely.
    table: Alias,
}

impl Map {
    /// A map times a factor, with its table.
    pub fn new(radiance: LatLong, scale: f32) -> Self {
        let (width, height) = (radiance.width(), radiance.height());
        let sums: Vec<f64> =
            radiance.texels().iter().map(|rgb| rgb.to_array().map(f64::from).iter().sum()).collect();
        let mut weights = Vec::with_capacity(sums.len());
        for row in 0..height {
            let solid_angle = radiance.solid_angle(row);
            for column in 0..width {
                let mut most = 0.0;
                for near in row.saturating_sub(1)..usize::min(row + 2, height) {
                    for step in [width - 1, 0, 1] {
                        most = max(most, sums[near * width + (column + step) % width]);
                    }
                }
                weights.push(most * solid_angle);
            }
        }
        Self { radiance, scale, table: Alias::new(&weights) }
    }

    /// Draws a direction and the density per steradian that it has.
    fn sample(&self, random: &mut Sample) -> (Vec3, f32) {
        let texel = self.table.pick(random.bits());
        let (width, height) = (self.radiance.width(), self.radiance.height());
        let (row, column) = (texel / width, texel % width);
        let [u, v] = random.pair().map(f64::from);
        let edge = |row: usize| sin_cos(0.5 * row as f64 / height as f64).1;
        let (from, to) = (edge(row), edge(row + 1));
        let y = from + (to - from) * v;
        let (sine, cosine) = sin_cos((column as f64 + u) / width as f64);
        let across = max(1.0 - y * y, 0.0).sqrt();
        let direction = Vec3::new((across * cosine) as f32, y as f32, (across * sine) as f32);
        (direction, self.density(texel, row))
    }

    fn pdf(&self, direction: Vec3) -> f32 {
        let (width, height) = (self.radiance.width(), self.radiance.height());
        let (row, column) = {
            use crate::numeric::single::atan2;
            let Vec3 { x, y, z } = direction;
            let theta = atan2((x * x + z * z).sqrt(), y);
            let phi = atan2(z, x) / std::f32::consts::TAU;
            let u = if phi < 0.0 { phi + 1.0 } else { phi };
            let at = |turns: f32, count: usize| clamp((turns * count as f32) as usize, 0, count - 1);
            (at(theta / std::f32::consts::PI, height), at(u, width))
        };
        self.density(row * width + column, row)
    }

    fn density(&self, texel: usize, row: usize) -> f32 {
        (self.table.probability(texel) / self.radiance.solid_angle(row)) as f32
    }
}

impl Sky {
    /// The radiance that arrives from the unit vector `direction`.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Map(map) => map.radiance.radiance(direction) * map.scale,
            Self::Harmonics { bands, coefficients } if *bands <= sh::FAST_BANDS => {
                let mut basis = [0.0; sh::FAST_BANDS * sh::FAST_BANDS];
                let basis = &mut basis[..bands * bands];
                sh::evaluate_fast(*bands, direction, basis);
                let add = |sum: Vec3, (rgb, value): (&[f32; 3], &f32)| sum + Vec3::from_array(*rgb) * *value;
                coefficients.iter().zip(&*basis).fold(Vec3::ZERO, add)
            }
            Self::Harmonics { bands, coefficients } => {
                let mut basis = [0.0; sh::MAX_BANDS * sh::MAX_BANDS];
                let basis = &mut basis[..bands * bands];
                sh::evaluate(*bands, direction.as_dvec3().to_array(), basis);
                let mut sum = [0.0; 3];
                for (rgb, value) in coefficients.iter().zip(&*basis) {
                    (0..3).for_each(|channel| sum[channel] += f64::from(rgb[channel]) * value);
                }
                Vec3::from_array(sum.map(|sum| sum as f32))
            }
        }
    }

    /// The numbers that it is made of.
    pub(super) fn values(&self) -> Vec<Vec3> {
        match self {
            Self::Constant(radiance) => vec![*radiance],
            Self::Harmonics { coefficients, .. } => coefficients.iter().copied().map(Vec3::from).collect(),
            Self::Map(map) => {
                let form = Vec3::new(map.radiance.width() as f32, map.radiance.height() as f32, map.scale);
                [&[form], map.radiance.texels()].concat()
            }
        }
    }

    /// Draws a direction in proportion to a map's radiance, with its density; `None` for a sky that is no
    /// map.
    pub(super) fn sample(&self, random: &mut Sample) -> Option<(Vec3, f32)> {
        match self {
            Self::Map(map) => Some(map.sample(random)),
            _ => None,
        }
    }

    /// The density with which [`Self::sample`] draws a direction.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        match self {
            Self::Map(map) => map.pdf(direction),
            _ => 0.0,
        }
    }
}

/// All lights of a scene.
#[derive(Debug, Clone, Default)]
pub struct Lights {
    /// Points and directions.
    pub lamps: Vec<Lamp>,
    /// Environments; they add up.
    pub skies: Vec<Sky>,
    /// Whether directions are drawn from maps too, weighted against those that the surface draws. Otherwise
    /// the surface alone draws them, which is as correct and noisier.
    pub draw: bool,
}

impl Lights {
    /// The radiance of all environments from a unit vector.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.skies.iter().fold(Vec3::ZERO, |sum, sky| sum + sky.radiance(direction))
    }

    /// The radiance of all environments from a direction that something else drew with density `pdf`,
    /// weighted by the balance heuristic (Veach 1997, Eq. 9.8) against [`Sky::sample`].
    pub(super) fn weighted_radiance(&self, direction: Vec3, pdf: f32) -> Vec3 {
        self.skies.iter().fold(Vec3::ZERO, |sum, environment| {
            let other = if self.draw { environment.pdf(direction) } else { 0.0 };
            sum + environment.radiance(direction) * (pdf / (pdf + other))
        })
    }
}
