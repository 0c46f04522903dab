//! Quantiles of the residuals at the sample rate, which distinguish a contact from model errors.

use crate::stored_value::number;
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::identification::observation::{InverseDynamics, Motion, MotionGroup, delay_samples};
use crate::identification::problem::{Context, IdentificationError};
use didim_dynamics::numeric::WIDTH;

/// Shares of the residuals that are below each quantile.
const QUANTILE_LEVELS: [f64; 3] = [0.99, 0.999, 0.9999];

/// Quantiles of the absolute residuals of one joint \[N·m or N\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResidualQuantiles {
    /// 99 % quantile.
    #[serde(rename = "99 %")]
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub of_99: f64,
    /// 99.9 % quantile.
    #[serde(rename = "99.9 %")]
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub of_999: f64,
    /// 99.99 % quantile.
    #[serde(rename = "99.99 %")]
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub of_9999: f64,
}

impl ResidualQuantiles {
    /// Returns the quantiles of each joint's residual torque at every counted sample. `which`
    /// returns the index of the parameters that predict a given sample.
    pub(crate) fn per_joint(
        context: &Context<'_>,
        motion: &Motion,
        parameters: &[DVector<f64>],
        which: &dyn Fn(usize) -> usize,
    ) -> Result<Vec<Self>, IdentificationError> {
        let mut dynamics: Vec<InverseDynamics> =
            (parameters.iter()).map(|own| InverseDynamics::of_the_estimate(context, own)).collect();
        let experiment = context.experiment;
        let delay = experiment.torque_timing().mean_delay_s() * experiment.sample_rate_hz();
        let torque = delay_samples(experiment, delay)?;
        let samples: Vec<usize> = (experiment.counted_samples())
            .filter(|sample| !experiment.is_held_out(*sample))
            .collect();
        let joints = experiment.joints();
        let mut residuals = vec![LargestValues::new(samples.len()); joints];
        let mut group = MotionGroup::of_joints(joints);
        let mut next = 0;
        while let Some(&first) = samples.get(next) {
            let neighbours = which(first);
            // Counts consecutive samples that are predicted with the same parameters.
            let together = samples[next..].iter().take(WIDTH).enumerate();
            let count = together
                .take_while(|(k, sample)| **sample == first + k && which(**sample) == neighbours)
                .count();
            let predicted = dynamics[neighbours].torque(&context.model, group.read(motion, first));
            let torques = torque.column_iter().zip(&predicted);
            for (residuals, (torque, predicted)) in residuals.iter_mut().zip(torques) {
                let torques = torque.as_slice()[first..first + count].iter().zip(predicted.0);
                for (torque, predicted) in torques {
                    residuals.add((torque - predicted).abs());
                }
            }
            next += count;
        }
        Ok(residuals
            .into_iter()
            .enumerate()
            .map(|(joint, residuals): (usize, LargestValues)| {
                let [of_99, of_999, of_9999] = match context.has_torque(joint) {
                    true => residuals.quantiles(),
                    false => [f64::NAN; QUANTILE_LEVELS.len()],
                };
                ResidualQuantiles { of_99, of_999, of_9999 }
            })
            .collect())
    }
}

/// Largest of many values, as many as the quantiles require.
#[derive(Clone)]
struct LargestValues {
    /// Total number of values.
    count: usize,
    /// The largest values and others, at most twice the needed number.
    values: Vec<f64>,
}

impl LargestValues {
    fn new(count: usize) -> Self {
        Self { count, values: Vec::with_capacity(2 * Self::needed_values(count)) }
    }

    /// Returns the number of values from the smallest quantile upwards.
    fn needed_values(count: usize) -> usize {
        count - Self::quantile_index(count, QUANTILE_LEVELS[0])
    }

    /// Returns the index, in ascending order, of the quantile with this share of all values below
    /// it.
    fn quantile_index(count: usize, share: f64) -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of a length"
        )]
        let below = (share * count as f64).ceil() as usize;
        below.clamp(1, count.max(1)) - 1
    }

    fn add(&mut self, value: f64) {
        self.values.push(value);
        if self.values.len() == self.values.capacity().max(1) {
            self.drop_smallest();
        }
    }

    fn drop_smallest(&mut self) {
        let needed = Self::needed_values(self.count);
        if self.values.len() > needed {
            let first = self.values.len() - needed;
            self.values.select_nth_unstable_by(first, f64::total_cmp);
            self.values.drain(..first);
        }
    }

    fn quantiles(mut self) -> [f64; QUANTILE_LEVELS.len()] {
        self.drop_smallest();
        self.values.sort_unstable_by(f64::total_cmp);
        let forgotten = self.count - self.values.len();
        QUANTILE_LEVELS
            .map(|share| self.values[Self::quantile_index(self.count, share) - forgotten])
    }
}
