//! Scenes: TOML files that say what to render. [`keys`] has every key, [`Scene::parse`] checks a file against
//! them, [`Assets`] finds the files that it names.

pub mod keys;
mod value;

use crate::Error;
use crate::bake;
use crate::techniques::{prt, translucency};
use crate::truth::Filter;
use crate::world::brdf::{Brdf, Gloss};
use crate::world::camera::Camera;
use crate::world::deform::{Bend, Wave};
use crate::world::medium::{JENSEN_2001, Medium};
use glam::Vec3;
use keys::{KEYS, Key};
use serde_json::{Map, Value as Json};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use value::{Entry, Value, brief, path};

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

/// The checked values of a file, and those that were looked at.
struct Reader {
    entries: Vec<Entry>,
}

impl Reader {
    fn new(text: &str, set: &[String]) -> Result<Self, Error> {
        let mut entries = value::entries(text)?;
        for assignment in set {
            let override_ = assigned(assignment)?;
            let lights = entries.iter().filter(|entry| entry.table.starts_with("light[")).count();
            if override_.table.starts_with("light[")
                && (lights == 0 || !entries.iter().any(|entry| entry.table == override_.table))
            {
                return Err(Error::new("the scene has no such light")
                    .key(override_.path())
                    .remedy("lights count from light[0]"));
            }
            entries.retain(|entry| entry.path() != override_.path());
            entries.push(override_);
        }
        let reader = Self { entries };
        for entry in &reader.entries {
            reader.check(entry)?;
        }
        Ok(reader)
    }

    /// Whether an entry's key exists and takes its value.
    fn check(&self, entry: &Entry) -> Result<(), Error> {
        let error = |what: String| {
            let error = Error::new(what).key(brief(&entry.path()));
            if let Some(line) = entry.line { error.line(line) } else { error }
        };
        let table = entry.table.split('[').next().unwrap_or_default();
        let indexed = entry.table != table;
        let known = |name: &str| KEYS.iter().any(|key| key.table.split(':').next() == Some(name));
        if indexed != (table == "light") || (!table.is_empty() && !known(table)) {
            let near =
                crate::nearest(table, KEYS.iter().map(|key| key.table).filter(|name| !name.contains(':')));
            let remedy = match (table, near) {
                ("light", _) => "write [[light]], with two brackets: there can be several".to_owned(),
                (_, Some(near)) => format!("did you mean [{near}]?"),
                _ => "the tables are [image], [camera], [solid], [wave], [bend], [material], [surface], [[light]], \
                     [truth] and the technique's"
                    .to_owned(),
            };
            return Err(error(format!("there is no table {}", brief(&entry.table))).remedy(remedy));
        }
        let kind = self.entries.iter().find(|other| other.table == entry.table && other.name == "kind");
        let kind = match kind.map(|kind| &kind.value) {
            Some(Value::Text(kind)) if table == "light" => format!("light:{kind}"),
            _ => table.to_owned(),
        };
        let own = |key: &&Key| key.table == table || key.table == kind;
        let Some(key) = KEYS.iter().filter(own).find(|key| key.name == entry.name) else {
            let names = KEYS.iter().filter(own).map(|key| key.name);
            let remedy = match crate::nearest(&entry.name, names.clone()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("the keys here are {}", names.collect::<Vec<_>>().join(", ")),
            };
            return Err(error("there is no such key".into()).remedy(remedy));
        };
        if key.kind.accepts(&entry.value) {
            Ok(())
        } else {
            Err(error(format!("is {}, and takes {}", entry.value, key.kind.describe())).remedy(key.about))
        }
    }

