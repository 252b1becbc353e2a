//! `bitlight verify`

use super::progress::Progress;
use super::{AssetFolder, print};
use crate::Error;
use crate::compare::{Golden, Pixels, Verdict, picture};
use crate::store::file;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit status 0 if every scene that has its assets equals its golden, 1 if one differs or has \
    no golden.\nScenes whose assets are absent are reported as skipped."
)]
pub(super) struct Arguments {
    /// Scenes; all below the folder `scenes` where none is named
    scene: Vec<PathBuf>,
    /// Folder of the goldens
    #[arg(long, value_name = "DIR", default_value = "golden")]
    golden: PathBuf,
    /// Folder for the pictures of differences
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    #[command(flatten)]
    folder: AssetFolder,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let scenes =
            if self.scene.is_empty() { file::below(Path::new("scenes"), "toml")? } else { self.scene };
        let assets = self.folder.assets();
        let (mut passed, mut failed, mut skipped) = (0, 0, 0);
        let mut progress = Progress::new(scenes.len());
        for path in &scenes {
            progress.say(&path.display().to_string());
            let verdict = Golden::verify(&self.golden, path, &assets)?;
            let (line, count) = match &verdict {
                Verdict::Same(passes) => (format!("ok, {passes} passes"), &mut passed),
                Verdict::Skipped(error) => (format!("skipped: {error}"), &mut skipped),
                Verdict::Missing(golden) => {
                    let cure = format!("`bitlight bless {} --reason \"...\"` makes one", path.display());
                    (format!("FAILED: there is no golden {}; {cure}", golden.display()), &mut failed)
                }
                Verdict::Settings(key, golden, now) => (
                    format!("FAILED: the golden was made with {key} = {golden}, the scene has {now}"),
                    &mut failed,
                ),
                Verdict::Passes(name) => {
                    (format!("FAILED: golden and technique differ in {name}"), &mut failed)
                }
                Verdict::Differs(pass, pixels) => (
                    format!("FAILED: {pass} differs first\n{}", differs(pixels, &self.out, path)?),
                    &mut failed,
                ),
            };
            *count += 1;
            progress.step();
            print(&format!("{}: {line}\n", path.display()))?;
        }
        drop(progress);
        print(&format!("{passed} passed, {failed} failed, {skipped} skipped\n"))?;
        Ok(if failed > 0 { ExitCode::from(1) } else { ExitCode::SUCCESS })
    }
}

/// What the pixels say, and where the picture of the difference is.
fn differs(pixels: &Pixels, out: &Path, scene: &Path) -> Result<String, Error> {
    match pixels {
        Pixels::None => {
            Ok("  no pixels are kept for this scene: render it at the commit of the golden to compare".into())
        }
        Pixels::Value(place, expected, found) => {
            let distance = (found - expected).abs();
            Ok(format!(
                "  first at {place:?}: expected {expected:e}, found {found:e}, a distance of {distance:e}"
            ))
        }
        Pixels::Image(image) => {
            let (difference, expected, found) = image.as_ref();
            let name = scene.file_stem().unwrap_or_default().to_string_lossy();
            let path = out.join(format!("{name}.{}.difference.png", difference.layer));
            picture(&path, expected, found, 0.0)?;
            Ok(format!("  {difference}\n  {} shows where", path.display()))
        }
    }
}
