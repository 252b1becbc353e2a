//! From a scene to its passes: the one place that knows every technique.

use crate::Error;
use crate::numeric::double;
use crate::pass::{Axis, Info, Kept, Recorder, closure, execute};
use crate::scene::{Assets, Origin, Radiance, Scene, Solid, Source};
use crate::sphere::environment::{LatLong, constant};
use crate::sphere::probes;
use crate::techniques::translucency;
use crate::world::decimate::decimate;
use crate::world::light::Light;
use crate::world::mesh::Mesh;
use crate::world::{obj, shapes};
use glam::{Mat3, Vec3};

/// The most bytes that a request may need, as [`memory`] counts them.
pub const MAX_MEMORY: u64 = 8 << 30;

/// The least and the greatest radius of a solid's bounding box, in the scene's unit: beyond them squares and products
/// of lengths leave the range of `f32`.
pub const RADII: [f32; 2] = [1e-12, 1e15];

/// Every pass of every technique, in flow order.
pub fn passes() -> impl Iterator<Item = &'static Info> {
    translucency::PASSES.iter().map(|pass| &pass.info)
}

/// The names of the passes that a request means: `final`, `all`, or names separated by commas, with or without
/// the technique before them.
///
/// # Errors
/// An unknown name, with the nearest known one.
pub fn wanted(request: &str) -> Result<Vec<&'static str>, Error> {
    if request == "all" {
        return Ok(passes().map(|info| info.name).collect());
    }
    let one = |name: &str| {
        let full = |info: &&Info| {
            info.name == name || info.name.split_once('.').is_some_and(|(_, short)| short == name)
        };
        passes().find(full).map(|info| info.name).ok_or_else(|| {
            let names = passes()
                .flat_map(|info| [info.name, info.name.split_once('.').map_or("", |(_, short)| short)]);
            let near = crate::nearest(name, names)
                .map(|near| format!("did you mean \"{near}\"? "))
                .unwrap_or_default();
            Error::new(format!("there is no pass \"{name}\""))
                .remedy(format!("{near}`bitlight passes` lists all"))
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

/// What sets the size of a pass's images, each with the key that does.
const GROUPS: [(&str, &[&str]); 3] = [
    ("translucency.cubemap", &["translucency.cubemap", "translucency.transmit"]),
    ("translucency.shadow", &["translucency.shadow", "translucency.peel", "translucency.blur"]),
    ("image.width", &[]), // all others
];

/// The group of a pass in [`GROUPS`], and the bytes of its buffer.
fn buffer(scene: &Scene, info: &Info) -> (usize, u64) {
    let group = GROUPS.iter().position(|(_, names)| names.contains(&info.name)).unwrap_or(GROUPS.len() - 1);
    let [rows, columns] = match group {
        0 => [scene.translucency.cubemap; 2],
        1 => [scene.translucency.shadow; 2],
        _ => [scene.size[1], scene.size[0]],
    };
    let casters = scene.lights.iter().filter(|light| !matches!(light, Source::Environment { .. })).count();
    let length = |axis: &Axis| match axis {
        Axis::Light => scene.lights.len(),
        Axis::Caster => casters,
        Axis::Face => 6,
        // At most: the solid's proportions are not known before it is loaded.
        Axis::Point => scene.translucency.accumulation.pow(3),
        Axis::Row => rows,
        Axis::Column => columns,
        Axis::Coefficient => 9,
        Axis::MatrixRow | Axis::MatrixColumn => 4,
        Axis::Channel(names) => names.len(),
    };
    (group, info.axes.iter().map(|axis| length(axis) as u64).product::<u64>() * 4)
}

/// The bytes that the passes of a request need at most, by the scene's settings alone: their buffers, as if none were
/// freed before the end, the recorder's copies of the wanted ones, twice the largest while it is made and digested, and
/// the tables of the cubemap. The solid's own come on top.
///
/// # Errors
/// An unknown pass.
pub fn memory(scene: &Scene, wanted: &[&str]) -> Result<u64, Error> {
    Ok(groups(scene, wanted)?.iter().sum())
}

/// [`memory`] for each of [`GROUPS`].
fn groups(scene: &Scene, wanted: &[&str]) -> Result<[u64; 3], Error> {
    let (mut bytes, mut largest) = ([0; 3], (0, 0));
    for (pass, _) in
        translucency::PASSES.iter().zip(closure(&translucency::PASSES, wanted)?).filter(|row| row.1)
    {
        let (group, buffer) = buffer(scene, &pass.info);
        bytes[group] += buffer * if wanted.contains(&pass.info.name) { 2 } else { 1 };
        if buffer > largest.1 {
            largest = (group, buffer);
        }
    }
    bytes[largest.0] += 2 * largest.1;
    if bytes[0] > 0 {
        // A texel's triangle, what its tile holds while it is filled, and its corner's share of solid angles.
        bytes[0] += 6 * (scene.translucency.cubemap as u64).pow(2) * (4 + 14 + 8);
    }
    Ok(bytes)
}

fn check_memory(scene: &Scene, wanted: &[&str]) -> Result<(), Error> {
    let groups = groups(scene, wanted)?;
    let total: u64 = groups.iter().sum();
    if total <= MAX_MEMORY {
        return Ok(());
    }
    let greatest = (0..groups.len()).max_by_key(|group| groups[*group]).unwrap_or_default();
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let lights = if scene.lights.len() > 1 { ", use fewer lights" } else { "" };
    Err(Error::new(format!("the passes need {:.1} GiB of memory, over {:.0} GiB", gib(total), gib(MAX_MEMORY)))
        .key(GROUPS[greatest].0)
        .remedy(format!(
            "make image.width and image.height, translucency.shadow or translucency.cubemap smaller{lights}, or ask \
             for fewer passes"
        )))
}

/// Loads what a scene names and prepares its frame.
///
/// # Errors
/// A missing or unusable asset, a light inside the solid.
pub fn frame(scene: &Scene, assets: &Assets) -> Result<translucency::Frame, Error> {
    Loaded::new(scene, assets, &[])?.frame(scene)
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
    /// The coefficients of each of the scene's lights, zeros where it is no environment.
    environments: Vec<[[f32; 3]; 9]>,
}

impl Loaded {
    /// Loads what a scene names, for a request of the `wanted` passes.
    ///
    /// # Errors
    /// More than [`MAX_MEMORY`], before anything is loaded; a missing or unusable asset.
    pub fn new(scene: &Scene, assets: &Assets, wanted: &[&str]) -> Result<Self, Error> {
        let load = || {
            check_memory(scene, wanted)?;
            // Before anything is loaded: a missing file shows at once.
            scene.assets().into_iter().try_for_each(|name| assets.find(name).map(drop))?;
            let lights = scene.lights.iter().enumerate();
            let environments =
                lights.map(|(index, source)| environment(index, source, assets)).collect::<Result<_, _>>()?;
            Ok(Self { solid: solid(&scene.solid, assets)?, environments })
        };
        load().map_err(|error: Error| scene.place(error))
    }

    /// Prepares the frame of the scene that this was loaded for, at that scene's time ([`Scene::at`]). Its camera may
    /// have moved since, and so may its points and directions of light.
    ///
    /// # Errors
    /// A light inside the solid, a solid deformed out of range.
    pub fn frame(&self, scene: &Scene) -> Result<translucency::Frame, Error> {
        let solid = scene.wave.apply(&self.solid, scene.time).map_err(|error| error.key("wave.amplitude"))?;
        let lights = scene.lights.iter().zip(&self.environments).map(|(source, coefficients)| match source {
            Source::Point { position, intensity } => {
                Light::Point { position: *position, intensity: *intensity }
            }
            Source::Directional { direction, irradiance } => {
                Light::Directional { direction: *direction, irradiance: *irradiance }
            }
            Source::Environment { .. } => Light::Environment { coefficients: *coefficients },
        });
        translucency::Frame::new(
            solid,
            scene.medium,
            scene.gloss,
            lights.collect(),
            scene.camera,
            scene.size,
            scene.background,
            scene.translucency,
        )
    }

    /// Renders the wanted passes of the scene that this was loaded for, as [`render`] does.
    ///
    /// # Errors
    /// Those of [`Self::frame`], and what the recorder refuses.
    pub fn render(&self, scene: &Scene, wanted: &[&str], recorder: &mut dyn Recorder) -> Result<(), Error> {
        let rendered =
            self.frame(scene).and_then(|frame| execute(&translucency::PASSES, &frame, wanted, recorder));
        rendered.map_err(|error| scene.place(error))
    }
}

/// Renders every pass of a scene into a recorder, and gathers what reproducing the frame elsewhere takes.
///
/// # Errors
/// Those of [`render`].
pub fn export(
    scene: &Scene,
    assets: &Assets,
    recorder: &mut dyn Recorder,
) -> Result<translucency::Export, Error> {
    let mut kept = Kept::default();
    let all = translucency::PASSES.map(|pass| pass.info.name);
    let loaded = Loaded::new(scene, assets, &all)?;
    let frame = loaded.frame(scene).map_err(|error| scene.place(error))?;
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

/// The coefficients of a light's radiance, zeros where it is no environment.
fn environment(index: usize, source: &Source, assets: &Assets) -> Result<[[f32; 3]; 9], Error> {
    let Source::Environment { radiance, scale } = source else { return Ok([[0.0; 3]; 9]) };
    let coefficients = match radiance {
        Radiance::Probe(name) => *probes::probe(name)?,
        Radiance::File(name) => nine(&LatLong::read_hdr(&assets.find(name)?)?.project(3)),
        Radiance::Constant(colour) => nine(&constant(3, *colour)),
    };
    let coefficients = coefficients.map(|rgb| rgb.map(|value| value * scale));
    if !coefficients.as_flattened().iter().all(|value| value.is_finite()) {
        return Err(Error::new("makes the environment brighter than numbers go")
            .key(format!("light[{index}].scale"))
            .remedy("scale it down"));
    }
    Ok(coefficients)
}

fn nine(coefficients: &[[f32; 3]]) -> [[f32; 3]; 9] {
    std::array::from_fn(|index| coefficients[index])
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
            render(&scene, &Assets::default(), &wanted("all").unwrap(), &mut kept).unwrap();
            assert_eq!(kept.0.len(), passes().count());
            for (info, _, made) in &kept.0 {
                assert_eq!(buffer(&scene, info).1, 4 * made.data.len() as u64, "{}", info.name);
            }
        }
    }

    #[test]
    fn a_request_beyond_the_memory_is_refused_by_its_greatest_part() {
        let refusal = |set: &[&str]| {
            let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
            let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
            check_memory(&scene, &wanted("all").unwrap()).map_err(|error| error.key.unwrap_or_default())
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
        let rest = loaded.frame(&still).unwrap();
        for time in [0.0, 0.25, 0.5] {
            let frame = loaded.frame(&scene.at(time)).unwrap();
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
        assert_eq!(still.frame(&moved).unwrap(), afresh.frame(&moved).unwrap());
        assert_ne!(still.frame(&moved).unwrap(), still.frame(&scene).unwrap());
    }

    fn render_final(scene: &Scene, loaded: &Loaded) -> Vec<f32> {
        let mut kept = Kept::default();
        loaded.render(scene, &["translucency.final"], &mut kept).unwrap();
        kept.get("translucency.final").unwrap().as_f32().to_vec()
    }
}