    fn entry(&self, table: &str, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.table == table && entry.name == name)
    }

    /// Puts an error at a key, with its line if the file has it.
    fn at(&self, table: &str, name: &str, error: Error) -> Error {
        let error = error.key(path(table, name));
        match self.entry(table, name).and_then(|entry| entry.line) {
            Some(line) => error.line(line),
            None => error,
        }
    }

    fn error(&self, table: &str, name: &str, what: &str) -> Error {
        self.at(table, name, Error::new(what))
    }

    /// The value of a key, its default, or nothing.
    fn value(&self, table: &str, name: &str) -> Option<Value> {
        let given = self.entry(table, name).map(|entry| entry.value.clone());
        let base = table.split('[').next().unwrap_or_default();
        given.or_else(|| {
            let key =
                KEYS.iter().find(|key| key.table.split(':').next() == Some(base) && key.name == name)?;
            Value::parse(key.default?).ok()
        })
    }

    fn required(&self, table: &str, name: &str) -> Result<Value, Error> {
        self.value(table, name).ok_or_else(|| {
            let key = KEYS.iter().find(|key| {
                key.name == name && table.starts_with(key.table.split(':').next().unwrap_or_default())
            });
            let example =
                key.map(|key| format!("write for example {name} = {}", key.example)).unwrap_or_default();
            self.error(table, name, "is missing").remedy(example)
        })
    }

    fn text(&self, table: &str, name: &str) -> Option<String> {
        match self.value(table, name)? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    fn number(&self, table: &str, name: &str) -> Option<f64> {
        match self.value(table, name)? {
            Value::Number(number) => Some(number),
            _ => None,
        }
    }

    /// A key that has a default and passed [`Self::check`].
    fn flag(&self, table: &str, name: &str) -> bool {
        matches!(self.value(table, name), Some(Value::Flag(true)))
    }

    fn vector(&self, table: &str, name: &str) -> Result<Vec3, Error> {
        match self.required(table, name)? {
            Value::Numbers(all) if all.len() == 3 => {
                Ok(Vec3::new(all[0] as f32, all[1] as f32, all[2] as f32))
            }
            _ => Err(self.error(table, name, "takes three numbers")),
        }
    }

    /// A key that has a default and passed [`Self::check`].
    fn whole(&self, table: &str, name: &str) -> usize {
        self.number(table, name).unwrap_or_default() as usize
    }

    fn real(&self, table: &str, name: &str) -> f32 {
        self.number(table, name).unwrap_or_default() as f32
    }

    fn scene(&self, file: &Path) -> Result<Scene, Error> {
        let technique = match self.required("", "technique")? {
            Value::Text(name) if name == "prt" => Technique::Prt,
            _ => Technique::Translucency,
        };
        let millimetres = match self.text("", "unit").as_deref() {
            Some("mm") => 1.0,
            Some("cm") => 10.0,
            _ => 1000.0,
        };
        let (medium, gloss) = self.material(millimetres)?;
        let mut lights = Vec::new();
        while self.entries.iter().any(|entry| entry.table == format!("light[{}]", lights.len())) {
            let table = format!("light[{}]", lights.len());
            let light = self.light(&table)?;
            if technique == Technique::Prt && matches!(light, Source::Point { .. }) {
                let error = self.error(&table, "kind", "is point, and prt takes light from far away alone");
                return Err(error.remedy("make it directional, with the irradiance at the solid"));
            }
            lights.push(light);
        }
        if lights.is_empty() {
            let kind = if technique == Technique::Prt { "environment" } else { "point" };
            return Err(Error::new("the scene has no light")
                .key("light")
                .remedy(format!("add [[light]] with kind = \"{kind}\"")));
        }
        Ok(Scene {
            file: file.into(),
            settings: self.settings(technique),
            lines: self.entries.iter().filter_map(|entry| Some((entry.path(), entry.line?))).collect(),
            technique,
            time: self.number("", "time").unwrap_or_default(),
            frame_rate: self.number("", "frame_rate").unwrap_or_default(),
            size: [self.whole("image", "width"), self.whole("image", "height")],
            background: self.vector("image", "background")?,
            exposure: self.real("image", "exposure"),
            camera: self.camera()?,
            solid: self.solid()?,
            wave: self.wave(),
            bend: self.bend(),
            medium,
            gloss,
            surface: self.surface()?,
            lights,
            translucency: self.translucency(),
            prt: self.prt(),
            truth: self.truth(),
        })
    }

    fn prt(&self) -> prt::Settings {
        let table = "prt";
        prt::Settings {
            bands: self.whole(table, "bands"),
            directions: self.whole(table, "directions"),
            method: match self.text(table, "method").as_deref() {
                Some("quadrature") => bake::Estimate::Plain,
                _ => bake::Estimate::Control,
            },
            reading: match self.text(table, "reading").as_deref() {
                Some("paper") => bake::Reading::Printed,
                _ => bake::Reading::Corrected,
            },
            bounces: self.whole(table, "bounces"),
            subsurface: match self.text(table, "subsurface").as_deref() {
                Some("dipole") => prt::Subsurface::Dipole,
                _ => prt::Subsurface::None,
            },
            poses: self.whole(table, "poses"),
        }
    }

    fn truth(&self) -> Truth {
        Truth {
            model: match self.text("truth", "model").as_deref() {
                Some("surface") => Some(Model::Surface),
                Some("medium") => Some(Model::Medium),
                Some("dipole") => Some(Model::Dipole),
                _ => None,
            },
            bands: self.whole("truth", "bands"),
            bounces: self.number("truth", "bounces").map(|bounces| bounces as usize),
            anisotropy: self.real("truth", "anisotropy"),
            filter: match self.text("truth", "filter").as_deref() {
                Some("box") => Filter::Box,
                _ => Filter::Point,
            },
        }
    }

    fn translucency(&self) -> translucency::Settings {
        let table = "translucency";
        translucency::Settings {
            cubemap: self.whole(table, "cubemap"),
            shadow: self.whole(table, "shadow"),
            blur: self.whole(table, "blur"),
            reading: match self.text(table, "reading").as_deref() {
                Some("paper") => translucency::Reading::Paper,
                _ => translucency::Reading::Corrected,
            },
            smallest_d: self.number(table, "smallest_d").map(|d| d as f32),
            evaluation: match self.text(table, "evaluation").as_deref() {
                Some("vertex") => translucency::Evaluation::Vertex,
                _ => translucency::Evaluation::Pixel,
            },
            second_layer: self.flag(table, "second_layer"),
            shift_cure: self.flag(table, "shift_cure"),
            blindness_cure: self.flag(table, "blindness_cure"),
            show: match self.text(table, "show").as_deref() {
                Some("direct") => translucency::Show::Direct,
                Some("scattered") => translucency::Show::Scattered,
                _ => translucency::Show::All,
            },
            accumulation: self.whole(table, "accumulation"),
            fit: match self.text(table, "fit").as_deref() {
                Some("solid") => translucency::Fit::Solid,
                _ => translucency::Fit::Box,
            },
        }
    }

    fn camera(&self) -> Result<Camera, Error> {
        let camera = Camera {
            position: self.vector("camera", "position")?,
            target: self.vector("camera", "target")?,
            up: self.vector("camera", "up")?,
            fov: self.real("camera", "fov"),
        };
        // A direction whose square underflows has no length either.
        if (camera.target - camera.position).try_normalize().is_none() {
            let error = self.error("camera", "position", "is the target: the camera looks nowhere");
            return Err(error.remedy("move one of the two"));
        }
        if camera.up.try_normalize().is_none() {
            let error = self.error("camera", "up", "is zero");
            return Err(error.remedy("give the direction that is upward in the picture, such as [0, 1, 0]"));
        }
        Ok(camera)
    }

    fn solid(&self) -> Result<Solid, Error> {
        let origin = match (self.text("solid", "shape"), self.text("solid", "file")) {
            (Some(name), None) => {
                let extents = self.vector("solid", "extents")?;
                // Thinner, and `f32` no longer tells the depths of two opposite faces apart.
                let least = extents.max_element() * 1e-5;
                if extents.min_element() <= 0.0 || extents.min_element() < least {
                    return Err(self
                        .error("solid", "extents", "have a side of under a hundred-thousandth of the longest")
                        .remedy("give each side a length; 0.001 of the longest makes a sheet"));
                }
                Origin::Shape { name, resolution: self.whole("solid", "resolution"), extents }
            }
            (None, Some(file)) => Origin::File(file),
            (Some(_), Some(_)) => {
                return Err(self.error("solid", "file", "stands beside shape").remedy("keep one of the two"));
            }
            (None, None) => {
                let remedy =
                    format!("write shape = \"torus-knot\", or another of {}", keys::SHAPES.join(", "));
                return Err(self.error("solid", "shape", "is missing, and so is file").remedy(remedy));
            }
        };
        let size = self.number("solid", "size").map(|size| size as f32);
        let (triangles, turn) = (self.whole("solid", "triangles"), self.real("solid", "turn"));
        Ok(Solid { origin, triangles, size, turn, center: self.vector("solid", "center")? })
    }

    fn wave(&self) -> Wave {
        let [amplitude, length, period] =
            ["amplitude", "length", "period"].map(|name| self.number("wave", name).unwrap_or_default());
        Wave { amplitude, length, period }
    }

    fn bend(&self) -> Bend {
        let [angle, length, root, period] =
            ["angle", "length", "root", "period"].map(|name| self.number("bend", name).unwrap_or_default());
        Bend { angle, length, root, period }
    }

    fn surface(&self) -> Result<Brdf, Error> {
        Ok(Brdf {
            albedo: self.vector("surface", "albedo")?,
            specular: self.vector("surface", "specular")?,
            gloss: match self.text("surface", "highlight").as_deref() {
                Some("phong") => Gloss::Phong { exponent: self.real("surface", "exponent") },
                Some("cook-torrance") => Gloss::CookTorrance { roughness: self.real("surface", "roughness") },
                _ => Gloss::None,
            },
        })
    }

    fn material(&self, millimetres: f32) -> Result<(Medium, f32), Error> {
        let given = |name| self.entry("material", name).is_some();
        let eta = self.number("material", "eta").map(|eta| eta as f32);
        let medium = if given("scattering") || given("absorption") {
            if given("name") {
                let error = self.error("material", "name", "stands beside scattering or absorption");
                return Err(error.remedy("keep the name or the coefficients"));
            }
            let scattering = self.vector("material", "scattering")?;
            let absorption = self.vector("material", "absorption")?;
            if (scattering + absorption).min_element() <= 0.0 {
                let error = self.error("material", "scattering", "and absorption are both zero in a channel");
                return Err(error.remedy("give each channel a coefficient above 0"));
            }
            Medium::new(scattering.to_array(), absorption.to_array(), eta.unwrap_or(1.3), millimetres)
        } else {
            let name = self.text("material", "name").unwrap_or_else(|| "Marble".into());
            let Some(row) = JENSEN_2001.iter().find(|row| row.0 == name) else {
                let names: Vec<_> = JENSEN_2001.iter().map(|row| row.0).collect();
                return Err(self.at("material", "name", crate::unknown("material", &name, &names)));
            };
            Medium::new(row.1, row.2, eta.unwrap_or(row.3), millimetres)
        };
        Ok((medium, self.real("material", "gloss")))
    }

    fn light(&self, table: &str) -> Result<Source, Error> {
        let kind = self.required(table, "kind")?;
        Ok(match &kind {
            Value::Text(kind) if kind == "point" => Source::Point {
                position: self.vector(table, "position")?,
                intensity: self.vector(table, "intensity")?,
            },
            Value::Text(kind) if kind == "directional" => {
                let direction = self.vector(table, "direction")?.try_normalize().ok_or_else(|| {
                    self.error(table, "direction", "is zero, or nearly")
                        .remedy("give the direction in which the light travels")
                })?;
                Source::Directional { direction, irradiance: self.vector(table, "irradiance")? }
            }
            _ => Source::Environment { radiance: self.radiance(table)?, scale: self.real(table, "scale") },
        })
    }

    fn radiance(&self, table: &str) -> Result<Radiance, Error> {
        let given = ["file", "probe", "radiance"].map(|name| self.entry(table, name).is_some());
        if given.iter().filter(|given| **given).count() != 1 {
            let error = self.error(table, "kind", "an environment takes one of file, probe and radiance");
            return Err(error.remedy("write for example probe = \"eucalyptus\""));
        }
        if let Some(name) = self.text(table, "probe") {
            crate::sphere::probes::probe(&name).map_err(|error| self.at(table, "probe", error))?;
            return Ok(Radiance::Probe(name));
        }
        match self.text(table, "file") {
            Some(file) => Ok(Radiance::File(file)),
            None => Ok(Radiance::Constant(self.vector(table, "radiance")?)),
        }
    }

    /// All settings that hold for the technique: given ones and defaults.
    fn settings(&self, technique: Technique) -> Map<String, Json> {
        let mut settings = Map::new();
        let bent = self.entries.iter().any(|entry| entry.table == "bend");
        let listed = |table: &str| match table {
            "truth" => false,
            "bend" => bent,
            _ => keys::reads(technique.name(), table) && !table.starts_with("light"),
        };
        let defaults = KEYS.iter().filter(|key| listed(key.table));
        for key in defaults {
            if let Some(value) = self.value(key.table, key.name) {
                settings.insert(path(key.table, key.name), value.to_json());
            }
        }
        for entry in self.entries.iter().filter(|entry| entry.table.starts_with("light[")) {
            settings.insert(entry.path(), entry.value.to_json());
        }
        settings
    }
}

/// Reads `table.key=value` as `--set` has it; a value that is no TOML is taken for text.
fn assigned(assignment: &str) -> Result<Entry, Error> {
    let Some((key, text)) = assignment.split_once('=') else {
        let remedy = "write for example --set translucency.cubemap=32";
        return Err(Error::new(format!("--set {}: there is no =", brief(assignment))).remedy(remedy));
    };
    let (table, name) = key.trim().rsplit_once('.').unwrap_or(("", key.trim()));
    let value = Value::parse(text.trim()).unwrap_or_else(|_| Value::Text(text.trim().into()));
    Ok(Entry { table: table.into(), name: name.into(), value, line: None })
}

#[cfg(test)]
mod tests {
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
