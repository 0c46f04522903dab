//! Estimates of arms that are known, by least squares on random motions.

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::Robot;
use didim_identification::feasibility::{
    Estimate, FeasibilityError, FeasibilityLimits, Outcome, Prior, fit_consistent,
};
use nalgebra::{DMatrix, DVector};

use crate::arms::{Random, inverse};

/// An estimate of a robot's base parameters.
pub(crate) struct Example {
    pub(crate) robot: Robot,
    pub(crate) base: BaseParameters,
    pub(crate) names: Vec<String>,
    pub(crate) values: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

/// Positions, velocities and accelerations of random states.
pub(crate) fn states(random: &mut Random, joints: usize, count: usize) -> Vec<[Vec<f64>; 3]> {
    (0..count).map(|_| [3.0, 3.0, 10.0].map(|size| random.vector(joints, size))).collect()
}

pub(crate) fn torques(robot: &Robot, standard: &[f64], states: &[[Vec<f64>; 3]]) -> DVector<f64> {
    let model = Model::new(robot);
    let torque_at = |[q, dq, ddq]: &[Vec<f64>; 3]| inverse(&model, standard, q, dq, ddq);
    DVector::from_vec(states.iter().flat_map(torque_at).collect())
}

impl Example {
    /// From measured torques at states, with that noise in each of them \[N·m or N\].
    pub(crate) fn fit(
        robot: Robot,
        states: &[[Vec<f64>; 3]],
        measured: &DVector<f64>,
        noise: f64,
    ) -> Self {
        let model = Model::new(&robot).with_plain_friction();
        let base = BaseParameters::compute(&model).unwrap();
        let model = Model::new(&robot);
        let (n, p) = (robot.joints(), model.parameter_names().len());
        let mut regressor = vec![0.0; n * p];
        let mut stacked = DMatrix::zeros(n * states.len(), base.names().len());
        for (sample, [q, dq, ddq]) in states.iter().enumerate() {
            model.regressor(&mut Workspace::new(), q, dq, ddq, &mut regressor);
            let regressor_rows = DMatrix::from_row_slice(n, p, &regressor);
            stacked
                .rows_mut(sample * n, n)
                .copy_from(&regressor_rows.select_columns(base.columns()));
        }
        let qr = stacked.qr();
        let values = qr.r().solve_upper_triangular(&qr.q().tr_mul(measured)).unwrap();
        let inverse = qr.r().try_inverse().unwrap();
        let covariance = &inverse * inverse.transpose() * (noise * noise);
        let names = base.names().to_vec();
        Self { robot, base, names, values: values.as_slice().to_vec(), covariance }
    }

    pub(crate) fn estimate(&self) -> Estimate<'_> {
        let Self { names, values, covariance, .. } = self;
        Estimate { names, values, covariance, fixed: &[] }
    }

    pub(crate) fn consistent(
        &self,
        prior: &Prior,
        weight: f64,
    ) -> Result<Outcome, FeasibilityError> {
        fit_consistent(
            &self.robot,
            &self.base,
            &self.estimate(),
            prior,
            weight,
            &FeasibilityLimits::default(),
        )
    }
}
