//! Draws of an index in proportion to weights, in constant time (Vose 1991).

/// A table of cells, one an index: each holds its own index up to a threshold and another beyond it.
#[derive(Debug, Clone)]
pub(super) struct Alias {
    /// Threshold in 2⁻³², and the other index.
    cells: Vec<(u32, u32)>,
    probabilities: Vec<f32>,
}

impl Alias {
    /// The table of `weights`, none negative; where all are 0, every index is equally likely.
    pub(super) fn new(weights: &[f64]) -> Self {
        let total = crate::numeric::sum::sum(weights);
        let count = weights.len();
        let share = |weight: f64| if total > 0.0 { weight / total } else { 1.0 / count as f64 };
        let mut scaled: Vec<f64> = weights.iter().map(|weight| share(*weight) * count as f64).collect();
        let probabilities = weights.iter().map(|weight| share(*weight) as f32).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..count as u32).partition(|index| scaled[*index as usize] < 1.0);
        let mut cells: Vec<(u32, u32)> = (0..count as u32).map(|index| (u32::MAX, index)).collect();
        while let (Some(few), Some(&many)) = (small.pop(), large.last()) {
            let part = scaled[few as usize];
            cells[few as usize] = ((part * 4_294_967_296.0) as u32, many);
            scaled[many as usize] -= 1.0 - part;
            if scaled[many as usize] < 1.0 {
                large.pop();
                small.push(many);
            }
        }
        Self { cells, probabilities }
    }

    /// The index that 64 random bits pick.
    pub(super) fn pick(&self, bits: u64) -> usize {
        let index = ((u128::from(bits) * self.cells.len() as u128) >> 64) as usize;
        let (threshold, other) = self.cells[index];
        // The low bits: the high ones chose the cell.
        if (bits as u32) < threshold { index } else { other as usize }
    }

    /// The probability of an index.
    pub(super) fn probability(&self, index: usize) -> f64 {
        f64::from(self.probabilities[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::bits;

    #[test]
    fn picks_follow_the_weights() {
        let weights = [0.0, 3.0, 1.0, 0.0, 12.0, 0.25, 0.75];
        let table = Alias::new(&weights);
        let mut counts = [0_u32; 7];
        let draws = 200_000;
        (0..draws).for_each(|i| counts[table.pick(bits(1, i, 0, 0))] += 1);
        for (count, weight) in counts.iter().zip(weights) {
            let expected = weight / 17.0 * draws as f64;
            // 5 standard deviations of a binomial
            assert!((f64::from(*count) - expected).abs() <= 5.0 * expected.sqrt(), "{counts:?}");
        }
        assert!((0..7).all(|i| (table.probability(i) - weights[i] / 17.0).abs() < 1e-7));
    }
}
