//! `bitlight truth`

use super::progress::Progress;
use super::{Common, clock, example, print};
use crate::Error;
use crate::pass::Recorder;
use crate::run::truth::{TRUTH, Truth, Until};
use crate::store::Files;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = format!("Writes, NAME being the scene file's name without its ending:\n  \
    NAME.truth.png     the picture, for eyes\n  \
    NAME.truth.exr     truth.mean, and truth.variance: the variance of that mean (of the samples, over their number)\n  \
    NAME.truth.json    settings, samples, shapes, digests\n  \
    NAME.truth.state   the sums, from which the next run of the same scene goes on\n\n\
    A sample depends on its pixel and number alone: 16 samples and then 64 give the pictures and the state of 64 at \
    once, on any number of threads.\n\n\
    truth.model says what is traced: reflection between surfaces, the dipole of Jensen et al. 2001, or a medium; where it \
    is absent, what the scene's technique approximates. The dipole has no mirrored highlight (material.gloss).\n\n\
    Examples:\n  bitlight truth {scene} --spp 256\n  \
    bitlight truth {scene} --seconds 60 --set image.width=128 --set image.height=128", scene = example()))]
#[command(group = clap::ArgGroup::new("until").required(true).multiple(true).args(["spp", "seconds"]))]
pub(super) struct Arguments {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Samples of every pixel; those of an earlier run count
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1 << 40))]
    spp: Option<u64>,
    /// Stop after this time, once every pixel has the same number of samples, at least two
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Folder to write into; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let report = self.common.run(|| self.estimate())?;
        print(&report)?;
        Ok(ExitCode::SUCCESS)
    }

    /// Takes samples, writes and announces the files, and returns what was done.
    fn estimate(&self) -> Result<String, Error> {
        let scene = self.common.scene(&self.scene)?;
        let name = format!("{}.truth", scene.name());
        let state = self.out.join(format!("{name}.state"));
        let mut files = Files::new(&self.out, &name, clock)?;
        let mut progress = Progress::estimate();
        progress.say("loading");
        let mut truth = Truth::new(&scene, &self.common.assets())?;
        truth.resume(&state)?;
        let (found, begun) = (truth.sums.samples, (clock(), processor_seconds()));
        let until = Until { samples: self.spp, seconds: self.seconds };
        let all = self.spp.map_or_else(String::new, |spp| format!("/{spp}"));
        truth.sample(until, &state, clock, &mut |now| {
            progress.at(now.part, &format!("{:.1}{all} samples", now.samples), now.begins);
        })?;
        progress.say("writing");
        let (taken, wall) = (truth.sums.samples - found, clock() - begun.0);
        let processor = processor_seconds().zip(begun.1).map(|(now, then)| now - then);
        for (info, buffer) in TRUTH.iter().zip(truth.buffers()) {
            files.begin(info);
            files.record(info, true, &buffer)?;
        }
        let mut settings = truth.identity.settings.clone();
        settings.insert("truth.samples".into(), truth.sums.samples.into());
        let mut batch = files.write(&self.scene, &settings, scene.exposure)?;
        batch.write(format!("{name}.state"), |path| truth.save(path))?;
        let written = batch.commit()?;
        drop(progress);
        written.iter().try_for_each(|path| print(&format!("{}\n", path.display())))?;
        Ok(report(&truth, taken, wall, processor))
    }
}

/// What was done, for a person.
fn report(truth: &Truth, taken: u64, wall: f64, processor: Option<f64>) -> String {
    let samples = truth.sums.samples;
    if taken == 0 {
        return format!("{samples} samples a pixel were there already\n");
    }
    let paths = taken as f64 * truth.sums.values.len() as f64;
    let rate = match processor {
        Some(seconds) if seconds > 0.05 => {
            format!("; {:.0} thousand paths a second of processor time", paths / seconds * 1e-3)
        }
        _ => String::new(),
    };
    format!("{samples} samples a pixel, {taken} of them now in {wall:.1} s{rate}\n")
}

/// The processor time that this process has used, of all threads, where the system tells: Linux counts it in
/// hundredths.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in parentheses, may hold spaces; user and system time are the 14th and 15th field.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / 100.0)
}

/// Reads a time in seconds.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        _ => Err("a number of seconds above 0".into()),
    }
}
