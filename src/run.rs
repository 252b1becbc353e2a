//! From a scene to its passes: the one place that knows every technique.

pub mod truth;

pub use truth::{TRUTH, Truth};

use crate::Error;
use crate::numeric::double;
use crate::pass::{Axis, Buffer, Info, Kept, Pass, Recorder, closure, execute};
use crate::scene::{Assets, Origin, Radiance, Scene, Solid, Source, Technique};
use crate::sphere::environment::{Environment, Form, LatLong};
use crate::sphere::probes;
use crate::techniques::{prt, translucency};
use crate::world::brdf::Gloss;
use crate::world::decimate::decimate;
use crate::world::light::Light;
use crate::world::mesh::Mesh;
use crate::world::{obj, shapes};
use glam::{Mat3, Vec3};
use serde_json::{Map, Value as Json};

/// The most bytes that a request may need, as [`memory`] counts them.
pub const MAX_MEMORY: u64 = 8 << 30;

/// The least and the greatest radius of a solid's bounding box, in the scene's unit: beyond them squares and products
/// of lengths leave the range of `f32`.
pub const RADII: [f32; 2] = [1e-12, 1e15];

/// Every pass of every technique, in flow order.
pub fn passes() -> impl Iterator<Item = &'static Info> {
    passes_of(Technique::Translucency).chain(passes_of(Technique::Prt))
}

/// Every pass of a technique, in flow order.
pub fn passes_of(technique: Technique) -> impl Iterator<Item = &'static Info> {
    fn infos<F>(table: &'static [Pass<F>]) -> Vec<&'static Info> {
        table.iter().map(|pass| &pass.info).collect()
    }
    match technique {
        Technique::Translucency => infos(&translucency::PASSES),
        Technique::Prt => infos(&prt::PASSES),
    }
    .into_iter()
}

/// The passes of a technique that a request for some needs, in flow order.
fn needed(technique: Technique, wanted: &[&str]) -> Result<Vec<&'static Info>, Error> {
    let needed = match technique {
        Technique::Translucency => closure(&translucency::PASSES, wanted),
        Technique::Prt => closure(&prt::PASSES, wanted),
    }?;
    Ok(passes_of(technique).zip(needed).filter(|(_, needed)| *needed).map(|(info, _)| info).collect())
}

/// The names of the passes of a technique that a request means: `final`, `all`, or names separated by commas, with or
/// without the technique before them.
///
/// # Errors
/// An unknown name, with the nearest known one.
pub fn wanted(technique: Technique, request: &str) -> Result<Vec<&'static str>, Error> {
    let all = passes_of(technique).map(|info| info.name);
    if request == "all" {
        return Ok(all.collect());
    }
    let short = |name: &'static str| name.split_once('.').map_or("", |(_, short)| short);
    let names: Vec<_> = all.collect();
    let one = |name: &str| {
        names.iter().find(|full| **full == name || short(full) == name).copied().ok_or_else(|| {
            let near = crate::nearest(name, names.iter().flat_map(|full| [*full, short(full)]))
                .map(|near| format!("did you mean \"{near}\"? "))
                .unwrap_or_default();
            Error::new(format!("there is no pass \"{name}\" of {}", technique.name()))
                .remedy(format!("{near}`bitlight passes {}` lists all", technique.name()))
        })
    };
    request.split(',').map(|name| one(name.trim())).collect()
}

/// Renders the wanted passes of a scene, and what they need, into a recorder.
///
/// # Errors
/// More than [`MAX_MEMORY`], before anything is allocated; a missing or unusable asset, a scene that cannot be
/// rendered, and what the recorder refuses.
///
/// ```
/// use bitlight::pass::Kept;
/// use bitlight::scene::{Assets, Scene};
///
/// let text = r#"
/// technique = "translucency"
/// image = { width = 32, height = 32 }
/// camera = { position = [0, 0, 4] }
/// solid = { shape = "sphere", resolution = 8 }
/// light = [{ kind = "point", position = [0, 3, -3], intensity = [9, 9, 9] }]
/// "#;
/// let scene = Scene::parse(text, "example.toml".as_ref(), &[])?;
/// let mut kept = Kept::default();
/// bitlight::run::render(&scene, &Assets::default(), &["translucency.final"], &mut kept)?;
/// assert_eq!(kept.get("translucency.final").unwrap().shape, [32, 32, 3]);
/// # Ok::<(), bitlight::Error>(())
/// ```
pub fn render(
    scene: &Scene,
    assets: &Assets,
    wanted: &[&str],
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    Loaded::new(scene, assets, wanted)?.render(scene, wanted, recorder)
}

