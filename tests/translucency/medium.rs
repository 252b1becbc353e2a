//! The medium itself, over all published materials.

use bitlight::world::medium::Medium;
use bitlight_reference::tables::JENSEN_2001;
use bitlight_reference::translucency::optics;

use crate::{U, Worst};

/// Dipole, wall, reflectance and transmittance of every material in every unit. e⁻ˣ in f32 has the relative error of
/// its argument, x times some [`U`]; the rest is some ten operations.
#[test]
fn every_published_material() {
    let mut worst = Worst::new("medium");
    for material in JENSEN_2001 {
        for (millimetres, factor) in [(1.0, 1.0), (10.0, 0.1), (1000.0, 0.001)] {
            let rgb = |of: [f64; 3]| of.map(|value| value as f32);
            let (scattering, absorption) = (rgb(material.sigma_s_prime), rgb(material.sigma_a));
            let ours = Medium::new(scattering, absorption, material.eta as f32, millimetres);
            for (channel, dipole) in ours.dipoles.iter().enumerate() {
                let theirs = material.medium(channel).with_unit(factor);
                let place = (material.name, channel, millimetres);
                let relative = |x: f64, n: f64| n * U * x;
                worst.check(dipole.albedo, theirs.alpha_prime(), relative(1.0, 4.0), place);
                worst.check(dipole.extinction, theirs.sigma_tr(), relative(theirs.sigma_tr(), 4.0), place);
                worst.check(dipole.real, theirs.z_r(), relative(theirs.z_r(), 4.0), place);
                worst.check(dipole.virtual_, theirs.z_v(), relative(theirs.z_v(), 8.0), place);
                let total = theirs.total_r_d();
                worst.check(dipole.reflectance(), total, relative(total, 12.0), place);
                for paths in [0.0, 0.25, 1.0, 4.0, 20.0] {
                    let d = f64::from((paths * theirs.z_r()) as f32);
                    let exponent = theirs.sigma_tr() * (d + theirs.z_v());
                    let (wall, kernel) = (theirs.attenuation(d) * std::f64::consts::PI, theirs.r_d(d));
                    worst.check(dipole.wall(d as f32), wall, relative(wall, 12.0 + 6.0 * exponent), place);
                    worst.check(
                        dipole.kernel(d as f32),
                        kernel,
                        relative(kernel, 20.0 + 6.0 * exponent),
                        place,
                    );
                }
            }
            for step in -2..=18 {
                let cosine = f64::from(step) / 16.0;
                let expected = optics::schlick_transmittance(material.eta, cosine);
                worst.check(ours.transmittance(cosine as f32), expected, 8.0 * U, (material.name, step));
            }
        }
    }
    worst.check(Medium::diffuse_cosine(), optics::effective_diffuse_cosine(), U, "diffuse cosine");
    worst.done(1000);
}
