//! `bitlight bless`

use super::{AssetFolder, print};
use crate::Error;
use crate::compare::Golden;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = format!("The only way to change a golden. Which passes changed, when and why is added to \
    GOLDEN/.../SCENE.history.\n\nExample:\n  bitlight bless {} \
    --reason \"blur: the kernel is centred (T6)\"", super::example()))]
pub(super) struct Arguments {
    /// The scene whose golden is made or changed
    scene: PathBuf,
    /// The cause: which change of the code or the scene makes these bits the right ones
    #[arg(long, value_name = "TEXT")]
    reason: String,
    /// Render the golden under this assignment (to make it smaller); replaces the golden's own
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Keep pixels too, not digests alone: for one scene a technique, of at most 128 x 128 pixels
    #[arg(long)]
    pixels: bool,
    /// Folder of the goldens
    #[arg(long, value_name = "DIR", default_value = "golden")]
    golden: PathBuf,
    #[command(flatten)]
    folder: AssetFolder,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        if self.reason.trim().is_empty() {
            return Err(Error::new("--reason is empty").remedy("say which change makes the new bits right"));
        }
        let set = (!self.set.is_empty()).then_some(self.set);
        let pixels = self.pixels.then_some(true);
        let [date, reason] = [today(), self.reason.replace('\n', " ")];
        let assets = self.folder.assets();
        let changes = Golden::record(&self.golden, &self.scene, &assets, set, pixels, [&date, &reason])?;
        if changes.is_empty() {
            print("nothing has changed\n")?;
        }
        for change in changes {
            print(&format!("{change}\n"))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The date in UTC as year-month-day.
#[expect(
    clippy::disallowed_methods,
    reason = "the history of a golden says when it changed; no value depends on it"
)]
fn today() -> String {
    let seconds =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let (year, month, day) = civil(seconds / 86_400);
    format!("{year}-{month:02}-{day:02}")
}

/// Year, month and day of a day counted from 1970-01-01.
fn civil(mut days: u64) -> (u64, u64, u64) {
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = 1970;
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let mut month = 1;
    for length in [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    (year, month, days + 1)
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_become_dates() {
        assert_eq!(civil(0), (1970, 1, 1));
        assert_eq!(civil(11_016), (2000, 2, 29));
        assert_eq!(civil(20_779), (2026, 11, 22));
    }
}
