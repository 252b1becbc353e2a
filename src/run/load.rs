//! Loads once what a scene names, and makes the scene's stage at a time.

use super::memory;
use crate::Error;
use crate::numeric::double;
use crate::pass::{Given, Recorder};
use crate::scene::{Assets, Origin, Radiance, Scene, Shape, Solid, Source};
use crate::sphere::environment::{self, Environment, Form, LatLong};
use crate::sphere::probes;
use crate::world::Stage;
use crate::world::decimate::decimate;
use crate::world::light::Light;
use crate::world::mesh::Mesh;
use crate::world::{obj, shapes};
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// The least and the greatest radius of a solid's bounding box, in the scene's unit: beyond them squares and
/// products of lengths leave the range of `f32`.
pub const RADII: [f32; 2] = [1e-12, 1e15];

/// What a scene names, loaded and placed: all frames of a sequence share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// As placed, before it is deformed.
    pub(super) solid: Arc<Mesh>,
    /// For each light of the scene, the light if it is an environment. Empty where no lights were loaded.
    environments: Vec<Option<Light>>,
}

impl Loaded {
    /// Loads what a scene names, for a request of the `wanted` passes.
    ///
    /// # Errors
    /// More than [`super::MAX_MEMORY`], before anything is allocated for a pass; a missing or unusable asset.
    pub fn new(scene: &Scene, assets: &Assets, wanted: &[&str]) -> Result<Self, Error> {
        Self::of(scene, assets, wanted, &[], scene.assets(), &scene.lights)
    }

    /// [`Self::new`] where some buffers are given, so that their passes do not run.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn beside(scene: &Scene, assets: &Assets, wanted: &[&str], given: &[&str]) -> Result<Self, Error> {
        Self::of(scene, assets, wanted, given, scene.assets(), &scene.lights)
    }

    /// [`Self::new`] without lights, for passes that do not read them.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn unlit(scene: &Scene, assets: &Assets, wanted: &[&str]) -> Result<Self, Error> {
        Self::of(scene, assets, wanted, &[], scene.solid_asset().into_iter().collect(), &[])
    }

    fn of(
        scene: &Scene,
        assets: &Assets,
        wanted: &[&str],
        given: &[&str],
        named: Vec<&str>,
        lights: &[Source],
    ) -> Result<Self, Error> {
        let load = || {
            memory::check(scene, wanted, given, 0)?;
            // Before anything is loaded: a missing file shows at once.
            named.into_iter().try_for_each(|name| assets.find(name).map(drop))?;
            let bands = (scene.technique.bands)(&scene.values);
            let environments = lights.iter().enumerate();
            let environments = environments.map(|(index, light)| environment(index, light, bands, assets));
            let environments = environments.collect::<Result<_, _>>()?;
            let solid = solid(&scene.solid, assets)?;
            memory::check(scene, wanted, given, solid.positions.len())?;
            Ok(Self { solid: Arc::new(solid), environments })
        };
        load().map_err(|error: Error| scene.place(error))
    }

    /// The solid of the scene that this was loaded for, in the pose of that scene's time: the wave first,
    /// then the bend.
    ///
    /// # Errors
    /// A solid deformed out of range.
    pub fn posed(&self, scene: &Scene) -> Result<Arc<Mesh>, Error> {
        let (mut solid, time) = (Arc::clone(&self.solid), scene.time);
        if scene.wave.amplitude != 0.0 {
            let waved = scene.wave.apply(&solid, time).map_err(|error| error.key("wave.amplitude"))?;
            solid = Arc::new(waved);
        }
        if scene.bend.angle != 0.0 {
            solid = Arc::new(scene.bend.apply(&solid, time).map_err(|error| error.key("bend.angle"))?);
        }
        Ok(solid)
    }

    /// What a frame is made of: the scene that this was loaded for, at that scene's time ([`Scene::at`]). The
    /// camera and the lights that are points or directions may have moved since loading.
    ///
    /// # Errors
    /// A solid deformed out of range.
    pub fn stage(&self, scene: &Scene) -> Result<Stage, Error> {
        let lights = scene.lights.iter().zip(&self.environments).map(|(source, environment)| match source {
            Source::Point { position, intensity } => {
                Light::Point { position: *position, intensity: *intensity }
            }
            Source::Directional { direction, irradiance } => {
                Light::Directional { direction: *direction, irradiance: *irradiance }
            }
            Source::Environment { .. } => environment.clone().expect("it was loaded with the others"),
        });
        Ok(Stage {
            solid: self.posed(scene)?,
            medium: scene.medium,
            surface: scene.surface,
            gloss: scene.gloss,
            lights: lights.collect(),
            camera: scene.camera,
            size: scene.size,
            background: scene.background,
        })
    }

    /// Renders the wanted passes of the scene that this was loaded for, as [`super::render`] does.
    ///
    /// # Errors
    /// What cannot be prepared, and what the recorder refuses.
    pub fn render(&self, scene: &Scene, wanted: &[&str], recorder: &mut dyn Recorder) -> Result<(), Error> {
        self.render_from(scene, wanted, Given::new(), recorder)
    }

    /// [`Self::render`] without running the passes whose buffers are given.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub fn render_from(
        &self,
        scene: &Scene,
        wanted: &[&str],
        given: Given,
        recorder: &mut dyn Recorder,
    ) -> Result<(), Error> {
        let rendered = self
            .stage(scene)
            .and_then(|stage| (scene.technique.render)(stage, &scene.values, wanted, given, recorder));
        rendered.map_err(|error| scene.place(error))
    }
}

