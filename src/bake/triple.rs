//! Integrals of three basis functions, C_ijk = ∫ y_i y_j y_k dω, and with them the product matrix of a
//! function.
//!
//! The matrix G_ij = ∫ V y_i y_j dω of any V depends on the first 2n − 1 bands of V alone, because the
//! product of two functions of n bands has no others: G_ij = Σ_k C_ijk v_k. So 121 sums over directions give
//! the 1,296 entries of six bands, with the same value that summing each entry over the same directions has.

use crate::sphere::{quadrature, sh};

/// The integrals that are not 0 by symmetry, for i ≤ j below `bands` bands and k below 2 `bands` − 1.
#[derive(Debug, Clone)]
pub(super) struct Triple {
    functions: usize,
    /// Where the entries of each pair i ≤ j end, pairs in the order (0, 0), (0, 1) … (1, 1) …
    ends: Vec<usize>,
    /// k and C_ijk, k ascending.
    entries: Vec<(u32, f64)>,
}

/// Band and order of a function.
fn band(index: usize) -> (usize, isize) {
    let l = index.isqrt();
    (l, index as isize - (l * l + l) as isize)
}

/// Whether C_ijk may differ from 0: the triangle rule and parity in l; in m, the product of three sines and
/// cosines of multiples of φ has a mean only if one multiple is the sum of the others and the number of sines
/// is even.
fn allowed(i: usize, j: usize, k: usize) -> bool {
    let [(l1, m1), (l2, m2), (l3, m3)] = [i, j, k].map(band);
    let [a, b, c] = [m1, m2, m3].map(isize::unsigned_abs);
    let sines = [m1, m2, m3].iter().filter(|m| **m < 0).count();
    (l1 + l2 + l3).is_multiple_of(2)
        && l3 <= l1 + l2
        && l3 >= l1.abs_diff(l2)
        && (c == a + b || c == a.abs_diff(b))
        && sines.is_multiple_of(2)
}

impl Triple {
    /// The integrals, by a rule that is exact for them.
    pub(super) fn new(bands: usize) -> Self {
        let functions = bands * bands;
        let wide = 2 * bands - 1;
        let rule = quadrature::product(4 * bands - 4);
        // The basis at all nodes, `[functions][nodes]`; and times the nodes' weights.
        let mut basis = vec![vec![0.0; rule.len()]; wide * wide];
        let mut at = vec![0.0; wide * wide];
        for (node, (direction, _)) in rule.iter().enumerate() {
            sh::evaluate(wide, *direction, &mut at);
            basis.iter_mut().zip(&at).for_each(|(row, value)| row[node] = *value);
        }
        let (mut ends, mut entries) = (Vec::new(), Vec::new());
        for i in 0..functions {
            for j in i..functions {
                let product: Vec<f64> = rule
                    .iter()
                    .enumerate()
                    .map(|(node, (_, w))| w * basis[i][node] * basis[j][node])
                    .collect();
                for k in (0..wide * wide).filter(|k| allowed(i, j, *k)) {
                    let terms = product.iter().zip(&basis[k]);
                    entries.push((k as u32, terms.fold(0.0, |sum, (a, b)| sum + a * b)));
                }
                ends.push(entries.len());
            }
        }
        Self { functions, ends, entries }
    }

    /// G_ij of a function with the coefficients `v`, by rows, into `out`.
    pub(super) fn product(&self, v: &[f64], out: &mut [f64]) {
        let (mut pair, mut start) = (0, 0);
        for i in 0..self.functions {
            for j in i..self.functions {
                let end = self.ends[pair];
                let sum = self.entries[start..end].iter().fold(0.0, |sum, (k, c)| sum + c * v[*k as usize]);
                out[i * self.functions + j] = sum;
                out[j * self.functions + i] = sum;
                (pair, start) = (pair + 1, end);
            }
        }
    }
}
