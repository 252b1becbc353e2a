//! Wavefront OBJ files: their polygons, as one mesh.
//!
//! Read are `v`, `vn` and `f`; every other line is skipped, so no material library is ever opened, groups and
//! objects merge in file order, and texture coordinates split no vertex. Polygons become fans from their first
//! corner. Vertices keep the order of the file, unused ones included, so what is computed a vertex can be
//! compared with other programs that read the same file. Source: Wavefront, Advanced Visualizer, appendix B1.
//!
//! A vertex is shared by all faces that name it with an equal normal. Where faces give it several (a hard
//! edge), the first keeps its number and each other is a new vertex after the file's own, in file order.
//! Corners without a normal share one computed from their faces ([`Mesh::new`]).

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::Vec3;

use super::mesh::{self, Mesh};
use crate::Error;

/// The largest file that is read, in bytes.
pub const MAX_BYTES: u64 = 1 << 30;

/// A corner without a normal, in place of its index.
const NO_NORMAL: u32 = u32::MAX;

/// Reads the OBJ file at `path`.
///
/// # Errors
/// Those of [`parse`]; and if the file cannot be read or is longer than [`MAX_BYTES`], found before it is
/// held in memory.
pub fn read(path: impl AsRef<Path>) -> Result<Mesh, Error> {
    let path = path.as_ref();
    let unreadable = |error: std::io::Error| {
        Error::new(format!("cannot read the mesh: {error}"))
            .file(path)
            .remedy("check the path and the folder of the assets")
    };
    let file = File::open(path).map_err(unreadable)?;
    let too_long = || {
        Error::new(format!("the mesh is longer than {MAX_BYTES} bytes"))
            .file(path)
            .remedy("simplify it or write fewer decimals")
    };
    if file.metadata().map_err(unreadable)?.len() > MAX_BYTES {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    // What is not a plain file has no length: read one byte beyond the limit at most.
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(too_long());
    }
    parse(&bytes, path)
}

/// The mesh of an OBJ file that is already in memory; `name` is the file that errors name.
///
/// Faces must follow the vertices that they name, as they do wherever relative (negative) indices are to have
/// a meaning. What follows the third coordinate (a weight of rational curves, a colour) is skipped. A file cut
/// off between two lines, or inside the last number of a face, is a shorter valid file and cannot be told.
///
/// # Errors
/// With the line: a `v`, `vn` or `f` that does not parse, a coordinate that is not finite or beyond
/// [`mesh::MAX_COORDINATE`], a face of fewer than three corners or of vertices or normals that are not above
/// it, more vertices or triangles than a mesh may have. Without: the refusals of [`Mesh::new`].
pub fn parse(bytes: &[u8], name: impl AsRef<Path>) -> Result<Mesh, Error> {
    let mut polygons = Polygons::default();
    for (line, text) in bytes.split(|&byte| byte == b'\n').enumerate() {
        polygons.line(text).map_err(|error| error.file(&name).line(line + 1))?;
    }
    polygons.into_mesh().map_err(|error| error.file(&name))
}

#[derive(Clone, Copy, PartialEq)]
struct Corner {
    vertex: u32,
    normal: u32,
}

#[derive(Default)]
struct Polygons {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
}

