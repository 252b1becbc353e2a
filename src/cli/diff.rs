//! `bitlight diff`

use super::print;
use crate::Error;
use crate::compare::{diverges_first, files};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = format!("Layers are paired by name, files of two folders too. For each layer: the largest, the mean and the \
    root-mean-square difference, how many pixels differ, and the first. -0 equals +0; a NaN equals only the same NaN.\n\
    A layer's size, channels or type that differ, and a layer or file that one side lacks, are differences.\n\n\
    Exit status 0 if nothing differs, 1 if something does.\n\n\
    Example:\n  bitlight render {} --passes all -o out\n  \
    bitlight diff out dumps-of-the-engine --tolerance 1e-5 -o differences", super::example())
)]
pub(super) struct Arguments {
    /// What is expected: an EXR file (or NPY), or a folder of both
    a: PathBuf,
    /// What is compared with it: of the same kind
    b: PathBuf,
    /// Real numbers that differ by no more count as the same
    #[arg(long, value_name = "ABS", default_value_t = 0.0)]
    tolerance: f64,
    /// Folder for a picture of each image that differs
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one object of JSON instead
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        if self.tolerance.is_nan() || self.tolerance < 0.0 {
            let error = Error::new(format!("--tolerance {} is no distance", self.tolerance));
            return Err(error.remedy("give a number of at least 0, such as --tolerance 1e-6"));
        }
        let rows = files(&self.a, &self.b, self.tolerance, self.out.as_deref())?;
        let (count, first) = (rows.iter().filter(|row| !row.same()).count(), diverges_first(&rows));
        if self.json {
            let layers: Vec<Json> = rows.iter().map(|row| row.to_json()).collect();
            let json = json!({
                "a": self.a.to_string_lossy(),
                "b": self.b.to_string_lossy(),
                "tolerance": self.tolerance,
                "same": count == 0,
                "diverges_first": first,
                "layers": layers,
            });
            print(&format!("{json:#}\n"))?;
        } else {
            rows.iter().try_for_each(|row| print(&format!("{row}\n")))?;
            print(&format!("{} the same, {count} not", rows.len() - count))?;
            print(&first.map_or("\n".into(), |name| format!("; {name} diverges first\n")))?;
        }
        Ok(if count > 0 { ExitCode::from(1) } else { ExitCode::SUCCESS })
    }
}
