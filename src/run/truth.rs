//! From a scene to its ground truth.

use super::{Loaded, MAX_MEMORY};
use crate::Error;
use crate::numeric::order::max;
use crate::pass::{Axis, Buffer, Info, RGB};
use crate::scene::{Assets, Model, Scene, Source, Technique};
use crate::sphere::environment::{Environment, Form};
use crate::sphere::sh;
use crate::techniques::prt::Subsurface;
use crate::truth::{self, Caster, Identity, Lights, Map, Normals, Sums, Volume};
use crate::world::brdf::{Brdf, Gloss};
use glam::Vec3;
use serde_json::json;

/// Mean and variance, in this order: what a ground truth hands to recorders, as passes do.
pub const TRUTH: [Info; 2] = [
    Info {
        name: "truth.mean",
        equation: "-",
        about: "radiance by Monte Carlo, without a technique's approximations",
        inputs: &[],
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "radiance",
    },
    Info {
        name: "truth.variance",
        equation: "-",
        about: "variance of that mean: the unbiased variance of a pixel's samples over their number",
        inputs: &[],
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "squared radiance",
    },
];

/// A scene's ground truth as far as it has come.
#[derive(Debug, Clone)]
pub struct Truth {
    /// What light travels through.
    pub scene: truth::Scene,
    /// Who looks.
    pub view: truth::View,
    /// Of what the sums are.
    pub identity: Identity,
    /// A pixel's sums, row by row from the top left.
    pub sums: Sums,
}

impl Truth {
    /// Loads what a scene names and prepares its ground truth: by the model of `truth.model`, or where that is absent by
    /// what the technique approximates: for translucency the dipole, for prt reflection, or the dipole where the surface
    /// reflects nothing.
    ///
    /// # Errors
    /// A missing or unusable asset, more than [`MAX_MEMORY`] for the sums, what the model cannot find, and a solid that both
    /// reflects and has light go through it where `truth.model` is absent.
    pub fn new(scene: &Scene, assets: &Assets) -> Result<Self, Error> {
        let count = scene.size[0] * scene.size[1];
        // The sums twice, as they are written, and the two buffers.
        if count as u64 * (2 * 48 + 2 * 12) > MAX_MEMORY {
            return Err(scene.place(
                Error::new("needs more than 8 GiB for the sums of its pixels")
                    .key("image.width")
                    .remedy("make image.width and image.height smaller"),
            ));
        }
        let loaded = Loaded::new(scene, assets, &[])?;
        let prepared = Self::scene(scene, &loaded).map_err(|error| scene.place(error))?;
        let view = truth::View {
            camera: scene.camera,
            size: scene.size,
            background: scene.background,
            filter: scene.truth.filter,
        };
        let identity = Identity { settings: settings(scene, prepared.model()), data: prepared.digest() };
        Ok(Self { scene: prepared, view, identity, sums: Sums::new(count) })
    }

    fn scene(scene: &Scene, loaded: &Loaded) -> Result<truth::Scene, Error> {
        let model = match model(scene)? {
            Model::Surface => surface(scene.surface, scene.truth.bounces),
            other => {
                if scene.truth.bounces.is_some() {
                    return Err(Error::new("counts reflections between surfaces, which this model has not")
                        .key("truth.bounces")
                        .remedy("leave it out, or set truth.model to \"surface\""));
                }
                match other {
                    Model::Medium => truth::Model::Medium(Volume::new(&scene.medium, scene.truth.anisotropy)),
                    _ => truth::Model::Dipole { medium: scene.medium, normals: Normals::Interpolated },
                }
            }
        };
        let prepared = truth::Scene::new(loaded.solid(scene)?, model, loaded.lights(scene));
        let casting = scene.lights.iter().position(|light| !matches!(light, Source::Environment { .. }));
        prepared
            .check()
            .map_err(|error| error.key(format!("light[{}].kind", casting.unwrap_or_default())))?;
        if matches!(prepared.model(), truth::Model::Medium(_)) && prepared.encloses(scene.camera.position) {
            return Err(Error::new("is inside the solid, and a walk through a medium begins outside of it")
                .key("camera.position")
                .remedy("move the camera out of the solid"));
        }
        Ok(prepared)
    }

    /// Adds samples until each pixel has `samples`; `told` is told now and then how many pixels have them.
    pub fn advance(&mut self, samples: u64, told: &mut dyn FnMut(usize)) {
        self.scene.pixels(&self.view, &mut self.sums, samples, told);
    }

