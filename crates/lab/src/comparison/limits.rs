//! Limits on the figures of a comparison, as data.

use std::fmt;

use didim_identification::identification::{Estimate, Method, ParameterEstimate};
use serde::Deserialize;

use super::agreement::lies_in;
use super::method_comparison::Comparison;
use super::published::check_names;
use super::trial::{Framework, Trial};

/// Content of a file of limits.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// The limits.
    pub limits: Vec<Limit>,
}

/// Minimum or maximum of a figure, or both.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// The limited figure.
    pub figure: Figure,
    /// The method.
    pub method: Method,
    /// The framework; decimated by default.
    #[serde(default = "default_framework")]
    pub framework: Framework,
    /// Method to compare with. `inside` and `mean-deviation` compare the estimates of the two
    /// methods; their default is IDIM-LS. Any other figure is divided by the figure of this method.
    pub against: Option<Method>,
    /// Names of the parameters for `inside` and `mean-deviation`; all parameters by default.
    pub parameters: Option<Vec<String>>,
    /// Minimum of the figure.
    pub at_least: Option<f64>,
    /// Maximum of the figure.
    pub at_most: Option<f64>,
}

/// A figure of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Figure {
    /// Number of estimates within 3 σ of the other method's estimates.
    Inside,
    /// Mean of |θ − θ'| / |θ'| over the parameters, with θ' the estimate of the other method.
    MeanDeviation,
    /// Largest singular value of the observation matrix, without weights.
    LargestSingularValue,
    /// Smallest singular value of the observation matrix, without weights.
    SmallestSingularValue,
    /// Ratio of the largest to the smallest singular value of the observation matrix, without
    /// weights.
    ConditionNumber,
    /// Durbin–Watson statistic, mean over the joints, divided by its expected value for white noise
    /// after the decimation filter. The figure is 1 for this noise and tends to 0 with positive
    /// correlation.
    DurbinWatson,
    /// Probability that white noise after the decimation filter is as correlated as the residuals;
    /// the smallest value of all joints.
    Whiteness,
    /// Closed-loop simulations per iteration step.
    SimulationsPerStep,
    /// ‖q − q_s‖ / ‖q‖ of the simulated loop, mean over the joints.
    PositionError,
    /// ‖τ − τ_s‖ / ‖τ‖ of the simulated loop, mean over the joints.
    TorqueError,
}

fn default_framework() -> Framework {
    Framework::Decimated
}

/// The outcome of a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitOutcome<'a> {
    /// The limit.
    pub limit: &'a Limit,
    /// Value of the figure; `None` if a required method has no result with this figure.
    pub found: Option<f64>,
}

impl LimitOutcome<'_> {
    /// Returns true if the figure is present and within its limit.
    pub fn is_met(&self) -> bool {
        let (least, most) = (self.limit.at_least, self.limit.at_most);
        self.found.is_some_and(|found| {
            least.is_none_or(|least| found >= least) && most.is_none_or(|most| found <= most)
        })
    }
}

impl Limits {
    /// Parses limits from TOML. Checks them against the arm's parameter names (`available`) and the
    /// trials that will run.
    ///
    /// # Errors
    /// A message that names the problem and its place in the file.
    pub fn from_toml(text: &str, available: &[String], trials: &[Trial]) -> Result<Self, String> {
        let limits: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        if limits.limits.is_empty() {
            return Err("limits is empty; list at least one [[limits]]".to_owned());
        }
        for limit in &limits.limits {
            limit.check(available, trials).map_err(|what| format!("{limit}: {what}"))?;
        }
        Ok(limits)
    }

    /// Returns the outcome of every limit.
    pub fn check_all<'a>(&'a self, comparison: &Comparison) -> Vec<LimitOutcome<'a>> {
        let outcome = |limit: &'a Limit| LimitOutcome { limit, found: limit.figure_of(comparison) };
        self.limits.iter().map(outcome).collect()
    }
}

impl Limit {
    fn check(&self, available: &[String], trials: &[Trial]) -> Result<(), String> {
        let bounds = [self.at_least, self.at_most];
        if bounds == [None, None] {
            return Err("has neither at_least nor at_most; state one".to_owned());
        }
        if bounds.into_iter().flatten().any(|bound| !bound.is_finite()) {
            return Err("at_least and at_most have to be finite".to_owned());
        }
        check_names(available, self.parameters.iter().flatten())?;
        let methods = core::iter::once(self.method).chain(self.against);
        match methods
            .map(|method| self.trial_of_method(method))
            .find(|trial| !trials.contains(trial))
        {
            Some(trial) => Err(format!(
                "{trial} does not run; name it in --methods, add --strict where it is strict, or \
                leave the limit out"
            )),
            None => Ok(()),
        }
    }

    fn trial_of_method(&self, method: Method) -> Trial {
        // IDIM-LS always runs after the decimation filter.
        let framework = if method.simulates() { self.framework } else { Framework::Decimated };
        Trial { method, framework }
    }

