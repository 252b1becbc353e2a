//! Garbage, and valid files that were cut, flipped, shortened and lengthened, for every reader: an error or a
//! valid object, never a panic, never long. `PROPTEST_CASES=20000` runs more cases than a commit does.

use bitlight::Error;
use bitlight::pass::{Buffer, Channel, Data, Layer, exr, npy};
use bitlight::scene::Scene;
use bitlight::sphere::environment::LatLong;
use bitlight::store::file;
use bitlight::world::obj;
use exr_files::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LineOrder, Vec2,
    WritableImage,
};
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// What a reader may take for one of the small inputs here, on a busy machine in a debug build.
const PATIENCE: Duration = Duration::from_secs(10);

fn config(cases: u32) -> ProptestConfig {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok());
    ProptestConfig {
        cases: asked.unwrap_or(cases),
        failure_persistence: None,
        max_shrink_iters: 2000,
        ..ProptestConfig::default()
    }
}

/// An edit: what is done, where (as a share of the length), and with which byte.
type Edit = (u8, u16, u8);

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec((0..6_u8, any::<u16>(), any::<u8>()), 1..5)
}

fn edited(good: &[u8], edits: &[Edit]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for &(kind, place, byte) in edits {
        let at = usize::from(place) * bytes.len() / 65536;
        match kind {
            _ if bytes.is_empty() => {}
            0 => bytes[at] ^= 1 << (byte % 8),
            1 => bytes[at] = byte,
            2 => drop(bytes.remove(at)),
            3 => bytes.insert(at, byte),
            4 => bytes.truncate(at),
            _ => bytes[at] = [0, 0xff, 0x7f, 0x80][usize::from(byte % 4)],
        }
    }
    bytes
}

/// Reads, holds an error against what every error must have, and the time against patience.
fn read<T>(read: impl FnOnce() -> Result<T, Error>) -> Option<T> {
    let begun = Instant::now();
    let outcome = read();
    assert!(begun.elapsed() < PATIENCE, "took {:?}", begun.elapsed());
    match outcome {
        Ok(object) => Some(object),
        Err(error) => {
            assert!(error.remedy.is_some(), "no remedy: {error}");
            assert!(error.to_string().len() < 2000, "a message of {} bytes", error.to_string().len());
            None
        }
    }
}

const OBJ: &str = "# a corner\nv 0 0 0\nv 1 0 0.5\nv 0 1e-3 0\nv -1 -1 -1\nvn 0 0 1\nvt 0.5 0.5\ng one\n\
    f 1//1 2//1 3//1\nf 1/1 3/1 4/1\nf -1 -2 -3\n";

fn check_mesh(bytes: &[u8]) {
    if let Some(mesh) = read(|| obj::parse(bytes, "a.obj")) {
        assert!(mesh.positions.iter().chain(&mesh.normals).all(|vector| vector.is_finite()));
        assert!(mesh.triangles.iter().flatten().all(|corner| (*corner as usize) < mesh.positions.len()));
    }
}

/// A map of 9 × 3: rows in the new run-length encoding, an old one and plain ones.
static HDR: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut bytes = b"#?RADIANCE\nEXPOSURE=1.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 9\n".to_vec();
    bytes.extend([2, 2, 0, 9]);
    (0..4).for_each(|channel| bytes.extend([128 + 5, 100 + channel, 4, 9, 8, 7, 130]));
    bytes.extend([[3, 2, 1, 128], [1, 1, 1, 8]].concat());
    (0..9).for_each(|texel| bytes.extend([texel + 9, 80, 200, 120 + texel]));
    bytes
});

fn check_map(bytes: &[u8]) {
    if let Some(map) = read(|| LatLong::from_hdr(bytes)) {
        assert_eq!(map.texels().len(), map.width() * map.height());
        assert!(map.texels().iter().all(|rgb| rgb.is_finite() && rgb.min_element() >= 0.0));
    }
}

