//! `bitlight info`

use super::print;
use crate::Error;
use crate::pass::Data;
use crate::store::file;
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// An .obj, .hdr or .exr file
    file: PathBuf,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let ending = self.file.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let text = match ending.as_deref() {
            Some("obj") => mesh(&self.file)?,
            Some("hdr") => environment(&self.file)?,
            Some("exr") => image(&self.file)?,
            _ => {
                let error = Error::new("its ending is none of .obj, .hdr and .exr").file(&self.file);
                return Err(error.remedy("name a mesh, an environment or an image"));
            }
        };
        print(&text)?;
        Ok(ExitCode::SUCCESS)
    }
}

fn vector(v: Vec3) -> String {
    format!("({}, {}, {})", v.x, v.y, v.z)
}

fn mesh(path: &Path) -> Result<String, Error> {
    let facts = file::read_obj(path)?.facts();
    Ok(format!(
        "{}: a mesh\n  vertices             {} ({} used)\n  triangles            {} ({} without area)\n  \
         boundary edges       {}\n  non-manifold edges   {}\n  closed               {}\n  \
         Euler characteristic {}\n  bounding box         {} to {}\n  area                 {}\n  \
         volume               {}\n",
        path.display(),
        facts.vertices,
        facts.used_vertices,
        facts.triangles,
        facts.zero_area_triangles,
        facts.boundary_edges,
        facts.non_manifold_edges,
        if facts.closed { "yes" } else { "no" },
        facts.euler_characteristic,
        vector(facts.bounds.low),
        vector(facts.bounds.high),
        facts.area,
        facts.signed_volume,
    ))
}

fn environment(path: &Path) -> Result<String, Error> {
    let map = file::read_hdr(path)?;
    let brightest = map.texels().iter().map(|rgb| rgb.max_element()).fold(0.0, crate::numeric::order::max);
    let mean = map.project(1)[0].map(|c00| c00 / (4.0 * std::f32::consts::PI).sqrt());
    Ok(format!(
        "{}: a lat-long environment\n  size              {} x {}\n  mean radiance     {}\n  \
         brightest channel {brightest}\n",
        path.display(),
        map.width(),
        map.height(),
        vector(Vec3::from_array(mean)),
    ))
}

fn image(path: &Path) -> Result<String, Error> {
    let mut text = format!("{}: an image\n", path.display());
    for layer in file::read_exr(path)? {
        text.push_str(&format!("  {} ({} x {})\n", layer.name, layer.width, layer.height));
        for channel in &layer.channels {
            text.push_str(&format!(
                "    {:<10} {} {}\n",
                channel.name,
                channel.data.type_name(),
                range(&channel.data)
            ));
        }
    }
    Ok(text)
}

fn range(data: &Data) -> String {
    fn ends<T: PartialOrd + Copy + std::fmt::Display>(values: &[T]) -> String {
        let Some(first) = values.first() else { return "empty".into() };
        let (low, high) = values.iter().fold((*first, *first), |(low, high), value| {
            (if *value < low { *value } else { low }, if *value > high { *value } else { high })
        });
        format!("{low} to {high}")
    }
    match data {
        Data::F32(values) => ends(values),
        Data::U32(values) => ends(values),
    }
}
