//! The techniques, one row each. Code above this folder knows them by their rows alone. A new technique is a
//! folder here and a line in [`ALL`].

pub mod prt;
pub mod translucency;

use crate::Error;
use crate::keys::{Key, Values};
use crate::pass::{Axis, Buffer, Given, Info, Kept, Recorder, needed, unknown_pass};
use crate::truth::Transport;
use crate::world::Stage;
use crate::world::brdf::Brdf;
use serde_json::Value as Json;
use std::fmt;

/// Every technique.
pub static ALL: &[&Technique] = &[&translucency::TECHNIQUE, &prt::TECHNIQUE];

/// A technique: what scenes, goldens, stores and the ground truth need to know of one. Plain data and
/// functions.
pub struct Technique {
    /// Its name in scenes and before the names of its passes.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub about: &'static str,
    /// A scene that needs no asset and asks for every pass, below the folder of the project.
    pub scene: &'static str,
    /// The keys of its table, which has its name.
    pub keys: &'static [Key],
    /// Which of the tables `material` and `surface` it reads. Every technique reads the other shared tables.
    pub tables: &'static [&'static str],
    /// The kinds of light that it takes, the one to start from first.
    pub lights: &'static [&'static str],
    /// What to do about a light of another kind.
    pub other_light: &'static str,
    /// The rows of its passes, in flow order.
    pub passes: &'static [Info],
    /// How many bands of an environment it takes.
    pub bands: fn(&Values) -> usize,
    /// The greatest length of an axis of a pass's buffer; `None` for an axis that every technique has alike.
    pub length: fn(&Outline<'_>, &Info, Axis) -> Option<usize>,
    /// The bytes that a pass needs beside its buffer, if they are many, and the key that sets how many.
    pub scratch: fn(&Outline<'_>, &Info) -> Option<(&'static str, u64)>,
    /// Whether light enters the solid, so that what it is made of bears on a bake.
    pub enters: fn(&Values) -> bool,
    /// What it bakes, if it bakes.
    pub bake: Option<Bake>,
    /// The transport that it approximates, which its ground truth traces.
    pub transport: fn(&Stage, &Values) -> Result<Transport, Error>,
    /// Renders passes from a stage into a recorder. Passes whose buffers are given do not run.
    pub render: Render,
    /// What another program needs to reproduce a frame, if the technique exports it.
    pub export: Option<Export>,
}

/// Renders passes; see [`Technique::render`].
pub type Render = fn(Stage, &Values, &[&str], Given, &mut dyn Recorder) -> Result<(), Error>;

/// Gathers what another program needs to reproduce a frame; see [`Export::gather`].
pub type Gather = fn(&Stage, &Values, &Kept) -> Result<(Json, Vec<Buffer>), Error>;

/// What a technique bakes.
#[derive(Debug, Clone, Copy)]
pub struct Bake {
    /// Every pass that bakes may store: what does not depend on lights and camera and is worth keeping.
    pub passes: &'static [&'static str],
    /// Those that a bake stores under certain settings. Only they read the others.
    pub stored: fn(&Outline<'_>) -> Vec<&'static str>,
    /// How many poses the scene has.
    pub poses: fn(&Values) -> u32,
}

/// What a technique exports of a frame for programs that reproduce it.
#[derive(Debug, Clone, Copy)]
pub struct Export {
    /// The arrays by name, and what each holds.
    pub arrays: &'static [(&'static str, &'static str)],
    /// Makes facts, an object of JSON, and the arrays from a stage and all its passes.
    pub gather: Gather,
}

/// What the sizes of buffers depend on, known before anything is loaded.
#[derive(Debug, Clone, Copy)]
pub struct Outline<'a> {
    /// The scene's values.
    pub values: &'a Values,
    /// How the solid's surface reflects.
    pub surface: &'a Brdf,
    /// Width and height of the image, in pixels.
    pub size: [usize; 2],
    /// How many lights there are.
    pub lights: usize,
    /// How many of these are points or directions.
    pub casters: usize,
    /// Vertices of the solid; 0 before it is loaded.
    pub vertices: usize,
}

impl Technique {
    /// The passes that a request for `wanted` needs where the buffers of `given` are there, in flow order.
    ///
    /// # Errors
    /// An unknown pass, with the nearest known one.
    pub fn needed(&self, wanted: &[&str], given: &[&str]) -> Result<Vec<&'static Info>, Error> {
        let needed = needed(self.passes, wanted, given)?;
        Ok(self.passes.iter().zip(needed).filter(|(_, needed)| *needed).map(|(info, _)| info).collect())
    }

    /// The names of the passes that a request means: `final`, `all`, or names separated by commas, with or
    /// without the technique before them.
    ///
    /// # Errors
    /// An unknown name, with the nearest known one.
    pub fn wanted(&self, request: &str) -> Result<Vec<&'static str>, Error> {
        let all = self.passes.iter();
        if request == "all" {
            return Ok(all.map(|info| info.name).collect());
        }
        let one = |name: &str| {
            let is = |info: &&Info| info.name == name || info.short() == name;
            self.passes.iter().find(is).map(|info| info.name).ok_or_else(|| {
                let names = self.passes.iter().flat_map(|info| [info.name, info.short()]);
                unknown_pass(name, names, self.name)
            })
        };
        request.split(',').map(|name| one(name.trim())).collect()
    }
}

/// By its name: a program has one technique of a name.
impl PartialEq for Technique {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for Technique {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Technique({})", self.name)
    }
}
