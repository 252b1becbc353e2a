//! `bitlight passes`

use super::print;
use crate::pass::Info;
use crate::scene::keys::TECHNIQUES;
use crate::{Error, run};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The technique; all where none is named
    technique: Option<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        if let Some(name) = self.technique.as_deref().filter(|name| !TECHNIQUES.contains(name)) {
            let error = Error::new(format!("there is no technique \"{name}\""));
            return Err(error.remedy(format!("the techniques are {}", TECHNIQUES.join(", "))));
        }
        let technique = |info: &&Info| match &self.technique {
            Some(name) => info.name.starts_with(&format!("{name}.")),
            None => true,
        };
        for info in run::passes().filter(technique) {
            let axes = info.axes.iter().map(|axis| axis.label()).collect::<Vec<_>>().join(", ");
            let inputs = if info.inputs.is_empty() { "the scene".to_owned() } else { info.inputs.join(", ") };
            print(&format!(
                "{}\n  computes  {}\n  equation  {}\n  inputs    {inputs}\n  output    [{axes}], {}\n\n",
                info.name, info.about, info.equation, info.unit
            ))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}