fn solid(solid: &Solid, assets: &Assets) -> Result<Mesh, Error> {
    let mut mesh = match &solid.origin {
        Origin::File(name) => {
            obj::parse(&assets.bytes(name, obj::MAX_BYTES, obj::SHORTER)?, assets.find(name)?)?
        }
        Origin::Shape { shape: of, resolution, extents } => {
            shape(*of, *resolution, *extents).map_err(|error| error.key("solid.resolution"))?
        }
    };
    if solid.triangles > 0 {
        mesh = decimate(mesh, solid.triangles).map_err(|error| error.key("solid.triangles"))?;
    }
    let bounds = mesh.bounds();
    let longest = (bounds.high - bounds.low).max_element();
    let scale = solid.size.map_or(1.0, |size| size / longest);
    let angle = f64::from(solid.turn) * (std::f64::consts::PI / 180.0);
    let (sine, cosine) = (double::sin(angle) as f32, double::cos(angle) as f32);
    let turn = Mat3::from_cols(Vec3::new(cosine, 0.0, -sine), Vec3::Y, Vec3::new(sine, 0.0, cosine));
    mesh.apply(scale, turn, -(turn * (bounds.center() * scale))).map_err(|error| {
        Error::new(format!(
            "a solid {longest} long loses its shape when it is scaled by {scale}: {}",
            error.what
        ))
        .key("solid.size")
        .remedy("bring its size nearer to 1, with a unit that suits it")
    })?;
    // Turning moves the centre of the bounding box, so the solid is centred again.
    let turned = mesh.bounds();
    let radius = turned.radius();
    if !(RADII[0]..=RADII[1]).contains(&radius) {
        let [low, high] = RADII;
        return Err(Error::new(format!(
            "the solid has a radius of {radius:e}; {low:e} to {high:e} can be rendered"
        ))
        .key("solid.size")
        .remedy("bring it nearer to 1, with a unit that suits it"));
    }
    // Farther out, the rounding of a coordinate is over a hundredth of the radius.
    if solid.center.length() > 1e5 * radius {
        return Err(Error::new("is over 100,000 times the solid's radius from the origin")
            .key("solid.center")
            .remedy("bring it nearer, with the camera and the lights, or make the solid larger"));
    }
    mesh.apply(1.0, Mat3::IDENTITY, solid.center - turned.center())?;
    Ok(mesh)
}

/// A procedural shape: for each `resolution`, n, about 20 n² triangles (12 n² of a cuboid).
fn shape(shape: Shape, n: usize, extents: Vec3) -> Result<Mesh, Error> {
    match shape {
        Shape::Sphere => shapes::sphere(n),
        // At least the divisions that the knot's curve needs.
        Shape::TorusKnot => shapes::torus_knot(2, 3, 0.35, (8 * n).max(40), n.max(3)),
        Shape::Genus3 => shapes::genus3(n.div_ceil(10)), // its base mesh has 2,180 triangles
        Shape::Cuboid => shapes::cuboid(extents * 0.5, n),
    }
}