/// What sets the size of a pass's buffer, each with the key that does, and what to make smaller then.
const GROUPS: [(&str, &[&str], &str); 5] = [
    ("translucency.cubemap", &["translucency.cubemap", "translucency.transmit"], TRANSLUCENCY),
    ("translucency.shadow", &["translucency.shadow", "translucency.peel", "translucency.blur"], TRANSLUCENCY),
    ("prt.directions", &["prt.visibility"], PRT),
    ("prt.bands", &["prt.vectors", "prt.matrices", "prt.brdf", "prt.bounced", "prt.scattered"], PRT),
    ("image.width", &[], ""), // all others
];

/// The place in [`GROUPS`] of what the directions of a bake set the size of.
const PRT_DIRECTIONS: usize = 2;

const TRANSLUCENCY: &str =
    "make image.width and image.height, translucency.shadow or translucency.cubemap smaller";
const PRT: &str =
    "make prt.bands or prt.directions smaller, or the solid coarser by solid.resolution or solid.triangles";

/// The group of a pass in [`GROUPS`], and the bytes of its buffer for a solid of so many vertices.
fn buffer(scene: &Scene, info: &Info, vertices: usize) -> (usize, u64) {
    let group =
        GROUPS.iter().position(|(_, names, _)| names.contains(&info.name)).unwrap_or(GROUPS.len() - 1);
    let [rows, columns] = match group {
        0 => [scene.translucency.cubemap; 2],
        1 => [scene.translucency.shadow; 2],
        _ => [scene.size[1], scene.size[0]],
    };
    let (coefficients, matrix) = match scene.technique {
        Technique::Translucency => (9, 4),
        Technique::Prt => (scene.prt.bands.pow(2), scene.prt.bands.pow(2)),
    };
    let casters = scene.lights.iter().filter(|light| !matches!(light, Source::Environment { .. })).count();
    let computes = prt::computes(info.name, &scene.surface, &scene.prt);
    let [vertices, matrix, exits] =
        [vertices, matrix, prt::EXITS].map(|length| if computes { length } else { 0 });
    let length = |axis: &Axis| match axis {
        Axis::Light => scene.lights.len(),
        Axis::Caster => casters,
        Axis::Face => 6,
        // At most: the solid's proportions are not known before it is loaded.
        Axis::Point => scene.translucency.accumulation.pow(3),
        Axis::Row => rows,
        Axis::Column => columns,
        Axis::Vertex => vertices,
        Axis::Exit => exits,
        Axis::Word => scene.prt.directions.div_ceil(32),
        Axis::Coefficient => coefficients,
        Axis::MatrixRow | Axis::MatrixColumn => matrix,
        Axis::Channel(names) => names.len(),
    };
    (group, info.axes.iter().map(|axis| length(axis) as u64).product::<u64>() * 4)
}

/// The bytes that the passes of a request need at most, by the scene's settings and the number of the solid's vertices
/// (0 before it is loaded): their buffers, as if none were freed before the end, the recorder's copies of the wanted
/// ones, twice the largest while it is made and digested, the tables of the cubemap, and what blocked directions meet where
/// light bounces. The solid's own come on top.
///
/// # Errors
/// An unknown pass.
pub fn memory(scene: &Scene, wanted: &[&str], vertices: usize) -> Result<u64, Error> {
    Ok(groups(scene, wanted, vertices)?.iter().sum())
}

