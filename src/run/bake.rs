//! Bakes, and frames that are lit from them. A bake computes a technique's transfer once for each pose, into
//! a store.
//!
//! Pose k is the scene at time k / `frame_rate`. The technique's row says which passes are kept under which
//! settings ([`crate::techniques::Bake`]). A bake reads no light.

use super::Loaded;
use crate::Error;
use crate::keys::Bears;
use crate::pass::{Buffer, Data, Given, Info, Kept, Recorder};
use crate::scene::{Assets, Scene, keys};
use crate::store::{self, Manifest, Store};
use crate::techniques::{ALL, Bake};
use crate::world::mesh::Mesh;
use serde_json::{Map, Value as Json};
use std::ops::Range;
use std::path::Path;

/// The most poses of one bake. The store is searched for each of them before the first is baked.
pub const MAX_POSES: usize = 100_000;

/// How far a bake has come.
#[derive(Debug, Clone, Copy)]
pub enum Step<'a> {
    /// The solid is being loaded.
    Loading,
    /// Poses that are there already are being verified.
    Verifying,
    /// So many poses are there, and so many are to be baked.
    Found(usize, usize),
    /// A pass of a pose begins.
    Pass(u32, &'a Info),
    /// A pose is in the store.
    Stored(u32),
}

/// What a bake has done.
#[derive(Debug, Clone)]
pub struct Baked {
    /// Poses that it baked.
    pub baked: usize,
    /// Those that were there.
    pub there: usize,
    /// What the store has now.
    pub manifest: Manifest,
}

