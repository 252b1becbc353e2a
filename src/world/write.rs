//! Meshes as files that other tools open: Wavefront OBJ, and glTF 2.0 as one binary file (GLB).
//!
//! Both hold every vertex and triangle in the mesh's order, with the bits of its numbers (−0 as +0).

use super::mesh::{Bounds, Mesh};
use crate::numeric::order::{max3, min3};
use glam::Vec3;
use serde_json::json;
use std::io::{self, Write};

/// Writes `mesh` as OBJ: `v`, `vn` and `f a//a b//b c//c`, each number as the shortest decimal that is read
/// as the same `f32`.
///
/// # Errors
/// What the writer refuses.
pub fn obj(out: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    fn vectors(out: &mut impl Write, keyword: &str, vectors: &[Vec3]) -> io::Result<()> {
        vectors
            .iter()
            .map(|vector| *vector + Vec3::ZERO)
            .try_for_each(|Vec3 { x, y, z }| writeln!(out, "{keyword} {x} {y} {z}"))
    }
    vectors(out, "v", &mesh.positions)?;
    vectors(out, "vn", &mesh.normals)?;
    mesh.triangles
        .iter()
        .map(|triangle| triangle.map(|corner| u64::from(corner) + 1))
        .try_for_each(|[a, b, c]| writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}"))
}

/// Writes `mesh` as GLB: one mesh with `POSITION`, `NORMAL` and indices of 32 bits. The numbers are in the
/// scene's unit, which is `metres` long; the one node scales them to glTF's metres.
///
/// # Errors
/// What the writer refuses.
pub fn glb(out: &mut impl Write, mesh: &Mesh, metres: f32) -> io::Result<()> {
    let vectors = |vectors: &[Vec3]| -> Vec<u8> {
        vectors
            .iter()
            .flat_map(|vector| (*vector + Vec3::ZERO).to_array())
            .flat_map(f32::to_le_bytes)
            .collect()
    };
    let indices = mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()).collect();
    // Each a multiple of four bytes long, so each begins at one.
    let parts: [Vec<u8>; 3] = [vectors(&mesh.positions), vectors(&mesh.normals), indices];
    let offsets = [0, parts[0].len(), parts[0].len() + parts[1].len()];
    let length = offsets[2] + parts[2].len();
    let view = |part: usize, target: u32| json!({"buffer": 0, "byteOffset": offsets[part], "byteLength": parts[part].len(), "target": target});
    // Of all vertices: glTF's limits are those of the accessor, used or not.
    let first = mesh.positions[0];
    let Bounds { low, high } =
        mesh.positions.iter().fold(Bounds { low: first, high: first }, |bounds, point| Bounds {
            low: min3(bounds.low, *point),
            high: max3(bounds.high, *point),
        });
    let [low, high] = [low, high].map(|corner| (corner + Vec3::ZERO).to_array());
    let (float, unsigned, vertices, elements) = (5126, 5125, 34_962, 34_963);
    let count = mesh.positions.len();
    let json = json!({
        "asset": {"version": "2.0", "generator": "bitlight"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [metres, metres, metres]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "componentType": float, "count": count, "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": float, "count": count, "type": "VEC3"},
            {"bufferView": 2, "componentType": unsigned, "count": 3 * mesh.triangles.len(), "type": "SCALAR"},
        ],
        "bufferViews": [view(0, vertices), view(1, vertices), view(2, elements)],
        "buffers": [{"byteLength": length}],
    });
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + length;
    let mut word = |word: usize| out.write_all(&(word as u32).to_le_bytes());
    word(0x4654_6c67)?; // "glTF"
    word(2)?;
    word(total)?;
    word(text.len())?;
    word(0x4e4f_534a)?; // "JSON"
    out.write_all(&text)?;
    let mut word = |word: usize| out.write_all(&(word as u32).to_le_bytes());
    word(length)?;
    word(0x004e_4942)?; // "BIN"
    parts.iter().try_for_each(|part| out.write_all(part))
}