    fn figure_of(&self, comparison: &Comparison) -> Option<f64> {
        let estimate = comparison.estimate(self.trial_of_method(self.method))?;
        let against = self.against.map(|method| comparison.estimate(self.trial_of_method(method)));
        if matches!(self.figure, Figure::Inside | Figure::MeanDeviation) {
            return self.of_estimates(estimate, against.unwrap_or_else(|| comparison.reference())?);
        }
        let figure = self.value(estimate)?;
        Some(match against {
            Some(other) => figure / self.value(other?)?,
            None => figure,
        })
    }

    fn of_estimates(&self, own: &Estimate, other: &Estimate) -> Option<f64> {
        let chosen = |name: &String| self.parameters.as_ref().is_none_or(|of| of.contains(name));
        let pairs: Vec<_> = own
            .parameters
            .iter()
            .filter(|parameter| chosen(&parameter.name))
            .filter_map(|one| Some((one, other.parameters.iter().find(|p| p.name == one.name)?)))
            .collect();
        let wanted = self.parameters.as_ref().map_or(own.parameters.len(), Vec::len);
        let share = |(one, other): &(&_, &_)| relative_deviation(one, other);
        match self.figure {
            _ if pairs.is_empty() || pairs.len() != wanted => None,
            Figure::Inside => {
                let inside = pairs.iter().filter(|(one, other)| lies_in(one.value, other)).count();
                Some(float(inside))
            }
            _ => Some(pairs.iter().map(share).sum::<f64>() / float(pairs.len())),
        }
    }

    fn value(&self, estimate: &Estimate) -> Option<f64> {
        let singular_values = estimate.unweighted_singular_values;
        match self.figure {
            Figure::Inside | Figure::MeanDeviation => None,
            Figure::LargestSingularValue => Some(singular_values.max),
            Figure::SmallestSingularValue => Some(singular_values.min),
            Figure::ConditionNumber => Some(estimate.unweighted_condition_number),
            Figure::DurbinWatson => {
                let mean = mean(&estimate.durbin_watson_per_joint)?;
                Some(mean / estimate.durbin_watson_expected)
            }
            Figure::Whiteness => {
                estimate.whiteness_per_joint.iter().copied().min_by(f64::total_cmp)
            }
            Figure::SimulationsPerStep => {
                let steps = estimate.convergence.len();
                (steps > 0).then(|| f64::from(estimate.simulations) / float(steps))
            }
            Figure::PositionError => mean(estimate.relative_position_error_per_joint.as_ref()?),
            Figure::TorqueError => mean(estimate.simulated_torque_error_per_joint.as_ref()?),
        }
    }
}

fn relative_deviation(one: &ParameterEstimate, other: &ParameterEstimate) -> f64 {
    ((one.value - other.value) / other.value).abs()
}

/// Returns the mean, or `None` if there are no values.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / float(values.len()))
}

