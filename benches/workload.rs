//! What is timed: frames of the translucency technique whose camera, light and shape all change from one to
//! the next, at the paper's settings: 512 × 512 pixels, 64 × 64 texels a face, a shadow map of 512 × 512
//! under one point light.

#![allow(dead_code, reason = "each program takes what it needs")]

use bitlight::Error;
use bitlight::numeric::double::{cos, sin};
use bitlight::pass::{Buffer, Given, Info, Kept, Recorder, execute};
use bitlight::raster::NONE;
use bitlight::run::Loaded;
use bitlight::scene::{Assets, Scene, Source};
use bitlight::techniques::translucency::{Frame, PASSES, Settings};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::sync::LazyLock;
use std::time::Instant;

/// What a whole frame asks for.
pub(crate) const FINAL: &str = "translucency.final";

/// The last pass of the G-buffer.
pub(crate) const GBUFFER: &str = "translucency.gbuffer";

/// How many threads the pools have.
pub(crate) const THREADS: [usize; 2] = [1, 2];

/// One pool of each of [`THREADS`], for the whole of a program: starting one costs more than a small frame.
pub(crate) fn pools() -> [ThreadPool; 2] {
    THREADS.map(|threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{threads} threads: {error}"))
    })
}

/// A solid and where the camera stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Model {
    /// What it is called.
    pub(crate) name: &'static str,
    /// Its key and value below `[solid]`.
    pub(crate) solid: &'static str,
    /// How many triangles it is decimated to; 0 for its own.
    pub(crate) triangles: usize,
    /// The camera's height and distance from its centre; it is 50 long.
    pub(crate) camera: [f32; 2],
    /// Frames a second of the paper's GPU; of the Dragon where there is the armadillo.
    pub(crate) paper: Option<f64>,
}

/// Made without any file.
pub(crate) const KNOT: Model =
    Model { name: "knot", solid: "shape = \"torus-knot\"", triangles: 0, camera: [8.0, 76.0], paper: None };

/// The paper's first solid.
pub(crate) const BUNNY: Model = Model {
    name: "bunny",
    solid: "file = \"stanford/stanford-bunny.obj\"",
    triangles: 0,
    camera: [4.0, 99.0],
    paper: Some(65.2),
};

const BUDDHA: Model = Model {
    name: "buddha",
    solid: "file = \"stanford/buddha.obj\"",
    triangles: 0,
    camera: [0.0, 56.5],
    paper: None,
};

const ARMADILLO: Model = Model {
    name: "armadillo",
    solid: "file = \"stanford/armadillo.obj\"",
    triangles: 0,
    camera: [0.0, 72.5],
    paper: None,
};

/// The paper's solids at their own sizes and at the paper's.
pub(crate) const MODELS: [Model; 5] = [
    BUNNY,
    BUDDHA,
    Model { triangles: 67_000, paper: Some(67.9), ..BUDDHA },
    ARMADILLO,
    Model { triangles: 47_000, paper: Some(83.6), ..ARMADILLO },
];

