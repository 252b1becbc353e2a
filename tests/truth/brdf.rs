//! Drawing directions from a reflection: against quadrature of the reflection and of the density.

use crate::{agrees, estimate};
use bitlight::sphere::quadrature::gauss_legendre;
use bitlight::world::brdf::{Brdf, Gloss, polar};
use glam::Vec3;

fn brdfs() -> Vec<Brdf> {
    let (albedo, specular) = (Vec3::new(0.5, 0.3, 0.0), Vec3::new(0.1, 0.4, 0.9));
    [
        Gloss::None,
        Gloss::Phong { exponent: 0.0 },
        Gloss::Phong { exponent: 30.0 },
        Gloss::CookTorrance { roughness: 0.15 },
        Gloss::CookTorrance { roughness: 0.6 },
    ]
    .map(|gloss| Brdf { albedo, specular, gloss })
    .to_vec()
}

/// ∫ f over the hemisphere: 400 nodes of the cosine's square root, which crowd where lobes meet the horizon,
/// by 800 turns.
fn hemisphere(f: impl Fn(Vec3) -> Vec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (node, weight) in gauss_legendre(400) {
        let root = 0.5 * (node + 1.0);
        for turn in 0..800 {
            let value = f(polar((root * root) as f32, (turn as f32 + 0.5) / 800.0));
            let area = weight * root * 2.0 * std::f64::consts::PI / 800.0;
            (0..3).for_each(|channel| sum[channel] += f64::from(value[channel]) * area);
        }
    }
    sum
}

#[test]
fn draws_weigh_up_to_the_directional_albedo_and_hit_as_often_as_their_density_says() {
    for brdf in brdfs() {
        for cosine in [0.95, 0.5, 0.15] {
            let eye = polar(cosine, 0.3);
            let what = format!("{:?} at {cosine}", brdf.gloss);
            let albedo = hemisphere(|light| brdf.value(light, eye) * light.z);
            let drawn = estimate(40_000, |random| {
                let (choice, uv) = (random.unit(), random.pair());
                brdf.sample(eye, choice, uv)
                    .map_or(Vec3::ZERO, |light| brdf.value(light, eye) * (light.z / brdf.pdf(light, eye)))
            });
            agrees(&drawn, albedo, 2e-4, &what);
            // The density weighted by what tells directions apart: 1, x and y.
            let moments = |light: Vec3| Vec3::new(1.0, light.x, light.y);
            let expected = hemisphere(|light| moments(light) * brdf.pdf(light, eye));
            let drawn = estimate(40_000, |random| {
                let (choice, uv) = (random.unit(), random.pair());
                brdf.sample(eye, choice, uv).map_or(Vec3::ZERO, moments)
            });
            agrees(&drawn, expected, 2e-4, &what);
        }
    }
}
