//! A progress bar on standard error. It appears after a second of work, and only where standard error is a
//! terminal.

use crate::Error;
use crate::pass::{Buffer, Info, Recorder};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Steps of an estimate's bar.
const PARTS: u64 = 10_000;

/// Counts finished passes.
pub(super) struct Progress {
    bar: ProgressBar,
    /// Dropped with this, so that a bar that is not shown yet never is.
    _alive: Sender<()>,
}

impl Progress {
    /// A bar of `steps`.
    pub(super) fn new(steps: usize) -> Self {
        Self::of(steps as u64, "{bar:30} {pos}/{len} {prefix}{msg} {elapsed}")
    }

    /// A bar of an estimate, with the time left.
    pub(super) fn estimate() -> Self {
        Self::of(PARTS, "{bar:30} {msg} {elapsed}, {eta} left")
    }

    fn of(length: u64, template: &str) -> Self {
        let bar = ProgressBar::hidden();
        bar.set_length(length);
        let style = ProgressStyle::with_template(template);
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let (alive, ended) = channel();
        if std::io::stderr().is_terminal() {
            let bar = bar.clone();
            std::thread::spawn(move || show(&bar, &ended));
        }
        Self { bar, _alive: alive }
    }

    /// Shows which part of an estimate is done, beside the text `what`. The time left is counted from where
    /// it `begins`.
    pub(super) fn at(&mut self, part: f64, what: &str, begins: bool) {
        self.say(what);
        self.bar.set_position((part * PARTS as f64) as u64);
        if begins {
            self.bar.reset_eta();
        }
    }

    /// Sets how many steps there are, and how many are done.
    pub(super) fn count(&mut self, steps: usize, done: usize) {
        self.bar.set_length(steps as u64);
        self.bar.set_position(done as u64);
    }

    /// Says what is being done now.
    pub(super) fn say(&mut self, what: &str) {
        self.bar.set_message(what.to_owned());
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

/// Shows a bar after a second, whatever is being done then, unless its work has ended.
fn show(bar: &ProgressBar, ended: &Receiver<()>) {
    if ended.recv_timeout(Duration::from_secs(1)) == Err(RecvTimeoutError::Timeout) {
        bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        bar.enable_steady_tick(Duration::from_millis(200));
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
