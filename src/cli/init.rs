//! `bitlight init`

use super::print;
use crate::Error;
use crate::scene::keys;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  bitlight init translucency > mine.toml\n  bitlight render mine.toml")]
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
            print(&format!("{:#}\n", keys::schema()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let technique = self.technique.unwrap_or_default();
        if !keys::TECHNIQUES.contains(&technique.as_str()) {
            let error = Error::new(format!("there is no technique \"{technique}\""));
            return Err(error.remedy(format!("the techniques are {}", keys::TECHNIQUES.join(", "))));
        }
        print(&keys::template(&technique))?;
        Ok(ExitCode::SUCCESS)
    }
}
