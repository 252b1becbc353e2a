//! Scenes: TOML files that say what to render. [`keys`] has the shared keys, `reader.rs` makes a scene of a
//! file's checked values, [`Assets`] yields the files that it names.

mod assets;
pub mod keys;
mod reader;

pub use assets::Assets;

use crate::Error;
use crate::keys::{Bears, Values};
use crate::store::file;
use crate::techniques::{self, Outline, Technique};
use crate::truth;
use crate::world::brdf::Brdf;
use crate::world::camera::Camera;
use crate::world::deform::{Bend, Wave};
use crate::world::medium::Medium;
use glam::Vec3;
use serde_json::{Map, Value as Json};
use std::path::{Path, PathBuf};

/// The largest scene file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// A checked scene. Its lengths are in its own unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file it came from.
    pub file: PathBuf,
    /// Every value in force, given or by default. The fields below are made from them; each technique reads
    /// its own.
    pub values: Values,
    /// The technique that renders it.
    pub technique: &'static Technique,
    /// The time that is rendered, in seconds.
    pub time: f64,
    /// Frames a second of a sequence.
    pub frame_rate: f64,
    /// Width and height of the image, in pixels.
    pub size: [usize; 2],
    /// Radiance where the camera sees nothing.
    pub background: Vec3,
    /// Stops by which previews are brightened.
    pub exposure: f32,
    /// The camera.
    pub camera: Camera,
    /// The solid that is rendered.
    pub solid: Solid,
    /// The wave that deforms the placed solid.
    pub wave: Wave,
    /// The bend that follows the wave.
    pub bend: Bend,
    /// The medium that fills it.
    pub medium: Medium,
    /// Exponent of the highlight of `[material]`.
    pub gloss: f32,
    /// How its surface reflects, for techniques that read `[surface]`.
    pub surface: Brdf,
    /// The lights, in the file's order.
    pub lights: Vec<Source>,
    /// The settings of the ground truth.
    pub truth: truth::Settings,
}

/// A solid before it is loaded.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Where it comes from.
    pub origin: Origin,
    /// The most triangles that it may have; 0 for as many as it has.
    pub triangles: usize,
    /// Length of its longest side; `None` to leave it as it is.
    pub size: Option<f32>,
    /// Degrees about the vertical.
    pub turn: f32,
    /// Where the centre of its bounding box is put.
    pub center: Vec3,
}

/// A procedural shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A sphere.
    Sphere,
    /// A tube along a trefoil knot.
    TorusKnot,
    /// A solid with three handles.
    Genus3,
    /// A cuboid.
    Cuboid,
}

/// Where a solid comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// A procedural shape.
    Shape {
        /// Which.
        shape: Shape,
        /// How finely it is divided.
        resolution: usize,
        /// Side lengths of a cuboid.
        extents: Vec3,
    },
    /// An OBJ file below the assets.
    File(String),
}

/// A light before its files are loaded.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A point.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity.
        intensity: Vec3,
    },
    /// A direction.
    Directional {
        /// The unit direction in which it travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it.
        irradiance: Vec3,
    },
    /// An environment.
    Environment {
        /// Where its radiance comes from.
        radiance: Radiance,
        /// Factor on it.
        scale: f32,
    },
}

impl Source {
    /// The name of its asset, if it has one.
    pub fn asset(&self) -> Option<&str> {
        match self {
            Self::Environment { radiance: Radiance::File(name), .. } => Some(name),
            _ => None,
        }
    }
}

/// Where the radiance of an environment comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Radiance {
    /// A lat-long HDR file below the assets.
    File(String),
    /// A published probe, by name.
    Probe(String),
    /// The same from everywhere.
    Constant(Vec3),
}

