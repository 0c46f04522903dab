//! Agreement of two results.

use didim_identification::identification::{Estimate, ParameterEstimate};
use serde::Serialize;

use super::result::MethodResult;
use super::trial::Trial;

/// Half-width of a confidence interval, in standard deviations, as in the paper.
pub const INTERVAL_DEVIATIONS: f64 = 3.0;

/// Number of estimates of one result that lie in the confidence intervals of another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// The method of the estimates.
    pub estimates: Trial,
    /// The method of the intervals. An interval is an estimate of this method ± 3 σ.
    pub intervals: Trial,
    /// Number of estimates that both results have.
    pub compared: usize,
    /// Number of these estimates within the intervals.
    pub inside: usize,
    /// Names of the compared parameters whose estimates lie outside the intervals.
    pub outside: Vec<String>,
}

impl Agreement {
    /// Returns the agreement of every ordered pair of results.
    pub(super) fn of_pairs(results: &[MethodResult]) -> Vec<Self> {
        let estimates_found: Vec<(Trial, &Estimate)> = results
            .iter()
            .filter_map(|result| Some((result.trial, result.estimate.as_ref()?)))
            .collect();
        let pairs = estimates_found
            .iter()
            .flat_map(|one| estimates_found.iter().map(move |other| (one, other)));
        pairs
            .filter(|((one, _), (other, _))| one != other)
            .map(|((estimates, of), (intervals, other))| {
                Self::between(*estimates, of, *intervals, other)
            })
            .collect()
    }

    fn between(estimates: Trial, of: &Estimate, intervals: Trial, other: &Estimate) -> Self {
        let both = of.parameters.iter().filter_map(|parameter| {
            let interval = other.parameters.iter().find(|p| p.name == parameter.name)?;
            Some((parameter, interval))
        });
        let (mut compared, mut outside) = (0, Vec::new());
        for (parameter, interval) in both {
            compared += 1;
            if !lies_in(parameter.value, interval) {
                outside.push(parameter.name.clone());
            }
        }
        Self { estimates, intervals, compared, inside: compared - outside.len(), outside }
    }
}

/// Returns true if a value lies within 3 σ of an estimate. Returns false if the value is not a
/// number.
pub(crate) fn lies_in(value: f64, interval: &ParameterEstimate) -> bool {
    (value - interval.value).abs() <= INTERVAL_DEVIATIONS * interval.standard_deviation
}

#[cfg(test)]
mod tests {
    use didim_identification::identification::Method;

    use super::*;
    use crate::comparison::Framework;

    fn result(method: Method, parameters: &[(&str, f64, f64)]) -> MethodResult {
        let parameter = |&(name, value, standard_deviation): &(&str, f64, f64)| ParameterEstimate {
            joint_name: None,
            description: None,
            name: name.to_owned(),
            regrouped: false,
            value,
            standard_deviation,
            unit: "N·m",
            combined_standard_deviation: 2.0,
            classical_standard_deviation: standard_deviation,
            relative_standard_deviation: standard_deviation / value,
        };
        let parameters = parameters.iter().map(parameter).collect();
        let trial = Trial { method, framework: Framework::Decimated };
        let estimate = Some(Estimate { parameters, ..Estimate::default() });
        MethodResult {
            trial,
            estimate,
            failure: None,
            failure_kind: None,
            elapsed_ms: 0.0,
            fit: None,
        }
    }

    #[test]
    fn each_is_held_against_the_intervals_of_the_other() {
        let certain =
            result(Method::Clie, &[("a", 1.4, 0.1), ("b", f64::NAN, 0.1), ("c", 1.0, 1.0)]);
        let uncertain = result(Method::IdimLs, &[("a", 1.0, 0.2), ("b", 1.0, 0.2)]);
        let pairs = Agreement::of_pairs(&[uncertain, certain]);
        let said: Vec<(Method, usize, usize, &[String])> = pairs
            .iter()
            .map(|pair| (pair.estimates.method, pair.compared, pair.inside, &pair.outside[..]))
            .collect();
        let names = |of: &[&str]| of.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        // 0.4 is four of the small standard deviations and two of the large ones.
        assert_eq!(
            said,
            [
                (Method::IdimLs, 2, 0, &names(&["a", "b"])[..]),
                (Method::Clie, 2, 1, &names(&["b"])[..])
            ]
        );
    }
}
