//! The scenes under test, rendered once, and what the oracle knows of them: numbers from the scene's
//! settings, the published tables, and the mesh.

use std::sync::OnceLock;

use bitlight::pass::{Buffer, Kept};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight_reference::tables;
use bitlight_reference::translucency::cube::Aabb;
use bitlight_reference::translucency::dipole::Medium;
use bitlight_reference::translucency::optics;
use bitlight_reference::translucency::{eq10_radiosity, eq11_constants, eq11_matrix};
use bitlight_reference::vector::{Vec3, dot, length, normalize, scale, sub};

use crate::oracle::View;
use crate::{larger, smaller};

/// Where every solid's box is centred, so that nothing may take the origin for its centre.
pub(crate) const CENTRE: Vec3 = [1.5, -2.25, 0.75];

/// A light in f64.
#[derive(Clone)]
pub(crate) enum Lamp {
    Point { position: Vec3, intensity: Vec3 },
    Directional { direction: Vec3, irradiance: Vec3 },
    Environment { matrices: Box<[[[f64; 4]; 4]; 3]> },
}

impl Lamp {
    /// For a casting light the unit direction towards it and its irradiance on a surface that faces it.
    pub(crate) fn arriving(&self, point: Vec3) -> Option<(Vec3, Vec3)> {
        match self {
            Self::Point { position, intensity } => {
                let to = sub(*position, point);
                Some((normalize(to), scale(1.0 / dot(to, to), *intensity)))
            }
            Self::Directional { direction, irradiance } => Some((scale(-1.0, *direction), *irradiance)),
            Self::Environment { .. } => None,
        }
    }

    /// Irradiance, and the cosine at which it arrives.
    pub(crate) fn illuminates(&self, point: Vec3, normal: Vec3) -> [f64; 4] {
        let mut result = [0.0; 4];
        for (channel, value) in result.iter_mut().take(3).enumerate() {
            *value = match self {
                Self::Point { position, intensity } => {
                    optics::point_light_irradiance(intensity[channel], *position, point, normal)
                }
                Self::Directional { direction, irradiance } => {
                    optics::directional_light_irradiance(irradiance[channel], *direction, normal)
                }
                Self::Environment { matrices } => larger(eq10_radiosity(&matrices[channel], normal), 0.0),
            };
        }
        result[3] = match self.arriving(point) {
            Some((towards, _)) => larger(dot(normal, towards), 0.0),
            None => optics::effective_diffuse_cosine(),
        };
        result
    }

    /// The size of the terms that make up an irradiance: what its rounding errors are relative to.
    pub(crate) fn magnitude(&self, point: Vec3, channel: usize) -> f64 {
        match self {
            Self::Environment { matrices } => matrices[channel].iter().flatten().map(|m| m.abs()).sum(),
            _ => self.arriving(point).map_or(0.0, |(_, facing)| facing[channel]),
        }
    }
}

/// What the oracle computes from, in f64 and in the scene's unit.
pub(crate) struct World {
    pub(crate) triangles: Vec<[Vec3; 3]>,
    pub(crate) normals: Vec<[Vec3; 3]>,
    pub(crate) bounds: Aabb,
    /// What the six views fill: the box, or a cube around it.
    pub(crate) viewed: Aabb,
    pub(crate) lamps: Vec<Lamp>,
    /// For each casting light its index and its view.
    pub(crate) casters: Vec<(usize, View)>,
    pub(crate) eye: Vec3,
    pub(crate) camera: View,
    pub(crate) media: [Medium; 3],
    pub(crate) eta: f64,
    pub(crate) gloss: f64,
    pub(crate) background: Vec3,
    pub(crate) cubemap: usize,
    pub(crate) blur: u32,
    /// Whether the letter of the paper is read.
    pub(crate) paper: bool,
    /// What Eq. 12 to the letter takes for the thickness below it.
    pub(crate) smallest_d: f64,
    /// Whether the radiosity is evaluated at the vertices.
    pub(crate) per_vertex: bool,
    pub(crate) second_layer: bool,
    pub(crate) shift_cure: bool,
}

/// A scene, the oracle's view of it, and every buffer that was made of it.
pub(crate) struct Rendered {
    pub(crate) name: &'static str,
    pub(crate) world: World,
    kept: Kept,
}

