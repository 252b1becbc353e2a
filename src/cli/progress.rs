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
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { begun: Instant::now(), bar, shown: false }
    }

    /// Says what is being done now.
    pub(super) fn say(&mut self, what: &str) {
        self.bar.set_message(what.to_owned());
        if !self.shown && self.begun.elapsed() > Duration::from_secs(1) && std::io::stderr().is_terminal() {
            self.shown = true;
            self.bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
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