impl Polygons {
    fn line(&mut self, text: &[u8]) -> Result<(), Error> {
        let mut words = text
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty())
            .take_while(|word| !word.starts_with(b"#"));
        match words.next() {
            Some(b"v") => {
                let position =
                    vector(words).filter(|&position| mesh::in_range(position)).ok_or_else(|| {
                        Error::new("the vertex is not three numbers in range").remedy(format!(
                            "write `v x y z` with numbers within ±{:e}",
                            mesh::MAX_COORDINATE
                        ))
                    })?;
                if self.positions.len() == mesh::MAX_VERTICES {
                    return Err(too_many(mesh::MAX_VERTICES, "vertices"));
                }
                self.positions.push(position);
            }
            Some(b"vn") => {
                let normal = vector(words).ok_or_else(|| {
                    Error::new("the normal is not three numbers").remedy("write `vn x y z`")
                })?;
                self.normals.push(normal);
            }
            Some(b"f") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> Result<(), Error> {
        let mut next = || words.next().map(|word| self.corner(word)).transpose();
        let (Some(first), Some(mut previous), Some(mut last)) = (next()?, next()?, next()?) else {
            return Err(Error::new("the face has fewer than three corners")
                .remedy("remove it; at the end of a file, see whether the file is cut off"));
        };
        loop {
            if self.triangles.len() == mesh::MAX_TRIANGLES {
                return Err(too_many(mesh::MAX_TRIANGLES, "triangles"));
            }
            self.triangles.push([first, previous, last]);
            let Some(word) = words.next() else { return Ok(()) };
            (previous, last) = (last, self.corner(word)?);
        }
    }

    /// `vertex`, `vertex/texture`, `vertex//normal` or `vertex/texture/normal`.
    fn corner(&self, word: &[u8]) -> Result<Corner, Error> {
        let mut fields = word.split(|&byte| byte == b'/');
        let vertex = index(fields.next(), self.positions.len());
        fields.next(); // the texture's
        let normal = match fields.next() {
            None | Some(b"") => Some(NO_NORMAL),
            field => index(field, self.normals.len()),
        };
        match (vertex, normal, fields.next()) {
            (Some(vertex), Some(normal), None) => Ok(Corner { vertex, normal }),
            _ => Err(Error::new(format!(
                "the face's corner `{}` names none of the {} vertices and {} normals above it",
                String::from_utf8_lossy(&word[..word.len().min(40)]),
                self.positions.len(),
                self.normals.len()
            ))
            .remedy("write `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or back from −1")),
        }
    }

    fn into_mesh(self) -> Result<Mesh, Error> {
        if self.triangles.iter().flatten().all(|corner| corner.normal == NO_NORMAL) {
            let triangles = self.triangles.iter().map(|corners| corners.map(|corner| corner.vertex));
            return Mesh::new(self.positions, None, triangles.collect());
        }
        // Exporters that write a normal a corner repeat equal ones: only their values may split a vertex.
        let equal = mesh::first_equal(&self.normals);
        let mut positions = self.positions;
        let mut kept: Vec<Option<u32>> = vec![None; positions.len()]; // the normal of each vertex so far
        let mut copies = BTreeMap::new();
        let mut split = |corner: Corner| {
            let vertex = corner.vertex as usize;
            let normal = equal.get(corner.normal as usize).copied().unwrap_or(NO_NORMAL);
            if *kept[vertex].get_or_insert(normal) == normal {
                return corner.vertex;
            }
            *copies.entry((corner.vertex, normal)).or_insert_with(|| {
                positions.push(positions[vertex]);
                kept.push(Some(normal));
                (positions.len() - 1) as u32
            })
        };
        let triangles = self.triangles.iter().map(|corners| corners.map(&mut split)).collect();
        let normals = kept
            .into_iter()
            .map(|normal| normal.and_then(|n| self.normals.get(n as usize).copied()).unwrap_or(Vec3::ZERO))
            .collect();
        Mesh::new(positions, Some(normals), triangles)
    }
}

fn vector<'a>(words: impl Iterator<Item = &'a [u8]>) -> Option<Vec3> {
    let mut numbers = words.map(|word| std::str::from_utf8(word).ok()?.parse::<f32>().ok());
    Some(Vec3::new(numbers.next()??, numbers.next()??, numbers.next()??))
}

/// The index from 0 that `field` means after `count` elements: from 1 upward, or from −1 backward.
fn index(field: Option<&[u8]>, count: usize) -> Option<u32> {
    let number: i64 = std::str::from_utf8(field?).ok()?.parse().ok()?;
    let from_zero = if number < 0 { number.checked_add(count as i64)? } else { number - 1 };
    usize::try_from(from_zero).ok().filter(|&index| index < count).map(|index| index as u32)
}