impl Rendered {
    pub(crate) fn new(name: &'static str, text: &str, set: &[&str]) -> Self {
        let (scene, kept) = render(text, set);
        Self { name, world: World::new(&scene), kept }
    }

    pub(crate) fn buffer(&self, pass: &str) -> &Buffer {
        self.kept.get(&format!("translucency.{pass}")).unwrap_or_else(|| panic!("{pass} has not run"))
    }

    /// Position and normal of a pixel, recorded by `gbuffer`; none where the camera sees nothing.
    pub(crate) fn pixel(&self, index: usize) -> Option<(Vec3, Vec3)> {
        let texel: Vec<f64> =
            self.buffer("gbuffer").as_f32()[index * 7..][..7].iter().map(|value| f64::from(*value)).collect();
        (texel[6] != 0.0).then(|| ([texel[0], texel[1], texel[2]], [texel[3], texel[4], texel[5]]))
    }

    pub(crate) fn pixels(&self) -> usize {
        self.world.camera.size[0] * self.world.camera.size[1]
    }
}

/// Parses and renders every pass.
pub(crate) fn render(text: &str, set: &[&str]) -> (Scene, Kept) {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let scene = Scene::parse(text, "oracle.toml".as_ref(), &set).unwrap();
    let mut kept = Kept::default();
    let all = scene.technique.wanted("all").unwrap();
    run::render(&scene, &Assets::default(), &all, &mut kept).unwrap();
    (scene, kept)
}

/// The head of a scene: all but its lights. Sizes are odd against each other so that none can stand for
/// another.
pub(crate) fn head(solid: &str, material: &str) -> String {
    format!(
        r#"
technique = "translucency"
unit = "mm"
image = {{ width = 40, height = 32, background = [0.125, 0.25, 0.5] }}
camera = {{ position = [6, 8, 46], target = [1, -2, 0.5], up = [0.25, 1, 0], fov = 27 }}
solid = {{ {solid}, center = [1.5, -2.25, 0.75] }}
material = {{ {material}, gloss = 20 }}
translucency = {{ cubemap = 12, shadow = 48, blur = 5 }}
"#
    )
}

pub(crate) const POINT: &str =
    "[[light]]\nkind = \"point\"\nposition = [-22, 16, -30]\nintensity = [5200, 4600, 3800]\n";
pub(crate) const BEAM: &str =
    "[[light]]\nkind = \"directional\"\ndirection = [-0.5, -0.75, -1]\nirradiance = [1, 2, 3]\n";
pub(crate) const PROBE: &str = "[[light]]\nkind = \"environment\"\nprobe = \"grace\"\nscale = 0.5\n";
pub(crate) const EVEN: &str = "[[light]]\nkind = \"environment\"\nradiance = [0.5, 0.75, 1.5]\n";

/// The solids under test: convex, knotted, a box far from a cube, and one with handles.
pub(crate) const SOLIDS: [(&str, &str, &str); 4] = [
    ("sphere", "shape = \"sphere\", resolution = 9, size = 20", "name = \"Marble\""),
    ("knot", "shape = \"torus-knot\", resolution = 8, size = 22, turn = 30", "name = \"Skin1\""),
    ("cuboid", "shape = \"cuboid\", resolution = 5, extents = [7, 19, 3.5]", "name = \"Ketchup\""),
    (
        "genus-3",
        "shape = \"genus-3\", resolution = 10, size = 24, turn = -70",
        "name = \"Wholemilk\", eta = 1.5",
    ),
];

/// What is set otherwise, by the solid that it is set on: the letter of the paper with an even and an odd
/// blur, and without the cures of figures 7, 8 and 9.
const VARIANTS: [(&str, usize, &[&str]); 9] = [
    ("sphere to the letter", 0, &["translucency.reading=paper", "translucency.blur=8"]),
    (
        "knot to the letter",
        1,
        &["translucency.reading=paper", "translucency.blur=4", "translucency.smallest_d=0.25"],
    ),
    ("cuboid to the letter", 2, &["translucency.reading=paper"]),
    ("genus-3 to the letter", 3, &["translucency.reading=paper", "translucency.blur=0"]),
    ("cuboid in a cube", 2, &["translucency.blindness_cure=false"]),
    ("genus-3 shifted", 3, &["translucency.shift_cure=false"]),
    (
        "knot without a cure",
        1,
        &[
            "translucency.blindness_cure=false",
            "translucency.shift_cure=false",
            "translucency.second_layer=false",
        ],
    ),
    ("sphere per vertex", 0, &["translucency.evaluation=vertex", "translucency.second_layer=false"]),
    (
        "knot per vertex to the letter",
        1,
        &["translucency.evaluation=vertex", "translucency.reading=paper", "translucency.blur=8"],
    ),
];