/// Loads an environment and projects it to `bands` bands; `None` for another kind of light. The coefficients
/// are finite.
fn environment(index: usize, source: &Source, bands: usize, assets: &Assets) -> Result<Option<Light>, Error> {
    let Source::Environment { radiance, scale } = source else { return Ok(None) };
    let form = match radiance {
        Radiance::Probe(name) => Form::Probe(*probes::probe(name)?),
        Radiance::File(name) => {
            let bytes = assets.bytes(name, environment::MAX_BYTES, environment::SMALLER)?;
            let path = assets.find(name)?;
            Form::Map(LatLong::from_hdr(&bytes).map_err(|error| error.file(path))?)
        }
        Radiance::Constant(colour) => Form::Constant(*colour),
    };
    let environment = Environment { form, scale: *scale };
    let coefficients = environment.coefficients(bands);
    if coefficients.as_flattened().iter().all(|value| value.is_finite()) {
        return Ok(Some(Light::Environment { environment: Arc::new(environment), coefficients }));
    }
    Err(Error::new("makes the environment brighter than numbers go")
        .key(format!("light[{index}].scale"))
        .remedy("scale it down"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass::Kept;
    use crate::techniques::translucency::{Frame, Settings};

    const SEQUENCE: &str = "technique = \"translucency\"\nimage = { width = 16, height = 16 }\n\
        camera = { position = [0, 0, 6] }\nsolid = { file = \"two.obj\" }\nwave = { amplitude = 0.5 }\n\
        light = [{ kind = \"point\", position = [0, 9, 0], intensity = [9, 9, 9] }]\n";

    #[test]
    fn a_sequence_loads_once_and_every_frame_has_its_own_box() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("two.obj");
        // A cube's corner at the origin; its side along z is a quarter of the wave.
        std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.25\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            .unwrap();
        let scene = Scene::parse(SEQUENCE, "two.toml".as_ref(), &[]).unwrap();
        let assets = Assets::Folder(folder.path().into());
        let loaded = Loaded::new(&scene, &assets, &[]).unwrap();
        let whole = render_final(&scene.at(0.25), &Loaded::new(&scene, &assets, &[]).unwrap());
        std::fs::remove_file(&file).unwrap();
        assert!(Loaded::new(&scene, &assets, &[]).is_err());
        let still =
            Scene { wave: crate::world::deform::Wave { amplitude: 0.0, ..scene.wave }, ..scene.clone() };
        let rest = frame(&loaded, &still);
        for time in [0.0, 0.25, 0.5] {
            let frame = frame(&loaded, &scene.at(time));
            let used = frame.stage.solid.bounds();
            assert!((used.low.x - rest.bounds.low.x).abs() > 0.1, "the box follows at {time}");
            assert!(
                (frame.bounds.low - used.low).length() < 1e-6
                    && (frame.bounds.high - used.high).length() < 1e-6
            );
        }
        assert_eq!(render_final(&scene.at(0.25), &loaded), whole);
        assert_eq!(scene.at(0.25).settings()["time"], 0.25);
    }

    #[test]
    fn lights_that_move_need_no_loading() {
        let moving = SEQUENCE.replace("file = \"two.obj\"", "shape = \"cuboid\", resolution = 2");
        let scene = Scene::parse(&moving, "two.toml".as_ref(), &[]).unwrap();
        let mut moved = scene.clone();
        let Source::Point { position, .. } = &mut moved.lights[0] else { panic!("it is a point") };
        position.x += 1.0;
        let [still, afresh] = [&scene, &moved].map(|of| Loaded::new(of, &Assets::default(), &[]).unwrap());
        assert_eq!(frame(&still, &moved), frame(&afresh, &moved));
        assert_ne!(frame(&still, &moved), frame(&still, &scene));
    }

    #[test]
    fn a_solid_is_waved_first_and_bent_then() {
        let text = SEQUENCE.replace("file = \"two.obj\"", "shape = \"cuboid\", resolution = 2");
        let set = ["bend.angle=40".to_owned(), "time=0.2".into()];
        let scene = Scene::parse(&text, "two.toml".as_ref(), &set).unwrap();
        let loaded = Loaded::new(&scene, &Assets::default(), &[]).unwrap();
        let waved = scene.wave.apply(&loaded.solid, 0.2).unwrap();
        let posed = loaded.posed(&scene).unwrap();
        assert_eq!(*posed, scene.bend.apply(&waved, 0.2).unwrap());
        assert!(posed.positions != waved.positions && waved.positions != loaded.solid.positions);
    }

    #[test]
    fn what_is_not_deformed_is_not_copied() {
        let flat = SEQUENCE.replace("file = \"two.obj\"", "shape = \"cuboid\", resolution = 2");
        let of = |set: &[String]| {
            let scene = Scene::parse(&flat, "two.toml".as_ref(), set).unwrap();
            let loaded = Loaded::new(&scene, &Assets::default(), &[]).unwrap();
            Arc::ptr_eq(&loaded.solid, &loaded.stage(&scene).unwrap().solid)
        };
        assert!(!of(&[]) && of(&["wave.amplitude=0".into()]));
    }

    fn frame(loaded: &Loaded, scene: &Scene) -> Frame {
        Frame::new(loaded.stage(scene).unwrap(), Settings::read(&scene.values)).unwrap()
    }

    fn render_final(scene: &Scene, loaded: &Loaded) -> Vec<f32> {
        let mut kept = Kept::default();
        loaded.render(scene, &["translucency.final"], &mut kept).unwrap();
        kept.get("translucency.final").unwrap().as_f32().to_vec()
    }
}
