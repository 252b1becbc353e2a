//! From the checked values of a file and `--set` to a [`Scene`].

use super::{Origin, Radiance, Scene, Shape, Solid, Source};
use crate::Error;
use crate::keys::{Values, names};
use crate::techniques::Technique;
use crate::truth;
use crate::world::brdf::{Brdf, Gloss};
use crate::world::camera::Camera;
use crate::world::deform::{Bend, Wave};
use crate::world::medium::{JENSEN_2001, Medium};
use std::path::Path;

/// The millimetres of a scene's unit.
const UNITS: [(&str, f32); 3] = [("m", 1000.0), ("cm", 10.0), ("mm", 1.0)];
pub(super) const UNIT_NAMES: [&str; 3] = names(&UNITS);

const SHAPES: [(&str, Shape); 4] = [
    ("sphere", Shape::Sphere),
    ("torus-knot", Shape::TorusKnot),
    ("genus-3", Shape::Genus3),
    ("cuboid", Shape::Cuboid),
];
pub(super) const SHAPE_NAMES: [&str; 4] = names(&SHAPES);

/// Reads what a word stands for.
type Read<T> = fn(&Values) -> T;
/// Reads what a word stands for, from a table of its own.
type ReadTable<T> = fn(&Values, &str) -> Result<T, Error>;

/// How the highlight is read that each word names.
const HIGHLIGHTS: [(&str, Read<Gloss>); 3] = [
    ("none", |_| Gloss::None),
    ("phong", |values| Gloss::Phong { exponent: values.real("surface", "exponent") }),
    ("cook-torrance", |values| Gloss::CookTorrance { roughness: values.real("surface", "roughness") }),
];
pub(super) const HIGHLIGHT_NAMES: [&str; 3] = names(&HIGHLIGHTS);

/// How a light of each kind is read, from its own table.
const LIGHTS: [(&str, ReadTable<Source>); 3] =
    [("point", point), ("directional", directional), ("environment", environment)];
pub(super) const LIGHT_NAMES: [&str; 3] = names(&LIGHTS);

