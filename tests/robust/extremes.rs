//! Sizes, places and strengths at the ends of what numbers hold: a finite picture with a solid in it, or an
//! error that says which key.

use super::SCENE;
use bitlight::pass::{Data, Kept};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use std::path::Path;

/// Renders every pass; the picture's greatest value, or the error.
fn brightest(text: &str, assets: &Assets, set: &[&str]) -> Result<f32, String> {
    let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
    let mut kept = Kept::default();
    let rendered = Scene::parse(text, Path::new("a.toml"), &set).and_then(|scene| {
        let all = scene.technique.wanted("all").unwrap();
        run::render(&scene, assets, &all, &mut kept)
    });
    rendered.map_err(|error| {
        assert!(error.remedy.is_some() && error.file.is_some(), "{error}");
        error.to_string()
    })?;
    for (info, _, buffer) in &kept.0 {
        assert_eq!(buffer.first_not_finite(), None, "{} under {set:?}", info.name);
        if let (Data::F32(values), false) = (&buffer.data, info.name.ends_with("projection")) {
            // The letter of the print holds no thickness to at least 0.
            let signed = text.contains("paper") || set.iter().any(|set| set.ends_with("paper"));
            let signed = signed || ["gbuffer", "matrices"].iter().any(|name| info.name.ends_with(name));
            assert!(signed || values.iter().all(|value| *value >= 0.0), "{} under {set:?}", info.name);
        }
    }
    let picture = kept.get("translucency.final").unwrap();
    Ok(picture.as_f32().iter().fold(0.0, |most, value| if *value > most { *value } else { most }))
}

