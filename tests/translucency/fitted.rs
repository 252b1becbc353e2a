//! Shadow maps that just hold the solid: how many texels it covers, and how far recorded distances are from
//! rays.

use bitlight::pass::Kept;
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight::techniques::translucency::{self, Frame};
use bitlight_reference::vector::{Vec3, cross, dot, length, normalize, scale, sub};

use crate::larger;
use crate::world::head;

/// Solids that fill their boxes' maps badly: a turned slab, a knot, and a rod along its box's diagonal.
const SOLIDS: [(&str, &str); 3] = [
    ("slab", "shape = \"cuboid\", resolution = 8, extents = [7, 19, 3.5], turn = 35"),
    ("knot", "shape = \"torus-knot\", resolution = 8, size = 22, turn = 30"),
    ("rod", "shape = \"cuboid\", resolution = 8, extents = [22, 3, 3], turn = 45"),
];

const FITS: [&str; 2] = ["box", "solid"];

/// Where a light stands `away` from the solid's centre; with `None` the same direction, from everywhere.
fn light(away: Option<f64>) -> String {
    let towards = normalize([-0.5, 0.7, -0.9]);
    match away {
        Some(away) => {
            let [x, y, z] = [0, 1, 2].map(|i| towards[i] * away + crate::world::CENTRE[i]);
            format!("[[light]]\nkind = \"point\"\nposition = [{x}, {y}, {z}]\nintensity = [1, 1, 1]\n")
        }
        None => {
            let [x, y, z] = scale(-1.0, towards);
            format!(
                "[[light]]\nkind = \"directional\"\ndirection = [{x}, {y}, {z}]\nirradiance = [1, 1, 1]\n"
            )
        }
    }
}

struct Map {
    frame: Frame,
    distances: Vec<f32>,
}

impl Map {
    fn new(solid: &str, away: Option<f64>, fit: &str, size: usize) -> Self {
        let text = head(solid, "name = \"Marble\"") + &light(away);
        let set = [format!("translucency.fit={fit}"), format!("translucency.shadow={size}")];
        let scene = Scene::parse(&text, "fitted.toml".as_ref(), &set).unwrap();
        let mut kept = Kept::default();
        run::render(&scene, &Assets::default(), &["translucency.shadow"], &mut kept).unwrap();
        let texels = kept.get("translucency.shadow").unwrap().as_f32();
        let distances = texels.chunks_exact(3).map(|texel| texel[0]).collect();
        let loaded = run::Loaded::new(&scene, &Assets::default(), &[]).unwrap();
        let settings = translucency::Settings::read(&scene.values);
        Self { frame: Frame::new(loaded.stage(&scene).unwrap(), settings).unwrap(), distances }
    }

    fn covered(&self) -> usize {
        self.distances.iter().filter(|distance| **distance > 0.0).count()
    }

    /// The distance that the texel at a point holds.
    fn at(&self, point: glam::Vec3) -> Option<f64> {
        let shadow = &self.frame.casters[0].shadow;
        let size = shadow.view.width;
        let [x, y] = shadow.texel(point);
        assert!((0.0..size as f32).contains(&x) && (0.0..size as f32).contains(&y), "({x}, {y})");
        let distance = self.distances[y as usize * size + x as usize];
        (distance > 0.0).then_some(f64::from(distance))
    }
}

/// The distances are of the nearest, of a near and of far lights: at 10⁵ the solid's 11 is 10⁻⁴ of the way.
const AWAY: [Option<f64>; 6] = [Some(16.0), Some(40.0), Some(400.0), Some(1e4), Some(1e5), None];

