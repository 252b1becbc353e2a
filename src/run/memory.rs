//! How much memory a request needs, computed before anything is allocated.

use crate::Error;
use crate::pass::{Axis, Info};
use crate::scene::Scene;
use crate::techniques::Outline;
use std::collections::BTreeMap;

/// The most bytes that a request may need, as [`memory`] counts them. Pointers of 32 bits cannot address much
/// more, so the limit is lower there.
pub const MAX_MEMORY: u64 = if usize::BITS < 64 { 1 << 30 } else { 8 << 30 };

/// The most bytes that a pass's buffer can have.
///
/// # Panics
/// Where the technique's row does not give the length of an axis that only techniques know.
pub(super) fn shape(scene: &Scene, outline: &Outline<'_>, info: &Info) -> Vec<usize> {
    let length = |axis: &Axis| {
        let own = (scene.technique.length)(outline, info, *axis);
        own.unwrap_or_else(|| match axis {
            Axis::Light => outline.lights,
            Axis::Caster => outline.casters,
            Axis::Face => 6,
            Axis::Row => outline.size[1],
            Axis::Column => outline.size[0],
            Axis::Vertex => outline.vertices,
            Axis::Channel(names) => names.len(),
            Axis::Coefficient | Axis::Of(_) | Axis::Several(_) => {
                panic!(
                    "the row of {} does not tell how long {} of {} is",
                    scene.technique.name,
                    axis.label(),
                    info.name
                )
            }
        })
    };
    info.axes.iter().map(length).collect()
}

/// The bytes of a pass's buffer, at most.
fn buffer(scene: &Scene, outline: &Outline<'_>, info: &Info) -> u64 {
    shape(scene, outline, info).into_iter().map(|length| length as u64).product::<u64>() * 4
}

/// The most bytes that the passes of a request need, from the scene's settings and the number of the solid's
/// vertices (0 before it is loaded). Counted are all buffers, as if none were freed before the end; the
/// recorder's copies of the wanted ones; the largest twice more, while it is made and digested; and what
/// passes need beside their buffers. The solid itself comes on top.
///
/// # Errors
/// An unknown pass.
pub fn memory(scene: &Scene, wanted: &[&str], vertices: usize) -> Result<u64, Error> {
    Ok(by_knob(scene, wanted, &[], vertices)?.values().sum())
}

/// [`memory`], divided among the keys that set the sizes. What only given passes read is left out.
fn by_knob(
    scene: &Scene,
    wanted: &[&str],
    given: &[&str],
    vertices: usize,
) -> Result<BTreeMap<&'static str, u64>, Error> {
    let outline = scene.outline(vertices);
    let (mut bytes, mut largest) = (BTreeMap::new(), ("", 0));
    let mut add = |knob, more| *bytes.entry(knob).or_default() += more;
    for info in scene.technique.needed(wanted, given)? {
        let buffer = buffer(scene, &outline, info);
        add(info.knob, buffer * if wanted.contains(&info.name) { 2 } else { 1 });
        if buffer > largest.1 {
            largest = (info.knob, buffer);
        }
        let runs = !given.contains(&info.name);
        if let Some((knob, more)) = (scene.technique.scratch)(&outline, info).filter(|_| runs) {
            add(knob, more);
        }
    }
    add(largest.0, 2 * largest.1);
    Ok(bytes)
}

/// Refuses a request of more than [`MAX_MEMORY`].
///
/// # Errors
/// Such a request, with the key that sets most of it; an unknown pass.
pub(super) fn check(scene: &Scene, wanted: &[&str], given: &[&str], vertices: usize) -> Result<(), Error> {
    let bytes = by_knob(scene, wanted, given, vertices)?;
    let total: u64 = bytes.values().sum();
    if total <= MAX_MEMORY {
        return Ok(());
    }
    let mut knobs: Vec<_> = bytes.into_iter().filter(|(_, bytes)| *bytes > total / 10).collect();
    knobs.sort_by_key(|(knob, bytes)| (u64::MAX - bytes, *knob));
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let name = |(knob, _): &(&'static str, u64)| match *knob {
        "image.width" => "image.width and image.height",
        knob => knob,
    };
    let smaller = knobs.iter().map(name).collect::<Vec<_>>().join(", ");
    let coarser =
        if vertices > 0 { ", the solid coarser by solid.resolution or solid.triangles" } else { "" };
    // Fewer lights help where the buffers that need most have one image a light.
    let first = knobs.first().map_or("", |(knob, _)| knob);
    let a_light =
        |info: &&Info| info.knob == first && matches!(info.axes.first(), Some(Axis::Light | Axis::Caster));
    let many =
        scene.lights.len() > 1 && scene.technique.passes.iter().any(|info| a_light(&info) && info.is_image());
    let lights = if many { ", use fewer lights" } else { "" };
    Err(Error::new(format!(
        "the passes need {:.1} GiB of memory, over {:.0} GiB",
        gib(total),
        gib(MAX_MEMORY)
    ))
    .key(first)
    .remedy(format!("make {smaller} smaller{coarser}{lights}, or ask for fewer passes")))
}

