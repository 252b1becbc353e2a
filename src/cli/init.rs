//! `bitlight init`

use super::{print, technique};
use crate::Error;
use crate::scene::keys;
use crate::techniques::ALL;
use std::process::ExitCode;

fn help() -> String {
    let line =
        |technique: &&crate::techniques::Technique| format!("  {:<14} {}\n", technique.name, technique.about);
    let techniques: String = ALL.iter().map(line).collect();
    let name = ALL[0].name;
    format!(
        "The techniques:\n{techniques}\n\
         Example:\n  bitlight init {name} > mine.toml\n  bitlight render mine.toml"
    )
}

#[derive(Debug, clap::Args)]
#[command(after_help = help())]
pub(super) struct Arguments {
    /// The technique that the scene asks for
    #[arg(required_unless_present = "schema")]
    technique: Option<String>,
    /// Write the JSON Schema of scenes instead
    #[arg(long)]
    schema: bool,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        if self.schema {
            print(&format!("{:#}\n", keys::schema(ALL)))?;
            return Ok(ExitCode::SUCCESS);
        }
        print(&keys::template(technique(&self.technique.unwrap_or_default())?))?;
        Ok(ExitCode::SUCCESS)
    }
}
