//! From a scene to its passes: loading, memory, frames, bakes and the ground truth. The row of the scene's
//! technique says how to render, bake and export; nothing here knows a technique by its name.

pub mod bake;
mod load;
mod memory;
pub mod truth;

pub use load::{Loaded, RADII};
pub use memory::{MAX_MEMORY, memory};
pub use truth::{TRUTH, Truth};

use crate::Error;
use crate::pass::{Buffer, Kept, Recorder};
use crate::scene::{Assets, Scene};
use crate::world::Stage;
use serde_json::Value as Json;

/// Renders the wanted passes of a scene, and what they need, into a recorder.
///
/// # Errors
/// More than [`MAX_MEMORY`], before anything is allocated; a missing or unusable asset, a scene that cannot
/// be rendered, and what the recorder refuses.
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

/// Lets the allocator keep the memory of a frame for the next one. A program that renders many frames calls
/// it first.
///
/// A frame's buffers are megabytes each. By default glibc takes such blocks from the system one by one and
/// gives them back when they are freed, so every frame first touches new pages: about a quarter of its time.
/// glibc adapts to what is freed: after one block of 31 MiB, which is never touched here, it serves blocks up
/// to that size from its heap and keeps up to 62 MiB there. With another allocator this does nothing.
pub fn keep_memory() {
    drop(std::hint::black_box(vec![0_u8; 31 << 20]));
}

/// What another program needs to reproduce a frame, beside the scene's settings and its passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// What the frame is made of; its solid stands where the scene puts it, in the scene's unit.
    pub stage: Stage,
    /// Facts by their names.
    pub facts: Json,
    /// Arrays by their names, as the technique's row lists them.
    pub arrays: Vec<(&'static str, Buffer)>,
}

/// Renders every pass of a scene into a recorder, and gathers what another program needs to reproduce the
/// frame.
///
/// # Errors
/// Those of [`render`]; a technique that is not exported.
pub fn export(scene: &Scene, assets: &Assets, recorder: &mut dyn Recorder) -> Result<Exported, Error> {
    let technique = scene.technique;
    let Some(export) = technique.export else {
        let error = Error::new(format!("is {}, which is not exported", technique.name)).key("technique");
        return Err(scene.place(error.remedy("`bitlight render --passes all` writes every buffer of it")));
    };
    let mut kept = Kept::default();
    let all: Vec<_> = technique.passes.iter().map(|info| info.name).collect();
    let loaded = Loaded::new(scene, assets, &all)?;
    let sinks = &mut vec![&mut kept as &mut dyn Recorder, recorder];
    loaded.render(scene, &all, sinks)?;
    let gathered = loaded.stage(scene).and_then(|stage| {
        let (facts, arrays) = (export.gather)(&stage, &scene.values, &kept)?;
        Ok((stage, facts, arrays))
    });
    let (stage, facts, arrays) = gathered.map_err(|error| scene.place(error))?;
    assert_eq!(
        arrays.len(),
        export.arrays.len(),
        "the arrays of {} are others than its row lists",
        technique.name
    );
    let names = export.arrays.iter().map(|(name, _)| *name);
    Ok(Exported { stage, facts, arrays: names.zip(arrays).collect() })
}
