//! Sums of samples, element by element (pixels, vertices), with their means and variances.

use crate::numeric::parallel;
use crate::numeric::random::Sample;
use glam::Vec3;

/// Elements that one thread takes together.
const RUN: usize = 64;

/// Elements after which progress is reported.
const BLOCK: usize = 64 * RUN;

/// The seed of every random number.
const SEED: u64 = 0x7472_7574_6800; // "truth"

/// Sums and sums of squares of the first samples of each element, each added in the order of the samples, in
/// `f64`: they do not depend on threads, nor on where the work was divided.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    /// Samples that each element has.
    pub samples: u64,
    /// For each element the sums of R, G, B and of their squares.
    pub values: Vec<[f64; 6]>,
}

impl Sums {
    /// The sums of `count` elements without samples.
    pub fn new(count: usize) -> Self {
        Self { samples: 0, values: vec![[0.0; 6]; count] }
    }

    /// Adds samples until each element has `samples`: `of(element)` makes the function that draws its
    /// samples. `told` is called now and then with the number of elements that have them.
    pub fn advance<S: Fn(&mut Sample) -> Vec3>(
        &mut self,
        samples: u64,
        of: impl Fn(usize) -> S + Sync,
        told: &mut dyn FnMut(usize),
    ) {
        let first = self.samples;
        let some = |start: usize, values: &mut [[f64; 6]]| {
            for (element, sums) in (start..).zip(values) {
                let sample = of(element);
                for number in first..samples {
                    let colour = sample(&mut Sample::new(SEED, element as u64, number));
                    for (channel, value) in colour.to_array().map(f64::from).into_iter().enumerate() {
                        sums[channel] += value;
                        sums[3 + channel] += value * value;
                    }
                }
            }
        };
        for (block, values) in self.values.chunks_mut(BLOCK).enumerate() {
            let start = block * BLOCK;
            parallel::for_each_chunk(values, RUN, |run, values| some(start + run * RUN, values));
            told(start + values.len());
        }
        self.samples = samples;
    }

    /// The mean of an element's samples, RGB.
    pub fn mean(&self, element: usize) -> [f64; 3] {
        [0, 1, 2].map(|channel| self.values[element][channel] / self.samples as f64)
    }

    /// The variance of [`Self::mean`], RGB: the unbiased variance of the samples over their number. It needs
    /// two samples.
    pub fn variance(&self, element: usize) -> [f64; 3] {
        let count = self.samples as f64;
        [0, 1, 2].map(|channel| {
            let (sum, squares) = (self.values[element][channel], self.values[element][3 + channel]);
            let spread = squares - sum * (sum / count);
            // Rounding can make a spread of 0 negative.
            (if spread > 0.0 { spread } else { 0.0 }) / (count * (count - 1.0))
        })
    }
}