/// What must come of a case.
enum Outcome {
    /// A picture with light in it.
    Lit,
    /// A picture, which may be black.
    Finite,
    /// An error that says this.
    Refused(&'static str),
}
use Outcome::{Finite, Lit, Refused};

fn check(text: &str, assets: &Assets, set: &[&str], outcome: &Outcome) {
    match (brightest(text, assets, set), outcome) {
        (Ok(value), Lit) => assert!(value > 0.0, "a black picture under {set:?}"),
        (Ok(_), Finite) => {}
        (Err(error), Refused(part)) => assert!(error.contains(part), "{set:?}: {error}"),
        (Ok(value), Refused(part)) => panic!("{set:?} gave a picture ({value}), not: {part}"),
        (Err(error), _) => panic!("{set:?}: {error}"),
    }
}

fn cases(cases: &[(&[&str], Outcome)]) {
    for (set, outcome) in cases {
        check(SCENE, &Assets::default(), set, outcome);
    }
}

#[test]
fn cameras_in_odd_places() {
    cases(&[
        (&["camera.position=[0,0,0.1]"], Finite), // inside the solid: it sees the inner sides
        (&["camera.position=[0.5,0.5,0.5]"], Finite), // on a corner
        (&["camera.position=[0,0,0.5]"], Finite), // on a face
        (&["camera.position=[0,3,3]"], Lit),      // where the light is
        (&["camera.position=[0,0,4]", "camera.target=[0,0,9]"], Finite), // averted
        (&["camera.position=[0,4,0]"], Lit),      // up is the direction of view: z is taken for it
        (&["camera.position=[0,-4,1e-20]"], Lit),
        (&["camera.up=[0,0,1]"], Lit),
        (&["camera.up=[0,1e-30,0]"], Refused("camera.up: is zero")),
        (&["camera.position=[0,0,1e9]", "camera.fov=0.01"], Finite),
        (&["camera.position=[1e12,1e12,1e12]"], Finite),
        (
            &["camera.position=[0,0,1e12]", "camera.target=[0,0,999999999999]"],
            Refused("the camera looks nowhere"),
        ),
        (&["camera.fov=0.01"], Lit),
        (&["camera.fov=170"], Finite), // smaller than a pixel
        (&["camera.fov=170", "camera.position=[0,0,0.5001]"], Lit),
    ]);
}

#[test]
fn images_and_maps_of_odd_sizes() {
    cases(&[
        (&["image.width=1", "image.height=1"], Lit),
        (&["image.width=1", "image.height=8192"], Lit),
        (&["image.width=8192", "image.height=1"], Finite), // between two pixels
        (&["image.width=8192", "image.height=1", "camera.fov=0.01"], Lit),
        (&["translucency.cubemap=1"], Lit),
        (&["translucency.shadow=1"], Lit),
        (&["translucency.shadow=1", "translucency.blur=0"], Lit),
        (&["translucency.shadow=1", "translucency.blur=1"], Lit),
        (&["translucency.shadow=1", "translucency.blur=256"], Lit),
        (&["translucency.shadow=2", "translucency.blur=255", "translucency.cubemap=1"], Lit),
    ]);
}

#[test]
fn lights_in_odd_places() {
    const INSIDE: &str = "light[0].position: the light is inside the solid's bounding box";
    cases(&[
        (&["light[0].position=[0,0,0]"], Refused(INSIDE)), // in the middle
        (&["light[0].position=[0.2,0.1,0.3]"], Refused(INSIDE)),
        (&["light[0].position=[0.5,0.5,0.5]"], Refused(INSIDE)), // on a vertex
        (&["light[0].position=[0.5,0.1,0]"], Refused(INSIDE)),   // on a face
        (&["light[0].position=[0.500001,0,0]"], Refused(INSIDE)), // too near
        (&["light[0].position=[0,1,0]"], Lit),                   // along the shadow map's own up
        (&["light[0].position=[0,8e4,0]", "light[0].intensity=[1e9,1e9,1e9]"], Lit),
        (&["light[0].position=[0,1e9,0]"], Refused("light[0].position: the light is 1000000000 away")),
        (&["light[0].position=[0,1e9,0]"], Refused("kind = \"directional\"")),
        (&["light[0].position=[1e12,1e12,1e12]"], Refused("light[0].position")),
        (&["light[0].intensity=[1e12,1e12,1e12]"], Lit),
        (&["light[0].intensity=[1e30,1,1]"], Refused("light[0].intensity: is [1000000000")),
        (&["light[0].intensity=[1e-30,1e-30,1e-30]"], Lit),
        (&["light[0].intensity=[1e-45,0,0]"], Finite),
        (&["light[0].intensity=[0,0,0]"], Finite),
    ]);
    let other = |light: &str| {
        let (head, tail) = SCENE.split_once("kind = \"point\"").unwrap();
        let (_, tail) = tail.split_once("[translucency]").unwrap();
        format!("{head}{light}\n[translucency]{tail}")
    };
    let beam = |direction: &str| {
        other(&format!("kind = \"directional\"\ndirection = {direction}\nirradiance = [1, 1, 1]"))
    };
    for direction in
        ["[0, -1, 0]", "[0, 1e12, 0]", "[1e-15, -1e-15, -1e-15]", "[1, -1, -1]", "[0, -1, 1e-30]"]
    {
        check(&beam(direction), &Assets::default(), &[], &Lit);
    }
    check(
        &beam("[0, 1e-30, 0]"),
        &Assets::default(),
        &[],
        &Refused("light[0].direction: is zero, or nearly"),
    );
    for (radiance, outcome) in [
        ("radiance = [0, 0, 0]", Finite),
        ("radiance = [1e-30, 1e-30, 1e-30]", Lit),
        ("radiance = [1e12, 1e12, 1e12]\nscale = 1e12", Lit),
        ("probe = \"grace\"\nscale = 0", Finite),
        ("probe = \"grace\"\nscale = 1e12", Lit),
    ] {
        check(&other(&format!("kind = \"environment\"\n{radiance}")), &Assets::default(), &[], &outcome);
    }
}

#[test]
fn solids_of_odd_sizes() {
    // Everything grows with the solid: whatever its size, there is a picture of it.
    for size in [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9] {
        let vector =
            |name: &str, [x, y, z]: [f64; 3]| format!("{name}=[{},{},{}]", x * size, y * size, z * size);
        let (camera, light) =
            (vector("camera.position", [0.0, 0.0, 4.0]), vector("light[0].position", [0.0, 3.0, 3.0]));
        let strength = if size * size > 1e12 { 1e12 } else { size * size };
        let strength = format!("light[0].intensity=[{strength},{strength},{strength}]");
        check(SCENE, &Assets::default(), &[&format!("solid.size={size}"), &camera, &light, &strength], &Lit);
    }
    const LIGHT: &str = "light[0].position: the light is";
    cases(&[
        (&["solid.size=1e-9"], Refused(LIGHT)), // the light is left where it was, 10⁹ radii away
        (&["solid.size=1e9"], Refused(LIGHT)),  // inside
        (
            &["solid.size=1e-10"],
            Refused("solid.size: is 0.0000000001, and takes a number from 0.000000001 to 1e12"),
        ),
        (&["solid.size=1e13"], Refused("solid.size: is 10000000000000")),
        (
            &["solid.center=[1e9,0,0]"],
            Refused("solid.center: is over 100,000 times the solid's radius from the origin"),
        ),
        (&["solid.center=[0,0,-10]"], Lit),
        (&["solid.turn=36000"], Lit),
        (&["solid.extents=[1,1e-4,1]", "camera.position=[0,3,4]"], Lit),
        (&["solid.extents=[1e-30,1e-30,1e-30]"], Refused("solid.size: the solid has a radius of")),
        (&["solid.extents=[1e-30,1e-30,1e-30]", "solid.size=1"], Lit),
        (&["solid.extents=[1,1e-9,1]"], Refused("solid.extents: have a side of under")),
        (&["solid.extents=[1e12,1e12,1e12]", "solid.size=1"], Lit),
        (&["solid.triangles=12"], Lit),
        (
            &["solid.triangles=1"],
            Refused("a.toml: solid.triangles: the mesh cannot have fewer than 4 triangles"),
        ),
        (&["solid.triangles=-1"], Refused("solid.triangles: is -1, and takes a whole number from 0 to")),
    ]);
}

#[test]
fn materials_at_the_ends() {
    let material = |scattering: &str, absorption: &str, eta: f32| {
        format!("{SCENE}[material]\nscattering = {scattering}\nabsorption = {absorption}\neta = {eta}\n")
    };
    for (scattering, absorption, eta, outcome) in [
        ("[0, 0, 0]", "[1, 1, 1]", 1.3, Finite), // absorbs alone: black
        ("[1, 1, 1]", "[0, 0, 0]", 1.0, Lit),
        ("[1, 1, 1]", "[0, 0, 0]", 3.5, Lit),
        ("[1, 1, 1]", "[0, 0, 0]", 4.0, Refused("material.eta: is 4, and takes a number from 1 to 3.5")),
        ("[1e9, 1e9, 1e9]", "[1e9, 1e9, 1e9]", 1.3, Lit),
        ("[1e-9, 1e-9, 1e-9]", "[0, 0, 0]", 1.3, Lit),
        ("[1e-38, 1e-38, 1e-38]", "[0, 0, 0]", 1.3, Refused("is not finite at")),
    ] {
        check(&material(scattering, absorption, eta), &Assets::default(), &[], &outcome);
    }
    check(&format!("{SCENE}[material]\ngloss = 1e4\n"), &Assets::default(), &[], &Lit);
}

#[test]
fn meshes_of_odd_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let assets = Assets::Folder(folder.path().into());
    let text = SCENE.replace("shape = \"cuboid\"\nresolution = 3", "file = \"a.obj\"");
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
    let cases: [(String, Outcome); 12] = [
        (format!("{square}f 1 2 3\n"), Lit), // one triangle: flat
        (format!("{square}f 1 2 3 4\n"), Lit),
        (format!("{square}f 1 2 3 4\nf 1 2 3 4\nf 4 3 2 1\n"), Lit), // doubled, and seen from both sides
        (format!("{square}f 1 1 2\nf 1 2 3\nf 3 3 3\n"), Lit),       // some degenerate
        (format!("{square}f 1 1 2\nf 3 3 3\n"), Refused("no triangle of the mesh has an area")),
        (format!("{square}v 1e17 0 0\nf 1 2 3\n"), Lit), // a stray that nothing uses
        (format!("{square}v 0 0 1e-20\nf 1 2 3\nf 1 2 5\n"), Lit),
        (format!("{square}vn 0 0 0\nvn 1e-30 0 0\nf 1//1 2//2 3//1\n"), Lit), // normals without a direction
        (format!("{square}vn 0 0 1\nvn 0 0 -1\nf 1//1 2//2 3//1\n"), Finite), // that cancel
        (
            "v 0 0 0\nv 1e18 0 0\nv 0 1e18 0\nf 1 2 3\n".into(),
            Refused("solid.size: the solid has a radius of"),
        ),
        (
            "v 0 0 0\nv 1e-25 0 0\nv 0 1e-25 0\nf 1 2 3\n".into(),
            Refused("solid.size: the solid has a radius of"),
        ),
        ("v 1e8 0 0\nv 100000008 0 0\nv 1e8 8 0\nf 1 2 3\n".into(), Lit), // far off: it is centred
    ];
    for (mesh, outcome) in &cases {
        std::fs::write(folder.path().join("a.obj"), mesh).unwrap();
        check(&text, &assets, &[], outcome);
    }
    for scale in ["1e18", "1e-25"] {
        std::fs::write(
            folder.path().join("a.obj"),
            format!("v 0 0 0\nv {scale} 0 0\nv 0 {scale} 0\nf 1 2 3\n"),
        )
        .unwrap();
        check(&text, &assets, &["solid.size=1"], &Lit);
    }
}

