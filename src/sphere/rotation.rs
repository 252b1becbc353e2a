//! Rotation of coefficient vectors by the recurrence of Ivanic and Ruedenberg ("Rotation Matrices for Real
//! Spherical Harmonics. Direct Determination by Recursion", J. Phys. Chem. 1996), with the corrections of
//! their errata (J. Phys. Chem. A 1998): each band's matrix from the band below and the 3×3 rotation alone.

use super::sh::MAX_BANDS;
use crate::Error;
use crate::numeric::lanes::wide;

/// How far RᵀR may be from the identity, entry by entry: room for a matrix that was made in `f32`.
const ORTHONORMALITY: f64 = 1e-6;

/// A rotation of functions on the sphere, acting on their coefficients (order l² + l + m).
#[derive(Debug, Clone)]
pub struct Rotation {
    blocks: Vec<Block>,
}

/// The (2l + 1)² matrix of band l, by rows.
#[derive(Debug, Clone)]
struct Block {
    l: isize,
    entries: Vec<f64>,
}

impl Block {
    /// The entry at row m, column n.
    fn at(&self, m: isize, n: isize) -> f64 {
        self.entries[((m + self.l) * (2 * self.l + 1) + n + self.l) as usize]
    }
}

impl Rotation {
    /// The rotation R with the rows `matrix` for functions of `bands` bands.
    ///
    /// The error of the coefficients' matrices is that of `matrix`: nothing is re-orthonormalised.
    ///
    /// # Errors
    /// Where `bands` exceeds [`MAX_BANDS`], or `matrix` is no rotation: RᵀR differs from the identity by more
    /// than 1e-6, it mirrors (determinant −1), or an entry is not finite.
    pub fn new(bands: usize, matrix: [[f64; 3]; 3]) -> Result<Self, Error> {
        if bands > MAX_BANDS {
            return Err(Error::new(format!("{bands} bands of spherical harmonics"))
                .remedy(format!("ask for at most {MAX_BANDS}")));
        }
        check(&matrix)?;
        let mut blocks: Vec<Block> = Vec::with_capacity(bands);
        for l in 0..bands {
            blocks.push(match l {
                0 => Block { l: 0, entries: vec![1.0] },
                // Y_1−1, Y_10, Y_11 ∝ y, z, x
                1 => {
                    let axes = [1, 2, 0];
                    let entries = axes.iter().flat_map(|&row| axes.map(|column| matrix[row][column]));
                    Block { l: 1, entries: entries.collect() }
                }
                _ => next(&blocks[1], &blocks[l - 1]),
            });
        }
        Ok(Self { blocks })
    }

    /// The coefficients of g(d) = f(R⁻¹d), where `coefficients` are those of f: the function turned by R.
    ///
    /// # Panics
    /// Where `coefficients` has not bands² items.
    pub fn rotate(&self, coefficients: &[f64]) -> Vec<f64> {
        let bands = self.blocks.len();
        assert_eq!(coefficients.len(), bands * bands, "one coefficient for each function");
        let mut rotated = Vec::with_capacity(coefficients.len());
        for (l, block) in self.blocks.iter().enumerate() {
            let band = &coefficients[l * l..(l + 1) * (l + 1)];
            for row in block.entries.chunks_exact(2 * l + 1) {
                rotated.push(row.iter().zip(band).fold(0.0, |sum, (entry, c)| sum + entry * c));
            }
        }
        rotated
    }

    /// [`Self::rotate`] of every column of a matrix of bands² rows of `width` items, all at once and with the
    /// same bits.
    ///
    /// # Panics
    /// Where `matrix` has not bands² · `width` items.
    pub fn rotate_columns(&self, matrix: &[f64], width: usize) -> Vec<f64> {
        let bands = self.blocks.len();
        assert_eq!(matrix.len(), bands * bands * width, "one row for each function");
        let mut rotated = vec![0.0; matrix.len()];
        for (l, block) in self.blocks.iter().enumerate() {
            let band = l * l * width..(l + 1) * (l + 1) * width;
            add_rows(&mut rotated[band.clone()], &block.entries, &matrix[band], width);
        }
        rotated
    }
}

wide! {
    /// Adds to each row of `sums` the rows of `matrix`, each times an entry of that row of `entries`.
    fn add_rows(sums: &mut [f64], entries: &[f64], matrix: &[f64], width: usize) {
        let size = sums.len() / width;
        for (sums, entries) in sums.chunks_exact_mut(width).zip(entries.chunks_exact(size)) {
            for (entry, row) in entries.iter().zip(matrix.chunks_exact(width)) {
                for (sum, x) in sums.iter_mut().zip(row) {
                    *sum += entry * x;
                }
            }
        }
    }
}

