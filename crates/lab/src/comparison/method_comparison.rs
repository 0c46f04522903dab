//! The results of all methods.

use didim_identification::identification::Estimate;
use serde::Serialize;

use super::agreement::{Agreement, lies_in};
use super::held_out::HeldOut;
use super::result::MethodResult;
use super::trial::{Framework, Trial};

/// Version of the layout of [`Comparison`] in JSON.
pub const SCHEMA: u32 = 1;

/// The results of all methods.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Version of this record's layout.
    pub schema: u32,
    /// The robot's name.
    pub robot: String,
    /// Results of all methods in a fixed order, the reference first.
    pub methods: Vec<MethodResult>,
    /// Agreement of each pair of results: the number of estimates of one result that lie within 3 σ
    /// of the other result's estimates.
    pub agreement: Vec<Agreement>,
    /// Prediction errors of each method on held-out samples.
    pub held_out: Vec<HeldOut>,
    /// The true parameters, if the arm is simulated.
    pub truth: Option<Vec<TrueParameter>>,
}

/// True value of a parameter of a simulated arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueParameter {
    /// Name of the parameter.
    pub name: String,
    /// SI unit; empty if no method has identified the parameter.
    pub unit: &'static str,
    /// True value in SI units.
    pub value: f64,
}

impl Comparison {
    /// Returns the estimate of a method, if the method ran and has a result.
    pub fn estimate(&self, trial: Trial) -> Option<&Estimate> {
        self.methods.iter().find(|result| result.trial == trial)?.estimate.as_ref()
    }

    /// Returns the estimate of the reference method, IDIM-LS.
    pub fn reference(&self) -> Option<&Estimate> {
        self.estimate(Trial::REFERENCE)
    }

    /// Returns the true value of a parameter, if it is known.
    pub fn truth_of(&self, name: &str) -> Option<f64> {
        let truth = self.truth.as_ref()?.iter().find(|parameter| parameter.name == name)?;
        Some(truth.value)
    }

    /// Returns the names of a result's parameters whose true value lies outside 3 σ of the
    /// estimate; `None` if the truth or the result is not known.
    pub fn outside_of_truth(&self, trial: Trial) -> Option<Vec<&str>> {
        self.truth.as_ref()?;
        let parameters = self.estimate(trial)?.parameters.iter();
        let missed = parameters
            .filter(|found| self.truth_of(&found.name).is_some_and(|truth| !lies_in(truth, found)));
        Some(missed.map(|found| found.name.as_str()).collect())
    }

    /// Returns the results of one framework, in order.
    pub fn results(&self, framework: Framework) -> impl Iterator<Item = &MethodResult> {
        self.methods.iter().filter(move |result| result.trial.framework == framework)
    }

    /// Returns the names of all identified parameters, in the model's order.
    pub fn parameters(&self) -> Vec<&str> {
        let first = self.methods.iter().find_map(|result| result.estimate.as_ref());
        let parameters = first.map_or(&[][..], |estimate| &estimate.parameters);
        parameters.iter().map(|parameter| parameter.name.as_str()).collect()
    }
}
