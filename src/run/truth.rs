//! From a scene to its ground truth: preparation, sampling, and the state between runs.

use super::{Loaded, MAX_MEMORY};
use crate::Error;
use crate::keys::Bears;
use crate::numeric::order::{max, min};
use crate::pass::{Axis, Buffer, Clock, Info, Preview, RGB};
use crate::scene::{Assets, Scene, keys};
use crate::sphere::environment::{Environment, Form};
use crate::sphere::sh;
use crate::store::file;
use crate::truth::{self, Estimator, Identity, Lamp, Lights, Map, Normals, Sums, Transport, Volume};
use crate::world::Stage;
use crate::world::brdf::Brdf;
use crate::world::light::Light;
use glam::Vec3;
use std::path::Path;

/// The two results that a ground truth hands to recorders, as passes do: mean and variance, in this order.
pub const TRUTH: [Info; 2] = [
    Info {
        name: "truth.mean",
        about: "radiance by Monte Carlo, without a technique's approximations",
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "radiance",
        preview: &[Preview::Picture],
        ..Info::BLANK
    },
    Info {
        name: "truth.variance",
        about: "variance of that mean: the unbiased variance of a pixel's samples over their number",
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "squared radiance",
        preview: &[Preview::Colour],
        ..Info::BLANK
    },
];

/// Seconds between two saves of the state while samples are taken, and until the first save.
const OFTEN: f64 = 60.0;
const EARLY: f64 = 10.0;

/// When sampling ends: whichever comes first.
#[derive(Debug, Clone, Copy)]
pub struct Until {
    /// Every pixel has this many samples, including those of earlier runs.
    pub samples: Option<u64>,
    /// This many seconds have passed, and every pixel has at least two samples.
    pub seconds: Option<f64>,
}

/// How far sampling has come.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// Samples that a pixel has, on average.
    pub samples: f64,
    /// The part that is done, from 0 to 1.
    pub part: f64,
    /// Whether sampling begins now; the time left is estimated from here.
    pub begins: bool,
}

/// A scene's ground truth as far as it has come.
#[derive(Debug, Clone)]
pub struct Truth {
    /// What light travels through.
    pub estimator: Estimator,
    /// The camera and the image.
    pub sensor: truth::Sensor,
    /// What the sums belong to: a run goes on only with the same settings and data.
    pub identity: Identity,
    /// A pixel's sums, row by row from the top left.
    pub sums: Sums,
}

impl Truth {
    /// Loads what a scene names and prepares its ground truth. The model is that of `truth.model`, or where
    /// that is absent the one that the scene's technique approximates.
    ///
    /// # Errors
    /// A missing or unusable asset, more than [`MAX_MEMORY`] for the sums, what the model cannot estimate,
    /// and what the technique refuses where `truth.model` is absent.
    pub fn new(scene: &Scene, assets: &Assets) -> Result<Self, Error> {
        let count = scene.size[0] * scene.size[1];
        // The sums twice, since writing copies them, and the two buffers.
        if count as u64 * (2 * 48 + 2 * 12) > MAX_MEMORY {
            return Err(scene.place(
                Error::new(format!("needs more than {} GiB for the sums of its pixels", MAX_MEMORY >> 30))
                    .key("image.width")
                    .remedy("make image.width and image.height smaller"),
            ));
        }
        let loaded = Loaded::new(scene, assets, &[])?;
        let prepared = loaded.stage(scene).and_then(|stage| prepare(scene, stage));
        let (estimator, transport) = prepared.map_err(|error| scene.place(error))?;
        let sensor = truth::Sensor {
            camera: scene.camera,
            size: scene.size,
            background: scene.background,
            filter: scene.truth.filter,
        };
        let identity = Identity { settings: settings(scene, transport), data: estimator.digest() };
        Ok(Self { estimator, sensor, identity, sums: Sums::new(count) })
    }