fn too_many(most: usize, things: &str) -> Error {
    Error::new(format!("the mesh has more than {most} {things}")).remedy("simplify it or split it")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        parse(text.as_bytes(), "bad.obj").unwrap_err().to_string()
    }

    #[test]
    fn keeps_the_files_order_and_unused_vertices() {
        let text = "v 9 9 9\nv 0 0 0 0.5\r\nv 1 0 0 1 0 0\n\n# a comment\nv 0 1 0 # another\nf 2 3 4\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.positions, [Vec3::splat(9.0), Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.triangles, [[1, 2, 3]]);
        assert_eq!(mesh.normals[1], Vec3::Z);
    }

    #[test]
    fn polygons_become_fans_and_negative_indices_count_back() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 1 0\nf 1 2 3 4 5\nf -5 -4 -3\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2]]);
    }

    #[test]
    fn objects_merge_and_material_libraries_stay_closed() {
        let text = "mtllib /absent/nowhere.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n\
                    o b\nv 0 0 1\ng c\nusemtl blue\nf 1 2 4\nl 1 2\ns off\n\u{e9}\n";
        assert_eq!(parse(text.as_bytes(), "a.obj").unwrap().triangles, [[0, 1, 2], [0, 1, 3]]);
    }

    #[test]
    fn texture_coordinates_split_no_vertex() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 4/2 2/2\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert!(mesh.normals[0].distance(Vec3::new(0.0, 1.0, 1.0) / 2.0_f32.sqrt()) < 1e-6);
    }

    #[test]
    fn only_the_values_of_normals_split_a_vertex() {
        let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        let smooth = format!("{square}vn 0 0 1\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n");
        let mesh = parse(smooth.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.normals, [Vec3::Z; 4]);

        let hard =
            format!("{square}vn 0 0 2\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\nf 3//2 4//2 1//1\n");
        let mesh = parse(hard.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [4, 5, 3], [5, 3, 0]]);
        assert_eq!(mesh.positions[4..], [mesh.positions[0], mesh.positions[2]]);
        assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::X, Vec3::X, Vec3::X]);
    }

    #[test]
    fn corners_without_a_normal_get_one_from_their_own_faces() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1 3 2\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.normals, [Vec3::X, Vec3::X, Vec3::X, -Vec3::Z, -Vec3::Z, -Vec3::Z]);
    }

    #[test]
    fn refusals_name_file_line_and_remedy() {
        let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
        for bad in [
            "v 1 2",
            "v 1 2 x",
            "v nan 0 0",
            "v 1e39 0 0",
            "v 1e19 0 0",
            "v",
            "vn 1 2",
            "f",
            "f 1 2",
            "f 1 2 4",
            "f 0 1 2",
            "f 1 2 -4",
            "f 1 2 99999999999999999999",
            "f 1 2 -9223372036854775808",
            "f 1 2 3.0",
            "f 1//1 2//1 3//2",
            "f 1//1 2//1 3//0",
            "f 1/1/1/1 2 3",
            "f 1 2 3 \\",
            "f /1 2 3",
        ] {
            let error = refusal(&format!("{start}{bad}\nf 1 2 3\n"));
            assert!(error.starts_with("bad.obj:5: ") && error.contains("; "), "{bad}: {error}");
        }
        // References below the face are refused too; see `parse`.
        assert!(refusal("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").starts_with("bad.obj:1: "));
        assert!(refusal("").contains("no triangle"));
        assert!(refusal(start).starts_with("bad.obj: "));
        assert!(refusal("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n").contains("has an area"));
    }

    #[test]
    fn a_file_that_cannot_be_read_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_path_buf(), folder.path().join("absent.obj")] {
            let error = read(&path).unwrap_err();
            assert_eq!(error.file.as_deref(), Some(path.as_path()));
            assert!(error.remedy.is_some(), "{error}");
        }
        let huge = folder.path().join("huge.obj");
        File::create(&huge).unwrap().set_len(MAX_BYTES + 1).unwrap(); // sparse
        assert!(read(&huge).unwrap_err().what.contains("longer than"));
    }
}