/// Refuses what is no rotation.
fn check(matrix: &[[f64; 3]; 3]) -> Result<(), Error> {
    let remedy = "give a 3×3 matrix with orthonormal columns and determinant +1";
    for i in 0..3 {
        for j in 0..3 {
            let product = (0..3).fold(0.0, |sum, k| sum + matrix[k][i] * matrix[k][j]);
            let expected = if i == j { 1.0 } else { 0.0 };
            // A NaN must fail, so the comparison is not turned round.
            let close = (product - expected).abs() <= ORTHONORMALITY;
            if !close {
                return Err(Error::new(format!(
                    "not a rotation: the product of columns {i} and {j} is {product}, not {expected}"
                ))
                .remedy(remedy));
            }
        }
    }
    let [a, b, c] = matrix;
    let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    if determinant < 0.0 {
        return Err(Error::new("not a rotation: the matrix mirrors (its determinant is −1)").remedy(remedy));
    }
    Ok(())
}

/// The matrix of band l from those of bands 1 and l − 1: Ivanic and Ruedenberg, Eq. 8.1 with Tables 1 and 2
/// as corrected in 1998.
fn next(first: &Block, below: &Block) -> Block {
    let l = below.l + 1;
    // Table 2: the function P
    let p = |i: isize, mu: isize, n: isize| {
        if n == l {
            first.at(i, 1) * below.at(mu, l - 1) - first.at(i, -1) * below.at(mu, 1 - l)
        } else if n == -l {
            first.at(i, 1) * below.at(mu, 1 - l) + first.at(i, -1) * below.at(mu, l - 1)
        } else {
            first.at(i, 0) * below.at(mu, n)
        }
    };
    let mut entries = Vec::with_capacity(((2 * l + 1) * (2 * l + 1)) as usize);
    for m in -l..=l {
        for n in -l..=l {
            let denominator = if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) } as f64;
            let a = m.abs();
            let mut entry = 0.0;
            // u U
            if a < l {
                entry += (((l + m) * (l - m)) as f64 / denominator).sqrt() * p(0, m, n);
            }
            // v V
            let v = 0.5 * (((l + a - 1) * (l + a)) as f64 / denominator).sqrt();
            entry += match m {
                0 => -v * 2.0_f64.sqrt() * (p(1, 1, n) + p(-1, -1, n)),
                1 => v * 2.0_f64.sqrt() * p(1, 0, n),
                -1 => v * 2.0_f64.sqrt() * p(-1, 0, n),
                2.. => v * (p(1, m - 1, n) - p(-1, 1 - m, n)),
                _ => v * (p(1, m + 1, n) + p(-1, -m - 1, n)),
            };
            // w W
            if m != 0 && a < l - 1 {
                let w = -0.5 * (((l - a - 1) * (l - a)) as f64 / denominator).sqrt();
                entry += if m > 0 {
                    w * (p(1, m + 1, n) + p(-1, -m - 1, n))
                } else {
                    w * (p(1, m - 1, n) - p(-1, 1 - m, n))
                };
            }
            entries.push(entry);
        }
    }
    Block { l, entries }
}

#[cfg(test)]
mod tests {
    use super::super::{quadrature, sh};
    use super::*;
    use crate::numeric::random;
    use proptest::prelude::*;