#[test]
fn the_solid_covers_more_of_its_own_map_and_no_less_from_afar() {
    let size = 256;
    for (name, solid) in SOLIDS {
        let shares: Vec<[f64; 2]> = AWAY
            .iter()
            .map(|away| {
                FITS.map(|fit| Map::new(solid, *away, fit, size).covered() as f64 / (size * size) as f64)
            })
            .collect();
        for (away, [boxed, fitted]) in AWAY.iter().zip(&shares) {
            eprintln!(
                "{name}, light at {away:?}: {:.1} % with box, {:.1} % with solid",
                boxed * 100.0,
                fitted * 100.0
            );
            assert!(*fitted > 1.05 * boxed, "{name} at {away:?}: {fitted} for {boxed}");
        }
        // Parallel light is the limit.
        let limit = shares[5][1];
        for [_, fitted] in &shares[2..] {
            assert!((fitted - limit).abs() < 0.02 * limit, "{name}: {fitted} in the limit {limit}");
        }
        let least = shares.iter().map(|[_, fitted]| *fitted).fold(1.0, crate::smaller);
        assert!(least > 0.95 * shares[0][1], "{name}: {least}, and {} near by", shares[0][1]);
    }
}

/// Nearest hit of a ray with any triangle (Möller and Trumbore 1997), in f64.
fn first_hit(triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> f64 {
    let mut nearest = f64::INFINITY;
    for [a, b, c] in triangles {
        let (ab, ac, from) = (sub(*b, *a), sub(*c, *a), sub(origin, *a));
        let across = cross(direction, ac);
        let determinant = dot(ab, across);
        if determinant.abs() < 1e-12 {
            continue;
        }
        let (u, along) = (dot(from, across) / determinant, cross(from, ab));
        let (v, t) = (dot(direction, along) / determinant, dot(ac, along) / determinant);
        if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && t < nearest {
            nearest = t;
        }
    }
    nearest
}

/// The mean difference between the texel at a triangle's middle and the ray from the light through that
/// middle, over all triangles: what the thickness is made of.
fn error(map: &Map, away: Option<f64>) -> f64 {
    let solid = &map.frame.stage.solid;
    let triangles: Vec<[Vec3; 3]> = solid
        .triangles
        .iter()
        .map(|triangle| triangle.map(|corner| solid.positions[corner as usize].to_array().map(f64::from)))
        .collect();
    let (mut total, mut count) = (0.0, 0);
    for triangle in &triangles {
        let middle = [0, 1, 2].map(|i| (triangle[0][i] + triangle[1][i] + triangle[2][i]) / 3.0);
        let point = glam::DVec3::from(middle).as_vec3();
        let Some(recorded) = map.at(point) else { continue };
        let towards = normalize([-0.5, 0.7, -0.9]);
        // From just before the solid, so that the ray is exact for a distant light too.
        let (before, direction) = match away {
            Some(away) => {
                let eye = [0, 1, 2].map(|i| f64::from((towards[i] * away + crate::world::CENTRE[i]) as f32));
                (length(sub(middle, eye)), normalize(sub(middle, eye)))
            }
            None => (f64::from(map.frame.casters[0].shadow.distance(point)), scale(-1.0, towards)),
        };
        let origin = sub(middle, scale(60.0, direction));
        let hit = before - 60.0 + first_hit(&triangles, origin, direction);
        total += (recorded - hit).abs();
        count += 1;
    }
    assert!(count * 10 > triangles.len() * 9, "{count} of {} lie on the map", triangles.len());
    total / f64::from(count as u32)
}

#[test]
fn distances_on_the_solids_own_map_are_nearer_to_rays() {
    for (name, solid) in SOLIDS {
        let mut worst: f64 = 0.0;
        for away in [Some(16.0), Some(40.0), Some(400.0), Some(1e4), None] {
            let [boxed, fitted] = FITS.map(|fit| error(&Map::new(solid, away, fit, 96), away));
            eprintln!(
                "{name}, light at {away:?}: mean error of a distance {boxed:.4} with box, {fitted:.4} with solid"
            );
            worst = larger(worst, fitted / boxed);
        }
        assert!(worst < 0.97, "{name}: {worst}");
    }
}