/// [`memory`] for each of [`GROUPS`].
fn groups(scene: &Scene, wanted: &[&str], vertices: usize) -> Result<[u64; GROUPS.len()], Error> {
    let (mut bytes, mut largest) = ([0; GROUPS.len()], (0, 0));
    for info in needed(scene.technique, wanted)? {
        let (group, buffer) = buffer(scene, info, vertices);
        bytes[group] += buffer * if wanted.contains(&info.name) { 2 } else { 1 };
        if buffer > largest.1 {
            largest = (group, buffer);
        }
    }
    bytes[largest.0] += 2 * largest.1;
    if scene.technique == Technique::Prt && scene.prt.bounces > 0 {
        // What each blocked direction meets, at most all above the horizon: a hit, a meeting of its vertex, one of the list.
        bytes[PRT_DIRECTIONS] += vertices as u64 * scene.prt.directions as u64 / 2 * (20 + 16 + 16);
    }
    if bytes[0] > 0 {
        // A texel's triangle, what its tile holds while it is filled, and its corner's share of solid angles.
        bytes[0] += 6 * (scene.translucency.cubemap as u64).pow(2) * (4 + 14 + 8);
    }
    Ok(bytes)
}

fn check_memory(scene: &Scene, wanted: &[&str], vertices: usize) -> Result<(), Error> {
    let groups = groups(scene, wanted, vertices)?;
    let total: u64 = groups.iter().sum();
    if total <= MAX_MEMORY {
        return Ok(());
    }
    let greatest = (0..groups.len()).max_by_key(|group| groups[*group]).unwrap_or_default();
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let lights = if scene.lights.len() > 1 { ", use fewer lights" } else { "" };
    let smaller = match (GROUPS[greatest].2, scene.technique) {
        ("", Technique::Translucency) => TRANSLUCENCY,
        ("", Technique::Prt) => "make image.width and image.height smaller",
        (own, _) => own,
    };
    Err(Error::new(format!(
        "the passes need {:.1} GiB of memory, over {:.0} GiB",
        gib(total),
        gib(MAX_MEMORY)
    ))
    .key(GROUPS[greatest].0)
    .remedy(format!("{smaller}{lights}, or ask for fewer passes")))
}

/// Lets the allocator keep the memory of a frame for the next one: a program that renders many frames calls it first.
///
/// A frame's buffers are megabytes each. By default glibc takes such blocks from the system one by one and gives them
/// back when they are freed, so every frame first touches new pages: about a quarter of its time. glibc learns by what is
/// freed: after one block of 31 MiB, never touched here, it serves blocks up to that size from its heap and keeps up to
/// 62 MiB there. With another allocator this does nothing.
pub fn keep_memory() {
    drop(std::hint::black_box(vec![0_u8; 31 << 20]));
}

/// What a scene names, loaded and placed: all frames of a sequence share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// As placed, before it is deformed.
    solid: Mesh,
    /// Of each of the scene's lights that is one.
    environments: Vec<Option<Environment>>,
    /// The coefficients of each environment in the bands that the scene's technique takes, none of other lights.
    coefficients: Vec<Vec<[f32; 3]>>,
}

impl Loaded {
    /// Loads what a scene names, for a request of the `wanted` passes.
    ///
    /// # Errors
    /// More than [`MAX_MEMORY`], before anything is allocated for a pass; a missing or unusable asset.
    pub fn new(scene: &Scene, assets: &Assets, wanted: &[&str]) -> Result<Self, Error> {
        let load = || {
            check_memory(scene, wanted, 0)?;
            // Before anything is loaded: a missing file shows at once.
            scene.assets().into_iter().try_for_each(|name| assets.find(name).map(drop))?;
            let environments = scene
                .lights
                .iter()
                .map(|source| environment(source, assets))
                .collect::<Result<Vec<_>, _>>()?;
            let bands = match scene.technique {
                Technique::Translucency => 3,
                Technique::Prt => scene.prt.bands,
            };
            let coefficients = environments.iter().enumerate();
            let coefficients = coefficients.map(|(index, environment)| match environment {
                Some(environment) => coefficients_of(index, environment, bands),
                None => Ok(Vec::new()),
            });
            let coefficients = coefficients.collect::<Result<_, _>>()?;
            let solid = solid(&scene.solid, assets)?;
            check_memory(scene, wanted, solid.positions.len())?;
            Ok(Self { solid, environments, coefficients })
        };
        load().map_err(|error: Error| scene.place(error))
    }