    /// The buffers of [`TRUTH`]; of fewer than two samples the variance is 0.
    pub fn buffers(&self) -> [Buffer; 2] {
        let [width, height] = self.view.size;
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

impl Loaded {
    /// The lights of the scene that this was loaded for, as the ground truth sees them: as they are, or where `truth.bands`
    /// is not 0, environments and directions projected to so many bands, as prt lights with them.
    pub fn lights(&self, scene: &Scene) -> Lights {
        let mut lights = Lights { draw: true, ..Lights::default() };
        for (index, source) in scene.lights.iter().enumerate() {
            match *source {
                Source::Point { position, intensity } => {
                    lights.casters.push(Caster::Point { position, intensity });
                }
                Source::Directional { direction, irradiance } if scene.truth.bands == 0 => {
                    lights.casters.push(Caster::Directional { direction, irradiance });
                }
                Source::Directional { direction, irradiance } => {
                    lights.environments.push(lobe(scene.truth.bands, direction, irradiance));
                }
                Source::Environment { .. } => {
                    let seen = self.environment(index).map(|all| environment(all, scene.truth.bands));
                    lights.environments.extend(seen);
                }
            }
        }
        lights
    }
}

/// An environment as it is (0 bands), or projected.
fn environment(all: &Environment, bands: usize) -> truth::Environment {
    let harmonics =
        |bands: usize| truth::Environment::Harmonics { bands, coefficients: all.coefficients(bands) };
    match &all.form {
        Form::Constant(colour) => truth::Environment::Constant(*colour * all.scale),
        Form::Probe(_) if bands == 0 => harmonics(3),
        Form::Map(map) if bands == 0 => truth::Environment::Map(Map::new(map.clone(), all.scale)),
        _ => harmonics(bands),
    }
}

/// Parallel light in a few bands: Σ Y_lm(−d) Y_lm, times its irradiance.
fn lobe(bands: usize, direction: Vec3, irradiance: Vec3) -> truth::Environment {
    let mut basis = vec![0.0; bands * bands];
    sh::evaluate(bands, (-direction).as_dvec3().to_array(), &mut basis);
    let coefficients = basis.iter().map(|value| (irradiance * *value as f32).to_array()).collect();
    truth::Environment::Harmonics { bands, coefficients }
}

/// The surface model; `bounces` are those between points of the solid, as `prt.bounces` counts, without the reflection to
/// the eye.
pub fn surface(brdf: Brdf, bounces: Option<usize>) -> truth::Model {
    let bounces = bounces.map(|between| between as u32 + 1);
    truth::Model::Surface { brdf, bounces, normals: Normals::Interpolated }
}

fn model(scene: &Scene) -> Result<Model, Error> {
    let reflects = scene.surface.albedo != Vec3::ZERO || scene.surface.gloss != Gloss::None;
    match (scene.truth.model, scene.technique, scene.prt.subsurface) {
        (Some(model), ..) => Ok(model),
        (None, Technique::Prt, Subsurface::None) => Ok(Model::Surface),
        (None, Technique::Prt, Subsurface::Dipole) if reflects => {
            Err(Error::new("is absent, and the solid both reflects and has light go through it")
                .key("truth.model")
                .remedy("set it to \"surface\" or \"dipole\": the whole light is the sum of the two"))
        }
        (None, Technique::Prt, Subsurface::Dipole) | (None, Technique::Translucency, _) => Ok(Model::Dipole),
    }
}

/// The settings on which samples depend: not those of the techniques' own knobs, nor of the preview. What the solid is
/// made of is told by the model, since a scene's settings are those that its technique reads.
fn settings(scene: &Scene, model: &truth::Model) -> serde_json::Map<String, serde_json::Value> {
    let matters = |key: &str| match key.split_once('.') {
        Some((table, _)) => {
            !["translucency", "prt", "material", "surface"].contains(&table) && key != "image.exposure"
        }
        None => !["technique", "frame_rate"].contains(&key),
    };
    let all = scene.settings.iter().filter(|(key, _)| matters(key));
    let mut settings: serde_json::Map<_, _> = all.map(|(key, value)| (key.clone(), value.clone())).collect();
    let mut set = |key: &str, value: serde_json::Value| drop(settings.insert(key.into(), value));
    // With the digits that tell an `f32` from its neighbours, as people write them.
    let number = |value: f32| serde_json::from_str(&value.to_string()).unwrap_or_default();
    let three = |values: [f32; 3]| values.into_iter().map(number).collect::<serde_json::Value>();
    let name = match model {
        truth::Model::Surface { brdf, .. } => {
            set("surface.albedo", three(brdf.albedo.to_array()));
            set("surface.specular", three(brdf.specular.to_array()));
            match brdf.gloss {
                Gloss::None => set("surface.highlight", json!("none")),
                Gloss::Phong { exponent } => set("surface.exponent", number(exponent)),
                Gloss::CookTorrance { roughness } => set("surface.roughness", number(roughness)),
            }
            "surface"
        }
        truth::Model::Medium(_) | truth::Model::Dipole { .. } => {
            set("material.scattering", three(scene.medium.scattering));
            set("material.absorption", three(scene.medium.absorption));
            set("material.eta", number(scene.medium.eta));
            if matches!(model, truth::Model::Medium(_)) { "medium" } else { "dipole" }
        }
    };
    set("truth.model", json!(name));
    let truth = &scene.truth;
    set("truth.bands", json!(truth.bands));
    set("truth.bounces", json!(truth.bounces));
    set("truth.anisotropy", number(truth.anisotropy));
    set("truth.filter", json!(format!("{:?}", truth.filter).to_lowercase()));
    settings
}

/// The chunk in which samples are taken between two looks at the clock: whole passes over the image that take about a
/// second, by how long the last ones took.
pub fn chunk(last: u64, seconds: f64) -> u64 {
    max((last as f64 / max(seconds, 1e-6)) as u64, 1)
}