/// One scene a solid, each under a point, a direction, a published probe and a constant environment, and one
/// with the lights in another order.
pub(crate) fn scenes() -> &'static [Rendered] {
    static SCENES: OnceLock<Vec<Rendered>> = OnceLock::new();
    SCENES.get_or_init(|| {
        let render = |(name, solid, material): (&'static str, &str, &str)| {
            Rendered::new(name, &[&head(solid, material), PROBE, POINT, EVEN, BEAM].concat(), &[])
        };
        let mut scenes: Vec<_> = SOLIDS.into_iter().map(render).collect();
        // Without the blur a lookup at a silhouette meets empty texels; and odd sizes have texels in the
        // middle.
        let (_, solid, material) = SOLIDS[1];
        let text = [&head(solid, material), BEAM, EVEN, POINT, PROBE].concat();
        let knobs = "cubemap = 12, shadow = 48, blur = 5";
        assert!(text.contains(knobs));
        scenes.push(Rendered::new(
            "unblurred",
            &text.replace(knobs, "cubemap = 9, shadow = 33, blur = 0"),
            &[],
        ));
        scenes
    })
}

/// [`scenes`], and the same solids under [`VARIANTS`].
pub(crate) fn all() -> impl Iterator<Item = &'static Rendered> {
    static SCENES: OnceLock<Vec<Rendered>> = OnceLock::new();
    let variants = SCENES.get_or_init(|| {
        let render = |(name, solid, set): (&'static str, usize, &[&str])| {
            let (_, solid, material) = SOLIDS[solid];
            Rendered::new(name, &[&head(solid, material), PROBE, POINT, EVEN, BEAM].concat(), set)
        };
        VARIANTS.into_iter().map(render).collect()
    });
    scenes().iter().chain(variants)
}

impl World {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mesh = run::Loaded::new(scene, &Assets::default(), &[]).unwrap().posed(scene).unwrap();
        let corners = |of: &[glam::Vec3]| -> Vec<[Vec3; 3]> {
            let corner = |index: u32| of[index as usize].to_array().map(f64::from);
            mesh.triangles.iter().map(|triangle| triangle.map(corner)).collect()
        };
        let (triangles, normals) = (corners(&mesh.positions), corners(&mesh.normals));
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in triangles.iter().flatten() {
            for axis in 0..3 {
                min[axis] = smaller(min[axis], corner[axis]);
                max[axis] = larger(max[axis], corner[axis]);
            }
        }
        let bounds = Aabb { min, max };

        let settings = &scene.settings();
        let number = |key: &str| settings.get(key).and_then(|value| value.as_f64());
        let triple = |key: &str| {
            [0, 1, 2].map(|i| settings[key][i].as_f64().unwrap_or_else(|| panic!("{key} is no triple")))
        };
        let text = |key: &str| settings.get(key).and_then(|value| value.as_str());

        let flag = |key: &str| settings[key].as_bool().unwrap_or_else(|| panic!("{key} is neither"));
        let longest = bounds.half_extents().into_iter().fold(0.0, larger);
        let cube = |side: f64| bounds.centre().map(|middle| middle + side * longest);
        let viewed = match flag("translucency.blindness_cure") {
            true => bounds,
            false => Aabb { min: cube(-1.0), max: cube(1.0) },
        };