/// Small EXR files: ours, and one of each way to compress and to divide.
static EXR: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let channel = |name: &str, data| Channel { name: name.into(), data };
    let layers = [
        Layer {
            name: "t.a".into(),
            width: 5,
            height: 3,
            channels: vec![
                channel("B", Data::F32((0..15).map(|i| i as f32 * 0.1).collect())),
                channel("R", Data::U32((0..15).collect())),
            ],
        },
        Layer {
            name: "t.b".into(),
            width: 1,
            height: 2,
            channels: vec![channel("Y", Data::F32(vec![1.0, -2.0]))],
        },
    ];
    file::write_exr(&path, &layers).unwrap();
    let mut files = vec![std::fs::read(&path).unwrap()];
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 3))] {
            let half = |i: usize| exr_files::prelude::f16::from_f32(i as f32);
            let channels = [
                AnyChannel::new("G", FlatSamples::F16((0..63).map(half).collect())),
                AnyChannel::new("Z", FlatSamples::F32((0..63).map(|i| i as f32 * 0.7).collect())),
            ];
            let layer = exr_files::image::Layer::new(
                (9, 7),
                exr_files::meta::header::LayerAttributes::named("a"),
                Encoding { compression, blocks, line_order: LineOrder::Increasing },
                AnyChannels::sort(channels.into_iter().collect()),
            );
            let mut bytes = Vec::new();
            let out = std::io::Cursor::new(&mut bytes);
            Image::from_layer(layer).write().non_parallel().to_buffered(out).unwrap();
            files.push(bytes);
        }
    }
    files
});

fn check_image(bytes: &[u8]) {
    for layer in read(|| exr::parse(bytes)).into_iter().flatten() {
        assert!(layer.channels.iter().all(|channel| channel.data.len() == layer.width * layer.height));
    }
}

static NPY: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    file::write_npy(&path, &Buffer::f32(&[2, 3], vec![1.0, 2.0, 3.0, -4.0, 5.0, 6.5])).unwrap();
    std::fs::read(&path).unwrap()
});

fn check_buffer(bytes: &[u8]) {
    if let Some(buffer) = read(|| npy::parse(bytes)) {
        assert_eq!(buffer.shape.iter().product::<usize>(), buffer.data.len());
    }
}

/// A scene with a key of every table and a light of every kind.
const SCENE: &str = r#"technique = "translucency"
unit = "mm"
[image]
width = 32
background = [0.1, 0.2, 0.3]
[camera]
position = [0, 0.5, 4]
fov = 40
[solid]
shape = "cuboid"
extents = [1, 2, 3]
size = 2.0
[material]
scattering = [2.19, 2.62, 3.0]
absorption = [0.0021, 0.0041, 0.0071]
eta = 1.5
[[light]]
kind = "point"
position = [3, 4, 2]
intensity = [30, 30, 30]
[[light]]
kind = "directional"
direction = [0, -1, 0]
irradiance = [3, 3, 3]
[[light]]
kind = "environment"
probe = "grace"
[translucency]
blur = 0x8
"#;

fn check_scene(text: &str, set: &[String]) {
    if let Some(scene) = read(|| Scene::parse(text, Path::new("a.toml"), set)) {
        let camera = scene.camera;
        assert!([camera.position, camera.target, camera.up, scene.background].iter().all(|v| v.is_finite()));
        assert!(scene.size.iter().all(|size| (1..=8192).contains(size)) && !scene.lights.is_empty());
        assert!(scene.settings().values().all(|value| !value.is_null()), "{:?}", scene.settings());
        // The estimate must not overflow whatever the settings.
        let all = scene.technique.wanted("all").unwrap();
        assert!(bitlight::run::memory(&scene, &all, u32::MAX as usize).unwrap() > 0);
    }
}