    /// Goes on from the state that an earlier run left at `path`, if there is one.
    ///
    /// # Errors
    /// A file that is no state or is damaged, and one of another scene or other settings: what differs is
    /// named.
    pub fn resume(&mut self, path: &Path) -> Result<(), Error> {
        let count = self.sums.values.len();
        let Some(bytes) = file::read_if_there(path, truth::state_bytes(count), truth::ANEW)? else {
            return Ok(());
        };
        self.sums = self.identity.parse(&bytes, count).map_err(|error| error.file(path))?;
        Ok(())
    }

    /// Writes the state from which another run goes on, whole or not at all.
    ///
    /// # Errors
    /// What the system refuses, naming the file.
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        file::write(path, |out| self.identity.write(out, &self.sums))
    }

    /// Takes samples in whole passes over the image until there are enough or the time is over. Now and then
    /// it saves the state at `path`.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn sample(
        &mut self,
        until: Until,
        path: &Path,
        clock: Clock,
        told: &mut dyn FnMut(Sampled),
    ) -> Result<(), Error> {
        let target = until.samples.unwrap_or(u64::MAX);
        let begun = clock();
        let (mut saved, mut wait, mut next) = (begun, EARLY, 1);
        let mut tell = |samples: f64, begins: bool| {
            let passed = clock() - begun;
            let of_samples = until.samples.map_or(0.0, |all| samples / all as f64);
            let of_time = until.seconds.map_or(0.0, |seconds| min(passed / seconds, 1.0));
            told(Sampled { samples, part: max(of_samples, of_time), begins });
        };
        tell(self.sums.samples as f64, true);
        while self.sums.samples < target {
            // At least two samples: one has no variance.
            if until.seconds.is_some_and(|seconds| clock() - begun >= seconds) && self.sums.samples > 1 {
                break;
            }
            let pass = clock();
            let (there, pixels) = (self.sums.samples, self.sums.values.len() as f64);
            let step = u64::min(next, target - there);
            self.advance(there + step, &mut |done| {
                tell(there as f64 + step as f64 * (done as f64 / pixels), false);
            });
            let left = until.seconds.map_or(1.0, |seconds| seconds - (clock() - begun));
            let rate = chunk(step, clock() - pass);
            next = u64::min(rate, u64::max((rate as f64 * left) as u64, 1));
            // Samples that took long are saved, even the first one.
            if clock() - saved > wait {
                self.save(path)?;
                (saved, wait) = (clock(), OFTEN);
            }
        }
        Ok(())
    }

    /// Adds samples until each pixel has `samples`; `told` is called now and then with the number of pixels
    /// that have them.
    pub fn advance(&mut self, samples: u64, told: &mut dyn FnMut(usize)) {
        self.estimator.pixels(&self.sensor, &mut self.sums, samples, told);
    }

    /// The buffers of [`TRUTH`]; with fewer than two samples the variance is 0.
    pub fn buffers(&self) -> [Buffer; 2] {
        let [width, height] = self.sensor.size;
        let image = |pixel: &dyn Fn(usize) -> [f64; 3]| {
            let values = (0..width * height).flat_map(|index| pixel(index).map(|value| value as f32));
            Buffer::f32(&[height, width, 3], values.collect())
        };
        let enough = self.sums.samples > 1;
        [
            image(&|pixel| self.sums.mean(pixel)),
            image(&|pixel| if enough { self.sums.variance(pixel) } else { [0.0; 3] }),
        ]
    }
}