    /// The rotation of a unit quaternion (w, x, y, z).
    fn matrix([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
        let length = (w * w + x * x + y * y + z * z).sqrt();
        let [w, x, y, z] = [w, x, y, z].map(|c| c / length);
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    fn apply(matrix: [[f64; 3]; 3], d: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
    }

    fn basis(bands: usize, d: [f64; 3]) -> Vec<f64> {
        let mut values = vec![0.0; bands * bands];
        sh::evaluate(bands, d, &mut values);
        values
    }

    fn random_quaternion(index: u64) -> [f64; 4] {
        [0, 1, 2, 3].map(|axis| f64::from(random::unit(3, index, 0, axis)) - 0.5)
    }

    /// Y is the coefficient vector of a narrow lobe about d, so turning the lobe turns d: Y(Rd) = M Y(d).
    #[test]
    fn rotating_the_basis_is_evaluating_it_elsewhere() {
        for (bands, tolerance) in [(12, 1e-12), (MAX_BANDS, 1e-11)] {
            for index in 0..20 {
                let r = matrix(random_quaternion(index));
                let rotation = Rotation::new(bands, r).unwrap();
                for d in quadrature::fibonacci(11) {
                    let turned = rotation.rotate(&basis(bands, d));
                    for (i, (a, b)) in turned.iter().zip(basis(bands, apply(r, d))).enumerate() {
                        assert!((a - b).abs() < tolerance, "{bands} bands, function {i}: {a} against {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn quarter_turns_permute_the_axes() {
        // About z by +90°: x becomes y, so the lobe ∝ x (index 3) becomes the lobe ∝ y (index 1).
        let rotation = Rotation::new(2, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
        assert_eq!(rotation.rotate(&[5.0, 0.0, 2.0, 7.0]), [5.0, 7.0, 2.0, 0.0]);
        // About x by +90°: y becomes z.
        let rotation = Rotation::new(2, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]).unwrap();
        assert_eq!(rotation.rotate(&[5.0, 3.0, 0.0, 7.0]), [5.0, 0.0, 3.0, 7.0]);
    }

    #[test]
    fn columns_rotate_as_vectors_do() {
        let rotation = Rotation::new(5, matrix([0.3, -0.2, 0.9, 0.1])).unwrap();
        let columns: Vec<f64> = (0..25 * 7).map(|i| f64::from(random::unit(5, i, 0, 0)) - 0.5).collect();
        let rotated = rotation.rotate_columns(&columns, 7);
        for column in 0..7 {
            let pick = |of: &[f64]| of.iter().skip(column).step_by(7).copied().collect::<Vec<f64>>();
            assert_eq!(rotation.rotate(&pick(&columns)), pick(&rotated));
        }
    }

    #[test]
    fn identity_is_exact() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let coefficients: Vec<f64> = (0..1024).map(|i| f64::from(random::unit(4, i, 0, 0)) - 0.5).collect();
        assert_eq!(Rotation::new(32, identity).unwrap().rotate(&coefficients), coefficients);
        assert!(Rotation::new(0, identity).unwrap().rotate(&[]).is_empty());
    }

    #[test]
    fn refuses_what_is_no_rotation() {
        let good = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let with = |row: usize, column: usize, value: f64| {
            let mut bad = good;
            bad[row][column] = value;
            Rotation::new(3, bad)
        };
        for bad in
            [with(0, 0, -1.0), with(0, 1, 1e-3), with(2, 2, 0.0), with(1, 0, f64::NAN), with(2, 2, 1.1)]
        {
            let message = bad.unwrap_err().to_string();
            assert!(message.starts_with("not a rotation") && message.contains("orthonormal"), "{message}");
        }
        assert!(with(0, 1, 1e-7).is_ok());
        assert!(Rotation::new(MAX_BANDS + 1, good).is_err());
    }

    proptest! {
        #[test]
        fn keeps_the_norm_of_every_band(
            q in prop::array::uniform4(-1.0..1.0_f64),
            coefficients in prop::collection::vec(-10.0..10.0_f64, 100),
        ) {
            prop_assume!(q.iter().map(|c| c * c).fold(0.0, |a, b| a + b) > 1e-4);
            let rotated = Rotation::new(10, matrix(q)).unwrap().rotate(&coefficients);
            let norm = |c: &[f64]| c.iter().fold(0.0, |sum, x| sum + x * x);
            for l in 0..10 {
                let band = l * l..(l + 1) * (l + 1);
                prop_assert!((norm(&rotated[band.clone()]) / norm(&coefficients[band]) - 1.0).abs() < 1e-12);
            }
        }

        #[test]
        fn composes_as_matrices_do(
            p in prop::array::uniform4(-1.0..1.0_f64),
            q in prop::array::uniform4(-1.0..1.0_f64),
            coefficients in prop::collection::vec(-1.0..1.0_f64, 100),
        ) {
            for r in [p, q] {
                prop_assume!(r.iter().map(|c| c * c).fold(0.0, |a, b| a + b) > 1e-4);
            }
            let (a, b) = (matrix(p), matrix(q));
            let columns: [[f64; 3]; 3] = [0, 1, 2].map(|j| apply(a, [b[0][j], b[1][j], b[2][j]]));
            let product = [0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i]]);
            let once = Rotation::new(10, product).unwrap().rotate(&coefficients);
            let b_first = Rotation::new(10, b).unwrap().rotate(&coefficients);
            let twice = Rotation::new(10, a).unwrap().rotate(&b_first);
            for (x, y) in once.iter().zip(twice) {
                prop_assert!((x - y).abs() < 1e-12);
            }
        }
    }
}