#[expect(clippy::cast_precision_loss, reason = "counts of joints, parameters and steps")]
fn float(count: usize) -> f64 {
    count as f64
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inside => "estimates within 3 σ",
            Self::MeanDeviation => "mean relative deviation",
            Self::LargestSingularValue => "largest singular value",
            Self::SmallestSingularValue => "smallest singular value",
            Self::ConditionNumber => "condition number",
            Self::DurbinWatson => "Durbin–Watson over that of filtered white noise",
            Self::Whiteness => "probability of white noise",
            Self::SimulationsPerStep => "simulations for each step",
            Self::PositionError => "mean relative error of the positions",
            Self::TorqueError => "mean relative error of the torques",
        })
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.trial_of_method(self.method), self.figure)?;
        if let Some(parameters) = &self.parameters {
            write!(f, " of {}", parameters.join(" "))?;
        }
        match (self.against, self.figure) {
            (Some(method), _) => write!(f, ", against {}", self.trial_of_method(method)),
            (None, Figure::Inside | Figure::MeanDeviation) => {
                write!(f, ", against {}", Trial::REFERENCE)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use didim_identification::identification::SingularValues;

    use super::*;
    use crate::comparison::{MethodResult, trials};

    fn result(method: Method, values: &[(&str, f64)], smallest: f64) -> MethodResult {
        let parameter = |&(name, value): &(&str, f64)| ParameterEstimate {
            joint_name: None,
            description: None,
            name: name.to_owned(),
            regrouped: false,
            value,
            standard_deviation: 0.1,
            unit: "N·m",
            combined_standard_deviation: 2.0,
            classical_standard_deviation: 0.1,
            relative_standard_deviation: 0.1 / value,
        };
        let estimate = Estimate {
            parameters: values.iter().map(parameter).collect(),
            unweighted_singular_values: SingularValues { max: 1.0, min: smallest },
            durbin_watson_per_joint: vec![1.0, 2.0],
            durbin_watson_expected: 1.5,
            ..Estimate::default()
        };
        let trial = Trial { method, framework: Framework::Decimated };
        MethodResult {
            trial,
            estimate: Some(estimate),
            failure: None,
            failure_kind: None,
            elapsed_ms: 0.0,
            fit: None,
        }
    }

    fn comparison() -> Comparison {
        let methods = vec![
            result(Method::IdimLs, &[("fc1", 1.0), ("zz1r", 2.0)], 0.5),
            result(Method::Cloe, &[("fc1", 0.8), ("zz1r", 2.9)], 0.1),
        ];
        let (robot, agreement) = ("arm".to_owned(), vec![]);
        Comparison { schema: 1, robot, methods, agreement, held_out: vec![], truth: None }
    }

    /// Reads limits with all methods, for an arm with a parameter that is not identified.
    fn read(text: &str) -> Result<Limits, String> {
        let names = ["fc1", "zz1r", "fc9"].map(str::to_owned);
        Limits::from_toml(text, &names, &trials(&Method::ALL, true))
    }

    #[track_caller]
    fn outcome(limit: &str) -> (Option<f64>, bool) {
        let text = format!("[[limits]]\n{limit}");
        let limits = read(&text).unwrap();
        let comparison = comparison();
        let outcome = limits.check_all(&comparison).remove(0);
        (outcome.found, outcome.is_met())
    }

    #[test]
    fn figures_against_the_reference_and_against_another() {
        let mean = "figure = \"mean-deviation\"\nmethod = \"cloe\"\nparameters = [\"fc1\"]";
        let (value, holds) = outcome(&format!("{mean}\nat_least = 0.1"));
        assert!((value.unwrap() - 0.2).abs() < 1e-12 && holds);
        assert!(!outcome(&format!("{mean}\nat_most = 0.1")).1);
        let inside = "figure = \"inside\"\nmethod = \"cloe\"\nat_least = 2";
        assert_eq!(outcome(inside), (Some(1.0), false));
        let ratio =
            "figure = \"smallest-singular-value\"\nmethod = \"idim-ls\"\nagainst = \"cloe\"";
        assert_eq!(outcome(&format!("{ratio}\nat_least = 4.9\nat_most = 5.1")), (Some(5.0), true));
        let noise = "figure = \"durbin-watson\"\nmethod = \"cloe\"\nat_least = 1";
        assert_eq!(outcome(noise), (Some(1.0), true));
    }

    #[test]
    fn without_a_result_no_limit_holds() {
        for limit in [
            "figure = \"inside\"\nmethod = \"didim\"\nat_most = 99",
            "figure = \"inside\"\nmethod = \"cloe\"\nframework = \"strict\"\nat_most = 99",
            "figure = \"inside\"\nmethod = \"cloe\"\nparameters = [\"fc9\"]\nat_most = 99",
            "figure = \"torque-error\"\nmethod = \"cloe\"\nat_most = 99",
            "figure = \"condition-number\"\nmethod = \"cloe\"\nagainst = \"didim\"\nat_most = 99",
        ] {
            assert_eq!(outcome(limit), (None, false), "{limit}");
        }
    }

    #[test]
    fn what_limits_nothing_or_is_unknown_is_refused() {
        let refused = |limit: &str| read(&format!("[[limits]]\n{limit}")).unwrap_err();
        let pointless = refused("figure = \"inside\"\nmethod = \"cloe\"");
        assert!(pointless.contains("CLOE: estimates within 3 σ") && pointless.contains("at_least"));
        let unknown = refused("figure = \"inside\"\nmethod = \"cloe\"\nat_lest = 1");
        assert!(unknown.contains("at_lest") && unknown.contains("line 4"), "{unknown}");
        assert!(refused("figure = \"insides\"\nmethod = \"cloe\"").contains("insides"));
        let inside = "figure = \"inside\"\nmethod = \"cloe\"\n";
        assert!(refused(&format!("{inside}at_least = nan")).contains("finite"));
        let misspelt = refused(&format!("{inside}at_least = 1\nparameters = [\"fc_1\"]"));
        assert!(misspelt.contains("\"fc_1\" is no base parameter"), "{misspelt}");
    }

    #[test]
    fn a_limit_on_what_does_not_run_is_refused() {
        let names = ["fc1".to_owned()];
        let few = trials(&[Method::IdimIv], true);
        let limit = "[[limits]]\nfigure = \"inside\"\nmethod = \"idim-iv\"\nat_least = 1\n";
        assert!(Limits::from_toml(limit, &names, &few).is_ok());
        let against = format!("{limit}against = \"cloe\"");
        let refused = Limits::from_toml(&against, &names, &few).unwrap_err();
        assert!(
            refused.contains("CLOE does not run") && refused.contains("--methods"),
            "{refused}"
        );
    }
}
