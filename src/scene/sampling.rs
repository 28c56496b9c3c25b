//! How the samples of a pixel are placed: the sequence, and the filter that spreads them.

use crate::layout::FILTER_STEPS;
use std::f64::consts::PI;

/// Where the samples of a pixel lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Sobol's sequence with Owen's scrambling (Burley, JCGT 9(4) 2020): any number of samples is well spread, and may be continued.
    #[default]
    Sobol,
    /// Correlated multi-jittered (Kensler, Pixar TM 13-01, 2013): one sample in each cell, column and row.
    Stratified,
    /// Independent of each other.
    Independent,
}

/// How samples around a pixel's centre are weighed. All are separable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The pixel's own area, evenly.
    #[default]
    Box,
    /// A triangle two pixels wide.
    Tent,
    /// The four-term window of Blackman and Harris, four pixels wide (Harris, Proc. IEEE 66(1) 1978).
    BlackmanHarris,
    /// The cubic with B = C = 1/3, four pixels wide; it sharpens, with negative parts (Mitchell and Netravali, SIGGRAPH 1988).
    Mitchell,
}

/// Points at which a filter's integral is computed.
const INTEGRATION: usize = 1 << 16;

impl Filter {
    /// Half its width in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::BlackmanHarris | Self::Mitchell => 2.0,
        }
    }

    /// Its height at a distance from the centre, in pixels; not normalised.
    pub fn height(self, x: f64) -> f64 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x,
            Self::BlackmanHarris => {
                let phase = PI * (x / self.radius() + 1.0);
                0.35875 - 0.48829 * phase.cos() + 0.14128 * (2.0 * phase).cos() - 0.01168 * (3.0 * phase).cos()
            }
            Self::Mitchell if x < 1.0 => (7.0 * x - 12.0) * x * x + 16.0 / 3.0,
            Self::Mitchell => ((-7.0 / 3.0 * x + 12.0) * x - 20.0) * x + 32.0 / 3.0,
        }
    }

    /// Where it becomes negative, in pixels from the centre; infinite if it never does.
    pub fn zero(self) -> f64 {
        // The root of −7x³ + 36x² − 60x + 32 = −(x − 2)²(7x − 8).
        if self == Self::Mitchell {
            8.0 / 7.0
        } else {
            f64::INFINITY
        }
    }

    /// Cumulative integral of its size at evenly spaced points, 0 to 1.
    fn cumulative(self) -> Vec<f64> {
        let step = 2.0 * self.radius() / INTEGRATION as f64;
        let mut sums = vec![0.0; INTEGRATION + 1];
        for i in 0..INTEGRATION {
            sums[i + 1] = sums[i] + self.height((i as f64 + 0.5) * step - self.radius()).abs();
        }
        let whole = sums[INTEGRATION];
        sums.iter_mut().for_each(|sum| *sum /= whole);
        sums
    }

    /// Offsets from the centre that divide its size (negative parts counted as positive) into equal parts: start and end of each, in pixels.
    pub fn steps(self) -> Vec<[f32; 2]> {
        let sums = self.cumulative();
        let count = FILTER_STEPS as usize;
        let offset = |part: usize| {
            let wanted = part as f64 / count as f64;
            let after = sums.partition_point(|sum| *sum < wanted).clamp(1, INTEGRATION);
            let (lo, hi) = (sums[after - 1], sums[after]);
            let within = if hi > lo { (wanted - lo) / (hi - lo) } else { 0.0 };
            (((after - 1) as f64 + within) / INTEGRATION as f64 * 2.0 - 1.0) * self.radius()
        };
        (0..count).map(|part| [offset(part) as f32, offset(part + 1) as f32]).collect()
    }

    /// The mean of a sample's weight, 1 or −1 where exactly one of the two coordinates lies in a negative part.
    pub fn mean_weight(self) -> f64 {
        let step = 2.0 * self.radius() / INTEGRATION as f64;
        let heights = (0..INTEGRATION).map(|i| self.height((i as f64 + 0.5) * step - self.radius()));
        let (sum, size) = heights.fold((0.0, 0.0), |(sum, size), height| (sum + height, size + height.abs()));
        (sum / size) * (sum / size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_divide_the_filter_evenly() {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris, Filter::Mitchell] {
            let steps = filter.steps();
            assert!(steps.windows(2).all(|pair| pair[0][1] == pair[1][0] && pair[0][0] < pair[0][1]), "{filter:?}");
            let size = |ends: &[f32; 2]| {
                let (lo, hi) = (f64::from(ends[0]), f64::from(ends[1]));
                (0..100).map(|i| filter.height(lo + (hi - lo) * (f64::from(i) + 0.5) / 100.0).abs()).sum::<f64>()
                    * (hi - lo)
            };
            let sizes: Vec<f64> = steps.iter().map(size).collect();
            let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
            let worst = sizes.iter().map(|size| (size / mean - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < 0.02, "{filter:?}: {worst}");
        }
    }

    #[test]
    fn mitchell_is_continuous_and_negative_beyond_its_zero() {
        let height = |x| Filter::Mitchell.height(x);
        assert!((height(1.0 - 1e-9) - height(1.0)).abs() < 1e-6 && height(Filter::Mitchell.zero()).abs() < 1e-12);
        assert!(height(1.13) > 0.0 && height(1.16) < 0.0 && height(1.99) < 0.0);
        assert!((0.5..0.9).contains(&Filter::Mitchell.mean_weight()));
        assert_eq!(Filter::Tent.mean_weight(), 1.0);
    }
}
