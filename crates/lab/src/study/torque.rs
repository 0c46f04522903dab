//! Error of estimated parameters in terms of torque.

use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::trajectory::Reference as _;
use didim_identification::identification::ParameterEstimate;
use didim_sim::Scenario;

/// Minimum contribution of a large parameter to the torque along the motion, as a fraction of this
/// torque.
const LARGE_SHARE: f64 = 0.05;

/// Torque of an arm along its planned motion, computed from its base parameters.
#[derive(Clone, Debug)]
pub struct ReferenceTorque {
    names: Vec<String>,
    truth: Vec<f64>,
    /// Columns of the observation matrix X. Each column has an entry for each joint and instant.
    columns: Vec<Vec<f64>>,
    /// Norm ‖X θ‖ of the torque with the true parameters.
    torque_norm: f64,
}

impl ReferenceTorque {
    /// Computes the torque along a scenario's motion, at every `decimation`-th of its samples.
    pub fn new(scenario: &Scenario, base: &BaseParameters, decimation: usize) -> Self {
        let model = Model::new(scenario.robot());
        let model = model.with_load(scenario.standard_parameters().to_vec());
        let (joints, width) = (model.joints(), model.parameter_names().len());
        let period_s = scenario.controller().timing.sample_period_s();
        let (mut names, mut truth) = (Vec::new(), Vec::new());
        for (name, value) in scenario.truth() {
            names.push(name.clone());
            truth.push(*value);
        }
        let mut columns = vec![Vec::new(); names.len()];
        let (mut workspace, mut regressor) = (Workspace::new(), vec![0.0; joints * width]);
        let mut history = model.history();
        for sample in 0..scenario.samples() {
            let [mut q, mut dq, mut ddq] = [[0.0; MAX_JOINTS]; 3];
            #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
            let time_s = sample as f64 * period_s;
            scenario.trajectory().evaluate(time_s, &mut q, &mut dq, &mut ddq);
            let (q, dq, ddq) = (&q[..joints], &dq[..joints], &ddq[..joints]);
            workspace.set_hysteresis(history.as_mut().map(|own| own.advance_to(q)));
            if sample % decimation.max(1) != 0 {
                continue;
            }
            model.regressor(&mut workspace, q, dq, ddq, &mut regressor);
            for (column, &of_model) in columns.iter_mut().zip(base.columns()) {
                column.extend((0..joints).map(|joint| regressor[joint * width + of_model]));
            }
        }
        let norm = norm_of_sum(&columns, &truth);
        Self { names, truth, columns, torque_norm: norm }
    }

    /// Returns ‖X (θ̂ − θ)‖ / ‖X θ‖ over all joints; a parameter that is not identified counts as
    /// 0.
    pub fn relative_deviation(&self, estimate: &[ParameterEstimate]) -> f64 {
        let value = |name: &String| {
            estimate.iter().find(|parameter| parameter.name == *name).map_or(0.0, |p| p.value)
        };
        let differences: Vec<f64> =
            self.names.iter().zip(&self.truth).map(|(name, truth)| value(name) - truth).collect();
        norm_of_sum(&self.columns, &differences) / self.torque_norm
    }

    /// Returns the true value of a base parameter.
    pub fn true_value(&self, name: &str) -> Option<f64> {
        let index = self.names.iter().position(|own| own == name)?;
        self.truth.get(index).copied()
    }

    /// Returns true if a parameter contributes at least 5 % of the torque: ‖X_k θ_k‖ / ‖X θ‖.
    pub fn is_large(&self, name: &str) -> bool {
        let Some(index) = self.names.iter().position(|own| own == name) else { return false };
        let column = &self.columns[index..=index];
        norm_of_sum(column, &self.truth[index..=index]) >= LARGE_SHARE * self.torque_norm
    }
}

/// Returns ‖Σ_k X_k θ_k‖ for the columns X_k and the factors θ_k.
fn norm_of_sum(columns: &[Vec<f64>], factors: &[f64]) -> f64 {
    let mut sum = vec![0.0; columns.first().map_or(0, Vec::len)];
    for (column, factor) in columns.iter().zip(factors) {
        sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += factor * value);
    }
    sum.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(truth: &[(String, f64)], factor: f64) -> Vec<ParameterEstimate> {
        let parameter = |(name, value): &(String, f64)| ParameterEstimate {
            joint_name: None,
            description: None,
            name: name.clone(),
            regrouped: false,
            value: factor * value,
            standard_deviation: 1.0,
            unit: "N·m",
            combined_standard_deviation: 2.0,
            classical_standard_deviation: 1.0,
            relative_standard_deviation: 1.0,
        };
        truth.iter().map(parameter).collect()
    }

    /// Torques are linear in the parameters. An error of 5 % in all parameters gives a deviation of
    /// 5 %; no parameters at all give one of 100 %.
    #[test]
    fn the_deviation_is_that_of_the_torque() {
        let scenario = didim_sim::tx40_paper().unwrap();
        let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
        let torque = ReferenceTorque::new(&scenario, &base, 125);
        let deviation = |factor| torque.relative_deviation(&estimate(scenario.truth(), factor));
        assert!(deviation(1.0) < 1e-15);
        assert!((deviation(1.05) - 0.05).abs() < 1e-12);
        assert!((torque.relative_deviation(&[]) - 1.0).abs() < 1e-12);
        // Gravity of the upper arm is large; a wrist's inertia and an unknown parameter are not.
        assert!(torque.is_large("mx2r") && torque.is_large("fc2"));
        assert!(!torque.is_large("ia6") && !torque.is_large("nothing"));
    }
}