#[cfg(test)]
mod tests {
    use super::super::Loaded;
    use super::*;
    use crate::pass::Kept;
    use crate::scene::Assets;

    const SCENE: &str = "technique = \"translucency\"\nimage = { width = 7, height = 5 }\n\
        camera = { position = [0, 0, 4] }\nsolid = { shape = \"cuboid\", resolution = 2 }\n\
        light = [{ kind = \"point\", position = [0, 3, 3], intensity = [9, 9, 9] }, \
        { kind = \"environment\", radiance = [1, 1, 1] }]\ntranslucency = { cubemap = 3, shadow = 4 }\n";

    #[test]
    fn the_memory_of_a_buffer_is_known_before_it_is_made() {
        for set in [vec![], vec!["translucency.accumulation=2".to_owned()]] {
            let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
            let mut kept = Kept::default();
            let all = scene.technique.wanted("all").unwrap();
            super::super::render(&scene, &Assets::default(), &all, &mut kept).unwrap();
            assert_eq!(kept.0.len(), all.len());
            for (info, _, made) in &kept.0 {
                assert_eq!(
                    buffer(&scene, &scene.outline(0), info),
                    4 * made.data.len() as u64,
                    "{}",
                    info.name
                );
            }
        }
        let prt = SCENE.split("light = ").next().unwrap().replace("translucency", "prt")
            + "light = [{ kind = \"environment\", radiance = [1, 1, 1] }]\nprt = { bands = 3, directions = 40 }\n";
        let glossy = ["surface.highlight=phong", "prt.bounces=1", "prt.subsurface=dipole"];
        for set in [&[][..], &glossy[..1], &glossy] {
            let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
            let scene = Scene::parse(&prt, "a.toml".as_ref(), &set).unwrap();
            let all = scene.technique.wanted("all").unwrap();
            let loaded = Loaded::new(&scene, &Assets::default(), &all).unwrap();
            let mut kept = Kept::default();
            loaded.render(&scene, &all, &mut kept).unwrap();
            for (info, _, made) in &kept.0 {
                let expected = buffer(&scene, &scene.outline(loaded.solid.positions.len()), info);
                assert_eq!(expected, 4 * made.data.len() as u64, "{} under {set:?}", info.name);
            }
        }
    }

    /// What the doc comments of the techniques' `scratch` say, in numbers.
    #[test]
    fn what_passes_need_beside_their_buffers_counts() {
        let scene = Scene::parse(SCENE, "a.toml".as_ref(), &[]).unwrap();
        let buffer = 2 * 6 * 3 * 3 * 4 * 4; // two lights, six faces of 3 x 3 texels, four channels of four bytes
        // The buffer, the recorder's copy, twice while it is digested; 26 bytes a texel.
        let expected = 4 * buffer + 6 * 3 * 3 * 26;
        assert_eq!(memory(&scene, &["translucency.cubemap"], 0), Ok(expected));
        let bouncing = SCENE.split("light = ").next().unwrap().replace("translucency", "prt")
            + "light = [{ kind = \"environment\", radiance = [1, 1, 1] }]\nprt = { bands = 1, directions = 32, bounces = 1 }\n";
        let of = |set: &str| {
            let scene = Scene::parse(&bouncing, "a.toml".as_ref(), &[set.to_owned()]).unwrap();
            memory(&scene, &["prt.vectors"], 10).unwrap()
        };
        // Half of 32 directions of ten vertices, 52 bytes each.
        assert_eq!(of("prt.bounces=1") - of("prt.bounces=0"), 10 * 16 * 52);
        // What is given needs no inputs, and nothing beside its buffer.
        let scene = Scene::parse(&bouncing, "a.toml".as_ref(), &[]).unwrap();
        let given = by_knob(&scene, &["prt.shading"], &["prt.vectors"], 10).unwrap();
        let all = by_knob(&scene, &["prt.shading"], &[], 10).unwrap();
        assert_eq!(all["prt.directions"] - given["prt.directions"], 10 * 16 * 52);
    }

    #[test]
    fn a_request_beyond_the_memory_is_refused_by_its_greatest_part() {
        let refusal = |set: &[&str]| {
            let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
            let scene = Scene::parse(SCENE, "a.toml".as_ref(), &set).unwrap();
            check(&scene, &scene.technique.wanted("all").unwrap(), &[], 0)
                .map_err(|error| error.key.unwrap_or_default())
        };
        assert_eq!(refusal(&[]), Ok(()));
        assert_eq!(refusal(&["image.width=8192", "image.height=8192"]), Err("image.width".into()));
        assert_eq!(refusal(&["translucency.shadow=8192"]), Ok(()));
        assert_eq!(
            refusal(&["translucency.cubemap=2048", "image.width=4096", "image.height=4096"]),
            Err("translucency.cubemap".into())
        );
    }
}
