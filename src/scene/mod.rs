//! Scenes: TOML files that say what to render. [`keys`] has every key, `reader.rs` checks a file against
//! them, [`Assets`] finds the files that it names.

pub mod keys;
mod reader;
mod value;

use crate::Error;
use crate::techniques::{prt, translucency};
use crate::truth::Filter;
use crate::world::brdf::Brdf;
use crate::world::camera::Camera;
use crate::world::deform::{Bend, Wave};
use crate::world::medium::Medium;
use glam::Vec3;
use reader::Reader;
use serde_json::{Map, Value as Json};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use value::Value;

/// The largest scene file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// What renders a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Technique {
    /// Translucent solids after Banterle and Chalmers.
    Translucency,
    /// Precomputed radiance transfer at vertices.
    Prt,
}

impl Technique {
    /// Its name in scenes and before the names of its passes, one of [`keys::TECHNIQUES`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Translucency => "translucency",
            Self::Prt => "prt",
        }
    }
}

/// A checked scene. Its lengths are in its own unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file it came from.
    pub file: PathBuf,
    /// Every setting that holds for its technique, given or by default, by its key: not those of other techniques nor
    /// of the ground truth, and of `[bend]` only where the scene has that table.
    pub settings: Map<String, Json>,
    /// The line of the file, from 1, of every key that it has.
    pub lines: BTreeMap<String, usize>,
    /// What renders it.
    pub technique: Technique,
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
    /// Who looks.
    pub camera: Camera,
    /// What is looked at.
    pub solid: Solid,
    /// What deforms it once it is placed.
    pub wave: Wave,
    /// What bends it then.
    pub bend: Bend,
    /// What it is made of.
    pub medium: Medium,
    /// Exponent of the highlight.
    pub gloss: f32,
    /// How its surface reflects, for techniques that read `[surface]`.
    pub surface: Brdf,
    /// What lights it, in the file's order.
    pub lights: Vec<Source>,
    /// The knobs of the translucency technique.
    pub translucency: translucency::Settings,
    /// The knobs of precomputed radiance transfer.
    pub prt: prt::Settings,
    /// What the ground truth traces.
    pub truth: Truth,
}

/// What the ground truth traces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Which transport; `None` for the technique's own.
    pub model: Option<Model>,
    /// Bands to which an environment is seen; 0 for the environment itself.
    pub bands: usize,
    /// The most reflections between points of the solid before the one to the eye; `None` for no limit.
    pub bounces: Option<usize>,
    /// Mean cosine of the scattering angle in the medium.
    pub anisotropy: f32,
    /// Where in a pixel its samples lie.
    pub filter: Filter,
}

/// A model of light transport.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Reflection between surfaces.
    Surface,
    /// Scattering in the medium.
    Medium,
    /// The dipole over the surface.
    Dipole,
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

