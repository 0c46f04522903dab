//! The results of all methods.

use didim_core::identification::Estimate;
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
    /// Every method, the reference first, in a fixed order.
    pub methods: Vec<MethodResult>,
    /// Of each pair of results, how many estimates of one lie within 3 σ of the other.
    pub agreement: Vec<Agreement>,
    /// How well each method predicts held-out samples.
    pub held_out: Vec<HeldOut>,
    /// The true parameters, where the arm is a simulated one.
    pub truth: Option<Vec<TrueParameter>>,
}

/// A parameter of a simulated arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueParameter {
    /// The field's name.
    pub name: String,
    /// Its SI unit; empty where no method has it.
    pub unit: &'static str,
    /// SI value.
    pub value: f64,
}

impl Comparison {
    /// The result of a method, if it was tried and has one.
    pub fn estimate(&self, trial: Trial) -> Option<&Estimate> {
        self.methods.iter().find(|result| result.trial == trial)?.estimate.as_ref()
    }

    /// The reference for the others: the result of IDIM-LS.
    pub fn reference(&self) -> Option<&Estimate> {
        self.estimate(Trial::REFERENCE)
    }

    /// The true value of a parameter, where it is known.
    pub fn truth_of(&self, name: &str) -> Option<f64> {
        let truth = self.truth.as_ref()?.iter().find(|parameter| parameter.name == name)?;
        Some(truth.value)
    }

    /// The names of those parameters of a result whose truth lies outside of its 3 σ; none where the
    /// truth or the result is not known.
    pub fn outside_of_truth(&self, trial: Trial) -> Option<Vec<&str>> {
        self.truth.as_ref()?;
        let parameters = self.estimate(trial)?.parameters.iter();
        let missed = parameters
            .filter(|found| self.truth_of(&found.name).is_some_and(|truth| !lies_in(truth, found)));
        Some(missed.map(|found| found.name.as_str()).collect())
    }

    /// The results of one framework, in order.
    pub fn of(&self, framework: Framework) -> impl Iterator<Item = &MethodResult> {
        self.methods.iter().filter(move |result| result.trial.framework == framework)
    }

    /// The names of all parameters that were identified, in the model's order.
    pub fn parameters(&self) -> Vec<&str> {
        let first = self.methods.iter().find_map(|result| result.estimate.as_ref());
        let parameters = first.map_or(&[][..], |estimate| &estimate.parameters);
        parameters.iter().map(|parameter| parameter.name.as_str()).collect()
    }
}
