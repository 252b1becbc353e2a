//! Sums in a fixed order.

/// Length of the runs that [`sum`] adds from left to right.
const RUN: usize = 64;

/// The sum of `values`: runs of 64 from left to right, then the runs' sums pairwise as a binary tree.
///
/// The tree depends on the length alone (contract 3), and the error grows with the logarithm of the length.
pub fn sum(values: &[f64]) -> f64 {
    if values.len() <= RUN {
        return values.iter().fold(0.0, |total, value| total + value);
    }
    // The left half has the largest power of two of runs that is below their number, so the tree depends on
    // the length alone.
    let runs = values.len().div_ceil(RUN);
    let left = runs.next_power_of_two() / 2 * RUN;
    sum(&values[..left]) + sum(&values[left..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adds_whole_numbers_exactly_and_keeps_its_error_low() {
        for length in [0, 1, 63, 64, 65, 128, 129, 1000, 4097] {
            let values: Vec<f64> = (0..length).map(|i| i as f64).collect();
            assert_eq!(sum(&values), (length * usize::max(length, 1).wrapping_sub(1) / 2) as f64);
        }
        let tenths = vec![0.1; 1 << 20];
        let exact = 0.1 * f64::from(1 << 20);
        assert!((sum(&tenths) - exact).abs() <= 1e-13 * exact);
    }
}
