//! The command: one file a subcommand, without logic of its own.
//!
//! Exit status: 0 done, 1 a check failed, 2 bad input or usage.

mod bake;
mod bless;
mod diff;
mod export;
mod font;
mod info;
mod init;
mod join;
mod passes;
mod progress;
mod render;
mod sh;
mod sheet;
mod truth;
mod verify;

use crate::Error;
use crate::numeric::parallel;
use crate::scene::{Assets, Scene};
use crate::techniques::{ALL, Technique};
use clap::{Args, Parser, Subcommand};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::LazyLock;
use std::time::Instant;

/// Bit-reproducible CPU ground truth of published techniques that light with spherical harmonics.
///
/// A scene is a TOML file; a technique is a table of named passes. `bitlight render` runs the passes that are
/// asked for and those that they need. The same scene gives the same bits on every machine.
#[derive(Debug, Parser)]
#[command(name = "bitlight", version, max_term_width = 100)]
#[command(after_help = start())]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The scene that examples name.
fn example() -> &'static str {
    ALL[0].scene
}

fn start() -> String {
    let scene = example();
    format!(
        "Exit status: 0 done, 1 a check failed, 2 bad input or usage.\n\nStart with:\n  \
         bitlight render {scene} --passes all -o out\n  bitlight init {} > mine.toml",
        ALL[0].name
    )
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene: a picture, and the buffers of its passes
    Render(render::Arguments),
    /// Precompute the radiance transfer of poses into a store of .npy files, or verify one
    Bake(bake::Arguments),
    /// Render scenes and compare every pass with its golden, bit for bit
    Verify(verify::Arguments),
    /// Record what a scene renders now as its golden, and why
    Bless(bless::Arguments),
    /// Estimate a scene's light without the technique's approximations, with its variance; a second run goes
    /// on where the first stopped
    Truth(truth::Arguments),
    /// Compare two dumps pass by pass: how far they differ, where first, and which pass diverges first
    Diff(diff::Arguments),
    /// Put images of EXR files side by side into one picture, with their difference if that is asked for
    Join(join::Arguments),
    /// Write what another program needs to reproduce a frame: mesh, matrices, conventions
    Export(export::Arguments),
    /// List the passes: equation, inputs, output, the key that sets the size, and the GPU twin
    Passes(passes::Arguments),
    /// Describe a mesh (OBJ), an environment (HDR) or an image (EXR)
    Info(info::Arguments),
    /// Write a commented scene to start from, or the schema by which editors check scenes
    Init(init::Arguments),
    /// Project environments into spherical harmonics, evaluate and rotate them
    Sh(sh::Arguments),
}

/// Where real models and probes are.
#[derive(Debug, Args)]
struct AssetFolder {
    /// Folder of the models and probes that scenes name [default: the variable BITLIGHT_ASSETS]
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,
}

impl AssetFolder {
    fn assets(&self) -> Assets {
        self.assets.clone().map_or_else(Assets::from_environment, Assets::Folder)
    }
}

/// The arguments of every command that reads and runs a scene.
#[derive(Debug, Args)]
struct Common {
    /// Threads to use; 0 for one a core. The bits do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    folder: AssetFolder,
    /// Override a key of the scene, such as image.width=256; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Common {
    fn scene(&self, path: &Path) -> Result<Scene, Error> {
        Scene::read(path, &self.set)
    }

    fn assets(&self) -> Assets {
        self.folder.assets()
    }

    /// Runs a command's work in its one pool of threads.
    fn run<T: Send>(&self, work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
        parallel::with_threads(self.threads, work)?
    }
}

/// The technique of a name.
fn technique(name: &str) -> Result<&'static Technique, Error> {
    let found = ALL.iter().copied().find(|technique| technique.name == name);
    let names = || ALL.iter().map(|technique| technique.name).collect::<Vec<_>>();
    found.ok_or_else(|| crate::unknown("technique", name, &names()))
}

/// Seconds since the first call.
fn clock() -> f64 {
    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGUN.elapsed().as_secs_f64()
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Render(arguments) => arguments.run(),
        Command::Bake(arguments) => arguments.run(),
        Command::Verify(arguments) => arguments.run(),
        Command::Bless(arguments) => arguments.run(),
        Command::Truth(arguments) => arguments.run(),
        Command::Diff(arguments) => arguments.run(),
        Command::Join(arguments) => arguments.run(),
        Command::Export(arguments) => arguments.run(),
        Command::Passes(arguments) => arguments.run(),
        Command::Info(arguments) => arguments.run(),
        Command::Init(arguments) => arguments.run(),
        Command::Sh(arguments) => arguments.run(),
    };
    outcome.unwrap_or_else(|error| {
        let _ = writeln!(std::io::stderr(), "error: {error}"); // nobody is left to tell
        ExitCode::from(2)
    })
}

/// Prints lines to standard output. A reader that has gone away (`| head`) is no error.
fn print(text: &str) -> Result<(), Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::new(format!("cannot print: {error}")).remedy("send standard output elsewhere"))
        }
        _ => Ok(()),
    }
}