/// Bakes the poses of a scene that a store does not have yet: those in `poses`, or all poses of the scene.
/// `told` is called with the progress.
///
/// # Errors
/// A technique that bakes nothing; more than [`MAX_POSES`] poses; what loading refuses; a store that was made
/// of something else; a damaged pose without `repair`; a solid deformed out of range; what the system or
/// `told` refuses.
pub fn bake(
    scene: &Scene,
    assets: &Assets,
    folder: &Path,
    poses: Option<Range<u32>>,
    repair: bool,
    told: &mut dyn FnMut(Step<'_>) -> Result<(), Error>,
) -> Result<Baked, Error> {
    let row = row(scene)?;
    let poses = poses.unwrap_or(0..(row.poses)(&scene.values));
    if poses.len() > MAX_POSES {
        return Err(Error::new(format!("{} poses are asked for, over {MAX_POSES}", poses.len()))
            .remedy("bake them in parts"));
    }
    told(Step::Loading)?;
    let wanted = (row.stored)(&scene.outline(0));
    let loaded = Loaded::unlit(scene, assets, &wanted)?;
    let store = Store::open(folder, made_of(scene, &loaded))?;
    told(Step::Verifying)?;
    let entries: Vec<_> = poses.clone().map(entry).collect();
    let missing: Vec<u32> = poses
        .clone()
        .zip(store.missing(&entries, repair)?)
        .filter_map(|(pose, missing)| missing.then_some(pose))
        .collect();
    told(Step::Found(poses.len() - missing.len(), missing.len()))?;
    let mut baked = 0;
    for pose in &missing {
        // Another process may have baked it in the meantime.
        if store.missing(&[entry(*pose)], repair)? == [false] {
            told(Step::Stored(*pose))?;
            continue;
        }
        baked += 1;
        let chunks = transfer(scene, &loaded, &wanted, *pose, told)
            .map_err(|error| Error { what: format!("pose {pose}: {}", error.what), ..error })?;
        let named: Vec<_> = chunks.iter().map(|(info, buffer)| (info.short(), buffer)).collect();
        store.put(&entry(*pose), &named)?;
        told(Step::Stored(*pose))?;
    }
    Ok(Baked { baked, there: poses.len() - baked, manifest: store.manifest()? })
}

/// Loads a scene for frames that are lit from a store. Memory is counted without what only the store's passes
/// need.
///
/// # Errors
/// A technique that bakes nothing, and what loading refuses.
pub fn load(scene: &Scene, assets: &Assets, wanted: &[&str]) -> Result<Loaded, Error> {
    let row = row(scene)?;
    let stored = (row.stored)(&scene.outline(0));
    let given: Vec<_> = row.passes.iter().copied().filter(|pass| given(pass, &stored, wanted)).collect();
    Loaded::beside(scene, assets, wanted, &given)
}

/// Renders the wanted passes of a scene that [`load`] loaded. The passes that the store in `folder` has of
/// the scene's pose are read from there. The results are those of [`Loaded::render`], bit for bit.
///
/// # Errors
/// A time that is no pose's; a store that was made of something else, where the first key that differs is
/// named; a pose that is missing or damaged; those of [`Loaded::render`].
pub fn render(
    scene: &Scene,
    loaded: &Loaded,
    folder: &Path,
    wanted: &[&str],
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    let (row, entry) = (row(scene)?, entry(pose(scene)?));
    let stored = (row.stored)(&scene.outline(0));
    let mut chunks = store::read(folder, &made_of(scene, loaded), &entry)?;
    let mut given = Given::new();
    for info in scene.technique.passes.iter().filter(|info| row.passes.contains(&info.name)) {
        if let Some(chunk) = chunks.remove(info.short()) {
            fits(scene, loaded, info, &chunk).map_err(|error| error.file(folder))?;
            given.insert(info.name, Some(chunk));
        } else if self::given(info.name, &stored, wanted) {
            if stored.contains(&info.name) {
                let what = format!("has no {} of {entry}", info.short());
                return Err(Error::new(what).file(folder).remedy("bake it again into another folder"));
            }
            // The bake made it only for passes that are stored: nothing reads its values.
            given.insert(info.name, None);
        }
    }
    loaded.render_from(scene, wanted, given, recorder)
}

/// Whether a frame from a store leaves out a pass of the bake: the store has it, or only stored passes read
/// it and nobody asks for it.
fn given(pass: &str, stored: &[&str], wanted: &[&str]) -> bool {
    stored.contains(&pass) || !wanted.contains(&pass)
}

/// Refuses a chunk that the pass would not make. Digests tell only that the store's bytes are whole.
fn fits(scene: &Scene, loaded: &Loaded, info: &Info, chunk: &Buffer) -> Result<(), Error> {
    let expected = super::memory::shape(scene, &scene.outline(loaded.solid.positions.len()), info);
    let what = if chunk.shape != expected || matches!(chunk.data, Data::U32(_)) != info.is_whole() {
        format!(
            "its {} have the shape {:?}, or a type, that the scene does not make",
            info.short(),
            chunk.shape
        )
    } else if let Some(at) = chunk.first_not_finite() {
        format!("its {} are not finite at {:?}", info.short(), chunk.place(at))
    } else {
        return Ok(());
    };
    Err(Error::new(what).remedy("bake the scene again into another folder"))
}

/// The name of a pose's entry in a store.
fn entry(pose: u32) -> String {
    format!("pose.{pose:04}")
}

/// The number of the pose at the scene's time.
fn pose(scene: &Scene) -> Result<u32, Error> {
    let pose = (scene.time * scene.frame_rate + 0.5).floor();
    // A conversion saturates, so a time out of range is no pose's.
    if f64::from(pose as u32) / scene.frame_rate == scene.time {
        return Ok(pose as u32);
    }
    let what =
        format!("is {}, and a store has the scene at whole numbers of 1 / frame_rate from 0", scene.time);
    Err(scene.place(Error::new(what).key("time").remedy("use --frames, or leave time out for pose 0")))
}

fn row(scene: &Scene) -> Result<Bake, Error> {
    scene.technique.bake.ok_or_else(|| {
        let bakes = ALL.iter().filter(|technique| technique.bake.is_some()).map(|technique| technique.name);
        let bakes = bakes.collect::<Vec<_>>().join(" or ");
        let error = Error::new(format!("is {}, which bakes nothing", scene.technique.name)).key("technique");
        scene.place(error.remedy(format!("set it to {bakes}; lights that those do not take must change too")))
    })
}

/// What a bake depends on, by key, as texts: the settings that bear on transfer, and the solid.
pub fn made_of(scene: &Scene, loaded: &Loaded) -> Map<String, Json> {
    let enters = (scene.technique.enters)(&scene.values);
    let settings = scene.values.bearing(Bears::Transfer, |key| match (key.table, key.name) {
        // Materials are given per millimetre.
        ("material", _) | ("", "unit") => enters,
        (table, _) => keys::reads(scene.technique, table),
    });
    let text = |value: &Json| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let mut from: Map<_, _> = settings.iter().map(|(key, value)| (key.clone(), text(value).into())).collect();
    from.insert("vertices".into(), loaded.solid.positions.len().to_string().into());
    from.insert("triangles".into(), loaded.solid.triangles.len().to_string().into());
    from.insert("mesh".into(), digest(&loaded.solid).into());
    from
}

/// BLAKE3 over a mesh, as hexadecimal digits; −0 counts as +0.
fn digest(solid: &Mesh) -> String {
    let mut hasher = blake3::Hasher::new();
    for vector in solid.positions.iter().chain(&solid.normals) {
        vector.to_array().iter().for_each(|value| {
            hasher.update(&(value + 0.0).to_le_bytes());
        });
    }
    solid.triangles.iter().flatten().for_each(|corner| {
        hasher.update(&corner.to_le_bytes());
    });
    hasher.finalize().to_hex().to_string()
}

/// Bakes a pose: the stored passes and their buffers.
fn transfer(
    scene: &Scene,
    loaded: &Loaded,
    wanted: &[&str],
    pose: u32,
    told: &mut dyn FnMut(Step<'_>) -> Result<(), Error>,
) -> Result<Vec<(Info, Buffer)>, Error> {
    let scene = scene.at(f64::from(pose) / scene.frame_rate);
    let (mut kept, mut begun) = (Kept::default(), Begun { pose, told });
    loaded.render(&scene, wanted, &mut vec![&mut kept as &mut dyn Recorder, &mut begun])?;
    let wanted = kept.0.into_iter().filter(|(_, wanted, _)| *wanted);
    Ok(wanted.map(|(info, _, buffer)| (info, buffer)).collect())
}

/// Tells which pass of a pose begins.
struct Begun<'a> {
    pose: u32,
    told: &'a mut dyn FnMut(Step<'_>) -> Result<(), Error>,
}

impl Recorder for Begun<'_> {
    fn begin(&mut self, pass: &Info) {
        let _ = (self.told)(Step::Pass(self.pose, pass)); // if this fails, so does the call for the stored pose
    }

    fn record(&mut self, _: &Info, _: bool, _: &Buffer) -> Result<(), Error> {
        Ok(())
    }
}
