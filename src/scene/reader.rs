//! From the checked values of a file and `--set` to a [`Scene`].

use super::keys::{self, KEYS, Key};
use super::value::{self, Entry, Value, brief, path};
use super::{Model, Origin, Radiance, Scene, Solid, Source, Technique, Truth};
use crate::Error;
use crate::bake;
use crate::techniques::{prt, translucency};
use crate::truth::Filter;
use crate::world::brdf::{Brdf, Gloss};
use crate::world::camera::Camera;
use crate::world::deform::{Bend, Wave};
use crate::world::medium::{JENSEN_2001, Medium};
use glam::Vec3;
use serde_json::{Map, Value as Json};
use std::path::Path;

/// The checked values of a file, and of what is set beside it.
pub(super) struct Reader {
    entries: Vec<Entry>,
}

impl Reader {
    pub(super) fn new(text: &str, set: &[String]) -> Result<Self, Error> {
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

    pub(super) fn scene(&self, file: &Path) -> Result<Scene, Error> {
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