/// Pieces of which something like TOML can be made.
const WORDS: &[&str] = &[
    "[",
    "]",
    "[[light]]",
    "[camera]",
    "[solid]",
    "=",
    "position",
    "camera.",
    "light",
    "\n",
    "\"",
    "'",
    "'''",
    "{",
    "}",
    ",",
    "1e999",
    "-nan",
    "99999999999999999999",
    "0xffffffffffffffff",
    "1979-05-27T07:32:00Z",
    "true",
    "\u{1F4A1}",
    "\u{0}",
    "\r",
    "#",
    "kind = \"point\"",
    "technique = \"translucency\"",
    "a.b.c",
    " ",
    "\\u{0}",
];

/// Values that `--set` may be given.
const VALUES: &[&str] = &[
    "1",
    "-1",
    "0",
    "1e999",
    "nan",
    "-inf",
    "1e-320",
    "[1,2,3]",
    "[1,2]",
    "[]",
    "[[",
    "\"",
    "{",
    "{a=1}",
    "true",
    "9223372036854775808",
    "0x7fffffffffffffff",
    "Marble",
    "cuboid",
    "[1e12,1e12,1e12]",
    "",
    "=",
    "3.5",
];

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn the_obj_reader(garbage in prop::collection::vec(any::<u8>(), 0..300), edits in edits()) {
        check_mesh(&garbage);
        check_mesh(&edited(OBJ.as_bytes(), &edits));
    }

    #[test]
    fn the_hdr_reader(garbage in prop::collection::vec(any::<u8>(), 0..300), edits in edits()) {
        check_map(&garbage);
        check_map(&edited(&HDR, &edits));
        let head = b"#?RADIANCE\n\n-Y 4 +X 8\n";
        check_map(&[head, &garbage[..]].concat());
    }

    #[test]
    fn the_npy_reader(garbage in prop::collection::vec(any::<u8>(), 0..300), edits in edits()) {
        check_buffer(&garbage);
        check_buffer(&edited(&NPY, &edits));
    }

    #[test]
    fn the_exr_reader(
        garbage in prop::collection::vec(any::<u8>(), 0..300),
        file in any::<prop::sample::Index>(),
        edits in edits(),
    ) {
        check_image(&garbage);
        check_image(&edited(&EXR[file.index(EXR.len())], &edits));
    }

    #[test]
    fn the_scene_reader(
        words in prop::collection::vec(prop::sample::select(WORDS), 0..40),
        text in ".{0,60}",
        edits in edits(),
    ) {
        check_scene(&words.concat(), &[]);
        check_scene(&text, &[]);
        check_scene(&String::from_utf8_lossy(&edited(SCENE.as_bytes(), &edits)), &[]);
    }

    #[test]
    fn assignments(
        key in prop::sample::select(bitlight::scene::keys::all(bitlight::techniques::ALL)),
        value in prop::sample::select(VALUES),
        text in ".{0,40}",
        light in 0..4_usize,
    ) {
        let table = if key.table.starts_with("light") { format!("light[{light}]") } else { key.table.into() };
        check_scene(SCENE, &[format!("{table}.{}={value}", key.name).trim_start_matches('.').into()]);
        check_scene(SCENE, std::slice::from_ref(&text));
        check_scene(SCENE, &[format!("{text}={value}")]);
        check_scene(SCENE, &[format!("{table}.{}={text}", key.name)]);
    }
}

#[test]
fn the_unharmed_files_are_read() {
    assert!(obj::parse(OBJ.as_bytes(), "a.obj").is_ok());
    LatLong::from_hdr(&HDR).unwrap();
    npy::parse(&NPY).unwrap();
    EXR.iter().for_each(|file| drop(exr::parse(file).unwrap()));
    Scene::parse(SCENE, Path::new("a.toml"), &[]).unwrap();
}

/// Every single byte of the small EXR files, set to each of the values that mean most.
#[test]
fn no_byte_of_an_exr_file_is_trusted() {
    for file in &EXR[..3] {
        for at in 0..file.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                let mut bytes = file.clone();
                bytes[at] = value;
                check_image(&bytes);
            }
        }
    }
}
