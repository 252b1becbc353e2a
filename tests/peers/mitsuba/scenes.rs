//! The scenes that Mitsuba renders too, from the tables that it wrote, and the test of both programs'
//! radiance.

#![allow(dead_code, reason = "each program takes what it needs")]

use bitlight::truth::{Estimator, Filter, Lamp, Lights, Model, Normals, Sensor, Sky, Sums, Volume};
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::camera::Camera;
use bitlight::world::shapes;
use glam::{Mat3, Vec3};
use serde_json::Value;
use std::error::Error;
use std::fs;
use std::path::Path;

/// The chance that two right programs fail one of all tests.
const LEVEL: f64 = 0.01;

/// Radiance, RGB, and the variance of each.
pub(crate) type Estimate = [[f64; 3]; 2];

/// What a file of Mitsuba's says.
pub(crate) struct Table {
    pub(crate) scene: Estimator,
    pub(crate) view: Sensor,
    /// Pixels along a side of a block.
    pub(crate) block: usize,
    /// Passes that Mitsuba's variances are from.
    pub(crate) passes: usize,
    /// Blocks that see the solid, by number, row by row.
    pub(crate) rows: Vec<(usize, Estimate)>,
}

impl Table {
    pub(crate) fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        Self::changed(path, |_| ())
    }

    /// As [`Self::read`], with a model that is another than Mitsuba's.
    pub(crate) fn changed(path: &Path, change: impl FnOnce(&mut Model)) -> Result<Self, Box<dyn Error>> {
        let table: Value = serde_json::from_str(&fs::read_to_string(path)?)?;
        let camera = &table["camera"];
        let view = Sensor {
            camera: Camera {
                position: vector(&camera["position"]),
                target: vector(&camera["target"]),
                up: vector(&camera["up"]),
                fov: number(&camera["fov"]) as f32,
            },
            size: [whole(&table["side"]); 2],
            background: Vec3::ZERO,
            filter: Filter::Box,
        };
        let n = whole(&table["resolution"]);
        let mut mesh = shapes::torus_knot(2, 3, 0.35, usize::max(8 * n, 40), n)?;
        let bounds = mesh.bounds();
        let scale = number(&table["size"]) as f32 / (bounds.high - bounds.low).max_element();
        mesh.apply(scale, Mat3::IDENTITY, bounds.center() * -scale)?;
        let mut model = if let Some(volume) = table.get("volume") {
            Model::Medium(Volume {
                scattering: vector(&volume["scattering"]).to_array(),
                absorption: vector(&volume["absorption"]).to_array(),
                anisotropy: number(&volume["g"]) as f32,
                eta: number(&volume["eta"]) as f32,
            })
        } else {
            let surface = &table["surface"];
            let gloss = match (surface.get("exponent"), surface.get("roughness")) {
                (Some(exponent), _) => Gloss::Phong { exponent: number(exponent) as f32 },
                (_, Some(roughness)) => Gloss::CookTorrance { roughness: number(roughness) as f32 },
                _ => Gloss::None,
            };
            let specular = surface.get("specular").map(vector).unwrap_or_default();
            let brdf = Brdf { albedo: vector(&surface["albedo"]), specular, gloss };
            Model::Surface { brdf, bounces: None, normals: Normals::Face }
        };
        let mut lights = Lights { draw: true, ..Lights::default() };
        for light in items(&table["lights"]) {
            match light["kind"].as_str() {
                Some("point") => lights.lamps.push(Lamp::Point {
                    position: vector(&light["position"]),
                    intensity: vector(&light["intensity"]),
                }),
                Some("directional") => lights.lamps.push(Lamp::Directional {
                    direction: vector(&light["direction"]).normalize(),
                    irradiance: vector(&light["irradiance"]),
                }),
                Some("constant") => lights.skies.push(Sky::Constant(vector(&light["radiance"]))),
                _ => lights.skies.push(Sky::Harmonics {
                    bands: 3,
                    coefficients: items(&light["coefficients"]).map(|rgb| vector(rgb).to_array()).collect(),
                }),
            }
        }
        let rows = items(&table["rows"]).map(|row| {
            let numbers: Vec<f64> = items(row).map(number).collect();
            let three = |first: usize| [numbers[first], numbers[first + 1], numbers[first + 2]];
            (numbers[0] as usize, [three(1), three(4).map(|error| error * error)])
        });
        let rows = rows.collect();
        change(&mut model);
        let scene = Estimator::new(mesh, model, lights);
        scene.check()?;
        Ok(Self { scene, view, block: whole(&table["block"]), passes: whole(&table["passes"]), rows })
    }

    /// Our samples of every pixel.
    pub(crate) fn render(&self, samples: u64) -> Sums {
        let mut sums = Sums::new(self.view.size[0] * self.view.size[1]);
        self.scene.pixels(&self.view, &mut sums, samples, &mut |_| {});
        sums
    }

    /// The blocks of [`Self::rows`] of ours.
    pub(crate) fn blocks(&self, sums: &Sums) -> Vec<Estimate> {
        let (side, block) = (self.view.size[0], self.block);
        let across = side / block;
        let estimate = |(number, _): &(usize, Estimate)| {
            let first = number / across * block * side + number % across * block;
            let pixels = (0..block * block).map(|pixel| first + pixel / block * side + pixel % block);
            mean(&pixels.map(|pixel| [sums.mean(pixel), sums.variance(pixel)]).collect::<Vec<_>>())
        };
        self.rows.iter().map(estimate).collect()
    }
}