        let lamps: Vec<Lamp> = (0..)
            .map_while(|index| Some((index, text(&format!("light[{index}].kind"))?)))
            .map(|(index, kind)| {
                let key = |name: &str| format!("light[{index}].{name}");
                match kind {
                    "point" => Lamp::Point {
                        position: triple(&key("position")),
                        intensity: triple(&key("intensity")),
                    },
                    "directional" => Lamp::Directional {
                        direction: normalize(triple(&key("direction"))),
                        irradiance: triple(&key("irradiance")),
                    },
                    _ => {
                        let factor = number(&key("scale")).unwrap_or(1.0);
                        let channel = |channel: usize| {
                            let coefficients = match text(&key("probe")) {
                                Some(name) => tables::probe(name).unwrap().channel(channel),
                                None => {
                                    // The coefficients of a constant, by quadrature.
                                    let radiance = triple(&key("radiance"))[channel];
                                    let projected = bitlight_reference::sh::project(3, |_| radiance, 2);
                                    projected.try_into().unwrap()
                                }
                            };
                            eq11_matrix(&coefficients.map(|value| value * factor), &eq11_constants())
                        };
                        Lamp::Environment { matrices: Box::new([0, 1, 2].map(channel)) }
                    }
                }
            })
            .collect();

        let shadow = number("translucency.shadow").unwrap() as usize;
        let view = |lamp: &Lamp| match lamp {
            Lamp::Point { position, .. } => Some(View::from_point(*position, &bounds, shadow)),
            Lamp::Directional { direction, .. } => Some(View::from_direction(*direction, &bounds, shadow)),
            Lamp::Environment { .. } => None,
        };
        let casters =
            lamps.iter().enumerate().filter_map(|(index, lamp)| Some((index, view(lamp)?))).collect();

        let material = tables::material(text("material.name").unwrap_or("Marble")).unwrap();
        let eta = number("material.eta").unwrap_or(material.eta);
        let factor = match text("unit") {
            Some("mm") => 1.0,
            Some("cm") => 0.1,
            _ => 0.001,
        };
        let media = [0, 1, 2].map(|channel| Medium { eta, ..material.medium(channel) }.with_unit(factor));
        let eye = triple("camera.position");
        Self {
            camera: View::camera(
                eye,
                triple("camera.target"),
                triple("camera.up"),
                number("camera.fov").unwrap(),
                scene.size,
                &bounds,
            ),
            triangles,
            normals,
            smallest_d: number("translucency.smallest_d").unwrap_or(1e-3 * length(bounds.half_extents())),
            paper: text("translucency.reading") == Some("paper"),
            viewed,
            per_vertex: text("translucency.evaluation") == Some("vertex"),
            second_layer: flag("translucency.second_layer"),
            shift_cure: flag("translucency.shift_cure"),
            bounds,
            lamps,
            casters,
            eye,
            media,
            eta,
            gloss: number("material.gloss").unwrap(),
            background: triple("image.background"),
            cubemap: number("translucency.cubemap").unwrap() as usize,
            blur: number("translucency.blur").unwrap() as u32,
        }
    }

    /// The refraction vector at a point of the surface.
    pub(crate) fn refracted(&self, point: Vec3, normal: Vec3) -> Vec3 {
        optics::refraction_vector(scale(-1.0, self.towards_eye(point)), normal, self.eta)
    }

    /// The unit direction from a point to the camera.
    pub(crate) fn towards_eye(&self, point: Vec3) -> Vec3 {
        normalize(sub(self.eye, point))
    }

    /// Transmittance towards the eye.
    pub(crate) fn leaving(&self, point: Vec3, normal: Vec3) -> f64 {
        optics::schlick_transmittance(self.eta, dot(normal, self.towards_eye(point)))
    }
}

/// The solids are where and as large as the scene says: the oracle takes the mesh for granted from here on.
#[test]
fn solids_stand_where_the_scene_puts_them() {
    for (scene, longest) in scenes().iter().zip([20.0, 22.0, 19.0, 24.0]) {
        let (centre, half) = (scene.world.bounds.centre(), scene.world.bounds.half_extents());
        let side = half.into_iter().fold(0.0, larger) * 2.0;
        let turned = scene.name == "knot" || scene.name == "genus-3";
        for axis in 0..3 {
            assert!((centre[axis] - CENTRE[axis]).abs() < 1e-5, "{}: {centre:?}", scene.name);
        }
        // The longest side is that before turning.
        assert!((side - longest).abs() < if turned { 0.2 * longest } else { 1e-5 }, "{}: {side}", scene.name);
    }
}