    /// The solid of the scene that this was loaded for, at that scene's time: the wave first, then the bend.
    ///
    /// # Errors
    /// A solid deformed out of range.
    pub fn solid(&self, scene: &Scene) -> Result<Mesh, Error> {
        let solid = scene.wave.apply(&self.solid, scene.time).map_err(|error| error.key("wave.amplitude"))?;
        scene.bend.apply(&solid, scene.time).map_err(|error| error.key("bend.angle"))
    }

    /// The environment that a light of the scene is; `None` for another kind of light.
    ///
    /// # Panics
    /// Where the scene has no such light.
    pub fn environment(&self, light: usize) -> Option<&Environment> {
        self.environments[light].as_ref()
    }

    /// Prepares the translucency technique's frame of the scene that this was loaded for, at that scene's time
    /// ([`Scene::at`]). Its camera may have moved since, and so may its points and directions of light.
    ///
    /// # Errors
    /// A light inside the solid, a solid deformed out of range.
    ///
    /// # Panics
    /// Where it was loaded for another technique.
    pub fn translucency(&self, scene: &Scene) -> Result<translucency::Frame, Error> {
        let lights = scene.lights.iter().zip(&self.coefficients).map(|(source, coefficients)| match source {
            Source::Point { position, intensity } => {
                Light::Point { position: *position, intensity: *intensity }
            }
            Source::Directional { direction, irradiance } => {
                Light::Directional { direction: *direction, irradiance: *irradiance }
            }
            Source::Environment { .. } => {
                Light::Environment { coefficients: std::array::from_fn(|index| coefficients[index]) }
            }
        });
        translucency::Frame::new(
            self.solid(scene)?,
            scene.medium,
            scene.gloss,
            lights.collect(),
            scene.camera,
            scene.size,
            scene.background,
            scene.translucency,
        )
    }

    /// [`Self::translucency`] for precomputed radiance transfer.
    ///
    /// # Errors
    /// A solid deformed out of range, a point light.
    pub fn prt(&self, scene: &Scene) -> Result<prt::Frame, Error> {
        let lights = scene.lights.iter().zip(&self.coefficients).enumerate();
        let lights = lights.map(|(index, (source, coefficients))| match source {
            Source::Point { .. } => Err(Error::new("is point, and prt takes light from far away alone")
                .key(format!("light[{index}].kind"))
                .remedy("make it directional, with the irradiance at the solid")),
            Source::Directional { direction, irradiance } => {
                Ok(prt::Light::Directional { direction: *direction, irradiance: *irradiance })
            }
            Source::Environment { .. } => Ok(prt::Light::Environment(coefficients.clone())),
        });
        Ok(prt::Frame::new(
            self.solid(scene)?,
            scene.surface,
            scene.medium,
            lights.collect::<Result<_, _>>()?,
            scene.camera,
            scene.size,
            scene.background,
            scene.prt,
        ))
    }

    /// Renders the wanted passes of the scene that this was loaded for, as [`render`] does.
    ///
    /// # Errors
    /// What cannot be prepared, and what the recorder refuses.
    pub fn render(&self, scene: &Scene, wanted: &[&str], recorder: &mut dyn Recorder) -> Result<(), Error> {
        let rendered = match scene.technique {
            Technique::Translucency => self
                .translucency(scene)
                .and_then(|frame| execute(&translucency::PASSES, &frame, wanted, recorder)),
            Technique::Prt => {
                self.prt(scene).and_then(|frame| execute(&prt::PASSES, &frame, wanted, recorder))
            }
        };
        rendered.map_err(|error| scene.place(error))
    }
}