/// Where a solid comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// A procedural shape, by its name in [`keys::SHAPES`].
    Shape {
        /// The name.
        name: String,
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

/// The folder of real models and probes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Assets(pub Option<PathBuf>);

impl Assets {
    /// The folder named by the variable `BITLIGHT_ASSETS`, if it is set.
    pub fn from_environment() -> Self {
        Self(std::env::var_os("BITLIGHT_ASSETS").map(PathBuf::from))
    }

    /// The path of an asset.
    ///
    /// # Errors
    /// Where no folder is known or the file is not there, naming the file and what to do.
    pub fn find(&self, name: &str) -> Result<PathBuf, Error> {
        let remedy = "give the folder of assets by --assets DIR or BITLIGHT_ASSETS";
        let Some(folder) = &self.0 else {
            return Err(Error::new("an asset, and no folder of assets is known").file(name).remedy(remedy));
        };
        let path = folder.join(name);
        if path.is_file() {
            Ok(path)
        } else {
            Err(Error::new("there is no such asset").file(path).remedy(remedy))
        }
    }
}

/// Every scene file (`.toml`) below a folder, in the order of their paths.
///
/// # Errors
/// A folder that cannot be read, naming it.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let refused = |error| {
        Error::new(format!("cannot be read: {error}"))
            .file(folder)
            .remedy("name the scenes, or go where they are")
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(refused)? {
        let path = entry.map_err(refused)?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

impl Scene {
    /// Reads and checks a scene file; `set` holds assignments `key=value` that override it.
    ///
    /// # Errors
    /// What is missing, unknown or out of range, naming file, line, key and remedy.
    pub fn read(file: &Path, set: &[String]) -> Result<Self, Error> {
        let refused = |error: std::io::Error| {
            Error::new(format!("cannot be read: {error}"))
                .file(file)
                .remedy("`bitlight init translucency` writes a scene to start from")
        };
        let mut bytes = Vec::new();
        // What is no plain file has no length: it is read to one byte beyond the limit at most.
        let read =
            std::fs::File::open(file).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
        if read.map_err(refused)? as u64 > MAX_BYTES {
            return Err(Error::new(format!("is longer than {MAX_BYTES} bytes, the most of a scene"))
                .file(file)
                .remedy("check that it is a scene, and leave out what it does not need"));
        }
        let text = std::str::from_utf8(&bytes).map_err(|error| {
            let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
            Error::new("is not UTF-8 text").file(file).line(line).remedy("save the scene as UTF-8")
        })?;
        Self::parse(text, file, set)
    }

    /// Checks the text of a scene; `file` is only named in errors.
    ///
    /// # Errors
    /// What is missing, unknown or out of range, naming file, line, key and remedy.
    pub fn parse(text: &str, file: &Path, set: &[String]) -> Result<Self, Error> {
        Reader::new(text, set).and_then(|reader| reader.scene(file)).map_err(|error| error.file(file))
    }

    /// The assets that the scene names.
    pub fn assets(&self) -> Vec<&str> {
        let solid = match &self.solid.origin {
            Origin::File(name) => Some(name.as_str()),
            Origin::Shape { .. } => None,
        };
        let environments = self.lights.iter().filter_map(|light| match light {
            Source::Environment { radiance: Radiance::File(name), .. } => Some(name.as_str()),
            _ => None,
        });
        solid.into_iter().chain(environments).collect()
    }

    /// Puts an error that names no file at the scene's file, and at the line of its key.
    pub fn place(&self, error: Error) -> Error {
        let line = error.key.as_ref().and_then(|key| self.lines.get(key)).copied();
        match line.filter(|_| error.file.is_none()) {
            Some(line) => error.file(&self.file).line(line),
            None => error.file(&self.file),
        }
    }

    /// The scene at another time, in seconds: what `--set time=…` makes of it.
    #[must_use]
    pub fn at(&self, time: f64) -> Self {
        let mut scene = Self { time, ..self.clone() };
        scene.settings.insert("time".into(), Value::Number(time).to_json());
        scene
    }

    /// The file's name without folder and ending: the NAME of what is written.
    pub fn name(&self) -> String {
        self.file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::keys::KEYS;
    use super::*;

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
        assert_eq!((scene.size, scene.camera.fov, scene.translucency.shadow), ([512, 512], 40.0, 512));
        assert_eq!(scene.settings["translucency.blur"], 8);
        assert_eq!(scene.settings["light[0].kind"], "point");
    }

    #[test]
    fn set_overrides_and_is_checked_like_the_file() {
        let set = ["translucency.cubemap=32", "material.name=Skin1", "light[0].intensity=[1,2,3]"];
        let scene = parse(SMALL, &set).unwrap();
        assert_eq!(scene.translucency.cubemap, 32);
        assert_eq!(scene.settings["material.name"], "Skin1");
        assert!(refusal(SMALL, &["translucency.cubmap=32"]).contains("did you mean cubemap?"));
        assert!(refusal(SMALL, &["light[3].intensity=[1,2,3]"]).contains("no such light"));
        assert!(refusal(SMALL, &["camera.fov"]).contains("there is no ="));
    }

    #[test]
    fn the_readings_and_switches_of_translucency_are_read() {
        use translucency::{Evaluation, Reading};
        let ours = parse(SMALL, &[]).unwrap().translucency;
        assert_eq!(
            (ours.reading, ours.evaluation, ours.smallest_d),
            (Reading::Corrected, Evaluation::Pixel, None)
        );
        assert!(ours.second_layer && ours.shift_cure && ours.blindness_cure);
        assert_eq!(ours.accumulation, 1);
        let of = |set: &str| parse(SMALL, &[&format!("translucency.{set}")]).unwrap().translucency;
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
        assert_eq!(scene.settings, parse(SMALL, &[]).unwrap().settings);
        assert_eq!((scene.truth.bounces, scene.truth.bands, scene.prt.bands), (Some(3), 0, 2));
        let environment = ["technique=prt", "light[0].kind=environment"];
        assert!(refusal(&both, &["technique=prt"]).contains("a.toml:7: light[0].kind: is point"));
        assert!(refusal(&both, &environment).contains("there is no such key"));
        let sun = both
            .replace("\"point\"", "\"directional\"")
            .replace("position = [0, 3, 3]", "direction = [0, -1, 0]");
        let scene =
            parse(&sun.replace("intensity", "irradiance"), &["technique=prt", "bend.angle=9"]).unwrap();
        assert_eq!((&scene.settings["prt.bands"], &scene.settings["bend.period"]), (&2.into(), &1.into()));
        assert_eq!(scene.surface.albedo, Vec3::ONE);
        assert!(
            scene.settings.keys().all(|key| !key.starts_with("translucency") && !key.starts_with("truth"))
        );
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
        assert!(refusal("technique = \"fur\"", &[]).contains("one of \"translucency\""));
        assert!(refusal("", &[]).contains("technique: is missing"));
        let marbel = format!("{SMALL}[material]\nname = \"Marbel\"\n");
        assert!(refusal(&marbel, &[]).contains("a.toml:11: material.name"), "{}", refusal(&marbel, &[]));
        assert!(refusal(&marbel, &[]).contains("did you mean \"Marble\"?"));
        assert!(refusal(SMALL, &["image.width=0"]).contains("a whole number from 1 to 8192"));
        assert!(refusal(SMALL, &["camera.position=[0,0,0]"]).contains("looks nowhere"));
    }

    #[test]
    fn the_template_is_a_scene_and_every_default_is_accepted() {
        for technique in keys::TECHNIQUES {
            let scene = parse(&keys::template(technique), &[]).unwrap();
            assert_eq!(scene.technique.name(), *technique);
        }
        for key in KEYS {
            let text = key.default.unwrap_or(key.example);
            assert!(key.kind.accepts(&Value::parse(text).unwrap()), "{} = {text}", key.name);
        }
    }

    #[test]
    fn the_committed_schema_is_the_generated_one() {
        let committed: Json = serde_json::from_str(include_str!("../../scenes/schema.json")).unwrap();
        assert_eq!(committed, keys::schema(), "run `bitlight init --schema > scenes/schema.json`");
    }
}