/// What a scene's light travels through, and the transport that is traced.
fn prepare(scene: &Scene, stage: Stage) -> Result<(Estimator, Transport), Error> {
    let transport = match scene.truth.model {
        Some(transport) => transport,
        None => (scene.technique.transport)(&stage, &scene.values)?,
    };
    if transport != Transport::Surface && scene.truth.bounces.is_some() {
        return Err(Error::new("counts reflections between surfaces, which this model does not have")
            .key("truth.bounces")
            .remedy("leave it out, or set truth.model to \"surface\""));
    }
    let model = match transport {
        Transport::Surface => surface(stage.surface, scene.truth.bounces),
        Transport::Medium => truth::Model::Medium(Volume::new(&stage.medium, scene.truth.anisotropy)),
        Transport::Dipole => truth::Model::Dipole { medium: stage.medium, normals: Normals::Interpolated },
    };
    let casting = stage.lights.iter().position(Light::casts);
    let lights = lights(&stage.lights, scene.truth.bands);
    let estimator = Estimator::new(stage.solid, model, lights);
    estimator.check().map_err(|error| error.key(format!("light[{}].kind", casting.unwrap_or_default())))?;
    if transport == Transport::Medium && estimator.encloses(stage.camera.position) {
        return Err(Error::new("is inside the solid, and a walk through a medium begins outside of it")
            .key("camera.position")
            .remedy("move the camera out of the solid"));
    }
    Ok((estimator, transport))
}

/// The lights of the ground truth. With 0 bands they are taken as they are. Otherwise environments and
/// directions are projected to `bands` bands, as techniques light with them.
pub fn lights(all: &[Light], bands: usize) -> Lights {
    let mut lights = Lights { draw: true, ..Lights::default() };
    for light in all {
        match light {
            Light::Point { position, intensity } => {
                lights.lamps.push(Lamp::Point { position: *position, intensity: *intensity });
            }
            Light::Directional { direction, irradiance } if bands == 0 => {
                lights.lamps.push(Lamp::Directional { direction: *direction, irradiance: *irradiance });
            }
            Light::Directional { direction, irradiance } => {
                lights.skies.push(lobe(bands, *direction, *irradiance));
            }
            Light::Environment { environment: all, .. } => lights.skies.push(environment(all, bands)),
        }
    }
    lights
}

/// An environment as it is (0 bands), or projected.
fn environment(all: &Environment, bands: usize) -> truth::Sky {
    let harmonics = |bands: usize| truth::Sky::Harmonics { bands, coefficients: all.coefficients(bands) };
    match &all.form {
        Form::Constant(colour) => truth::Sky::Constant(*colour * all.scale),
        Form::Probe(_) if bands == 0 => harmonics(3),
        Form::Map(map) if bands == 0 => truth::Sky::Map(Map::new(map.clone(), all.scale)),
        _ => harmonics(bands),
    }
}

/// Parallel light in a few bands: Σ Y_lm(−d) Y_lm, times its irradiance.
fn lobe(bands: usize, direction: Vec3, irradiance: Vec3) -> truth::Sky {
    let mut basis = vec![0.0; bands * bands];
    sh::evaluate(bands, (-direction).as_dvec3().to_array(), &mut basis);
    let coefficients = basis.iter().map(|value| (irradiance * *value as f32).to_array()).collect();
    truth::Sky::Harmonics { bands, coefficients }
}

/// The surface model; `bounces` are those between points of the solid, without the reflection to the
/// eye.
pub fn surface(brdf: Brdf, bounces: Option<usize>) -> truth::Model {
    let bounces = bounces.map(|between| between as u32 + 1);
    truth::Model::Surface { brdf, bounces, normals: Normals::Interpolated }
}

/// The settings on which samples depend: those that bear on the ground truth, and of `surface` and `material`
/// the table that the transport reads.
fn settings(scene: &Scene, transport: Transport) -> serde_json::Map<String, serde_json::Value> {
    let mut settings = scene.values.bearing(Bears::Truth, |key| match key.table {
        "surface" => transport == Transport::Surface,
        "material" => transport != Transport::Surface,
        "truth" => true,
        table => keys::reads(scene.technique, table),
    });
    settings.insert("truth.model".into(), transport.name().into());
    settings
}

/// How many passes over the image are made between two looks at the clock: as many as take about a second,
/// judged by the last ones.
fn chunk(last: u64, seconds: f64) -> u64 {
    max((last as f64 / max(seconds, 1e-6)) as u64, 1)
}