/// The mean of independent estimates.
pub(crate) fn mean(estimates: &[Estimate]) -> Estimate {
    let count = estimates.len() as f64;
    let add = |which: usize, channel: usize| estimates.iter().fold(0.0, |sum, one| sum + one[which][channel]);
    [
        [0, 1, 2].map(|channel| add(0, channel) / count),
        [0, 1, 2].map(|channel| add(1, channel) / (count * count)),
    ]
}

/// What came of many tests whether two means are the same.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) tests: usize,
    /// Of them, those that say yes.
    pub(crate) passed: usize,
    /// The greatest |t|, and the one that is allowed.
    pub(crate) most: [f64; 2],
    /// The mean of t²: 1 for two right programs, but for what |t| beyond [`Self::most`] add.
    pub(crate) spread: f64,
}

impl Outcome {
    /// Compares element by element and channel by channel what is not 0 without variance on both sides;
    /// `passes` are those that `theirs` are from.
    pub(crate) fn new(ours: &[Estimate], theirs: &[Estimate], passes: usize) -> Self {
        let mut values = vec![];
        for (ours, theirs) in ours.iter().zip(theirs) {
            for channel in 0..3 {
                let variance = ours[1][channel] + theirs[1][channel];
                let difference = ours[0][channel] - theirs[0][channel];
                if variance > 0.0 || difference != 0.0 {
                    values.push(difference.abs() / variance.sqrt());
                }
            }
        }
        let allowed = student(1.0 - (1.0 - LEVEL).powf(1.0 / values.len() as f64), passes - 1);
        Self {
            tests: values.len(),
            passed: values.iter().filter(|t| **t <= allowed).count(),
            most: [values.iter().fold(0.0, |most, t| f64::max(most, *t)), allowed],
            spread: values.iter().map(|t| t * t).sum::<f64>() / values.len() as f64,
        }
    }

    /// Whether at least 99.75 % pass.
    pub(crate) fn holds(&self) -> bool {
        self.tests > 0 && self.passed as f64 >= 0.9975 * self.tests as f64
    }
}

/// The |t| that is exceeded with a chance of `level`, for many degrees of freedom (Abramowitz and Stegun,
/// 26.7.5).
fn student(level: f64, freedom: usize) -> f64 {
    let [mut low, mut high] = [0.0, 40.0];
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let beyond = libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2) > level;
        [low, high] = if beyond { [middle, high] } else { [low, middle] };
    }
    let (x, x2, n) = (low, low * low, freedom as f64);
    let g1 = x * (x2 + 1.0) / 4.0;
    let g2 = x * ((5.0 * x2 + 16.0) * x2 + 3.0) / 96.0;
    let g3 = x * (((3.0 * x2 + 19.0) * x2 + 17.0) * x2 - 15.0) / 384.0;
    x + g1 / n + g2 / (n * n) + g3 / (n * n * n)
}

fn items(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn whole(value: &Value) -> usize {
    number(value) as usize
}

fn vector(value: &Value) -> Vec3 {
    let numbers: Vec<f32> = items(value).map(|value| number(value) as f32).collect();
    Vec3::from_slice(&numbers)
}
