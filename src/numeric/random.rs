//! Counter-based random numbers: a function of what they are for, never of a shared stream (contract 5).

/// 64 random bits for the `dimension`-th number of `sample` of `element` under `seed`.
///
/// The four words pass one after the other through the finaliser of SplitMix64 (Steele, Lea and Flood 2014),
/// a bijection with full avalanche, so neighbouring counters give unrelated bits.
pub fn bits(seed: u64, element: u64, sample: u64, dimension: u64) -> u64 {
    mix(fold(fold(fold(fold(0, seed), element), sample), dimension))
}

/// A number in [0, 1), a multiple of 2⁻²⁴, so exact in `f32`.
pub fn unit(seed: u64, element: u64, sample: u64, dimension: u64) -> f32 {
    fraction(bits(seed, element, sample, dimension))
}

/// The random numbers of one sample of one element, dimension after dimension: what a walk of unknown length
/// draws.
#[derive(Debug, Clone)]
pub struct Sample {
    /// What [`bits`] makes of seed, element and sample.
    state: u64,
    dimension: u64,
}

impl Sample {
    /// The numbers of `sample` of `element` under `seed`, from dimension 0.
    pub fn new(seed: u64, element: u64, sample: u64) -> Self {
        Self { state: fold(fold(fold(0, seed), element), sample), dimension: 0 }
    }

    /// The [`bits`] of the next dimension.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        let bits = mix(fold(self.state, self.dimension));
        self.dimension += 1;
        bits
    }

    /// The [`unit()`] of the next dimension.
    #[inline]
    pub fn unit(&mut self) -> f32 {
        fraction(self.bits())
    }

    /// The [`unit()`]s of the next two dimensions.
    #[inline]
    pub fn pair(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }
}

fn fold(state: u64, word: u64) -> u64 {
    mix(state ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15)
}

fn fraction(bits: u64) -> f32 {
    (bits >> 40) as f32 * (1.0 / 16_777_216.0)
}

fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_counter_moves_half_the_bits() {
        let base = bits(1, 2, 3, 4);
        for other in [bits(2, 2, 3, 4), bits(1, 3, 3, 4), bits(1, 2, 2, 4), bits(1, 2, 3, 5)] {
            let moved = (base ^ other).count_ones();
            assert!((16..=48).contains(&moved), "{moved} bits moved");
        }
    }

    #[test]
    fn a_sample_draws_the_same_numbers() {
        let mut sample = Sample::new(5, 6, 7);
        for dimension in (0..10).step_by(2) {
            assert_eq!(sample.bits(), bits(5, 6, 7, dimension));
            assert_eq!(sample.unit(), unit(5, 6, 7, dimension + 1));
        }
    }

    #[test]
    fn the_unit_numbers_are_uniform() {
        let mean = (0..100_000).map(|i| f64::from(unit(7, i, 0, 0))).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 0.005, "mean {mean}"); // 5 standard deviations
        assert!((0..100_000).all(|i| (0.0..1.0).contains(&unit(7, i, 0, 0))));
    }
}
