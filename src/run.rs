//! From a scene to its passes: the one place that knows every technique.

use crate::Error;
use crate::numeric::double;
use crate::pass::{Info, Kept, Recorder, execute};
use crate::scene::{Assets, Origin, Radiance, Scene, Solid, Source};
use crate::sphere::environment::LatLong;
use crate::sphere::probes;
use crate::techniques::translucency;
use crate::world::light::Light;
use crate::world::mesh::Mesh;
use crate::world::{obj, shapes};
use glam::{Mat3, Vec3};

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
/// A missing or unusable asset, a scene that cannot be rendered, and what the recorder refuses.
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
    let frame = frame(scene, assets).map_err(|error| error.file(&scene.file))?;
    execute(&translucency::PASSES, &frame, wanted, recorder).map_err(|error| error.file(&scene.file))
}

/// Loads what a scene names and prepares its frame.
///
/// # Errors
/// A missing or unusable asset, a light inside the solid.
pub fn frame(scene: &Scene, assets: &Assets) -> Result<translucency::Frame, Error> {
    // Before anything is loaded: a missing file shows at once.
    scene.assets().into_iter().try_for_each(|name| assets.find(name).map(drop))?;
    let lights = scene.lights.iter().map(|source| light(source, assets)).collect::<Result<_, _>>()?;
    translucency::Frame::new(
        solid(&scene.solid, assets)?,
        scene.medium,
        scene.gloss,
        lights,
        scene.camera,
        scene.size,
        scene.background,
        scene.translucency,
    )
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
    let frame = frame(scene, assets).map_err(|error| error.file(&scene.file))?;
    let mut kept = Kept::default();
    let all = translucency::PASSES.map(|pass| pass.info.name);
    execute(&translucency::PASSES, &frame, &all, &mut vec![&mut kept as &mut dyn Recorder, recorder])
        .map_err(|error| error.file(&scene.file))?;
    Ok(translucency::Export::new(frame, &kept))
}

fn solid(solid: &Solid, assets: &Assets) -> Result<Mesh, Error> {
    let mut mesh = match &solid.origin {
        Origin::File(name) => obj::read(&assets.find(name)?)?,
        Origin::Shape { name, resolution, extents } => {
            shape(name, *resolution, *extents).map_err(|error| error.key("solid.resolution"))?
        }
    };
    let bounds = mesh.bounds();
    let longest = (bounds.high - bounds.low).max_element();
    let scale = solid.size.map_or(1.0, |size| size / longest);
    let angle = f64::from(solid.turn) * (std::f64::consts::PI / 180.0);
    let (sine, cosine) = (double::sin(angle) as f32, double::cos(angle) as f32);
    let turn = Mat3::from_cols(Vec3::new(cosine, 0.0, -sine), Vec3::Y, Vec3::new(sine, 0.0, cosine));
    mesh.apply(scale, turn, -(turn * (bounds.center() * scale)))?;
    // Turning moves the box's centre: centre what has become of it.
    let turned = mesh.bounds();
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

fn light(source: &Source, assets: &Assets) -> Result<Light, Error> {
    Ok(match source {
        Source::Point { position, intensity } => Light::Point { position: *position, intensity: *intensity },
        Source::Directional { direction, irradiance } => {
            Light::Directional { direction: *direction, irradiance: *irradiance }
        }
        Source::Environment { radiance, scale } => {
            let coefficients = match radiance {
                Radiance::Probe(name) => *probes::probe(name)?,
                Radiance::File(name) => nine(&LatLong::read_hdr(&assets.find(name)?)?),
                Radiance::Constant(colour) => {
                    // Y_00 = 1/√(4π), so the coefficient of a constant is √(4π) times it.
                    let root = (4.0 * std::f64::consts::PI).sqrt() as f32;
                    let mut coefficients = [[0.0; 3]; 9];
                    coefficients[0] = (*colour * root).to_array();
                    coefficients
                }
            };
            Light::Environment { coefficients: coefficients.map(|rgb| rgb.map(|value| value * scale)) }
        }
    })
}

fn nine(environment: &LatLong) -> [[f32; 3]; 9] {
    let projected = environment.project(3);
    std::array::from_fn(|index| projected[index])
}
