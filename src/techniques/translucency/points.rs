//! The accumulation points x_a of §2: one, or several between which the radiosity is interpolated (the
//! extension that §5 hopes for, and leaves open).
//!
//! The box that the cubemap's views fill is divided into equal parts, and each part's middle is a point.
//! `projection` computes Eq. 6 and `matrices` Eq. 11 for every point, `radiosity` Eq. 10 for those around the
//! point that is shaded.
//!
//! Every point sees all of the one external cubemap, in directions from itself. A near texel counts for more,
//! as its solid angle is larger. A point's directions are those of the frame in which its own part is a cube.
//! With one part that is the box's frame, the cure of blindness; with parts that are cubes it is the world's,
//! without distortion. So an elongated box is divided along its length alone, and every box into parts that
//! are as near to cubes as whole numbers allow.

use crate::numeric::order::{clamp, max};
use glam::Vec3;

/// The accumulation points of a box, x counting fastest and z slowest. Without a unit: places are relative to
/// the box. Source: ours, after §5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Points {
    /// Parts along x, y and z.
    pub(super) counts: [usize; 3],
}

impl Points {
    /// `along` points along the longest side of a box with these half extents, and along the others in
    /// proportion, at least one.
    pub(super) fn new(half: Vec3, along: usize) -> Self {
        let longest = half.max_element();
        // The nearest whole number; a conversion rounds towards 0.
        let count = |side: f32| max((along as f32 * (side / longest) + 0.5) as usize, 1);
        Self { counts: half.to_array().map(count) }
    }

    /// How many there are.
    pub(super) fn count(self) -> usize {
        self.counts[0] * self.counts[1] * self.counts[2]
    }

    /// The shape of a buffer that has `each` for every light and point: a single point has no axis
    /// ([`crate::pass::Axis::Several`]), so that its buffers are those of the paper.
    pub(super) fn shape(self, lights: usize, each: &[usize]) -> Vec<usize> {
        let points = self.count();
        let several = (points > 1).then_some(points);
        [lights].into_iter().chain(several).chain(each.iter().copied()).collect()
    }

    /// The factors, one an axis, from the frame in which the box is the cube ±1 to the frame in which each
    /// part is.
    pub(super) fn scale(self) -> Vec3 {
        Vec3::from_array(self.counts.map(|count| count as f32))
    }

    /// Where point `index` is once the box is scaled by [`Self::scale`]; its part is the cube ±1 around it.
    pub(super) fn place(self, index: usize) -> Vec3 {
        let [nx, ny, _] = self.counts;
        let at = [index % nx, index / nx % ny, index / (nx * ny)];
        Vec3::from_array([0, 1, 2].map(|axis| (2 * at[axis] + 1) as f32 - self.counts[axis] as f32))
    }

    /// The points around `at`, a place in the frame in which the box is the cube ±1, and their trilinear
    /// weights, which are above 0 and sum to 1. Beyond the outermost points their values hold: nothing is
    /// extrapolated.
    pub(super) fn around(self, at: Vec3) -> impl Iterator<Item = (usize, f32)> {
        let mut cell = [[(0, 0.0); 2]; 3];
        for (axis, ends) in cell.iter_mut().enumerate() {
            let last = self.counts[axis] - 1;
            // The points lie at 0, 1 … last.
            let place = clamp((at[axis] * self.counts[axis] as f32 + last as f32) * 0.5, 0.0, last as f32);
            let below = place as usize; // rounds down: it is not negative
            let share = place - below as f32;
            *ends = [(below, 1.0 - share), (below + 1, share)];
        }
        (0..8).filter_map(move |corner| {
            let ends: [(usize, f32); 3] = [0, 1, 2].map(|axis| cell[axis][corner >> axis & 1]);
            let weight = ends[0].1 * ends[1].1 * ends[2].1;
            let index = (ends[2].0 * self.counts[1] + ends[1].0) * self.counts[0] + ends[0].0;
            (weight > 0.0).then_some((index, weight))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;

    #[test]
    fn parts_are_as_near_to_cubes_as_whole_numbers_allow() {
        let half = Vec3::new(1.0, 4.0, 2.0);
        for (along, counts) in [(1, [1, 1, 1]), (2, [1, 2, 1]), (4, [1, 4, 2]), (16, [4, 16, 8])] {
            assert_eq!(Points::new(half, along).counts, counts);
        }
        assert_eq!(Points::new(Vec3::ONE, 3).counts, [3; 3]);
    }

    #[test]
    fn weights_sum_to_one_and_find_the_place_again() {
        for points in [Points { counts: [1; 3] }, Points { counts: [1, 4, 2] }, Points { counts: [3, 2, 5] }]
        {
            for i in 0..500 {
                let at = Vec3::from_array([0, 1, 2].map(|k| unit(5, i, 0, k) * 2.2 - 1.1));
                let (mut total, mut place) = (0.0, Vec3::ZERO);
                for (index, weight) in points.around(at) {
                    assert!(index < points.count() && weight > 0.0);
                    total += weight;
                    place += points.place(index) * weight;
                }
                let outermost = points.scale() - Vec3::ONE;
                let held = (at * points.scale()).clamp(-outermost, outermost);
                assert!(
                    (total - 1.0).abs() < 1e-6 && place.distance(held) < 1e-5,
                    "{at}: {place} for {held}"
                );
            }
            for index in 0..points.count() {
                let at = points.place(index) / points.scale();
                let nearest = points.around(at).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                assert!(nearest.0 == index && nearest.1 > 0.999, "{index}");
            }
        }
    }

    #[test]
    fn weights_are_continuous_across_parts_and_points() {
        let points = Points { counts: [3, 2, 5] };
        let weights = |at: Vec3| {
            let mut all = vec![0.0; points.count()];
            points.around(at).for_each(|(index, weight)| all[index] = weight);
            all
        };
        let step = 1e-3;
        for i in 0..500 {
            // Along every axis through every bound between parts and through every point.
            let at = Vec3::from_array([0, 1, 2].map(|k| unit(6, i, 0, k) * 2.0 - 1.0));
            for axis in 0..3 {
                let parts = points.counts[axis];
                for bound in 0..=2 * parts {
                    let (mut low, mut high) = (at, at);
                    low[axis] = bound as f32 / parts as f32 - 1.0 - step;
                    high[axis] = low[axis] + 2.0 * step;
                    for (low, high) in weights(low).into_iter().zip(weights(high)) {
                        assert!((low - high).abs() <= 1.001 * step * parts as f32, "{low} {high} at {bound}");
                    }
                }
            }
        }
    }

    #[test]
    fn one_point_is_the_boxs_centre_and_has_no_axis() {
        let one = Points { counts: [1; 3] };
        assert_eq!(one.shape(2, &[9, 3]), [2, 9, 3]);
        assert_eq!(Points { counts: [1, 4, 2] }.shape(2, &[9, 3]), [2, 8, 9, 3]);
        assert_eq!(one.around(Vec3::new(0.3, -1.0, 0.9)).collect::<Vec<_>>(), [(0, 1.0)]);
        assert_eq!((one.place(0), one.scale()), (Vec3::ZERO, Vec3::ONE));
    }
}