#[test]
fn the_printed_equations_and_missing_cures_at_the_ends() {
    for setting in [
        "translucency.reading=paper",
        "translucency.evaluation=vertex",
        "translucency.second_layer=false",
        "translucency.shift_cure=false",
        "translucency.blindness_cure=false",
        "translucency.accumulation=3",
    ] {
        for (extreme, outcome) in [
            ("image.width=1", Finite),
            ("translucency.shadow=1", Lit),
            ("translucency.cubemap=1", Lit),
            ("camera.position=[0,0,0.1]", Finite),
            ("camera.position=[0,0,0.5001]", Finite),
            ("camera.target=[0,0,9]", Finite),
            ("solid.extents=[1,1e-5,1]", Finite),
            ("light[0].intensity=[1e12,1e12,1e12]", Lit),
            ("translucency.smallest_d=1e-9", Lit),
            ("translucency.smallest_d=1e12", Finite),
        ] {
            check(SCENE, &Assets::default(), &[setting, extreme], &outcome);
        }
    }
    // Printed, Eq. 12 diverges with the third power of the thickness: the pass that leaves f32 is named.
    let thin = "[material]\nscattering = [1e-20, 1e-20, 1e-20]\nabsorption = [0, 0, 0]\n";
    let set = ["translucency.reading=paper", "translucency.smallest_d=1e-9"];
    check(
        &format!("{SCENE}{thin}"),
        &Assets::default(),
        &set,
        &Refused("translucency.attenuation is not finite at"),
    );
}
