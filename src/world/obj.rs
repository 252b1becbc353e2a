//! Wavefront OBJ files: their polygons, as one mesh. The parser is tobj.
//!
//! tobj is handed only what makes a mesh: the coordinates of `v` and `vn`, and `f`. Materials, groups,
//! objects, texture coordinates, lines, curves, colours and comments are left out, so no other file is opened
//! and the whole file is one surface. The same walk over the lines refuses what tobj would take in silence or
//! refuse without a line: an index of 0, a face of two corners, a NaN.
//!
//! Polygons become fans from their first corner; triangles keep the order of the file. Vertices come in the
//! order in which faces first use them, and unused ones are dropped. Vertices in one place become one (−0
//! equals +0), so computed normals are smooth across groups and texture seams. Where every corner of the file
//! has a normal, only vertices with equal normals become one, so hard edges stay hard; where some corner has
//! none, all normals are computed ([`Mesh::new`]). Source: Wavefront, Advanced Visualizer, appendix B1.

use std::collections::BTreeMap;
use std::path::Path;

use glam::Vec3;

use super::mesh::{MAX_COORDINATE, MAX_TRIANGLES, Mesh};
use crate::Error;

/// The largest file that is read, in bytes.
pub const MAX_BYTES: u64 = 1 << 30;

/// What to do about a longer one.
pub(crate) const SHORTER: &str = "simplify the mesh or write fewer decimals";

/// The mesh of an OBJ file; `name` is the file that errors name.
///
/// Faces must follow the vertices that they name, as they do wherever relative (negative) indices are to have
/// a meaning. Bytes that are not UTF-8 are accepted where nothing is read, as in comments and names. A file
/// cut off between two lines, or inside the last number of a face, is a shorter valid file and cannot be
/// told.
///
/// # Errors
/// With the line: a `v`, `vn` or `f` that does not parse, a number that is not finite or beyond
/// [`MAX_COORDINATE`], a face of fewer than three corners or of vertices or normals that are not above it,
/// more than [`MAX_TRIANGLES`]. Without: the refusals of [`Mesh::new`].
pub fn parse(bytes: &[u8], name: impl AsRef<Path>) -> Result<Mesh, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut surface = Surface::default();
    for (line, text) in text.trim_start_matches('\u{feff}').split('\n').enumerate() {
        surface.line(text).map_err(|error| error.file(&name).line(line + 1))?;
    }
    surface.into_mesh().map_err(|error| error.file(&name))
}

/// What tobj is handed, and what stands in it.
#[derive(Default)]
struct Surface {
    text: String,
    vertices: usize,
    normals: usize,
    triangles: usize,
    /// Whether some corner has no normal.
    bare: bool,
}