impl Scene {
    /// Reads and checks a scene file; `set` holds assignments `key=value` that override it.
    ///
    /// # Errors
    /// What is missing, unknown or out of range, naming file, line, key and remedy.
    pub fn read(path: &Path, set: &[String]) -> Result<Self, Error> {
        let shorter = "check that it is a scene, and leave out what it does not need";
        let bytes = file::read(path, MAX_BYTES, shorter).map_err(|error| match error.remedy.as_deref() {
            Some(remedy) if remedy == shorter => error,
            _ => error.cure("`bitlight init TECHNIQUE` writes a scene to start from"),
        })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| {
            let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
            Error::new("is not UTF-8 text").file(path).line(line).remedy("save the scene as UTF-8")
        })?;
        Self::parse(text, path, set)
    }

    /// Checks the text of a scene; `file` is only named in errors.
    ///
    /// # Errors
    /// What is missing, unknown or out of range, naming file, line, key and remedy.
    pub fn parse(text: &str, file: &Path, set: &[String]) -> Result<Self, Error> {
        Self::parse_as(techniques::ALL, text, file, set)
    }

    /// [`Self::parse`] for a program with other techniques.
    ///
    /// # Errors
    /// Those of [`Self::parse`].
    pub fn parse_as(
        techniques: &[&'static Technique],
        text: &str,
        file: &Path,
        set: &[String],
    ) -> Result<Self, Error> {
        let values = Values::new(keys::all(techniques), text, set);
        values.and_then(|values| reader::scene(values, techniques, file)).map_err(|error| error.file(file))
    }

    /// Every setting on which some pass depends, given or by default, by its key. Those of other techniques
    /// and of the ground truth are left out.
    pub fn settings(&self) -> Map<String, Json> {
        self.values.bearing(Bears::Picture, |key| keys::reads(self.technique, key.table))
    }

    /// What the sizes of the passes' buffers depend on, for a solid of so many vertices.
    pub fn outline(&self, vertices: usize) -> Outline<'_> {
        let casts = |light: &&Source| !matches!(light, Source::Environment { .. });
        Outline {
            values: &self.values,
            surface: &self.surface,
            size: self.size,
            lights: self.lights.len(),
            casters: self.lights.iter().filter(casts).count(),
            vertices,
        }
    }

    /// The assets that the scene names.
    pub fn assets(&self) -> Vec<&str> {
        self.solid_asset().into_iter().chain(self.lights.iter().filter_map(Source::asset)).collect()
    }

    /// The name of the solid's asset, if it has one.
    pub fn solid_asset(&self) -> Option<&str> {
        match &self.solid.origin {
            Origin::File(name) => Some(name.as_str()),
            Origin::Shape { .. } => None,
        }
    }

    /// Adds the scene's file, and the line of its key, to an error that names no file.
    pub fn place(&self, error: Error) -> Error {
        let line = error.key.as_ref().and_then(|key| self.values.line(key));
        match line.filter(|_| error.file.is_none()) {
            Some(line) => error.file(&self.file).line(line),
            None => error.file(&self.file),
        }
    }

    /// The scene at another time, in seconds: what `--set time=…` makes of it.
    #[must_use]
    pub fn at(&self, time: f64) -> Self {
        let mut scene = Self { time, ..self.clone() };
        scene.values.set("time", time);
        scene
    }

    /// The file's name without folder and ending. The names of written files begin with it.
    pub fn name(&self) -> String {
        self.file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{Kind, Value};
    use crate::techniques::{prt, translucency};

    const SMALL: &str = "technique = \"translucency\"\n[camera]\nposition = [0, 0, 4]\n[solid]\nshape = \"sphere\"\n\
        [[light]]\nkind = \"point\"\nposition = [0, 3, 3]\nintensity = [9, 9, 9]\n";

    fn parse(text: &str, set: &[&str]) -> Result<Scene, Error> {
        Scene::parse(text, Path::new("a.toml"), &set.iter().map(|set| (*set).into()).collect::<Vec<_>>())
    }

    fn refusal(text: &str, set: &[&str]) -> String {
        parse(text, set).unwrap_err().to_string()
    }

    #[test]
    fn defaults_fill_what_a_small_scene_leaves_out() {
        let scene = parse(SMALL, &[]).unwrap();
        let shadow = translucency::Settings::read(&scene.values).shadow;
        assert_eq!((scene.size, scene.camera.fov, shadow), ([512, 512], 40.0, 512));
        assert_eq!(scene.settings()["translucency.blur"], 8);
        assert_eq!(scene.settings()["light[0].kind"], "point");
    }

    #[test]
    fn set_overrides_and_is_checked_like_the_file() {
        let set = ["translucency.cubemap=32", "material.name=Skin1", "light[0].intensity=[1,2,3]"];
        let scene = parse(SMALL, &set).unwrap();
        assert_eq!(translucency::Settings::read(&scene.values).cubemap, 32);
        assert_eq!(scene.settings()["material.name"], "Skin1");
        assert!(refusal(SMALL, &["translucency.cubmap=32"]).contains("did you mean cubemap?"));
        assert!(refusal(SMALL, &["light[3].intensity=[1,2,3]"]).contains("no such light"));
        assert!(refusal(SMALL, &["camera.fov"]).contains("there is no ="));
    }

    #[test]
    fn the_readings_and_switches_of_translucency_are_read() {
        use crate::keys::Reading;
        use translucency::{Evaluation, Settings};
        let ours = Settings::read(&parse(SMALL, &[]).unwrap().values);
        assert_eq!(
            (ours.reading, ours.evaluation, ours.smallest_d),
            (Reading::Corrected, Evaluation::Pixel, None)
        );
        assert!(ours.second_layer && ours.shift_cure && ours.blindness_cure);
        assert_eq!(ours.accumulation, 1);
        let of = |set: &str| Settings::read(&parse(SMALL, &[&format!("translucency.{set}")]).unwrap().values);
        assert_eq!(of("reading=paper").reading, Reading::Paper);
        assert_eq!(of("evaluation=vertex").evaluation, Evaluation::Vertex);
        assert_eq!(of("smallest_d=0.25").smallest_d, Some(0.25));
        assert_eq!(of("accumulation=16").accumulation, 16);
        assert!(!of("second_layer=false").second_layer && of("second_layer=true").second_layer);
        assert!(!of("shift_cure=false").shift_cure && !of("blindness_cure=false").blindness_cure);
        assert!(refusal(SMALL, &["translucency.shift_cure=1"]).contains("is 1, and takes true or false"));
        assert!(refusal(SMALL, &["translucency.reading=printed"]).contains("\"corrected\", \"paper\""));
    }

    #[test]
    fn settings_are_those_of_the_technique() {
        let both = format!("{SMALL}[truth]\nbounces = 3\n[prt]\nbands = 2\n[surface]\nalbedo = [1, 1, 1]\n");
        let scene = parse(&both, &[]).unwrap();
        assert_eq!(scene.settings(), parse(SMALL, &[]).unwrap().settings());
        let bands = prt::Settings::read(&scene.values).bands;
        assert_eq!((scene.truth.bounces, scene.truth.bands, bands), (Some(3), 0, 2));
        let environment = ["technique=prt", "light[0].kind=environment"];
        assert!(refusal(&both, &["technique=prt"]).contains("a.toml:7: light[0].kind: is point"));
        assert!(refusal(&both, &environment).contains("there is no such key"));
        let sun = both
            .replace("\"point\"", "\"directional\"")
            .replace("position = [0, 3, 3]", "direction = [0, -1, 0]");
        let scene =
            parse(&sun.replace("intensity", "irradiance"), &["technique=prt", "bend.angle=9"]).unwrap();
        let settings = scene.settings();
        assert_eq!((&settings["prt.bands"], &settings["bend.period"]), (&2.into(), &1.into()));
        assert_eq!(scene.surface.albedo, Vec3::ONE);
        assert!(settings.keys().all(|key| !key.starts_with("translucency") && !key.starts_with("truth")));
    }

    #[test]
    fn refusals_name_file_line_key_and_remedy() {
        let wrong = SMALL.replace("shape", "shpae");
        assert_eq!(refusal(&wrong, &[]), "a.toml:5: solid.shpae: there is no such key; did you mean shape?");
        let wrong = SMALL.replace("[0, 0, 4]", "[0, nan, 4]");
        assert!(
            refusal(&wrong, &[])
                .starts_with("a.toml:3: camera.position: is [0, NaN, 4], and takes three numbers")
        );
        let wrong = SMALL.replace("[solid]", "[sold]");
        assert!(refusal(&wrong, &[]).contains("did you mean [solid]?"));
        assert!(refusal("technique = \n", &[]).starts_with("a.toml:1: is no TOML"));
        assert!(refusal(&SMALL.replace("[[light]]", "[light]"), &[]).contains("with two brackets"));
        assert!(refusal("technique = \"fur\"", &[]).contains("there are translucency, "));
        assert!(refusal("", &[]).contains("technique: is missing"));
        let marbel = format!("{SMALL}[material]\nname = \"Marbel\"\n");
        assert!(refusal(&marbel, &[]).contains("a.toml:11: material.name"), "{}", refusal(&marbel, &[]));
        assert!(refusal(&marbel, &[]).contains("did you mean \"Marble\"?"));
        assert!(refusal(SMALL, &["image.width=0"]).contains("a whole number from 1 to 8192"));
        assert!(refusal(SMALL, &["camera.position=[0,0,0]"]).contains("looks nowhere"));
    }

    #[test]
    fn the_template_is_a_scene_and_every_default_is_accepted() {
        for technique in techniques::ALL {
            let scene = parse(&keys::template(technique), &[]).unwrap();
            assert_eq!(scene.technique, *technique);
        }
        for key in keys::all(techniques::ALL).into_iter().filter(|key| key.kind != Kind::Technique) {
            let text = key.default.unwrap_or(key.example);
            assert!(key.kind.accepts(&Value::parse(text).unwrap()), "{} = {text}", key.name);
        }
    }

    #[test]
    fn the_committed_schema_is_the_generated_one() {
        let committed: Json = serde_json::from_str(include_str!("../../scenes/schema.json")).unwrap();
        assert_eq!(
            committed,
            keys::schema(techniques::ALL),
            "run `bitlight init --schema > scenes/schema.json`"
        );
    }
}