/// What a bake depends on, by key, as texts: the settings of transfer that such a surface reads, and the solid with its own.
pub fn baked_from(scene: &Scene, loaded: &Loaded) -> Map<String, Json> {
    let (gloss, through) = (scene.surface.gloss, scene.prt.subsurface != prt::Subsurface::None);
    let counts = |key: &str| match key.split_once('.').unwrap_or(("", key)) {
        ("solid" | "wave" | "bend", _) | ("surface", "albedo" | "highlight") => true,
        ("surface", "specular") => gloss != Gloss::None,
        ("surface", "exponent") => matches!(gloss, Gloss::Phong { .. }),
        ("surface", "roughness") => matches!(gloss, Gloss::CookTorrance { .. }),
        ("material", name) => through && name != "gloss",
        ("prt", name) => name != "poses",
        ("", "unit") => through,
        ("", name) => ["technique", "frame_rate"].contains(&name),
        _ => false,
    };
    let settings = scene.settings.iter().filter(|(key, _)| counts(key));
    let text = |value: &Json| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let mut from: Map<_, _> = settings.map(|(key, value)| (key.clone(), text(value).into())).collect();
    let mut hasher = blake3::Hasher::new();
    let solid = &loaded.solid;
    for vector in solid.positions.iter().chain(&solid.normals) {
        vector.to_array().iter().for_each(|value| {
            hasher.update(&(value + 0.0).to_le_bytes());
        });
    }
    solid.triangles.iter().flatten().for_each(|corner| {
        hasher.update(&corner.to_le_bytes());
    });
    from.insert("vertices".into(), solid.positions.len().to_string().into());
    from.insert("triangles".into(), solid.triangles.len().to_string().into());
    from.insert("mesh".into(), hasher.finalize().to_hex().to_string().into());
    from
}

/// Bakes a pose, the scene at time pose / `frame_rate`: the transfer of each vertex, by the names of the passes that make
/// it ([`prt::stored`]). `recorder` is told of every pass that runs.
///
/// # Errors
/// A scene of another technique than prt, a solid deformed out of range, what the recorder refuses.
pub fn bake(
    scene: &Scene,
    loaded: &Loaded,
    pose: u32,
    recorder: &mut dyn Recorder,
) -> Result<Vec<(&'static str, Buffer)>, Error> {
    let scene = scene.at(f64::from(pose) / scene.frame_rate);
    let mut kept = Kept::default();
    let wanted = stored(&scene)?;
    loaded.render(&scene, &wanted, &mut vec![&mut kept as &mut dyn Recorder, recorder])?;
    Ok(kept
        .0
        .into_iter()
        .filter(|(_, wanted, _)| *wanted)
        .map(|(info, _, buffer)| (info.name, buffer))
        .collect())
}

/// The passes that a bake of a scene stores.
///
/// # Errors
/// A scene of another technique than prt.
pub fn stored(scene: &Scene) -> Result<Vec<&'static str>, Error> {
    match scene.technique {
        Technique::Prt => Ok(prt::stored(&scene.surface, &scene.prt)),
        other => Err(scene.place(
            Error::new(format!("is {}, and only prt is baked", other.name()))
                .key("technique")
                .remedy("set it to prt; a light that is a point must become directional then"),
        )),
    }
}

/// Renders every pass of a scene into a recorder, and gathers what reproducing the frame elsewhere takes.
///
/// # Errors
/// Those of [`render`]; a scene of another technique than translucency.
pub fn export(
    scene: &Scene,
    assets: &Assets,
    recorder: &mut dyn Recorder,
) -> Result<translucency::Export, Error> {
    if scene.technique != Technique::Translucency {
        let error = Error::new(format!("is {}, and export knows translucency alone", scene.technique.name()));
        let error = error.key("technique").remedy("`bitlight render --passes all` writes every buffer of it");
        return Err(scene.place(error));
    }
    let mut kept = Kept::default();
    let all = translucency::PASSES.map(|pass| pass.info.name);
    let loaded = Loaded::new(scene, assets, &all)?;
    let frame = loaded.translucency(scene).map_err(|error| scene.place(error))?;
    execute(&translucency::PASSES, &frame, &all, &mut vec![&mut kept as &mut dyn Recorder, recorder])
        .map_err(|error| scene.place(error))?;
    Ok(translucency::Export::new(frame, &kept))
}