impl Surface {
    fn line(&mut self, line: &str) -> Result<(), Error> {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some(keyword @ ("v" | "vn")) => {
                let valid = |number: f32| number.abs() <= MAX_COORDINATE; // false for NaN
                let numbers: Vec<_> = words.take(3).filter(|word| word.parse().is_ok_and(valid)).collect();
                let [x, y, z] = numbers[..] else {
                    return Err(Error::new(format!("the `{keyword}` is not three numbers in range"))
                        .remedy(format!("write `{keyword} x y z` with numbers within ±{MAX_COORDINATE:e}")));
                };
                *(if keyword == "v" { &mut self.vertices } else { &mut self.normals }) += 1;
                self.text.extend([keyword, " ", x, " ", y, " ", z, "\n"]);
            }
            Some("f") => {
                self.text.push('f');
                let corners = words.try_fold(0, |count, word| self.corner(word).map(|()| count + 1))?;
                self.text.push('\n');
                if corners < 3 {
                    return Err(Error::new("the face has fewer than three corners")
                        .remedy("remove it; at the end of a file, see whether the file is cut off"));
                }
                self.triangles += corners - 2;
                if self.triangles > MAX_TRIANGLES {
                    return Err(Error::new(format!("the mesh has more than {MAX_TRIANGLES} triangles"))
                        .remedy("simplify it or split it"));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// `vertex`, `vertex/texture`, `vertex//normal` or `vertex/texture/normal`: from 1, or back from −1.
    fn corner(&mut self, word: &str) -> Result<(), Error> {
        let counts = [self.vertices, usize::MAX, self.normals]; // of textures only the form matters
        let valid = word.split('/').zip(counts).enumerate().all(|(place, (field, count))| {
            let within = |index: isize| index != 0 && index.unsigned_abs() <= count;
            field.parse().is_ok_and(within) || (place > 0 && field.is_empty())
        });
        self.bare |= word.split('/').nth(2).is_none_or(str::is_empty);
        if valid && word.split('/').count() <= counts.len() {
            self.text.extend([" ", word]);
            return Ok(());
        }
        Err(Error::new(format!(
            "the face's corner `{}` names none of the {} vertices and {} normals above it",
            word.chars().take(40).collect::<String>(),
            self.vertices,
            self.normals
        ))
        .remedy("write `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or back from −1"))
    }

    fn into_mesh(self) -> Result<Mesh, Error> {
        // One index a vertex: what that splits (at texture indices) is in one place and becomes one again.
        let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
        let (models, _) = tobj::load_obj_buf(&mut self.text.as_bytes(), &options, |_| Ok(Default::default()))
            .map_err(|error| {
                Error::new(format!("tobj: {error}")).remedy("write the file with another program")
            })?;
        let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        let mut welded = BTreeMap::new();
        for tobj::Model { mesh, .. } in &models {
            let at = |numbers: &[f32], vertex| Vec3::from_slice(&numbers[3 * vertex..]) + Vec3::ZERO; // no −0
            let weld = |vertex| {
                let position = at(&mesh.positions, vertex);
                let normal = if self.bare { Vec3::ZERO } else { at(&mesh.normals, vertex) };
                let bits = [position, normal].map(|vector| vector.to_array().map(f32::to_bits));
                *welded.entry(bits).or_insert_with(|| {
                    positions.push(position);
                    normals.push(normal);
                    positions.len() as u32 - 1
                })
            };
            let vertices: Vec<u32> = (0..mesh.positions.len() / 3).map(weld).collect();
            let corners = mesh.indices.as_chunks().0.iter();
            triangles
                .extend(corners.map(|corners: &[u32; 3]| corners.map(|corner| vertices[corner as usize])));
        }
        Mesh::new(positions, Some(normals), triangles) // computes those of length zero
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        parse(text.as_bytes(), "bad.obj").unwrap_err().to_string()
    }

    #[test]
    fn vertices_come_in_order_of_first_use_and_unused_ones_go() {
        let text =
            "\u{feff}v 9 9 9\nv 0 0 0 0.5\r\nv 1 0 0 1 0 0\n\n# a comment\nv 0 1 0 # another\n f 4 2 3\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.positions, [Vec3::Y, Vec3::ZERO, Vec3::X]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
    }

    #[test]
    fn vertices_in_one_place_are_one_across_groups() {
        let text = "g a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ng b\nv -0 0 0\nv 0 0 1\nv 1 0 -0\nf 4 5 6\n";
        let mesh = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 3, 1]]);
        assert!(mesh.normals[1].distance(Vec3::new(0.0, 1.0, 1.0) / 2.0_f32.sqrt()) < 1e-6);
    }

    #[test]
    fn bytes_that_are_not_utf8_are_refused_only_where_they_are_read() {
        let good = b"# gr\xfc\xdfe\no \xff\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(parse(good, "a.obj").unwrap().triangles, [[0, 1, 2]]);
        let bad = parse(b"\xc3\nv 0 0 \xc3\nv 1 0 0\n", "bad.obj").unwrap_err();
        assert_eq!(bad.line, Some(2));
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
                    o b\nv 0 0 1\ng c\nusemtl blue\nf 1 2 4\nl 1 2\ns off\n\u{e9}\n\
                    usemtl\nl 1 2 3\nv 0 0 2\nl -1/9 1 2 3 4\np 1\n";
        assert_eq!(parse(text.as_bytes(), "a.obj").unwrap().triangles, [[0, 1, 2], [0, 1, 3]]);
    }

    #[test]
    fn texture_coordinates_split_no_vertex() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\n\
                    f 1/2 4/-9223372036854775808 2/9223372036854775807\n";
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
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [4, 5, 0]]);
        assert_eq!(mesh.positions[3..5], [mesh.positions[0], mesh.positions[2]]);
        assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::X, Vec3::X, Vec3::X]);
    }

    #[test]
    fn normals_that_some_corner_lacks_are_all_computed() {
        for bare in ["3", "3/1", "3//", "3/1/"] {
            let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nf 1//1 2//1 {bare}\n");
            assert_eq!(parse(text.as_bytes(), "a.obj").unwrap().normals, [Vec3::Z; 3]);
        }
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
            "vn inf 0 0",
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
            "f 1//1 2//1 3//9223372036854775807",
            "f 1/x 2 3",
            "f 1/0 2 3",
            "f 1/1/1/ 2 3",
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
}