/// The knot with 10³ to 10⁶ triangles, and at 256² to 4096² pixels: what grows, and the settings of each
/// size.
pub(crate) fn growth() -> [(&'static str, Vec<Vec<String>>); 2] {
    let triangles = [8, 25, 79, 250].map(|n| vec![format!("solid.resolution={n}")]);
    [("triangles", triangles.into()), ("pixels", [256, 512, 1024, 2048, 4096].map(side).into())]
}

/// The settings of a square image.
pub(crate) fn side(side: usize) -> Vec<String> {
    ["width", "height"].map(|of| format!("image.{of}={side}")).into()
}

/// The bunny, or the knot where there are no assets.
pub(crate) fn first(assets: &Assets) -> Model {
    if *assets == Assets::None { KNOT } else { BUNNY }
}

/// Frames that are one round of the camera, the light and the wave.
pub(crate) struct Workload {
    loaded: Loaded,
    scenes: Vec<Scene>,
    /// Of the solid.
    pub(crate) triangles: usize,
    /// Pixels of the image.
    pub(crate) pixels: usize,
    /// Pixels that see the solid, on average.
    pub(crate) covered: f64,
}

impl Workload {
    /// A round of `frames` frames of a model, with what `set` assigns.
    ///
    /// # Panics
    /// If a frame sees the solid in less than 40 % of its pixels.
    pub(crate) fn new(model: &Model, frames: usize, set: &[String], assets: &Assets) -> Result<Self, Error> {
        let Model { solid, triangles, camera: [height, distance], .. } = model;
        let text = format!(
            "technique = \"translucency\"\nunit = \"mm\"\n[image]\nwidth = 512\nheight = 512\n\
             [camera]\nposition = [0, {height}, {distance}]\nfov = 36\n\
             [solid]\n{solid}\ntriangles = {triangles}\nsize = 50\n\
             [wave]\namplitude = 2\nlength = 40\nperiod = 1\n[material]\nname = \"Skin1\"\n\
             [[light]]\nkind = \"point\"\nposition = [-40, 50, -70]\nintensity = [160000, 150000, 140000]\n\
             [translucency]\ncubemap = 64\nshadow = 512\n"
        );
        let scene = Scene::parse(&text, "workload.toml".as_ref(), set)?;
        let scenes = (0..frames).map(|number| moved(&scene, number as f64 / frames as f64)).collect();
        let loaded = Loaded::new(&scene, assets, &[FINAL])?;
        let mut workload =
            Self { loaded, scenes, triangles: 0, pixels: scene.size[0] * scene.size[1], covered: 0.0 };
        for number in 0..frames {
            let frame = workload.prepare(number)?;
            let mut kept = Kept::default();
            execute(&PASSES, &frame, &["translucency.vbuffer"], Given::new(), &mut kept)?;
            let seen = kept.get("translucency.vbuffer").map(Buffer::as_u32).unwrap_or_default();
            let covered = seen.iter().filter(|triangle| **triangle != NONE).count();
            let share = covered as f64 / workload.pixels as f64;
            assert!(share >= 0.4, "frame {number} of {} covers {share:.3} of the image", model.name);
            workload.covered += covered as f64 / frames as f64;
            workload.triangles = frame.stage.solid.triangles.len();
        }
        Ok(workload)
    }

    /// Prepares a frame, counting round and round: deforms the solid, finds its box and its normals, sets up
    /// the views.
    pub(crate) fn prepare(&self, number: usize) -> Result<Frame, Error> {
        let scene = &self.scenes[number % self.scenes.len()];
        Frame::new(self.loaded.stage(scene)?, Settings::read(&scene.values))
    }

    /// Prepares and renders a frame; how long preparing took.
    ///
    /// # Panics
    /// On any error.
    pub(crate) fn render(&self, number: usize, wanted: &str, recorder: &mut dyn Recorder) -> f64 {
        let begun = clock();
        let frame = self.prepare(number).unwrap_or_else(|error| panic!("{error}"));
        let prepared = clock() - begun;
        execute(&PASSES, &frame, &[wanted], Given::new(), recorder).unwrap_or_else(|error| panic!("{error}"));
        prepared
    }
}

/// Seconds since somebody asked first.
pub(crate) fn clock() -> f64 {
    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGUN.elapsed().as_secs_f64()
}

/// The scene at a time within a round, 0 to 1: each place of camera, light and wave is another.
fn moved(scene: &Scene, time: f64) -> Scene {
    let mut scene = scene.at(time);
    let [sine, cosine] = [sin(TAU * time) as f32, cos(TAU * time) as f32];
    scene.camera.position.x += 6.0 * sine;
    scene.camera.position.y += 3.0 * cosine;
    for light in &mut scene.lights {
        if let Source::Point { position, .. } = light {
            position.x += 20.0 * cosine;
            position.y += 20.0 * sine;
        }
    }
    scene
}

/// A sink that keeps nothing.
pub(crate) struct Nothing;

impl Recorder for Nothing {
    fn record(&mut self, _: &Info, _: bool, buffer: &Buffer) -> Result<(), Error> {
        black_box(buffer);
        Ok(())
    }
}
