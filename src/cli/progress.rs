//! A progress bar on standard error, for work over a second, and none where that is no terminal.

use crate::Error;
use crate::pass::{Buffer, Info, Recorder};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Counts finished passes.
pub(super) struct Progress {
    begun: Instant,
    bar: ProgressBar,
    shown: bool,
}

impl Progress {
    /// A bar of `steps`, shown once the work has lasted a second.
    pub(super) fn new(steps: usize) -> Self {
        let bar = ProgressBar::hidden();
        bar.set_length(steps as u64);
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {prefix}{msg} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { begun: Instant::now(), bar, shown: false }
    }

    /// A bar of an estimate: of its samples, or of its time where that alone ends it; with the time left.
    pub(super) fn estimate(samples: Option<u64>, seconds: Option<f64>) -> Self {
        let bar = ProgressBar::hidden();
        bar.set_length(samples.unwrap_or(seconds.unwrap_or_default() as u64));
        let unit = if samples.is_some() { "samples" } else { "s" };
        let style = ProgressStyle::with_template(&format!(
            "{{bar:30}} {{pos}}/{{len}} {unit} {{msg}} {{elapsed}}, {{eta}} left"
        ));
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { begun: Instant::now(), bar, shown: false }
    }

    /// Says how far an estimate is. The first call sets what the time left is counted from.
    pub(super) fn at(&mut self, samples: u64, seconds: f64, by_samples: bool) {
        let position = if by_samples { samples } else { seconds as u64 };
        if seconds < 1e-3 {
            self.bar.set_position(position);
            self.bar.reset_eta();
        }
        self.say("");
        self.bar.set_position(position);
    }

    /// Says what is being done now.
    pub(super) fn say(&mut self, what: &str) {
        self.bar.set_message(what.to_owned());
        if !self.shown && self.begun.elapsed() > Duration::from_secs(1) && std::io::stderr().is_terminal() {
            self.shown = true;
            self.bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
    }

    /// A frame of a sequence begins, after `done` steps.
    pub(super) fn frame(&mut self, number: u32, done: usize) {
        self.bar.set_prefix(format!("frame {number}: "));
        self.bar.set_position(done as u64);
    }

    /// Prints beside the bar.
    pub(super) fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }

    /// One step is done.
    pub(super) fn step(&mut self) {
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Recorder for Progress {
    fn begin(&mut self, pass: &Info) {
        self.say(pass.name);
    }

    fn record(&mut self, _: &Info, _: bool, _: &Buffer) -> Result<(), Error> {
        self.step();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_runs_over_all_frames() {
        let mut progress = Progress::new(3 * 10);
        for number in 0..3 {
            progress.frame(7 + number, number as usize * 10);
            assert_eq!(progress.bar.position(), 10 * u64::from(number));
            assert_eq!(progress.bar.prefix(), format!("frame {}: ", 7 + number));
            (0..4).for_each(|_| progress.step()); // not all passes are wanted
        }
        assert_eq!((progress.bar.position(), progress.bar.length()), (24, Some(30)));
    }
}