fn solid(solid: &Solid, assets: &Assets) -> Result<Mesh, Error> {
    let mut mesh = match &solid.origin {
        Origin::File(name) => obj::read(&assets.find(name)?)?,
        Origin::Shape { name, resolution, extents } => {
            shape(name, *resolution, *extents).map_err(|error| error.key("solid.resolution"))?
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
    // Turning moves the box's centre: centre what has become of it.
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
    // Farther out the rounding of a coordinate is over a hundredth of the radius.
    if solid.center.length() > 1e5 * radius {
        return Err(Error::new("is over 100,000 times the solid's radius from the origin")
            .key("solid.center")
            .remedy("bring it nearer, with the camera and the lights, or make the solid larger"));
    }
    mesh.apply(1.0, Mat3::IDENTITY, solid.center - turned.center())?;
    Ok(mesh)
}

/// A procedural shape: for each `resolution`, n, about 20 n² triangles (12 n² of a cuboid).
fn shape(name: &str, n: usize, extents: Vec3) -> Result<Mesh, Error> {
    match name {
        "sphere" => shapes::sphere(n),
        // At least the divisions that the knot's curve needs.
        "torus-knot" => shapes::torus_knot(2, 3, 0.35, (8 * n).max(40), n.max(3)),
        "genus-3" => shapes::genus3(n.div_ceil(10)), // its base mesh has 2,180 triangles
        _ => shapes::cuboid(extents * 0.5, n),
    }
}

/// The environment that a light is, if it is one.
fn environment(source: &Source, assets: &Assets) -> Result<Option<Environment>, Error> {
    let Source::Environment { radiance, scale } = source else { return Ok(None) };
    let form = match radiance {
        Radiance::Probe(name) => Form::Probe(*probes::probe(name)?),
        Radiance::File(name) => Form::Map(LatLong::read_hdr(&assets.find(name)?)?),
        Radiance::Constant(colour) => Form::Constant(*colour),
    };
    Ok(Some(Environment { form, scale: *scale }))
}

/// The coefficients of the light of that index, which are finite.
fn coefficients_of(index: usize, environment: &Environment, bands: usize) -> Result<Vec<[f32; 3]>, Error> {
    let coefficients = environment.coefficients(bands);
    if coefficients.as_flattened().iter().all(|value| value.is_finite()) {
        return Ok(coefficients);
    }
    Err(Error::new("makes the environment brighter than numbers go")
        .key(format!("light[{index}].scale"))
        .remedy("scale it down"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass::Kept;

    const SCENE: &str = "technique = \"translucency\"\nimage = { width = 7, height = 5 }\n\
        camera = { position = [0, 0, 4] }\nsolid = { shape = \"cuboid\", resolution = 2 }\n\
        light = [{ kind = \"point\", position = [0, 3, 3], intensity = [9, 9, 9] }, \
        { kind = \"environment\", radiance = [1, 1, 1] }]\ntranslucency = { cubemap = 3, shadow = 4 }\n";

    #[test]
    fn the_memory_of_a_buffer_is_known_before_it_is_made() {
        for set in [vec![], vec!["translucency.accumulation=2".to_owned()]] {
            let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
            let mut kept = Kept::default();
            let all = wanted(scene.technique, "all").unwrap();
            render(&scene, &Assets::default(), &all, &mut kept).unwrap();
            assert_eq!(kept.0.len(), all.len());
            for (info, _, made) in &kept.0 {
                assert_eq!(buffer(&scene, info, 0).1, 4 * made.data.len() as u64, "{}", info.name);
            }
        }
        let prt = SCENE.split("light = ").next().unwrap().replace("translucency", "prt")
            + "light = [{ kind = \"environment\", radiance = [1, 1, 1] }]\nprt = { bands = 3, directions = 40 }\n";
        let glossy = ["surface.highlight=phong", "prt.bounces=1", "prt.subsurface=dipole"];
        for set in [&[][..], &glossy[..1], &glossy] {
            let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
            let scene = Scene::parse(&prt, "a.toml".as_ref(), &set).unwrap();
            let all = wanted(scene.technique, "all").unwrap();
            let loaded = Loaded::new(&scene, &Assets::default(), &all).unwrap();
            let mut kept = Kept::default();
            loaded.render(&scene, &all, &mut kept).unwrap();
            for (info, _, made) in &kept.0 {
                let expected = buffer(&scene, info, loaded.solid.positions.len()).1;
                assert_eq!(expected, 4 * made.data.len() as u64, "{} under {set:?}", info.name);
            }
        }
    }

    #[test]
    fn a_request_beyond_the_memory_is_refused_by_its_greatest_part() {
        let refusal = |set: &[&str]| {
            let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
            let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
            check_memory(&scene, &wanted(scene.technique, "all").unwrap(), 0)
                .map_err(|error| error.key.unwrap_or_default())
        };
        assert_eq!(refusal(&[]), Ok(()));
        assert_eq!(refusal(&["image.width=8192", "image.height=8192"]), Err("image.width".into()));
        assert_eq!(refusal(&["translucency.shadow=8192"]), Ok(()));
        assert_eq!(
            refusal(&["translucency.cubemap=2048", "image.width=4096", "image.height=4096"]),
            Err("translucency.cubemap".into())
        );
    }

    const SEQUENCE: &str = "technique = \"translucency\"\nimage = { width = 16, height = 16 }\n\
        camera = { position = [0, 0, 6] }\nsolid = { file = \"two.obj\" }\nwave = { amplitude = 0.5 }\n\
        light = [{ kind = \"point\", position = [0, 9, 0], intensity = [9, 9, 9] }]\n";

    #[test]
    fn a_sequence_loads_once_and_every_frame_has_its_own_box() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("two.obj");
        // The origin's corner of a cube; along z a quarter of the wave.
        std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.25\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            .unwrap();
        let scene = Scene::parse(SEQUENCE, "two.toml".as_ref(), &[]).unwrap();
        let assets = Assets(Some(folder.path().into()));
        let loaded = Loaded::new(&scene, &assets, &[]).unwrap();
        let whole = render_final(&scene.at(0.25), &Loaded::new(&scene, &assets, &[]).unwrap());
        std::fs::remove_file(&file).unwrap();
        assert!(Loaded::new(&scene, &assets, &[]).is_err());
        let still =
            Scene { wave: crate::world::deform::Wave { amplitude: 0.0, ..scene.wave }, ..scene.clone() };
        let rest = loaded.translucency(&still).unwrap();
        for time in [0.0, 0.25, 0.5] {
            let frame = loaded.translucency(&scene.at(time)).unwrap();
            let used = frame.solid.bounds();
            assert!((used.low.x - rest.bounds.low.x).abs() > 0.1, "the box follows at {time}");
            assert!(
                (frame.bounds.low - used.low).length() < 1e-6
                    && (frame.bounds.high - used.high).length() < 1e-6
            );
        }
        assert_eq!(render_final(&scene.at(0.25), &loaded), whole);
        assert_eq!(scene.at(0.25).settings["time"], 0.25);
    }

    #[test]
    fn lights_that_move_need_no_loading() {
        let scene = Scene::parse(SCENE, "a.toml".as_ref(), &[]).unwrap();
        let mut moved = scene.clone();
        let Source::Point { position, .. } = &mut moved.lights[0] else { panic!("it is a point") };
        position.x += 1.0;
        let [still, afresh] = [&scene, &moved].map(|of| Loaded::new(of, &Assets::default(), &[]).unwrap());
        assert_eq!(still.translucency(&moved).unwrap(), afresh.translucency(&moved).unwrap());
        assert_ne!(still.translucency(&moved).unwrap(), still.translucency(&scene).unwrap());
    }

    fn render_final(scene: &Scene, loaded: &Loaded) -> Vec<f32> {
        let mut kept = Kept::default();
        loaded.render(scene, &["translucency.final"], &mut kept).unwrap();
        kept.get("translucency.final").unwrap().as_f32().to_vec()
    }
}
