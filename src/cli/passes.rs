//! `bitlight passes`

use super::{print, technique};
use crate::Error;
use crate::pass::Twin;
use crate::techniques::ALL;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The technique [default: all]
    technique: Option<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let techniques = match &self.technique {
            Some(name) => vec![technique(name)?],
            None => ALL.to_vec(),
        };
        for info in techniques.iter().flat_map(|technique| technique.passes) {
            let axes = info.axes.iter().map(|axis| axis.label()).collect::<Vec<_>>().join(", ");
            let inputs = if info.inputs.is_empty() { "the scene".to_owned() } else { info.inputs.join(", ") };
            let twin = match info.twin {
                Twin::Wgsl(file) => file.to_owned(),
                Twin::Absent(reason) => format!("none: {reason}"),
            };
            print(&format!(
                "{}\n  computes  {}\n  equation  {}\n  inputs    {inputs}\n  output    [{axes}], {}\n  \
                 size by   {}\n  on GPU    {twin}\n\n",
                info.name, info.about, info.equation, info.unit, info.knob
            ))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}