/// Makes the scene that the values describe. Its technique is one of `techniques`.
///
/// # Errors
/// What is missing, and what does not fit together, by its key and line.
pub(super) fn scene(values: Values, techniques: &[&'static Technique], file: &Path) -> Result<Scene, Error> {
    let names: Vec<_> = techniques.iter().map(|technique| technique.name).collect();
    let name = values.text("", "technique").ok_or_else(|| {
        let example = format!("write for example technique = \"{}\"", names[0]);
        values.error("", "technique", "is missing").remedy(example)
    })?;
    let found = techniques.iter().copied().find(|technique| technique.name == name);
    let technique =
        found.ok_or_else(|| values.at("", "technique", crate::unknown("technique", name, &names)))?;
    let (medium, gloss) = material(&values)?;
    let surface = Brdf {
        albedo: values.vector("surface", "albedo")?,
        specular: values.vector("surface", "specular")?,
        gloss: values.word("surface", "highlight", &HIGHLIGHTS)(&values),
    };
    let lights = lights(&values, technique)?;
    Ok(Scene {
        file: file.into(),
        technique,
        time: values.double("", "time"),
        frame_rate: values.double("", "frame_rate"),
        size: [values.whole("image", "width"), values.whole("image", "height")],
        background: values.vector("image", "background")?,
        exposure: values.real("image", "exposure"),
        camera: camera(&values)?,
        solid: solid(&values)?,
        wave: wave(&values),
        bend: bend(&values),
        medium,
        gloss,
        surface,
        lights,
        truth: truth::Settings::read(&values),
        values,
    })
}

fn lights(values: &Values, technique: &Technique) -> Result<Vec<Source>, Error> {
    let mut lights = Vec::new();
    while values.has(&format!("light[{}]", lights.len())) {
        let table = format!("light[{}]", lights.len());
        let kind = values.required(&table, "kind")?;
        if !technique.lights.contains(&kind) {
            let what = format!("is {kind}, and {} takes {}", technique.name, technique.lights.join(" or "));
            return Err(values.error(&table, "kind", &what).remedy(technique.other_light));
        }
        lights.push(values.word(&table, "kind", &LIGHTS)(values, &table)?);
    }
    if lights.is_empty() {
        let example = format!("add [[light]] with kind = \"{}\"", technique.lights[0]);
        return Err(Error::new("the scene has no light").key("light").remedy(example));
    }
    Ok(lights)
}

fn point(values: &Values, table: &str) -> Result<Source, Error> {
    let (position, intensity) = (values.vector(table, "position")?, values.vector(table, "intensity")?);
    Ok(Source::Point { position, intensity })
}

fn directional(values: &Values, table: &str) -> Result<Source, Error> {
    let direction = values.vector(table, "direction")?.try_normalize().ok_or_else(|| {
        values
            .error(table, "direction", "is zero, or nearly")
            .remedy("give the direction in which the light travels")
    })?;
    Ok(Source::Directional { direction, irradiance: values.vector(table, "irradiance")? })
}

fn environment(values: &Values, table: &str) -> Result<Source, Error> {
    Ok(Source::Environment { radiance: radiance(values, table)?, scale: values.real(table, "scale") })
}

fn radiance(values: &Values, table: &str) -> Result<Radiance, Error> {
    let given = ["file", "probe", "radiance"].map(|name| values.given(table, name));
    if given.iter().filter(|given| **given).count() != 1 {
        let error = values.error(table, "kind", "an environment takes one of file, probe and radiance");
        return Err(error.remedy("write for example probe = \"eucalyptus\""));
    }
    if let Some(name) = values.text(table, "probe") {
        crate::sphere::probes::probe(name).map_err(|error| values.at(table, "probe", error))?;
        return Ok(Radiance::Probe(name.into()));
    }
    match values.text(table, "file") {
        Some(file) => Ok(Radiance::File(file.into())),
        None => Ok(Radiance::Constant(values.vector(table, "radiance")?)),
    }
}

fn camera(values: &Values) -> Result<Camera, Error> {
    let camera = Camera {
        position: values.vector("camera", "position")?,
        target: values.vector("camera", "target")?,
        up: values.vector("camera", "up")?,
        fov: values.real("camera", "fov"),
    };
    // A direction whose square underflows has no length either.
    if (camera.target - camera.position).try_normalize().is_none() {
        let error = values.error("camera", "position", "is the target: the camera looks nowhere");
        return Err(error.remedy("move one of the two"));
    }
    if camera.up.try_normalize().is_none() {
        let error = values.error("camera", "up", "is zero");
        return Err(error.remedy("give the direction that is upward in the picture, such as [0, 1, 0]"));
    }
    Ok(camera)
}

fn solid(values: &Values) -> Result<Solid, Error> {
    let origin = match (values.word_if("solid", "shape", &SHAPES), values.text("solid", "file")) {
        (Some(shape), None) => {
            let extents = values.vector("solid", "extents")?;
            // In a thinner one, `f32` no longer tells the depths of two opposite faces apart.
            let least = extents.max_element() * 1e-5;
            if extents.min_element() <= 0.0 || extents.min_element() < least {
                return Err(values
                    .error("solid", "extents", "have a side of under a hundred-thousandth of the longest")
                    .remedy("give each side a length; 0.001 of the longest makes a sheet"));
            }
            Origin::Shape { shape, resolution: values.whole("solid", "resolution"), extents }
        }
        (None, Some(file)) => Origin::File(file.into()),
        (Some(_), Some(_)) => {
            return Err(values.error("solid", "file", "stands beside shape").remedy("keep one of the two"));
        }
        (None, None) => {
            let remedy = format!("write shape = \"torus-knot\", or another of {}", SHAPE_NAMES.join(", "));
            return Err(values.error("solid", "shape", "is missing, and so is file").remedy(remedy));
        }
    };
    let size = values.number("solid", "size").map(|size| size as f32);
    let (triangles, turn) = (values.whole("solid", "triangles"), values.real("solid", "turn"));
    Ok(Solid { origin, triangles, size, turn, center: values.vector("solid", "center")? })
}

fn wave(values: &Values) -> Wave {
    let [amplitude, length, period] =
        ["amplitude", "length", "period"].map(|name| values.double("wave", name));
    Wave { amplitude, length, period }
}

fn bend(values: &Values) -> Bend {
    let [angle, length, root, period] =
        ["angle", "length", "root", "period"].map(|name| values.double("bend", name));
    Bend { angle, length, root, period }
}

fn material(values: &Values) -> Result<(Medium, f32), Error> {
    let millimetres = values.word("", "unit", &UNITS);
    let given = |name| values.given("material", name);
    let eta = values.number("material", "eta").map(|eta| eta as f32);
    let medium = if given("scattering") || given("absorption") {
        if given("name") {
            let error = values.error("material", "name", "stands beside scattering or absorption");
            return Err(error.remedy("keep the name or the coefficients"));
        }
        let scattering = values.vector("material", "scattering")?;
        let absorption = values.vector("material", "absorption")?;
        if (scattering + absorption).min_element() <= 0.0 {
            let error = values.error("material", "scattering", "and absorption are both zero in a channel");
            return Err(error.remedy("give each channel a coefficient above 0"));
        }
        Medium::new(scattering.to_array(), absorption.to_array(), eta.unwrap_or(1.3), millimetres)
    } else {
        let name = values.text("material", "name").unwrap_or("Marble");
        let Some(row) = JENSEN_2001.iter().find(|row| row.0 == name) else {
            let names: Vec<_> = JENSEN_2001.iter().map(|row| row.0).collect();
            return Err(values.at("material", "name", crate::unknown("material", name, &names)));
        };
        Medium::new(row.1, row.2, eta.unwrap_or(row.3), millimetres)
    };
    Ok((medium, values.real("material", "gloss")))
}
